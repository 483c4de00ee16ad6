"""OpenSees: released frames of corotational beams (`elasticBeamColumn` with `Corotational`) by Newmark, HHT, TRBDF2 or generalized alpha, one run."""

import math
import time

import numpy as np
import openseespy.opensees as ops

# Parameters. Generalized alpha shrinks infinitely fast motions by 0.8 in a step, the default of this program.
INTEGRATORS = {"Newmark": (0.5, 0.25), "HHT": (0.9,), "TRBDF2": (), "GeneralizedAlpha": (1.2 / 1.8, 1 / 1.8)}
# Length of a first step over that of the others. It replaces the initial accelerations, which OpenSees takes as zero.
FIRST = 1e-3


def run(structure, finest, steps, integrator="Newmark", algorithm="Newton", consistent=False, system="SparseSYM", within=1e-4):
    """Times, x and y of the node, and the processor time of the steps (s). None where no step converges. `within` is the largest correction, over the
    largest displacement."""
    ops.wipe()
    ops.model("basic", "-ndm", 2, "-ndf", 3)
    places, elements = structure.divided(finest)
    for k, (x, y) in enumerate(places):
        ops.node(k + 1, float(x), float(y))
    for k in structure.anchors:
        ops.fix(k + 1, 1, 1, 1)
    masses = {k: [m, m, i] for k, (m, i) in structure.masses.items()}
    lengths = [math.dist(places[a], places[b]) for _, a, b in elements]
    for k, inertia in structure.rotary(elements, lengths).items():
        masses.setdefault(k, [0.0, 0.0, 0.0])[2] += inertia
    for k, mass in masses.items():
        ops.mass(k + 1, *mass)
    ops.geomTransf("Corotational", 1)
    for number, (bar, a, b) in enumerate(elements):
        # area and second moment with a modulus of 1
        more = ["-cMass"] if consistent else []
        ops.element("elasticBeamColumn", number + 1, a + 1, b + 1, bar.ea, 1.0, bar.ei, 1, "-mass", bar.line, *more)
    for number, stop in enumerate(structure.stops):
        # a table of the law, fine at its foot; zero up to the gap and beyond
        p = np.geomspace(1e-4, 2.0, 400)
        strain = [*(-stop.gap - p[::-1]), -stop.gap, 0.0, 1e3]
        stress = [*(-stop.force(p[::-1])), 0.0, 0.0, 0.0]
        ops.uniaxialMaterial("ElasticMultiLinear", number + 1, "-strain", *map(float, strain), "-stress", *map(float, stress))
        ground, x, y = len(places) + number + 1, *map(float, places[stop.node])
        ops.node(ground, x, y)
        ops.fix(ground, 1, 1, 1)
        ops.element("zeroLength", len(elements) + number + 1, ground, stop.node + 1, "-mat", number + 1, "-dir", 2)
    ops.timeSeries("Constant", 1)
    ops.timeSeries("Linear", 2)
    ops.pattern("Plain", 1, 2)
    for k, load in structure.loads.items():
        ops.load(k + 1, *load)
    ops.constraints("Plain")
    ops.numberer("RCM")
    ops.system(system)
    ops.algorithm("Newton")
    count = 20
    ops.test("NormDispIncr", 1e-8, 50)
    ops.integrator("LoadControl", 1 / count)
    ops.analysis("Static")
    if ops.analyze(count) != 0:
        return None
    node = structure.node + 1
    start = [ops.nodeDisp(node, 1), ops.nodeDisp(node, 2)]
    ops.remove("loadPattern", 1)
    ops.setTime(0.0)
    ops.wipeAnalysis()
    ops.constraints("Plain")
    ops.numberer("RCM")
    ops.system(system)
    ops.test("NormDispIncr", within * math.hypot(*start), 50)
    ops.algorithm(algorithm)
    ops.integrator(integrator, *INTEGRATORS[integrator])
    ops.analysis("Transient")
    h = structure.stop / steps
    rows = np.empty((steps + 1, 3))
    rows[0] = 0.0, *start
    begun = time.thread_time()
    if ops.analyze(1, FIRST * h) != 0:
        return None
    for k in range(1, steps + 1):
        if ops.analyze(1, h * (1 - FIRST) if k == 1 else h) != 0:
            return None
        rows[k] = ops.getTime(), ops.nodeDisp(node, 1), ops.nodeDisp(node, 2)
    return rows[:, 0], rows[:, 1:].T, time.thread_time() - begun
