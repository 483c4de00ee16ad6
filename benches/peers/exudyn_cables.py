"""Exudyn: released frames of ANCF cables (`ANCFCable2D`), joined at drawn nodes by constraints, generalized alpha (index 2), one run."""

import math
import time

import exudyn as exu
import numpy as np
from exudyn.utilities import (
    Cable2D,
    Force,
    GenericJoint,
    MarkerBodyPosition,
    MarkerBodyRigid,
    NodePoint2DSlope1,
    NodeRigidBody2D,
    ObjectGround,
    RigidBody2D,
    RotationMatrixZ,
    SensorBody,
    Torque,
)

# Factor by which an infinitely fast motion shrinks in a step.
RHO = 0.8
# Mass of the body at a node without one, relative to the lightest beam.
SMALL = 1e-6


def clusters(structure):
    """For each node the node of the rigid part that it belongs to: one with a mass, or an anchor, if there is one."""
    of = list(range(len(structure.places)))
    for bar in structure.bars:
        if bar.rigid:
            a, b = of[bar.a], of[bar.b]
            into, gone = (a, b) if a in structure.masses or a in structure.anchors else (b, a)
            of = [into if k == gone else k for k in of]
    return of


class Cables:
    def __init__(self, structure, finest, reduced=False):
        self.structure = structure
        self.container = exu.SystemContainer()
        mbs = self.mbs = self.container.AddSystem()
        of = clusters(structure)
        ground = mbs.AddObject(ObjectGround())
        bodies, loads = {}, []
        small = SMALL * min(structure.length(bar) * bar.line for bar in structure.bars if not bar.rigid)
        for k in sorted(set(of)):
            x, y = structure.places[k]
            if k in structure.anchors:
                bodies[k] = ground
                continue
            mass, inertia = structure.masses.get(k, (small, small))
            node = mbs.AddNode(NodeRigidBody2D(referenceCoordinates=[x, y, 0]))
            bodies[k] = mbs.AddObject(RigidBody2D(physicsMass=mass, physicsInertia=inertia, nodeNumber=node))

        def at(k):
            """The body that bears a node and the place of the node there."""
            body = bodies[of[k]]
            local = structure.places[k] if body == ground else structure.places[k] - structure.places[of[k]]
            return body, [float(local[0]), float(local[1]), 0.0]

        for bar, pieces in zip(structure.bars, structure.pieces(finest)):
            if bar.rigid:
                continue
            start, chord = structure.places[bar.a], structure.places[bar.b] - structure.places[bar.a]
            length = structure.length(bar) / pieces
            slope = chord / structure.length(bar)
            made, before = [], None
            for k in range(pieces + 1):
                place = start + chord * (k / pieces)
                node = mbs.AddNode(NodePoint2DSlope1(referenceCoordinates=[*map(float, place), *map(float, slope)]))
                if before is not None:
                    made.append(
                        mbs.AddObject(
                            Cable2D(
                                physicsLength=length,
                                physicsMassPerLength=bar.line,
                                physicsBendingStiffness=bar.ei,
                                physicsAxialStiffness=bar.ea,
                                nodeNumbers=[before, node],
                                useReducedOrderIntegration=int(reduced),
                            )
                        )
                    )
                before = node
            turned = RotationMatrixZ(math.atan2(chord[1], chord[0]))
            for node, element, where in ((bar.a, made[0], 0.0), (bar.b, made[-1], length)):
                body, local = at(node)
                markers = [
                    mbs.AddMarker(MarkerBodyRigid(bodyNumber=body, localPosition=local)),
                    mbs.AddMarker(MarkerBodyRigid(bodyNumber=element, localPosition=[where, 0, 0])),
                ]
                mbs.AddObject(GenericJoint(markerNumbers=markers, constrainedAxes=[1, 1, 0, 0, 0, 1], rotationMarker0=turned))
        for k, (fx, fy, moment) in structure.loads.items():
            body, local = at(k)
            loads.append((mbs.AddLoad(Force(markerNumber=mbs.AddMarker(MarkerBodyPosition(bodyNumber=body, localPosition=local)), loadVector=[fx, fy, 0]))))
            if moment:
                loads.append(mbs.AddLoad(Torque(markerNumber=mbs.AddMarker(MarkerBodyRigid(bodyNumber=body, localPosition=local)), loadVector=[0, 0, moment])))
        body, local = at(structure.node)
        self.sensor = mbs.AddSensor(SensorBody(bodyNumber=body, localPosition=local, storeInternal=True, outputVariableType=exu.OutputVariableType.Displacement))
        mbs.Assemble()
        self.settings = s = exu.SimulationSettings()
        s.solutionSettings.writeSolutionToFile = False
        s.linearSolverType = exu.LinearSolverType.EigenSparse
        s.parallel.numberOfThreads = 1
        s.staticSolver.numberOfLoadSteps = 20
        s.staticSolver.newton.maxIterations = 50
        s.staticSolver.verboseMode = s.timeIntegration.verboseMode = 0
        s.staticSolver.stabilizerODE2term = 0
        try:
            mbs.SolveStatic(s)
        except exu.SolverError:
            # rounding of fine meshes keeps corrections above the default tolerance
            s.staticSolver.newton.relativeTolerance = 1e-6
            s.staticSolver.newton.absoluteTolerance = 1e-6
            mbs.systemData.SetODE2Coordinates(np.zeros(len(mbs.systemData.GetODE2Coordinates())), configuration=exu.ConfigurationType.Initial)
            mbs.SolveStatic(s)
        self.start = mbs.systemData.GetODE2Coordinates()
        for load in loads:
            mbs.SetLoadParameter(load, "loadVector", [0.0, 0.0, 0.0])

    def run(self, steps, modified=True, within=1e-4):
        """Times, x and y of the node, and the processor time of the steps (s). None where no step converges."""
        mbs, s = self.mbs, self.settings
        mbs.systemData.SetODE2Coordinates(self.start, configuration=exu.ConfigurationType.Initial)
        zero = np.zeros(len(self.start))
        mbs.systemData.SetODE2Coordinates_t(zero, configuration=exu.ConfigurationType.Initial)
        t = s.timeIntegration
        t.generalizedAlpha.spectralRadius = RHO
        t.newton.useModifiedNewton = modified
        t.newton.relativeTolerance = within

        def go(count, end):
            t.numberOfSteps, t.endTime = count, end
            s.solutionSettings.sensorsWritePeriod = end / count
            begun = time.thread_time()
            mbs.SolveDynamic(s)
            return time.thread_time() - begun

        h = self.structure.stop / steps
        try:
            alone = go(1, h)
            spent = go(steps, self.structure.stop)
        except Exception:
            return None
        rows = np.array(mbs.GetSensorStoredData(self.sensor))
        return rows[:, 0], rows[:, 1:3].T, max(spent - alone, 0.0)
