"""Second-order field of a slender link of which only matrices and nodes are known, along the line of its sections.

Every cross section turns by θ and moves by u, the rigid motion next to that of its nodes. From one section to the next
curvature and strain are taken as constant, linear in the modes in axes that turn with the line, as those of beams are
(`fe_import.second_order.frame`). What sections deform within themselves turns with them.
"""

from __future__ import annotations

import numpy as np

from fe_import.modal.second_order import SecondOrder
from fe_import.model import Array, FEModel, IntArray
from fe_import.second_order.composition import paired, twice_turned
from fe_import.second_order.cross_sections import CrossSections, NoSections, cross_sections
from fe_import.second_order.frame import relative_to
from fe_import.second_order.moments import Pair, of_body

_DEFORMED = 0.02  # of what bends; beyond it sections are none


def line_second_order(model: FEModel, shapes: Array, reference: int, nodes: IntArray) -> tuple[SecondOrder, str]:
    """Field, and a statement for the provenance.

    Parameters
    ----------
    model : FEModel
        In SI.
    shapes : (d, m) array
        Modes, the six rigid-body ones first.
    reference : int
        Interface.
    nodes : (k,) int array
        Rising; whose fields are stored.

    Raises
    ------
    NoSections
        The link is not slender, forms a ring, or its matrices do not say.
    """
    sections = cross_sections(model, reference)
    deformed = _deformed(model, sections, shapes)
    if deformed > _DEFORMED:
        raise NoSections(f"cross sections deform: {100 * deformed:.0f} % of the motion by low modes is none of them")
    start = model.interface_nodes[reference].node
    relative = relative_to(model, shapes, start)
    (u, theta), own = sections.motion(model, relative), np.concatenate(sections.motion(model, shapes), axis=1)
    moved = np.concatenate([u, theta], axis=1)
    origin, n = model.nodes[start], shapes.shape[1] - 6
    first, second = np.triu_indices(n)
    stored = np.zeros((2, len(nodes), 3, len(first)))
    count = shapes.shape[1]
    momentum, spin = np.zeros((6, count, count)), np.zeros((3, 3, count, count))
    modal = np.zeros((n, count, count))
    seats = _seats(model, sections, nodes)
    added = _added(model)

    def count_body(mass: float, inertia: Array, place: Array, rows: tuple[Array, Array], fields: Pair) -> None:
        nonlocal momentum, spin, modal
        terms = of_body(mass, inertia, place, place - origin, rows[0], rows[1], fields)
        momentum, spin, modal = momentum + terms[0], spin + terms[1], modal + terms[2]

    at: dict[int, Pair] = {-1: (np.zeros((3, n, n)), np.zeros((3, n, n)))}
    for k, parent in enumerate(sections.parent.tolist()):
        place = origin if parent < 0 else sections.centres[parent]
        near = np.zeros((6, n)) if parent < 0 else moved[parent, :, 6:]
        at[k] = _next(at[parent], near, moved[k, :, 6:], sections.centres[k] - place)
        count_body(float(sections.masses[k]), sections.inertia[k], sections.centres[k], (moved[k], own[k]), at[k])
        for node in seats.get(k, ()):
            rows = model.dof_map[node]
            turns = rows[3] >= 0
            local = np.concatenate([relative[rows[:3], 6:], relative[rows[3:], 6:] if turns else moved[k, 3:, 6:]])
            if node == start:
                fields = at[-1]
            else:
                fields = _carried(at[k], moved[k, :, 6:], local, model.nodes[node] - sections.centres[k])
            for which, field in enumerate(fields if turns else fields[:1]):
                stored[which, np.searchsorted(nodes, node)] = field[:, first, second]
            if node in added:
                count_body(*added[node], model.nodes[node], (_six(relative, rows), _six(shapes, rows)), fields)
    statement = f"from {len(sections.parent)} cross sections along its line, rigid to {deformed:.1e} of the low modes"
    return SecondOrder(reference, momentum, spin, modal, nodes, stored[0], stored[1]), statement


def _deformed(model: FEModel, sections: CrossSections, shapes: Array) -> float:
    """Share of the kinetic energy that is none of rigid sections, of all elastic modes by their flexibility."""
    nodes = np.flatnonzero(sections.of_node >= 0)
    own, elastic = sections.of_node[nodes], shapes[:, 6:]
    u, theta = sections.motion(model, elastic)
    arms = model.nodes[nodes] - sections.centres[own]
    fields = elastic[model.dof_map[nodes, :3]]
    left = fields - u[own] - np.cross(theta[own], arms[:, :, None], axis=1)
    flexible = 1 / np.einsum("dk,dk->k", elastic, model.stiffness @ elastic)
    weights = sections.weights[nodes]
    energy, lost = (np.einsum("n,nik,nik->k", weights, f, f) for f in (fields, left))
    return float((lost / energy) @ flexible / flexible.sum())


def _seats(model: FEModel, sections: CrossSections, nodes: IntArray) -> dict[int, list[int]]:
    """Section that carries each of the nodes: its own; of an interface, that of most of the nodes that it moves."""
    result: dict[int, list[int]] = {}
    coupled = {i.node: i for i in model.interface_nodes}
    for node in nodes.tolist():
        section = int(sections.of_node[node])
        if section < 0 and node in coupled:
            around = sections.of_node[coupled[node].coupled_nodes]
            there = around >= 0
            if there.any():
                section = int(np.bincount(around[there], coupled[node].weights[there]).argmax())
        if section < 0:
            section = int(np.linalg.norm(sections.centres - model.nodes[node], axis=1).argmin())
        result.setdefault(section, []).append(node)
    return result


def _added(model: FEModel) -> dict[int, tuple[float, Array]]:
    """Point masses of the link description, by node."""
    result: dict[int, tuple[float, Array]] = {}
    if model.added_mass is None:
        return result
    for node in np.unique(np.nonzero(np.isin(model.dof_map, np.unique(model.added_mass.nonzero()[0])))[0]).tolist():
        rows = model.dof_map[node]
        block = np.zeros((6, 6))
        there = rows >= 0
        block[np.ix_(there, there)] = model.added_mass[rows[there]][:, rows[there]].toarray()
        result[node] = float(np.trace(block[:3, :3]) / 3), block[3:, 3:]
    return result


def _six(fields: Array, rows: IntArray) -> Array:
    """(6, m) motion of a node; rotations of one that has none do not matter."""
    return np.where((rows >= 0)[:, None], fields[rows], 0.0)


def _symmetric(product: Array) -> Array:
    return np.asarray((product + np.swapaxes(product, -1, -2)) / 2)


def _crossed(field: Array, arm: Array) -> Array:
    """(3, n, n) of a rotation (3, n, n) and an arm (3,)."""
    return np.asarray(np.cross(field, arm[:, None, None], axis=0))


def _next(near: Pair, start: Array, end: Array, arm: Array) -> Pair:
    """Field of the next section from that of one, their motions (6, n) and the way between their centres."""
    mean, turn = (start[3:] + end[3:]) / 2, end[3:] - start[3:]
    strain = end[:3] - start[:3] - np.cross(mean, arm[:, None], axis=0)
    turned = _symmetric(paired(start[3:], turn))
    along = _crossed(near[1] + turned / 2, arm) + twice_turned(mean, arm) + twice_turned(turn, arm) / 12
    return near[0] + along + 2 * _symmetric(paired(mean, strain)), near[1] + turned


def _carried(section: Pair, motion: Array, local: Array, arm: Array) -> Pair:
    """Field of a node that a section carries; what it moves by itself, linear in the modes, turns with the section."""
    theta = motion[3:]
    own = local[:3] - motion[:3] - np.cross(theta, arm[:, None], axis=0)
    moved = _crossed(section[1], arm) + twice_turned(theta, arm) + 2 * _symmetric(paired(theta, own))
    return section[0] + moved, section[1] + _symmetric(paired(theta, local[3:] - theta))
