"""Random planar frames of silicon beams: trees with closing beams, several anchors, plates, and dead loads or heated beams."""

import math
import random
from dataclasses import dataclass, field

import numpy as np


@dataclass
class Beam:
    a: int
    b: int
    w: float
    rise: float = 0.0


@dataclass
class Plate:
    node: int
    l: float
    w: float


@dataclass
class Load:
    node: int
    F: float
    M: float
    oz: float


@dataclass
class Scene:
    seed: int
    kind: str
    places: list
    beams: list
    anchors: set
    plates: list = field(default_factory=list)
    loads: list = field(default_factory=list)
    E: float = 165e9
    density: float = 2300.0
    h: float = 2e-6
    expansion: float = 2.7e-6
    ambient: float = 300.0

    def netlist(self):
        """The frame in the netlist language; the parameter `lam` scales loads and temperature rises."""
        lines = [
            f"% random frame {self.seed} ({self.kind}), written by scripts/random-frames",
            f"process p1 = [ Youngsmodulus={self.E} density={self.density} h={self.h} thermalexpansion={self.expansion} ambienttemperature={self.ambient} ]",
            "param lam = 1",
        ]
        lines += [f"anchor p1 [n({min(self.anchors)})] []"]
        for beam in self.beams:
            (xa, ya), (xb, yb) = self.places[beam.a], self.places[beam.b]
            l, oz = math.hypot(xb - xa, yb - ya), math.atan2(yb - ya, xb - xa)
            heat = f" T={self.ambient}+{beam.rise!r}*lam" if beam.rise else ""
            lines.append(f"beam2d p1 [n({beam.a}) n({beam.b})] [l={l!r} oz={oz!r} w={beam.w!r}{heat}]")
        lines += [f"anchor p1 [n({node})] []" for node in sorted(self.anchors)[1:]]
        lines += [f"plate2d p1 [n({p.node})] [l={p.l!r} w={p.w!r}]" for p in self.plates]
        lines += [f"f2d * [n({l.node})] [F={l.F!r}*lam M={l.M!r}*lam oz={l.oz!r}]" for l in self.loads]
        return "\n".join(lines) + "\n"


def frame(seed, kind=None):
    """The random frame of a seed; `kind` is "force" or "heat", two in three are the former."""
    draw = random.Random(seed)
    kind = kind or ("heat" if draw.random() < 1 / 3 else "force")
    size = 10 ** draw.uniform(math.log10(25e-6), math.log10(200e-6))
    width = lambda: 10 ** draw.uniform(math.log10(0.4e-6), math.log10(6e-6))
    places, beams = [(0.0, 0.0)], []
    for node in range(1, draw.randrange(3, 10)):
        # branches keep a distance from what is there
        for _ in range(50):
            at = draw.randrange(len(places))
            l, oz = size * draw.uniform(0.5, 1.3), draw.uniform(-math.pi, math.pi)
            place = (places[at][0] + l * math.cos(oz), places[at][1] + l * math.sin(oz))
            if min(math.dist(place, other) for other in places) > 0.4 * size:
                break
        places.append(place)
        beams.append(Beam(at, node, width()))
    joined = {(min(b.a, b.b), max(b.a, b.b)) for b in beams}
    pairs = [(a, b) for a in range(len(places)) for b in range(a) if (b, a) not in joined]
    pairs = [(a, b) for a, b in pairs if math.dist(places[a], places[b]) < 2.5 * size]
    closing = min(len(pairs), draw.choice([0, 0, 1, 2, 3, 4]) if kind == "force" else draw.choice([1, 2, 3, 4]))
    beams += [Beam(a, b, width()) for a, b in draw.sample(pairs, closing)]
    most = max(1, len(places) // 3)
    anchors = set(draw.sample(range(len(places)), draw.randint(1 if kind == "force" else min(2, most), most)))
    scene = Scene(seed, kind, places, beams, anchors)
    moving = [node for node in range(len(places)) if node not in anchors]
    if draw.random() < 0.4:
        node = draw.choice(moving)
        scene.plates.append(Plate(node, size * draw.uniform(0.1, 0.5), size * draw.uniform(0.1, 0.5)))
    if kind == "heat":
        rise = 10 ** draw.uniform(1.0, 3.0)
        for beam in beams:
            beam.rise = rise * draw.uniform(0.5, 1.0) if draw.random() < 0.7 else 0.0
        beams[0].rise = beams[0].rise or rise
        return scene
    for _ in range(draw.randrange(1, 4)):
        scene.loads.append(Load(draw.choice(moving), draw.choice([-1, 1]) * draw.uniform(0.2, 1.0), 0.0, draw.uniform(0, 2 * math.pi)))
    if draw.random() < 0.3:
        scene.loads[-1].M = draw.choice([-1, 1]) * draw.uniform(0.02, 0.2) * size
    _scale(scene, size, 10 ** draw.uniform(-2, 3))
    return scene


def _scale(scene, size, bend):
    """Scales the loads: the linear deflection is `bend` times a beam's length, and no force strains the thinnest beam by more than 3 %."""
    from .corotational import Frame

    deflection = Frame(scene, 1).linear_release().reshape(-1, 3)[:, :2]
    factor = bend * size / max(float(np.max(np.hypot(deflection[:, 0], deflection[:, 1]))), 1e-30)
    thinnest = min(beam.w for beam in scene.beams)
    total = sum(abs(load.F) for load in scene.loads)
    factor = min(factor, 0.03 * scene.E * scene.h * thinnest / total)
    for load in scene.loads:
        load.F *= factor
        load.M *= factor
