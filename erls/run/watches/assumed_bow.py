"""Second-order displacements assumed for a link whose modal model holds none: for estimates, not for equations.

Between its inboard interface and each node, at a distance d along t, the link is taken to bend as a cubic with the
displacement w across t and the slope s = θ × t of the node, so that the node comes nearer by ½∫w'²dx (the geometric
stiffness of a beam; J. S. Przemieniecki, Theory of Matrix Structural Analysis (1968), eq. 15.30),

    u₂ = -t (0.6 w² / d - 0.1 w·s + s² d / 15),

with s = ¾ w / d, a load at the node, where it has no rotation. The mass counts as spread evenly over the nodes.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from erls.maths.so3 import Array
from erls.mechanism.links import Link, node_shape6
from erls.mechanism.second_order import LinkSecondOrder, link_second_order
from fe_import.modal.model import ModalModel
from fe_import.modal.second_order import SecondOrder
from fe_import.model import IntArray
from fe_import.second_order.composition import composed
from fe_import.second_order.moments import of_masses

_VALUES = 2_000_000  # entries of the fields of nodes: 16 MB


def assumed_second_order(link: Link) -> LinkSecondOrder | None:
    """What `Link.second_order` would be if the link bent as this module says."""
    return link_second_order(replace(link, model=replace(link.model, second_order=_field(link))))


def _field(link: Link) -> SecondOrder:
    model = link.model
    reference = next(k for k, i in enumerate(model.interface_nodes) if i.node == link.inboard.node)
    nodes, n, m = _nodes(model), model.elastic_modes, model.modes
    u0, phi = node_shape6(model, link.inboard.node)
    arms = model.nodes[nodes] - link.inboard.position
    moved = model.translation_shapes[nodes] - u0 - np.cross(phi.T, arms[:, None, :]).transpose(0, 2, 1)
    moved[:, :, :6] = 0.0
    bow = _bow(model, nodes, arms, moved[:, :, 6:], phi[:, 6:])
    full = composed(bow, moved, phi, arms)
    masses = np.full(len(nodes), model.mass_properties.mass / len(nodes))
    momentum, spin = of_masses(masses, model.nodes[nodes], full)
    first, second = np.triu_indices(n)
    stored = np.ascontiguousarray(bow[:, :, first, second])
    return SecondOrder(reference, momentum, spin, np.zeros((n, m, m)), nodes, stored, np.zeros_like(stored))


def _nodes(model: ModalModel) -> IntArray:
    """Interfaces, and so many others, evenly out of all, as are worth their memory."""
    most = max(2, _VALUES // (3 * model.modes**2))
    some = np.linspace(0, len(model.nodes) - 1, min(most, len(model.nodes))).astype(np.int64)
    return np.unique(np.concatenate([some, [i.node for i in model.interface_nodes]]))


def _bow(model: ModalModel, nodes: IntArray, arms: Array, moved: Array, phi: Array) -> Array:
    """(k, 3, n, n) Ψ of the nodes from their displacements (k, 3, n) against the inboard interface."""
    length = np.linalg.norm(arms, axis=1)
    away = length > 1e-9 * max(float(length.max()), 1e-300)
    d = np.where(away, length, 1.0)[:, None, None]
    t = arms[:, :, None] * away[:, None, None] / d
    w = moved - t * np.einsum("kij,kin->kjn", t, moved)
    slope = 0.75 * w / d
    place = np.searchsorted(model.rotation_nodes, nodes).clip(0, max(len(model.rotation_nodes) - 1, 0))
    turning = np.isin(nodes, model.rotation_nodes)
    theta = model.rotation_shapes[place[turning]][:, :, 6:] - phi
    slope[turning] = np.cross(theta, t[turning], axis=1)
    mixed = np.einsum("kia,kib->kab", w, slope)
    nearer = 1.2 * np.einsum("kia,kib->kab", w, w) / d - 0.1 * (mixed + mixed.transpose(0, 2, 1))
    nearer += 2 / 15 * d * np.einsum("kia,kib->kab", slope, slope)
    return np.asarray(-t[:, :, :, None] * (nearer * away[:, None, None])[:, None])
