"""Released structures for transients.py: documents of `bimorph convert`, in micrometres, micronewtons, microseconds and 1e-12 kg."""

import json
import math
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "scripts"))

from frames import report  # noqa: E402
from frames.corotational import Frame  # noqa: E402
from frames.scenes import frame  # noqa: E402

# Linear deflection of random frames, in beam lengths, as in scripts/random-frames.
DEFLECTION = 0.05
# Periods of the lowest mode that random frames move.
PERIODS = 3
PLATE = """process p1 = [Youngsmodulus=165e9 density=2300 h=2e-6]
param F=0
anchor p1 [a] []
beam2d p1 [a b] [l=200u w=2u]
link2d * [b c] [l=25u]
plate2d p1 [c] [l=50u w=50u]
f2d * [c] [F=F oz=pi/2]
"""
STOP = """process p1 = [Youngsmodulus=165e9 density=2300 h=2e-6]
param F=0
anchor p1 [a] []
beam2d p1 [a b] [l=200u w=2u]
stop2d * [b] [gap=2u oz=-pi/2 k=100 restitution=1]
f2d * [b] [F=F oz=pi/2]
"""


@dataclass
class Problem:
    """A motion from the equilibrium at a parameter's value, which becomes 0."""

    name: str
    netlist: Path
    parameter: str
    value: float
    stop: float
    node: str


@dataclass
class Bar:
    """A beam, or a rigid link: stiff and without mass."""

    a: int
    b: int
    ea: float
    ei: float
    line: float
    scale: float
    rigid: bool


@dataclass
class Stop:
    """Bears a node beyond `gap` [µm] down -y with the force stiffness·p²/(p + SOFT) [µN] at the penetration p, without loss."""

    node: int
    gap: float
    stiffness: float

    # Penetration that halves the stiffness [µm].
    SOFT = 1e-3

    def force(self, p):
        p = np.maximum(p, 0.0)
        return self.stiffness * p**2 / (p + self.SOFT)

    def tangent(self, p):
        p = max(p, 0.0)
        return self.stiffness * p * (p + 2 * self.SOFT) / (p + self.SOFT) ** 2


class Structure:
    """Nodes [µm], bars, point masses by node (mass, inertia), anchors, and loads by node (x, y, moment)."""

    def __init__(self, program, problem):
        out = problem.netlist.with_suffix(".json")
        words = [program, "convert", problem.netlist, "--set", f"{problem.parameter}={problem.value!r}", "--out", out]
        subprocess.run(words, check=True, capture_output=True)
        document = json.loads(out.read_text())
        named = {n["name"]: k for k, n in enumerate(n for n in document["nodes"] if n["mechanical"])}
        self.places = np.array([n["position"] for n in document["nodes"] if n["mechanical"]]) * 1e6
        self.bars = []
        for beam in document["beams"]:
            e, w, h = beam["material"]["youngs_modulus"] * 1e-6, beam["width"] * 1e6, beam["thickness"] * 1e6
            line = beam["material"]["density"] * 1e-6 * w * h
            self.bars.append(Bar(named[beam["a"]], named[beam["b"]], e * w * h, e * h * w**3 / 12, line, math.sqrt(w), False))
        stiff, bend = max(b.ea for b in self.bars), max(b.ei for b in self.bars)
        # compliances below 1e-6 of those of any beam
        links = [Bar(named[k["a"]], named[k["b"]], 1e4 * stiff, 1e6 * bend, 0.0, 1.0, True) for k in document.get("links", [])]
        self.masses = {named[m["node"]]: (m["mass"] * 1e12, m["inertia"] * 1e24) for m in document.get("masses", [])}
        self.anchors = {named[s["node"]] for s in document["supports"] if all(s["held"])}
        self.loads = {named[k["node"]]: (*(1e6 * f for f in k["force"]), 1e12 * k["moment"]) for k in document["loads"]}
        self.node = named[problem.node]
        self.stops = [Stop(named[s["a"]], 1e6 * s["ways"][0], s["stiffness"]) for s in document.get("stops", [])]
        self.bars += links
        self.stop = problem.stop * 1e6

    def rotary(self, elements, lengths):
        """Rotary inertia at each node [1e-24 kg m²]: of its halves of elements where parts may touch, as in this program, else none."""
        inertia = {}
        for (bar, *ends), length in zip(elements, lengths if self.stops else ()):
            for k in ends:
                inertia[k] = inertia.get(k, 0.0) + bar.line * length / 2 * bar.scale**4 / 12
        return inertia

    def length(self, bar):
        return float(np.hypot(*(self.places[bar.b] - self.places[bar.a])))

    def pieces(self, finest):
        """Elements of each bar, as many as bending waves of one frequency need: `finest` of the bar with most, at least one."""
        waves = [0.0 if bar.rigid else self.length(bar) / bar.scale for bar in self.bars]
        return [max(1, round(finest * wave / max(waves))) for wave in waves]

    def divided(self, finest):
        """Places of all nodes and the elements (bar, a, b) of this mesh."""
        places, elements = [tuple(p) for p in self.places], []
        for bar, pieces in zip(self.bars, self.pieces(finest)):
            a, b = self.places[bar.a], self.places[bar.b]
            inner = list(range(len(places), len(places) + pieces - 1))
            places += [tuple(a + (b - a) * (k / pieces)) for k in range(1, pieces)]
            chain = [bar.a, *inner, bar.b]
            elements += [(bar, i, j) for i, j in zip(chain, chain[1:])]
        return places, elements


def loaded(beams):
    """Random frames by seed with so many beams, under forces that deflect them by DEFLECTION and that they bear."""
    for seed in range(1, 1000):
        scene = frame(seed, "force")
        if len(scene.beams) not in beams:
            continue
        model = Frame(scene, 8)
        factor = DEFLECTION / report.deflection(model, scene)
        for load in scene.loads:
            load.F *= factor
            load.M *= factor
        if Frame(scene, 8).follow()[1] == 1.0:
            yield scene


def problems(folder):
    """The stage, a cantilever with a plate, one that strikes a stop, and the first random frames with three to five beams and with ten or more."""
    folder.mkdir(parents=True, exist_ok=True)
    stage = folder / "quarter_stage.net"
    stage.write_text((ROOT / "examples/quarter_stage/quarter_stage.net").read_text())
    for shared in ("quarter.net", "bimorph.net", "poly.net"):
        (folder.parent / shared).write_text((ROOT / "examples" / shared).read_text())
    plate = folder / "plate.net"
    plate.write_text(PLATE)
    stop = folder / "stop.net"
    stop.write_text(STOP)
    found = [
        Problem("quarter_stage", stage, "F", 100e-6, 30e-6, "c"),
        Problem("plate", plate, "F", 15e-6, 120e-6, "c"),
        Problem("stop", stop, "F", 0.5e-6, 10e-6, "b"),
    ]
    small = next(loaded(range(3, 6)))
    large = next(loaded(range(10, 100)))
    for name, scene in (("small_frame", small), ("large_frame", large)):
        model = Frame(scene, 8)
        path = folder / f"{name}.net"
        path.write_text(scene.netlist())
        u = Frame(scene, 8).linear_release().reshape(-1, 3)[: len(scene.places)]
        node = int(np.argmax(np.hypot(u[:, 0], u[:, 1])))
        period = 2 * math.pi / model.modes_at_rest()[0][0]
        found.append(Problem(name, path, "lam", 1.0, float(f"{PERIODS * period:.2e}"), f"n({node})"))
    return found
