"""A formulation of pieces, seen as one of whole links.

Frames of the pieces turn with the deformation, so that a whole link may deflect more than small displacements allow:
its nodes are where the pieces carry them, its modal coordinates those whose displacements come nearest.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from erls.equations.formulation import ContactSeries, Energy, Formulation, Reaction, State
from erls.equations.serial.state_series import energy_series
from erls.maths import rotation_maps
from erls.maths.se3 import pose
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.links import Link
from erls.mechanism.substructures import Split


class Substructured:
    """A `Formulation` of whole links.

    Parameters
    ----------
    inner : Formulation
        Of the pieces, their loops tied.
    parts : Split
    """

    def __init__(self, inner: Formulation, parts: Split) -> None:
        self.inner, self.parts = inner, parts
        self.mechanism: Mechanism = parts.whole
        self._nearest = [_nearest(link) if link.pieces else None for link in parts.whole.links]

    @property
    def size(self) -> int:
        """Number of coordinates of the pieces."""
        return self.inner.size

    def initial_state(self) -> tuple[Array, Array]:
        """That of the pieces."""
        return self.inner.initial_state()

    def acceleration(self, t: float, y: Array, v: Array) -> Array:
        """(n,) that of the pieces."""
        return self.inner.acceleration(t, y, v)

    def energy_series(self, t: Array, y: Array, v: Array) -> Array:
        """(k, 4) that of all pieces at times (k,)."""
        return energy_series(self.inner, t, y, v)

    def load_power(self, t: Array, y: Array, v: Array) -> Array:
        """(k,) that of the pieces."""
        return self.inner.load_power(t, y, v)

    def contact_series(self, t: Array, y: Array, v: Array) -> ContactSeries:
        """That of the pieces."""
        return self.inner.contact_series(t, y, v)

    def energy(self, t: float, y: Array, v: Array) -> Energy:
        """That of all pieces."""
        return self.inner.energy(t, y, v)

    def state(self, t: float, y: Array, v: Array) -> State:
        """Nodes where the pieces carry them; the frame of a split link goes with its inboard interface."""
        found = self.inner.state(t, y, v)
        poses: list[Array] = []
        modal: list[Array] = []
        nodes: list[Array] = []
        every: list[Array] = []
        for number, own in enumerate(self.parts.links):
            link, nearest = self.mechanism.links[number], self._nearest[number]
            places, turns = self._displaced(found, number)
            nodes.append(places)
            every.append(turns)
            if nearest is None:
                poses.append(found.poses[own.start])
                modal.append(found.modal[own.start])
                continue
            inboard, model = link.inboard.node, link.model
            frame = pose(turns[inboard], places[inboard]) @ pose(position=-model.nodes[inboard])
            moved = (places - frame[:3, 3]) @ frame[:3, :3] - model.nodes
            turned = rotation_maps.log(frame[:3, :3].T @ turns[model.rotation_nodes])
            poses.append(frame)
            modal.append(nearest @ np.concatenate([moved, _reach(link) * turned]).ravel())
        joints = self.parts.joints
        coordinates, angles, rates = (x[joints] for x in (found.coordinates, found.angles, found.rates))
        return State(t, poses, modal, coordinates, angles, rates, nodes, every)

    def _displaced(self, found: State, number: int) -> tuple[Array, Array]:
        """Places (n, 3) and turns (n, 3, 3) of the nodes of a link in the world."""
        where = self.parts.places[number]
        places, turns = np.empty((len(where), 3)), np.empty((len(where), 3, 3))
        for k in self.parts.links[number]:
            here = np.flatnonzero(where[:, 0] == k)
            own, link = where[here, 1], self.parts.pieces.links[k]
            model, frame, q = link.model, found.poses[k], found.modal[k]
            moved = model.translation_shapes[own] @ q
            if "foreshortening" in self.mechanism.effects and link.second_order is not None:
                moved = moved + link.second_order.displacements(own, q)
            places[here] = (model.nodes[own] + moved) @ frame[:3, :3].T + frame[:3, 3]
            turned = np.zeros((len(model.nodes), 3))
            turned[model.rotation_nodes] = model.rotation_shapes @ q
            turns[here] = frame[:3, :3] @ rotation_maps.exp(turned[own])
        return places, turns

    def reactions(self, t: float, y: Array, v: Array) -> list[Reaction]:
        """In the joints of the whole links."""
        found = self.inner.reactions(t, y, v)
        return [found[k] for k in self.parts.joints]

    def describe(self) -> dict[str, Any]:
        """Names and sizes for reports."""
        split = {link.name: len(link.pieces) for link in self.mechanism.links if link.pieces}
        return {**self.inner.describe(), "joints": len(self.mechanism.joints), "substructures": split}


def solved(formulation: Formulation) -> Formulation:
    """What is integrated: the formulation itself, or that of the pieces."""
    return formulation.inner if isinstance(formulation, Substructured) else formulation


def _nearest(link: Link) -> Array:
    """(m, 3 nodes + 3 turning nodes) modal coordinates of least squares from displacements and scaled rotations."""
    model = link.model
    shapes = np.concatenate([model.translation_shapes, _reach(link) * model.rotation_shapes])
    return np.asarray(np.linalg.pinv(shapes.reshape(-1, model.modes)))


def _reach(link: Link) -> float:
    """Size that makes rotations into lengths [m]."""
    return link.size or 1.0
