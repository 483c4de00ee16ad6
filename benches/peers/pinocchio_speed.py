"""Pinocchio: ABA on the open chain; constraintDynamics and LCABA on the loops. One evaluation of the accelerations.

Called through the Python binding: a call on one body is printed as `pinocchio aba,chain,1`, and is nearly all binding.
Rods are numbered depth first, without which constraintDynamics is wrong. A pin is a 3D contact, whose z row is empty in a
planar mechanism; the proximal term takes care of it.
"""

import sys

import numpy as np
import pinocchio as pin

from clock import line, median_ns
from topologies import GRAVITY, MAKE

ROD = pin.Inertia(1.0, np.array([0.5, 0.0, 0.0]), np.diag([0.0, 1 / 12, 1 / 12]))


def place(angle, x=0.0, y=0.0):
    return pin.SE3(pin.rpy.rpyToMatrix(0.0, 0.0, angle), np.array([x, y, 0.0]))


def add(model, parent, at):
    """A rod on a pin; returns its joint."""
    joint = model.addJoint(parent, pin.JointModelRZ(), at, f"j{model.njoints}")
    model.appendBodyToJoint(joint, ROD, pin.SE3.Identity())
    return joint


def build(drawing):
    model = pin.Model()
    model.gravity.linear = np.array([0.0, -GRAVITY, 0.0])
    pins = []
    angle = drawing.angles
    if drawing.kind == "chain":
        parent = 0
        for k in range(drawing.count):
            at = place(angle[0]) if k == 0 else place(angle[k] - angle[k - 1], 1.0)
            parent = add(model, parent, at)
    elif drawing.kind == "bank":
        hub = 0
        for joint in (pin.JointModelPX(), pin.JointModelPY(), pin.JointModelRZ()):
            hub = model.addJoint(hub, joint, pin.SE3.Identity(), f"hub{model.njoints}")
        model.appendBodyToJoint(hub, pin.Inertia(1.0, np.zeros(3), np.eye(3) / 12), pin.SE3.Identity())
        for k in range(drawing.count):
            # from the hub outward: the second rod turned round, then the first; its far end is pinned to ground
            outer = add(model, hub, place(angle[2 * k + 1] + np.pi))
            inner = add(model, outer, place(angle[2 * k] - angle[2 * k + 1], 1.0))
            pins.append((inner, place(0.0, 1.0), 0, place(0.0, *drawing.start[2 * k])))
    else:
        rail = other = 0
        for k in range(drawing.count):
            at = (lambda i: place(angle[i], *drawing.start[i])) if k == 0 else (lambda i: place(0.0, 1.0))
            rail, before = add(model, rail, at(3 * k)), other
            rung = add(model, rail, place(angle[3 * k + 2] - angle[3 * k], 1.0))
            pins.append([rung, place(0.0, 1.0), k])
        # depth first: the other rail after the whole of the first
        ends = []
        for k in range(drawing.count):
            at = place(angle[1], *drawing.start[1]) if k == 0 else place(0.0, 1.0)
            other = add(model, other, at)
            ends.append(other)
        pins = [(rung, at, ends[k], place(0.0, 1.0)) for rung, at, k in pins]
    constraints = pin.StdVec_RigidConstraintModel()
    for a, at_a, b, at_b in pins:
        constraints.append(pin.RigidConstraintModel(pin.ContactType.CONTACT_3D, model, a, at_a, b, at_b, pin.LOCAL))
    return model, constraints


def gap(model, constraints, q):
    """Largest distance between the two sides of a pin [m]."""
    data = model.createData()
    pin.forwardKinematics(model, data, q)
    sides = [
        (data.oMi[c.joint1_id] * c.joint1_placement, data.oMi[c.joint2_id] * c.joint2_placement) for c in constraints
    ]
    return max((np.linalg.norm(a.translation - b.translation) for a, b in sides), default=0.0)


def main():
    some = (10, 30, 100)
    for kind, counts in (("chain", (1, 10, 100, 400)), ("bank", some), ("straight", some), ("ladder", some)):
        for count in counts:
            drawing = MAKE[kind](count)
            model, constraints = build(drawing)
            q, v, tau = pin.neutral(model), np.full(model.nv, 0.1), np.zeros(model.nv)
            if kind != "chain":
                v[:] = 0.0
            assert gap(model, constraints, q) < 1e-9, "the drawing does not close"
            data = model.createData()
            if kind == "chain":
                line("pinocchio aba", drawing, median_ns(lambda: pin.aba(model, data, q, v, tau)))
                continue
            datas = pin.StdVec_RigidConstraintData()
            for c in constraints:
                datas.append(c.createData())
            settings = pin.ProximalSettings(1e-12, 1e-6, 20)
            pin.initConstraintDynamics(model, data, constraints, datas)
            call = lambda: pin.constraintDynamics(model, data, q, v, tau, constraints, datas, settings)
            rigid = np.array(call())
            line("pinocchio constraintDynamics", drawing, median_ns(call))
            if hasattr(pin, "lcaba"):
                data = model.createData()
                settings = pin.ProximalSettings(1e-9, 1e-6, 1)
                pin.computeJointMinimalOrdering(model, data, constraints)
                call = lambda: pin.lcaba(model, data, q, v, tau, constraints, datas, settings)
                apart = np.linalg.norm(np.array(call()) - rigid) / np.linalg.norm(rigid)
                line("pinocchio lcaba", drawing, median_ns(call))
                print(f"  {kind} {count}: lcaba and constraintDynamics differ by {apart:.1e}", file=sys.stderr)


main()
