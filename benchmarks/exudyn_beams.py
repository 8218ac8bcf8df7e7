"""The heavy top and the L pendulum of geometrically exact beams as systems of exudyn, for `benchmarks/nodal.py`."""

from __future__ import annotations

import time
from itertools import pairwise
from typing import Any

import exudyn as exu
import exudyn.itemInterface as items
import numpy as np
from exudyn.rigidBodyUtilities import RigidBodyInertia
from exudyn.rigidBodyUtilities import RotationMatrix2EulerParameters as parameters_of

Array = np.ndarray
GRAVITY = 9.81
FAILURE = exu.SolverError


def solve(mbs: Any, sensor: int, duration: float, step: float, radius: float, settings: Any) -> tuple[Array, float]:
    """Times and positions (k, 4) and seconds that the solver took, one thread, nothing written."""
    integration = settings.timeIntegration
    integration.numberOfSteps, integration.endTime = round(duration / step), duration
    integration.verboseMode = 0
    integration.generalizedAlpha.spectralRadius = radius
    settings.parallel.numberOfThreads = 1
    settings.solutionSettings.writeSolutionToFile = False
    settings.solutionSettings.sensorsWritePeriod = step
    settings.displayStatistics = settings.displayComputationTime = False
    begun = time.process_time()
    mbs.SolveDynamic(settings)
    spent = time.process_time() - begun
    return np.array(mbs.GetSensorStoredData(sensor)), spent


def heavy_top(spin: Array, arm: Array, duration: float, step: float, modified: bool) -> tuple[Array, float]:
    """One body with a rotation vector as a Lie group, pinned; generalized-α with ρ∞ = 0.8."""
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    inertia = RigidBodyInertia(mass=15.0, inertiaTensor=np.diag([0.234375, 0.46875, 0.234375]), com=[0.0, 0.0, 0.0])
    body = mbs.CreateRigidBody(
        inertia=inertia,
        nodeType=exu.NodeType.RotationRotationVector,
        referencePosition=list(arm),
        initialVelocity=list(np.cross(spin, arm)),
        initialAngularVelocity=list(spin),
        gravity=[0.0, 0.0, -GRAVITY],
    )
    ground = mbs.AddObject(items.ObjectGround())
    mbs.CreateSphericalJoint(bodyNumbers=[ground, body], position=[0.0, 0.0, 0.0])
    kind = exu.OutputVariableType.Position
    sensor = mbs.AddSensor(items.SensorBody(bodyNumber=body, outputVariableType=kind, storeInternal=True))
    mbs.Assemble()
    settings = exu.SimulationSettings()
    settings.timeIntegration.newton.useModifiedNewton = modified
    settings.linearSolverType = exu.LinearSolverType.EXUdense
    return solve(mbs, sensor, duration, step, 0.8, settings)


def l_pendulum(elements: int, duration: float, step: float, tolerance: float) -> tuple[Array, float]:
    """Steel, 10 mm in the plane of the L, 30 mm across; the elbow is two nodes, welded."""
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    e, density, g = 2e11, 7800.0, 2e11 / 2.66
    area, across, inside = 3e-4, 0.01 * 0.03**3 / 12, 0.03 * 0.01**3 / 12
    section = exu.BeamSection()
    section.stiffnessMatrix = np.diag([e * area, *(5 / 6 * g * area,) * 2, g * 7.8995079e-9, e * across, e * inside])
    section.inertia = density * np.diag([across + inside, across, inside])
    section.massPerLength = density * area
    length = 0.5 / elements
    legs = (np.eye(3), np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]))
    starts = (np.zeros(3), np.array([0.5, 0.0, 0.0]))
    chains = []
    for axes, start in zip(legs, starts, strict=True):
        turn = list(parameters_of(axes))
        nodes = [
            mbs.AddNode(items.NodeRigidBodyEP(referenceCoordinates=[*(start + k * length * axes[:, 0]), *turn]))
            for k in range(elements + 1)
        ]
        for pair in pairwise(nodes):
            beam = mbs.AddObject(
                items.ObjectBeamGeometricallyExact(nodeNumbers=list(pair), length=length, sectionData=section)
            )
            mass = mbs.AddMarker(items.MarkerBodyMass(bodyNumber=beam))
            mbs.AddLoad(items.LoadMassProportional(markerNumber=mass, loadVector=[0.0, 0.0, -GRAVITY]))
        chains.append(nodes)
    ground = mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=mbs.AddObject(items.ObjectGround())))
    root, inner, outer = (
        mbs.AddMarker(items.MarkerNodeRigid(nodeNumber=n)) for n in (chains[0][0], chains[0][-1], chains[1][0])
    )
    mbs.AddObject(items.GenericJoint(markerNumbers=[ground, root], constrainedAxes=[1, 1, 1, 1, 0, 1]))
    mbs.AddObject(
        items.GenericJoint(markerNumbers=[inner, outer], constrainedAxes=[1] * 6, rotationMarker1=legs[1].T)
    )
    kind = exu.OutputVariableType.Position
    sensor = mbs.AddSensor(items.SensorNode(nodeNumber=chains[1][-1], outputVariableType=kind, storeInternal=True))
    mbs.Assemble()
    settings = exu.SimulationSettings()
    newton = settings.timeIntegration.newton
    newton.useModifiedNewton, newton.relativeTolerance = True, tolerance
    settings.linearSolverType = exu.LinearSolverType.EigenSparse
    return solve(mbs, sensor, duration, step, 0.8, settings)
