"""The arrays of `erls.equations.nodal.contract` from elements and joints."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeVar

import numpy as np

from erls.equations.nodal.actuators import Actuators
from erls.equations.nodal.beam import Beams
from erls.equations.nodal.contacts import Contacts
from erls.equations.nodal.contract import Factors, Model, Work
from erls.equations.nodal.elements import Elements
from erls.equations.nodal.elimination import Elimination
from erls.equations.nodal.joints import JointRows
from erls.equations.nodal.loads import NodalLoads
from erls.equations.nodal.nodes import rows_of
from erls.equations.nodal.rigid_body import RigidBodies
from erls.equations.nodal.scatter import IntArray
from erls.equations.nodal.shell import Shells
from erls.equations.nodal.springs import Springs
from erls.equations.nodal.turning_springs import TurningSprings
from erls.maths.so3 import Array

E = TypeVar("E")


class Kinds:
    """Elements sorted by kind; several sets of one kind follow each other."""

    def __init__(self, elements: Sequence[Elements]) -> None:
        self.beams = _one(elements, Beams) or Beams([], np.zeros((0, 4, 4)), np.zeros(3))
        self.bodies = _one(elements, RigidBodies) or RigidBodies([], np.zeros(3))
        self.loads = _one(elements, NodalLoads) or NodalLoads([])
        self.actuators = _all(elements, Actuators)
        self.contacts = _one(elements, Contacts) or Contacts([])
        self.shells = _one(elements, Shells) or Shells([], np.zeros((0, 4, 4)))
        self.springs = _all(elements, Springs) or [Springs([])]
        self.windings = _all(elements, TurningSprings) or [TurningSprings([])]
        known = (Beams, RigidBodies, NodalLoads, Actuators, Contacts, Shells, Springs, TurningSprings)
        strange = [type(e).__name__ for e in elements if not isinstance(e, known)]
        if strange:
            raise TypeError(f"there are no functions of {strange[0]}")

    @property
    def pairs(self) -> IntArray:
        """(E, 2) nodes of all elements, in the order of `Model`."""
        sets: list[Elements] = [self.beams, self.bodies, self.loads, *self.actuators, self.contacts, self.shells]
        return np.concatenate([_pairs(e.nodes) for e in [*sets, *self.springs, *self.windings]])

    @property
    def heavy(self) -> IntArray:
        """Nodes that resist every acceleration, with stiffness at least."""
        of_bodies = self.bodies.nodes[:, 0][np.linalg.eigvalsh(self.bodies.matrices)[:, 0] > 0]
        return np.unique(np.concatenate([of_bodies, self.beams.nodes[self.beams.moving > 0].ravel()]))


def build_model(kinds: Kinds, rows: JointRows, local: bool, metres: Array, own: Elimination) -> Model:
    """All constants.

    Parameters
    ----------
    kinds : Kinds
    rows : JointRows
    local : bool
        SE(3), or R³×SO(3).
    metres : (n,) array
        Per unit of each velocity.
    own : Elimination
    """
    beams, bodies, loads, actuators = kinds.beams, kinds.bodies, kinds.loads, kinds.actuators
    frames = [_frames(a.inner_frames, a.outer_frames) for a in actuators]
    return Model(
        local=int(local),
        gravity=np.array([beams.gravity, bodies.gravity], dtype=float),
        pairs=np.concatenate([kinds.pairs, rows.nodes]),
        beam_nodes=beams.nodes,
        beam_frames=_frames(beams.frames[:, 0], beams.frames[:, 1]),
        beam_built=beams.built,
        beam_stiffness=beams.stiffness,
        beam_inertia=beams.inertia,
        beam_moving=beams.moving,
        body_nodes=bodies.nodes[:, 0].copy(),
        bodies=bodies.matrices,
        load_nodes=loads.nodes,
        load_positions=loads.positions,
        loads=loads.wrenches,
        load_dead=loads.dead,
        actuator_nodes=_joined([a.nodes for a in actuators], 2, np.int64),
        actuator_frames=_joined(frames, 24),
        actuator_along=np.concatenate([np.zeros(0, dtype=np.int64), *(a.along for a in actuators)]),
        actuator_active=np.concatenate([np.zeros(0, dtype=np.int64), *(a.active for a in actuators)]),
        actuators=_joined([a.laws for a in actuators], 17),
        contact_nodes=kinds.contacts.nodes,
        contacts=kinds.contacts.laws,
        shell_nodes=kinds.shells.corners,
        shell_frames=kinds.shells.frames,
        shell_built=kinds.shells.built,
        shell_rises=kinds.shells.rises,
        shell_areas=kinds.shells.areas,
        shell_stiffness=kinds.shells.stiffness,
        spring_nodes=np.concatenate([s.nodes for s in kinds.springs]),
        springs=np.concatenate([s.laws for s in kinds.springs]),
        winding_nodes=np.concatenate([s.nodes for s in kinds.windings]),
        winding_frames=np.concatenate([s.frames for s in kinds.windings]),
        windings=np.concatenate([s.laws for s in kinds.windings]),
        joint_nodes=rows.nodes,
        joint_frames=_frames(rows.inner, rows.outer),
        joint_drives=rows.drives,
        joint_rows=np.searchsorted(rows.joint_of_row, np.arange(len(rows.joints) + 1)).astype(np.int64),
        conditions=np.ascontiguousarray(np.concatenate([rows.c, rows.entries.reshape(-1, 9)], axis=1)),
        pitches=rows.pitches,
        released=np.zeros(len(rows.names)),
        metres=metres,
        place=own.place,
        order=np.argsort(own.place).astype(np.int64),
        band=own.width,
        fronts=own.fronts,
        front_of=own.front_of,
        later=own.later,
        into=own.into,
    )


def room(model: Model) -> Work:
    """Memory for evaluations."""
    n, m, k, e = len(model.metres), len(model.conditions), len(model.metres) // 6, len(model.pairs)
    per_velocity = ("v", "a", "increment", "twist", "rate", "force", "reaction", "inertia")
    shapes: dict[str, tuple[int, ...]] = {
        "poses": (k, 12),
        "bent": model.beam_built.shape,
        "turned": (len(model.actuators),),
        "wound": (len(model.windings), 3),
        **dict.fromkeys(per_velocity, (n,)),
        **dict.fromkeys(("multipliers", "violation", "drift", "bias"), (m,)),
        "blocks": (e, 3, 12, 12),
        "whole": (e, 12, 12),
        **dict.fromkeys(("rows", "shape", "bends"), (6, 12)),
        "strained": (9, 24),
        "corners": (24, 24),
        "gradient": (m, 12),
        "factors": (k, 3, 6, 6),
        "turning": (k, 3, 3),
    }
    return Work(**{name: np.zeros(shape) for name, shape in shapes.items()})


def factor_room(model: Model, own: Elimination) -> Factors:
    """Memory for a factored iteration matrix."""
    m, unknowns = len(model.conditions), len(model.place)
    sizes = m, m, unknowns, unknowns, unknowns, own.entries, own.stack, unknowns
    return Factors(*map(np.zeros, sizes))


def _all(elements: Sequence[Elements], kind: type[E]) -> list[E]:
    return [e for e in elements if isinstance(e, kind)]


def _one(elements: Sequence[Elements], kind: type[E]) -> E | None:
    found = _all(elements, kind)
    if len(found) > 1:
        raise ValueError(f"{kind.__name__}: give all of a system as one set")
    return found[0] if found else None


def _pairs(nodes: IntArray) -> IntArray:
    if nodes.shape[1] == 2:
        return nodes
    return np.concatenate([nodes, np.full_like(nodes, -1)], axis=1)


def _frames(first: Array, second: Array) -> Array:
    """(e, 24) of poses (e, 4, 4)."""
    return np.ascontiguousarray(np.concatenate([rows_of(first), rows_of(second)], axis=-1).reshape(-1, 24))


def _joined(parts: Sequence[Any], columns: int, kind: type = float) -> Any:
    return np.concatenate([np.zeros((0, columns), dtype=kind), *parts])
