"""Exudyn: implicit steps (generalized alpha, index 2) with planar rigid bodies and revolute joints, sparse solver.

Thread CPU time of 20 steps with a full Newton iteration, less that of 10: what assembling the system costs once drops
out. Divided by the number of Newton iterations.
"""

import math
import sys
import time

import exudyn as exu
from exudyn.utilities import *  # noqa: F403, the package's own style

from clock import line
from topologies import GRAVITY, MAKE


def build(drawing):
    system = exu.SystemContainer()
    mbs = system.AddSystem()
    ground = mbs.AddObject(ObjectGround())

    def add(x, y, angle):
        node = mbs.AddNode(Rigid2D(referenceCoordinates=[x, y, angle], initialVelocities=[0, 0, 0]))
        body = mbs.AddObject(RigidBody2D(physicsMass=1, physicsInertia=1 / 12, nodeNumber=node))
        marker = mbs.AddMarker(MarkerBodyPosition(bodyNumber=body, localPosition=[0, 0, 0]))
        mbs.AddLoad(Force(markerNumber=marker, loadVector=[0, -GRAVITY, 0]))
        return body

    def pin(a, at_a, b, at_b):
        markers = [
            mbs.AddMarker(MarkerBodyPosition(bodyNumber=body, localPosition=[at[0], at[1], 0]))
            for body, at in ((a, at_a), (b, at_b))
        ]
        mbs.AddObject(RevoluteJoint2D(markerNumbers=markers))

    rods = [
        add(x + math.cos(angle) / 2, y + math.sin(angle) / 2, angle) for angle, (x, y) in zip(drawing.angles, drawing.start)
    ]
    left, right, n = (-0.5, 0.0), (0.5, 0.0), drawing.count
    if drawing.kind == "chain":
        for k in range(n):
            pin(*((ground, drawing.start[0]) if k == 0 else (rods[k - 1], right)), rods[k], left)
    elif drawing.kind == "bank":
        hub = add(0.0, 0.0, 0.0)
        for k in range(n):
            pin(ground, drawing.start[2 * k], rods[2 * k], left)
            pin(rods[2 * k], right, rods[2 * k + 1], left)
            pin(rods[2 * k + 1], right, hub, (0.0, 0.0))
    else:
        for k in range(n):
            for rail in (0, 1):
                before = (ground, drawing.start[rail]) if k == 0 else (rods[3 * (k - 1) + rail], right)
                pin(*before, rods[3 * k + rail], left)
            pin(rods[3 * k], right, rods[3 * k + 2], left)
            pin(rods[3 * k + 2], right, rods[3 * k + 1], right)
    mbs.Assemble()
    return system, mbs


def run(drawing, steps):
    """Thread CPU time of a simulation and its Newton iterations."""
    system, mbs = build(drawing)
    settings = exu.SimulationSettings()
    settings.timeIntegration.numberOfSteps = steps
    settings.timeIntegration.endTime = 1e-3 * steps
    settings.timeIntegration.newton.useModifiedNewton = False
    settings.timeIntegration.verboseMode = 0
    settings.solutionSettings.writeSolutionToFile = False
    settings.solutionSettings.sensorsWritePeriod = 1.0
    settings.linearSolverType = exu.LinearSolverType.EigenSparse
    settings.parallel.numberOfThreads = 1
    begin = time.thread_time_ns()
    mbs.SolveDynamic(settings)
    spent = time.thread_time_ns() - begin
    return spent, mbs.sys["dynamicSolver"].it.newtonStepsCount


def main():
    some = (10, 30, 100)
    for kind, counts in (("chain", (10, 100, 400)), ("bank", some), ("straight", some), ("ladder", some)):
        for count in counts:
            drawing = MAKE[kind](count)
            differences = []
            try:
                for _ in range(5):
                    (short, few), (long, many) = run(drawing, 10), run(drawing, 20)
                    differences.append((long - short) / (many - few))
            except exu.SolverError:
                print(f"  {drawing.label} {count}: finds no step", file=sys.stderr)
                continue
            line("exudyn Newton iteration", drawing, sorted(differences)[2])


main()
