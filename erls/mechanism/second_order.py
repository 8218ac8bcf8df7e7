"""Second-order kinematics of a link in a mechanism: relative to its inboard interface, payloads included."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from erls.maths.se3 import pose
from erls.maths.so3 import Array, cross_all, skew
from fe_import.modal.inertia import mass_properties
from fe_import.modal.model import ModalModel
from fe_import.modal.second_order import SecondOrder, pair_numbers
from fe_import.model import IntArray, InterfaceNode
from fe_import.second_order.composition import composed, composed_rotation, twice_turned
from fe_import.second_order.moments import LEVI_CIVITA, of_inertia, of_masses, of_modes, of_moments

_FEW = 3  # nodes whose own quadratic forms are quicker than the field of all


class Load(Protocol):
    """A mass on a node of a link, as `erls.mechanism.links.Payload` is one."""

    @property
    def node(self) -> int:
        """Its node."""

    @property
    def mass(self) -> float:
        """[kg]"""

    @property
    def offset(self) -> Array:
        """(3,) place of its centre from the node, mesh axes [m]."""

    @property
    def inertia(self) -> Array:
        """(3, 3) about its centre, mesh axes [kg m²]."""


class Loaded(Protocol):
    """A reduced link with what it carries, as `erls.mechanism.links.Link` is one."""

    @property
    def model(self) -> ModalModel:
        """In orthonormal form."""

    @property
    def inboard(self) -> InterfaceNode:
        """Where its joint sits."""

    @property
    def payloads(self) -> Sequence[Load]:
        """Masses on its nodes."""


@dataclass(frozen=True)
class LinkSecondOrder:
    """What of second order the equations of motion need of a link with m modal coordinates.

    Displacement and rotation of the inboard interface are linear in the coordinates.

    Attributes
    ----------
    momentum, spin : (6, m, m), (3, 3, m, m) arrays
        See `fe_import.modal.second_order.SecondOrder`.
    modal : (n, m, m) array
        K, likewise, of the n elastic modes.
    model : ModalModel
    field : SecondOrder
    inboard : int
        Its node.
    """

    momentum: Array
    spin: Array
    modal: Array
    model: ModalModel
    field: SecondOrder
    inboard: int

    def node(self, node: int) -> Array:
        """(6, m, m) second-order displacement and rotation vector of a node, known from the second time on."""
        if node not in self._nodes:
            self._nodes[node] = self._anchored(node)
        return self._nodes[node]

    @cached_property
    def _nodes(self) -> dict[int, Array]:
        return {}

    def _anchored(self, node: int) -> Array:
        """Relative to the inboard node."""
        found = _node(self.model, self.field, node)
        arm = self.model.nodes[node] - self.model.nodes[self.inboard]
        lift = self._inboard
        found[:3] -= lift[:3] - np.einsum("ij,jab->iab", skew(arm), lift[3:])
        found[3:] -= lift[3:]
        return found

    def bending(self, node: int) -> Array:
        """(6, m, m) symmetric part of what `node` gives, known from the second time on."""
        if node not in self._bending:
            found = self.node(node)
            self._bending[node] = (found + found.transpose(0, 2, 1)) / 2
        return self._bending[node]

    @cached_property
    def _bending(self) -> dict[int, Array]:
        return {}

    def interface(self, interface: InterfaceNode, frame: Array) -> Array:
        """(6, m, m) second-order displacement and rotation vector of a frame that moves rigidly with an interface, as
        `erls.mechanism.links.Link.interface_shape`.
        """
        arm = pose(position=-interface.position) @ frame
        offset, back = arm[:3, 3], arm[:3, :3].T
        moved = self.node(interface.node)
        _, phi = _rigid_shape(self.model, interface.node)
        u = moved[:3] - np.einsum("ij,jab->iab", skew(offset), moved[3:]) + twice_turned(phi, offset)
        return np.concatenate([np.einsum("ij,jab->iab", back, part) for part in (u, moved[3:])])

    @cached_property
    def _inboard(self) -> Array:
        """(6, m, m) of the inboard node, when the reference of the field is elsewhere."""
        return _node(self.model, self.field, self.inboard)

    def displacements(self, nodes: IntArray, q: Array) -> Array:
        """(..., k, 3) second-order displacement of nodes at modal coordinates (..., m).

        Nodes without a stored field (inside solids) follow the rigid-body part only.
        """
        if len(nodes) <= _FEW:
            return np.stack([_half_form(self.bending(node)[:3], q) for node in nodes.tolist()], axis=-2)
        model, field = self.model, self.field
        start = model.interface_nodes[field.reference].node
        pairs = q[..., 6:][..., self._pairs[0]] * q[..., 6:][..., self._pairs[1]] * self._halves
        place = np.searchsorted(field.nodes, nodes).clip(0, max(len(field.nodes) - 1, 0))
        result = np.zeros((*q.shape[:-1], len(nodes), 3))
        known = np.isin(nodes, field.nodes)
        result[..., known, :] = np.tensordot(pairs, field.translation[place[known]], ([-1], [2]))
        u0, phi = (np.tensordot(q, shape, ([-1], [1]))[..., None, :] for shape in _rigid_shape(model, start))
        arm = model.nodes[nodes] - model.nodes[start]
        turned = cross_all(phi, arm)
        moved = np.tensordot(q, model.translation_shapes[nodes], ([-1], [2])) - u0 - turned
        result += cross_all(phi, moved + turned / 2)
        if self.inboard != start:
            lift = 0.5 * np.einsum("cab,...a,...b->...c", self._inboard, q, q)[..., None, :]
            arm = model.nodes[nodes] - model.nodes[self.inboard]
            result -= lift[..., :3] + cross_all(lift[..., 3:], arm)
        return result

    def bound(self, q: Array, moved: Array) -> Array:
        """(k,) what `displacements` of no node exceed at modal coordinates (k, m), linear displacements against the
        inboard interface not exceeding ``moved`` (k,) [m].
        """
        start = self.model.interface_nodes[self.field.reference].node
        if self.inboard != start:
            return np.full(len(q), np.inf)
        pairs = q[:, 6:][:, self._pairs[0]] * q[:, 6:][:, self._pairs[1]]
        turned = np.linalg.norm(q @ _rigid_shape(self.model, start)[1].T, axis=1)
        largest, length = self._largest
        return np.asarray(np.abs(pairs) @ largest + turned * (moved + turned * length / 2))

    @cached_property
    def _largest(self) -> tuple[Array, float]:
        """Most that a pair of coordinates moves a node by, (p,), and how far nodes are from the inboard one [m]."""
        sizes = np.linalg.norm(self.field.translation, axis=1).max(axis=0, initial=0.0)
        arms = self.model.nodes - self.model.nodes[self.inboard]
        return self._halves * sizes, float(np.linalg.norm(arms, axis=1).max())

    @cached_property
    def _pairs(self) -> tuple[IntArray, IntArray]:
        first, second = np.triu_indices(self.model.elastic_modes)
        return first, second

    @cached_property
    def _halves(self) -> Array:
        """Share of each pair in ½ qᵀ Ψ q."""
        return np.where(self._pairs[0] == self._pairs[1], 0.5, 1.0)


def link_second_order(link: Loaded) -> LinkSecondOrder | None:
    """Second-order kinematics of a link; None where its modal model holds none."""
    model = link.model
    field = model.second_order or (_rigid(model) if model.elastic_modes == 0 else None)
    if field is None:
        return None
    found = LinkSecondOrder(field.momentum, field.spin, field.modal, model, field, link.inboard.node)
    momentum, spin, modal = field.momentum.copy(), field.spin.copy(), field.modal.copy()
    if link.inboard.node != model.interface_nodes[field.reference].node:
        # what moves linearly is another interface: all points less its second-order rigid motion
        lift, rigid = found._inboard, model.invariants.rigid_mass_matrix
        slide = lift[:3] + np.einsum("ij,jab->iab", skew(link.inboard.position), lift[3:])
        motion = np.concatenate([slide, lift[3:]])
        momentum -= np.einsum("ij,jab->iab", rigid, motion)
        modal -= np.einsum("cj,jab->cab", (model.invariants.m @ model.invariants.rigid)[6:], motion)
        first = np.array([rigid[5, 1], rigid[3, 2], rigid[4, 0]])
        second = np.trace(rigid[3:, 3:]) / 2 * np.eye(3) - rigid[3:, 3:]  # ∫ρ x ⊗ x
        moment = np.einsum("c,dab->cdab", first, slide) + np.einsum("ce,dfe,fab->cdab", second, LEVI_CIVITA, lift[3:])
        spin -= of_moments(slide, moment)[1]
    for payload in link.payloads:
        u, phi = _rigid_shape(model, payload.node)
        motion = found.node(payload.node)
        centre = motion[:3] - np.einsum("ij,jab->iab", skew(payload.offset), motion[3:])
        centre = centre + twice_turned(phi, payload.offset)
        place = model.nodes[payload.node] + payload.offset
        masses = of_masses(np.array([payload.mass]), place[None], centre[None])
        turning = of_inertia(payload.inertia, phi, motion[3:])
        momentum, spin = momentum + masses[0] + turning[0], spin + masses[1] + turning[1]
        own = np.concatenate([u - skew(payload.offset) @ phi, phi])[:, 6:]
        modal = modal + of_modes(own, np.concatenate([masses[0][:3], turning[0][3:]]))
    return LinkSecondOrder(momentum, spin, modal, model, field, link.inboard.node)


def _half_form(forms: Array, q: Array) -> Array:
    """(..., c) ½ qᵀ F q of forms (c, m, m) at (..., m)."""
    sides = q @ forms.transpose(1, 0, 2).reshape(forms.shape[1], -1)
    return np.asarray(np.einsum("...cm,...m->...c", sides.reshape(*q.shape[:-1], len(forms), -1), q) / 2)


def _rigid_shape(model: ModalModel, node: int) -> tuple[Array, Array]:
    translation, rotation = model.node_shape(node)
    return translation, np.zeros_like(translation) if rotation is None else rotation


def _node(model: ModalModel, field: SecondOrder, node: int) -> Array:
    """(6, m, m) of a node, relative to the reference of the field."""
    start = model.interface_nodes[field.reference].node
    u0, phi = _rigid_shape(model, start)
    u, theta = _rigid_shape(model, node)
    arm = model.nodes[node] - model.nodes[start]
    moved, turned = u - u0 + skew(arm) @ phi, theta - phi
    moved[:, :6] = turned[:, :6] = 0.0
    n = model.elastic_modes
    relative = np.zeros((2, 3, n, n))
    place = np.flatnonzero(field.nodes == node)
    if len(place):
        pairs = pair_numbers(n)
        relative[0], relative[1] = field.translation[place[0]][:, pairs], field.rotation[place[0]][:, pairs]
    return np.concatenate([composed(relative[0], moved, phi, arm), composed_rotation(relative[1], turned, phi)])


def _rigid(model: ModalModel) -> SecondOrder:
    """Of a rigid link, relative to its first interface."""
    properties = mass_properties(model.invariants.rigid_mass_matrix)
    start = model.interface_nodes[0]
    _, phi = _rigid_shape(model, start.node)
    centre = properties.centre_of_mass
    full = twice_turned(phi, centre - start.position)
    momentum, spin = of_masses(np.array([properties.mass]), centre[None], full[None])
    turning = of_inertia(properties.inertia, phi, np.zeros_like(full))
    none, nodes = np.zeros((0, 3, 0)), np.zeros(0, dtype=np.int64)
    return SecondOrder(0, momentum + turning[0], spin + turning[1], np.zeros((0, 6, 6)), nodes, none, none)
