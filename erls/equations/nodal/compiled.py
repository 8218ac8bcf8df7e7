"""A `NodalSystem` as arrays for compiled steps (`erls.equations.nodal.kernels`), where all its elements have
kernels.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import reverse_cuthill_mckee

from erls.equations.constrained_system import ConstrainedState
from erls.equations.nodal.actuators import Actuators, Turned
from erls.equations.nodal.assembly import NodalSystem, Nodes
from erls.equations.nodal.beam import Beams
from erls.equations.nodal.joints import JointRows
from erls.equations.nodal.kernels.contract import Model, State, Work
from erls.equations.nodal.loads import NodalLoads
from erls.equations.nodal.rigid_body import RigidBodies
from erls.equations.nodal.scatter import IntArray
from erls.equations.system import metre_scales
from erls.maths.so3 import Array
from erls.mechanism.drives import Drive
from erls.mechanism.joints import JointForces

_ASKED = (
    "compose",
    "tangent",
    "residual",
    "mass_matrix",
    "stiffness_and_damping",
    "constraint",
    "constraint_matrix",
    "length_scales",
)  # methods of a system that the kernels stand for


def has_kernels(system: NodalSystem) -> bool:
    """Whether the kernels compute what the system does: it may not change methods, nor hold other kinds of elements."""
    if any(getattr(type(system), name) is not getattr(NodalSystem, name) for name in _ASKED):
        return False
    kinds: list[type] = [type(e) for e in system.elements]
    if any(kind not in (Beams, RigidBodies, NodalLoads, Actuators) for kind in kinds):
        return False
    if any(kinds.count(kind) > 1 for kind in (Beams, RigidBodies, NodalLoads)) or type(system.rows) is not JointRows:
        return False
    if any(kind is Actuators for kind in kinds) and not hasattr(system, "actuators"):
        return False  # it does not store joint coordinates, as `ChainSystem` of `erls.equations.nodal.chain` does
    acting = [j for e in system.elements if isinstance(e, Actuators) for j in e.joints]
    return all(type(j.drive) is Drive and type(j.forces) is JointForces for j in acting)


class CompiledSystem:
    """Arrays of a system, and how its configurations lie in them.

    Parameters
    ----------
    system : NodalSystem
        With `has_kernels`.
    """

    def __init__(self, system: NodalSystem) -> None:
        self.system = system
        self._beams: Beams | None = self._of(Beams)
        self._loads: NodalLoads | None = self._of(NodalLoads)
        self._actuators = [e for e in system.elements if isinstance(e, Actuators)]
        self.places, self.width = _order(system)
        self.model = self._model()
        self.stored = 12 * system.count + len(self.model.actuators)

    def _of(self, kind: type) -> Any:
        return next((e for e in self.system.elements if type(e) is kind), None)

    def samples(self, times: Array) -> Array:
        """(times, ...) what depends on time alone; see `erls.equations.nodal.kernels.contract`."""
        system = self.system
        joints = len(system.rows.joints)
        loads = self._loads.loads if self._loads is not None else ()
        result = np.zeros((len(times), joints + len(loads) + 3 * len(self.model.actuators)))
        for k, tie in enumerate(system.rows.joints):
            if tie.motion is not None:
                result[:, k] = [tie.motion(t)[0] for t in times.tolist()]
        for k, load in enumerate(loads, joints):
            result[:, k] = [load.factor(t) for t in times.tolist()]
        column = joints + len(loads)
        for group in self._actuators:
            for k, joint in enumerate(group.joints):
                if k in group.acting:
                    result[:, column : column + 3] = [_wanted(joint.drive, group.leads[k], t) for t in times.tolist()]
                column += 3
        return result

    def state(self, known: ConstrainedState, algorithmic: Array) -> State:
        """A copy as arrays."""
        q: Nodes = known.q
        memory = dict(zip(map(id, self.system.elements), q.memory, strict=True))
        bent = memory[id(self._beams)].d if self._beams is not None else np.zeros((0, 6))
        angles = [memory[id(group)].angles for group in self._actuators]
        return State(
            _rows(q.poses),
            np.array(bent, dtype=float),
            np.concatenate([*angles, np.zeros(0)]),
            known.v.copy(),
            known.a.copy(),
            algorithmic.copy(),
            known.multipliers.copy(),
        )

    def configuration(self, state: State) -> Nodes:
        """Nodes of a state."""
        poses = np.zeros((self.system.count, 4, 4))
        poses[:, :3, 3], poses[:, :3, :3] = state.poses[:, :3], state.poses[:, 3:].reshape(-1, 3, 3)
        poses[:, 3, 3] = 1.0
        near: list[Any] = []
        first = 0
        for element, memory in zip(self.system.elements, self.system.start.memory, strict=True):
            if element is self._beams:
                near.append(_Near(state.bent))
            elif isinstance(element, Actuators):
                near.append(Turned(state.turned[first : first + len(element.joints)].copy(), np.zeros(0)))
                first += len(element.joints)
            else:
                near.append(memory)
        return self.system.at(poses, Nodes(poses, tuple(near)))

    def work(self) -> Work:
        """Memory for steps."""
        n, m, k = self.system.size, self.system.constraints, self.system.count
        per_velocity = ("v", "a", "increment", "twist", "rate", "force", "reaction", "inertia")
        shapes = {
            "poses": (k, 12),
            "bent": self.model.beam_built.shape,
            "turned": (len(self.model.actuators),),
            **dict.fromkeys(per_velocity, (n,)),
            **dict.fromkeys(("multipliers", "violation"), (m,)),
            **dict.fromkeys(("correction", "ordered", "left", "right"), (n + m,)),
            **dict.fromkeys(("mass", "damping", "stiffness"), (12, 12)),
            **dict.fromkeys(("rows", "shape"), (6, 12)),
            "gradient": (m, 12),
            "factors": (k, 3, 6, 6),
            "band": (n + m, 3 * self.width + 1),
        }
        return Work(**{name: np.zeros(shape) for name, shape in shapes.items()}, pivots=np.zeros(n + m, dtype=np.int64))

    def _model(self) -> Model:
        system, rows = self.system, self.system.rows
        bodies: RigidBodies | None = self._of(RigidBodies)
        gravity = np.array([b.gravity if b is not None else np.zeros(3) for b in (self._beams, bodies)], dtype=float)
        driven = np.array([rows.driven_along(j) for j in rows.joints], dtype=np.int64)
        signs = np.array([rows.sign(j) for j in rows.joints], dtype=float)
        firsts = np.searchsorted(rows.joint_of_row, np.arange(len(rows.joints) + 1))
        order = np.argsort(self.places)
        return Model(
            local=int(system.local),
            gravity=gravity,
            **_of_beams(self._beams),
            body_nodes=bodies.nodes[:, 0].copy() if bodies else _none(int),
            bodies=bodies.matrices if bodies else np.zeros((0, 6, 6)),
            **_of_loads(self._loads),
            **_of_actuators(self._actuators),
            joint_nodes=rows.nodes,
            joint_frames=_pairs(*rows.frames),
            joint_driven=driven,
            joint_sign=signs,
            joint_rows=firsts.astype(np.int64),
            conditions=np.ascontiguousarray(np.concatenate([rows.c, rows.entries.reshape(-1, 9)], axis=1)),
            metres=metre_scales(system),
            place=self.places,
            order=order.astype(np.int64),
        )


class _Near:
    """Memory of beams as far as the next one asks for it."""

    def __init__(self, d: Array) -> None:
        self.d = d.copy()


def _wanted(drive: Drive, lead: Any, t: float) -> tuple[float, float, float]:
    """Wanted coordinate, wanted rate, and torque besides."""
    if drive.load is not None or drive.motion is None:
        return 0.0, 0.0, drive.torque(t, 0.0, 0.0) + lead(t)
    wanted = drive.reference(t)
    assert wanted is not None
    return wanted[0], wanted[1], lead(t)


def _none(kind: type, *shape: int) -> Any:
    return np.zeros((0, *shape), dtype=np.int64 if kind is int else float)


def _rows(poses: Array) -> Array:
    """(..., 12) position and rotation, rows first."""
    flat = poses[..., :3, :3].reshape(*poses.shape[:-2], 9)
    return np.ascontiguousarray(np.concatenate([poses[..., :3, 3], flat], axis=-1))


def _pairs(first: Array, second: Array) -> Array:
    return np.ascontiguousarray(np.concatenate([_rows(first), _rows(second)], axis=-1).reshape(-1, 24))


def _of_beams(beams: Beams | None) -> dict[str, Any]:
    if beams is None:
        beams = Beams([], np.zeros((0, 4, 4)), np.zeros(3))
    return {
        "beam_nodes": beams.nodes,
        "beam_frames": _pairs(beams.frames[:, 0], beams.frames[:, 1]),
        "beam_built": beams.built,
        "beam_stiffness": beams.stiffness,
        "beam_inertia": beams.inertia,
        "beam_moving": beams.inertia.any(axis=(1, 2)).astype(np.int64),
    }


def _of_loads(known: NodalLoads | None) -> dict[str, Any]:
    loads = NodalLoads([]) if known is None else known
    return {
        "load_nodes": loads.nodes[:, 0].copy(),
        "loads": np.array([[*x.force, *x.moment] for x in loads.loads], dtype=float).reshape(-1, 6),
        "load_dead": np.array([not x.follower for x in loads.loads], dtype=np.int64),
    }


def _of_actuators(groups: Sequence[Actuators]) -> dict[str, Any]:
    nodes: list[list[int]] = []
    frames, along, active, laws = [], [], [], []
    for group in groups:
        for k, joint in enumerate(group.joints):
            ends = group.nodes[k]
            nodes.append([ends[0] if len(ends) == 2 else -1, ends[-1]])
            frames.append(_pairs(group.inner_frames[k], group.outer_frames[k])[0])
            along.append(group.along[k])
            active.append(k in group.acting or joint.rotor_inertia != 0)
            own, drive = joint.forces, joint.drive
            gains = drive.gains if k in group.acting else (0.0, 0.0)
            law = (own.stiffness, own.rest, own.damping, own.friction, own.transition_rate, *gains, drive.torque_limit)
            laws.append([joint.rotor_inertia, *law])
    return {
        "actuator_nodes": np.array(nodes, dtype=np.int64).reshape(-1, 2),
        "actuator_frames": np.array(frames, dtype=float).reshape(-1, 24),
        "actuator_along": np.array(along, dtype=np.int64),
        "actuator_active": np.array(active, dtype=np.int64),
        "actuators": np.array(laws, dtype=float).reshape(-1, 9),
    }


def _order(system: NodalSystem) -> tuple[IntArray, int]:
    """Numbers of all unknowns in the band, nodes and joints by the reverse Cuthill-McKee order; width of the band.

    E. Cuthill, J. McKee, Proc. 24th Nat. Conf. ACM (1969) 157–172.
    """
    joints, count = len(system.rows.joints), system.count
    groups = [np.concatenate([nodes[nodes >= 0]]) for e in system.elements for nodes in e.nodes]
    for k, pair in enumerate(system.rows.nodes):
        groups.append(np.append(pair[pair >= 0], count + k))
    rows = np.concatenate([np.repeat(g, len(g)) for g in groups] or [_none(int)])
    columns = np.concatenate([np.tile(g, len(g)) for g in groups] or [_none(int)])
    graph = sp.csr_array((np.ones(len(rows)), (rows, columns)), shape=(count + joints, count + joints))
    of_joints = np.bincount(system.rows.joint_of_row, minlength=joints)
    sizes = np.concatenate([np.full(count, 6), of_joints]).astype(np.int64)
    own = np.concatenate([[0], np.cumsum(sizes)])
    places = np.zeros(own[-1], dtype=np.int64)
    last = 0
    for block in reverse_cuthill_mckee(graph, symmetric_mode=True):
        places[own[block] : own[block + 1]] = np.arange(last, last + sizes[block])
        last += sizes[block]
    spans = [np.concatenate([places[own[b] : own[b + 1]] for b in g]) for g in groups]
    return places, max((int(np.ptp(s)) for s in spans if len(s)), default=5)
