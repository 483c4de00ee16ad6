"""MuJoCo: mj_forward (accelerations) with its Newton solver, pins as equality connect constraints.

Connect constraints are soft; they are hardened here with solref = 2 time steps and solimp 0.9999, as one has to for a
mechanism, and still give way a little.
"""

import math

import mujoco

from clock import line, median_ns
from topologies import GRAVITY, MAKE, TURN

INERTIAL = '<inertial pos="0.5 0 0" mass="1" diaginertia="1e-6 0.083333 0.083333"/>'
HARD = 'solref="0.002 1" solimp="0.9999 0.9999 0.001"'


def rod(name, x, y, angle, inner=""):
    return (
        f'<body name="{name}" pos="{x!r} {y!r} 0" euler="0 0 {angle!r}"><joint type="hinge" axis="0 0 1"/>'
        f"{INERTIAL}{inner}</body>"
    )


def row(names, angles, x, y, extra=None):
    """Rods in a row, each in the frame of the one before; `extra[k]` are further bodies on rod k."""
    text = ""
    for k in reversed(range(len(names))):
        before = angles[k - 1] if k else 0.0
        at = (1.0, 0.0) if k else (x, y)
        text = rod(names[k], *at, angles[k] - before, (extra[k] if extra else "") + text)
    return text


def connect(a, b, anchor):
    return f'<connect body1="{a}" body2="{b}" anchor="{anchor[0]!r} {anchor[1]!r} 0" {HARD}/>'


def build(drawing):
    n, angle, pins = drawing.count, drawing.angles, ""
    if drawing.kind == "chain":
        body = row([f"r{k}" for k in range(n)], angle, 0.0, 0.0)
    elif drawing.kind == "bank":
        arms = ""
        for k in range(n):
            first, second = angle[2 * k], angle[2 * k + 1]
            arms += row([f"o{k}", f"i{k}"], [second + math.pi, first + math.pi], 0.0, 0.0)
            pins += connect(f"i{k}", "world", (1.0, 0.0))
        joints = '<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/><joint type="hinge" axis="0 0 1"/>'
        hub = '<inertial pos="0 0 0" mass="1" diaginertia="0.083333 0.083333 0.083333"/>'
        body = f'<body name="hub">{joints}{hub}{arms}</body>'
    else:
        rungs = [rod(f"c{k}", 1.0, 0.0, math.pi / 2) for k in range(n)]
        body = row([f"a{k}" for k in range(n)], [TURN] * n, 0.0, 0.0, rungs)
        body += row([f"b{k}" for k in range(n)], [TURN] * n, *drawing.start[1])
        pins = "".join(connect(f"c{k}", f"b{k}", (1.0, 0.0)) for k in range(n))
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><compiler angle="radian" autolimits="false"/><option timestep="0.001" solver="Newton" '
        f'gravity="0 {-GRAVITY} 0"><flag contact="disable"/></option>'
        f"<worldbody>{body}</worldbody><equality>{pins}</equality></mujoco>"
    )


def main():
    some = (10, 30, 100)
    for kind, counts in (("chain", (1, 10, 100, 400)), ("bank", some), ("straight", some), ("ladder", some)):
        for count in counts:
            drawing = MAKE[kind](count)
            model = build(drawing)
            data = mujoco.MjData(model)
            mujoco.mj_forward(model, data)
            assert data.efc_pos.size == 0 or abs(data.efc_pos).max() < 1e-9, "the drawing does not close"
            line("mujoco forward", drawing, median_ns(lambda: mujoco.mj_forward(model, data)))


main()
