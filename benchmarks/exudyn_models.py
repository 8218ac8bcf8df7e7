"""The modal links of a scene as bodies of exudyn (FFRF reduced order): the same nodes, masses, shapes and stiffness.

exudyn's bodies have translations only. Links compared here carry their mass lumped at the nodes, rotary inertia
included; the same inertia comes from four mass points at both ends of each element, which follow the rotation of its
node. Gravity acts on the mean of all nodes, weighted with their masses: exudyn's own option for gravity leaves out the
deformation. Iterations are modified Newton, its best setting.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import exudyn as exu
import exudyn.itemInterface as items
import numpy as np
from exudyn.FEM import ObjectFFRFreducedOrderInterface
from exudyn.rigidBodyUtilities import ComputeSkewMatrix
from exudyn.utilities import SensorSuperElement

from erls.equations.ffr.body_frame import elastic_basis
from erls.mechanism.chain import Mechanism, poses
from erls.mechanism.links import Link

Array = np.ndarray
@dataclass(frozen=True)
class Section:
    """Rectangular section of all members of a link, height along z, and its mass per length [kg/m]."""

    width: float
    height: float
    line_mass: float


@dataclass(frozen=True)
class Body:
    """A link for exudyn: positions (n, 3), masses (n,), shapes (n, 3, m), stiffness (m,).

    ``weights`` (k,) masses at the k nodes of the link, which come first and have none of their own here; ``around``
    the points that follow the rotation of each node.
    """

    positions: Array
    masses: Array
    shapes: Array
    stiffness: Array
    weights: Array
    around: dict[int, list[int]]


def body_of(link: Link, section: Section) -> Body:
    """The link in its tangent frame."""
    basis = elastic_basis(link, "tangent")
    model = link.model
    positions, shapes = [*model.nodes], [*(model.translation_shapes @ basis)]
    masses, weights = [0.0] * len(positions), np.zeros(len(positions))
    around: dict[int, list[int]] = {}
    for ends in model.lines:
        along = model.nodes[ends[1]] - model.nodes[ends[0]]
        half = section.line_mass * np.linalg.norm(along) / 2
        side = np.cross([0.0, 0.0, 1.0], along / np.linalg.norm(along))
        across = (section.width / np.sqrt(6) * side, section.height / np.sqrt(6) * np.array([0.0, 0.0, 1.0]))
        for node in map(int, ends):
            weights[node] += half
            shape, turn = (s @ basis for s in model.node_shape(node))
            for offset in (across[0], -across[0], across[1], -across[1]):
                around.setdefault(node, []).append(len(positions))
                positions.append(model.nodes[node] + offset)
                shapes.append(shape + np.cross(turn.T, offset).T)
                masses.append(half / 4)
    body = Body(np.array(positions), np.array(masses), np.array(shapes), np.asarray(link.stiffness), weights, around)
    difference = np.einsum("n,nia,nib->ab", body.masses, body.shapes, body.shapes) - basis.T @ link.invariants.m @ basis
    assert np.abs(difference).max() < 1e-8, "the mass points do not have the link's inertia"
    return body


def _interface(body: Body, euler: bool) -> ObjectFFRFreducedOrderInterface:
    """Constant matrices, as exudyn's own pre-processing forms them from a mesh."""
    cms = ObjectFFRFreducedOrderInterface(None)
    count = len(body.positions)
    cms.modeBasis = body.shapes.reshape(3 * count, -1)
    cms.trigList, cms.postProcessingModes = [], {}
    cms.nModes, cms.nNodes, cms.dim3D = cms.modeBasis.shape[1], count, 3
    cms.rigidBodyNodeType = exu.NodeType.RotationEulerParameters if euler else exu.NodeType.RotationRxyz
    cms.nODE2rot = 4 if euler else 3
    cms.nODE2rigid = 3 + cms.nODE2rot
    cms.nODE2FFRFreduced = cms.nODE2rigid + cms.nModes
    mass = np.repeat(body.masses, 3)[:, None]
    phi = np.kron(np.ones(count), np.eye(3)).T
    cms.xRef = body.positions.ravel()
    tilde, turned = ComputeSkewMatrix(cms.xRef), ComputeSkewMatrix(cms.modeBasis)
    cms.massMatrixReduced = cms.modeBasis.T @ (mass * cms.modeBasis)
    cms.stiffnessMatrixReduced = np.diag(body.stiffness)
    cms.inertiaLocal = tilde.T @ (mass * tilde)
    cms.Mtt = phi.T @ (mass * phi)
    cms.totalMass = cms.Mtt[0, 0]
    cms.PsiTilde = turned
    cms.chiU = phi.T @ (mass[:, 0] * cms.xRef) / cms.totalMass
    cms.chiUtilde = ComputeSkewMatrix(cms.chiU)
    cms.mPsiTildePsi = turned.T @ (mass * cms.modeBasis)
    cms.mPsiTildePsiTilde = turned.T @ (mass * turned)
    cms.mPhitTPsi = phi.T @ (mass * cms.modeBasis)
    cms.mPhitTPsiTilde = phi.T @ (mass * turned)
    cms.mXRefTildePsi = tilde.T @ (mass * cms.modeBasis)
    cms.mXRefTildePsiTilde = tilde.T @ (mass * turned)
    return cms


@dataclass
class Model:
    """A system of exudyn and the sensor of the point that is compared."""

    container: exu.SystemContainer  # must live as long as its system
    mbs: exu.MainSystem
    sensor: int
    duration: float


def build(mechanism: Mechanism, sections: Sequence[Section], point: int, duration: float) -> Model:
    """All links of a mechanism at its initial angles; prescribed joints follow their motion."""
    # Rxyz takes less time; joints with an offset between two such bodies miss the motion by 5e-4 m here, Euler
    # parameters by nothing
    euler = len(mechanism.links) > 1
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    theta = np.array([joint.position for joint in mechanism.joints])
    ground = mbs.AddObject(items.ObjectGround())
    previous, objects = None, []
    for k, (link, frame) in enumerate(zip(mechanism.links, poses(mechanism, theta), strict=True)):
        body = body_of(link, sections[k])
        cms = _interface(body, euler)
        made = cms.AddObjectFFRFreducedOrderWithUserFunctions(
            exu, mbs, positionRef=frame[:3, 3], rotationMatrixRef=frame[:3, :3], gravity=[0, 0, 0]
        )
        number = made["oFFRFreducedOrder"]
        everywhere = mbs.AddMarker(
            items.MarkerSuperElementPosition(
                bodyNumber=number,
                meshNodeNumbers=list(range(len(body.weights))),
                weightingFactors=body.weights / body.weights.sum(),
            )
        )
        weight = body.weights.sum() * mechanism.gravity
        mbs.AddLoad(items.LoadForceVector(markerNumber=everywhere, loadVector=list(weight)))
        joint = mechanism.joints[k]
        # axes of the joint in the frames of both sides at the start; z turns
        axes = (frame @ np.linalg.inv(joint.after))[:3, :3]
        own = mbs.AddMarker(items.MarkerNodeRigid(nodeNumber=made["nRigidBody"]))
        if previous is None:
            other = mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=ground, localPosition=list(frame[:3, 3])))
            other_frame = np.eye(3)
        else:
            before, number_before, frame_before = previous
            nodes = before.around[mechanism.joints[k].seat.node][:4]
            other = mbs.AddMarker(
                items.MarkerSuperElementRigid(
                    bodyNumber=number_before, meshNodeNumbers=nodes, weightingFactors=[0.25] * 4
                )
            )
            other_frame = frame_before[:3, :3]
        rotations = {"rotationMarker0": other_frame.T @ axes, "rotationMarker1": frame[:3, :3].T @ axes}
        if joint.drive.prescribed:
            mbs.AddObject(
                items.GenericJoint(
                    markerNumbers=[other, own],
                    constrainedAxes=[1, 1, 1, 1, 1, 1],
                    offsetUserFunction=_offset(joint.drive, joint.position),
                    **rotations,
                )
            )
        else:
            mbs.AddObject(
                items.GenericJoint(markerNumbers=[other, own], constrainedAxes=[1, 1, 1, 1, 1, 0], **rotations)
            )
        previous = (body, number, frame)
        objects.append((number, made["nRigidBody"]))
    at = mechanism.points[point]
    sensor = mbs.AddSensor(
        SensorSuperElement(
            bodyNumber=objects[at.link][0],
            meshNodeNumber=at.node,
            storeInternal=True,
            outputVariableType=exu.OutputVariableType.Position,
        )
    )
    mbs.Assemble()
    return Model(container, mbs, sensor, duration)


def _offset(drive, start: float):
    def offset(mbs, t, number, parameters):
        return [0, 0, 0, 0, 0, drive.reference(t)[0] - start]

    return offset


def run(model: Model, step: float, times: Array, radius: float = 0.95, tolerance: float = 1e-5) -> tuple[Array, float]:
    """Positions (k, 3) of the point at ``times`` (multiples of the step) and the time it took."""
    settings = exu.SimulationSettings()
    integration = settings.timeIntegration
    integration.numberOfSteps = round(model.duration / step)
    integration.endTime = model.duration
    integration.verboseMode = 0
    integration.newton.useModifiedNewton = True
    integration.newton.relativeTolerance = tolerance
    integration.generalizedAlpha.spectralRadius = radius
    settings.parallel.numberOfThreads = 1
    settings.solutionSettings.writeSolutionToFile = False
    settings.solutionSettings.sensorsWritePeriod = float(times[1] - times[0])
    settings.linearSolverType = exu.LinearSolverType.EXUdense
    settings.displayStatistics = settings.displayComputationTime = False
    begun = time.perf_counter()
    model.mbs.SolveDynamic(settings)
    spent = time.perf_counter() - begun
    stored = model.mbs.GetSensorStoredData(model.sensor)
    rows = np.searchsorted(stored[:, 0], times - 1e-9)
    assert np.allclose(stored[rows, 0], times, atol=1e-6)
    return stored[rows, 1:4], spent
