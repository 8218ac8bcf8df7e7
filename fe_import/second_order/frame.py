"""Second-order field of a frame whose members form a tree: the nonlinear kinematics of beams, integrated outward.

With the rotation vector θ + θ₂ and the position x + u + u₂ of a cross section, curvature κ and stretch and shear γ in
its own turned axes linear in the modes, R' = R κ̃ and x' = R (t + γ) give in second order (J. C. Simo, Comput. Methods
Appl. Mech. Eng. 49 (1985) 55-70)

    θ₂' = ½ θ × κ,   u₂' = θ₂ × t + ½ θ × (θ × t) + θ × γ.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from fe_import.modal.second_order import SecondOrder
from fe_import.model import Array, BeamLines, FEModel, IntArray
from fe_import.second_order.beams import INTEGRALS, POINTS, WEIGHTS, LineFields, line_fields
from fe_import.second_order.composition import composed, composed_rotation, paired, twice_turned
from fe_import.second_order.moments import Pair, of_body, of_inertias, of_masses, of_modes

_AT_ONCE = 1_000_000  # numbers of a second-order field in memory at a time


def frame_second_order(model: FEModel, beams: BeamLines, shapes: Array, reference: int, nodes: IntArray) -> SecondOrder:
    """Integrate from the reference interface outward.

    Parameters
    ----------
    model : FEModel
        In SI.
    beams : BeamLines
        Its elements, a tree.
    shapes : (d, m) array
        Modes, the six rigid-body ones first.
    reference : int
        Interface.
    nodes : (k,) int array
        Rising; whose fields are stored.
    """
    start = model.interface_nodes[reference].node
    phi, relative = shapes[model.dof_map[start, 3:]], relative_to(model, shapes, start)
    wanted = {int(node): k for k, node in enumerate(nodes)}
    count = shapes.shape[1]
    first, second = np.triu_indices(count - 6)
    stored = np.zeros((2, len(nodes), 3, len(first)))
    momentum, spin = np.zeros((6, count, count)), np.zeros((3, 3, count, count))
    modal = np.zeros((count - 6, count, count))
    extra = _point_masses(model, beams.lumped)

    def settle(node: int, fields: Pair) -> None:
        """Keep the field of a node, and count its mass."""
        nonlocal momentum, spin, modal
        if node in wanted:
            for k in range(2):
                stored[k, wanted[node]] = fields[k][:, first, second]
        if node in extra:
            mass, inertia = extra[node]
            place, rows = model.nodes[node], model.dof_map[node]
            terms = of_body(mass, inertia, place, place - model.nodes[start], relative[rows], shapes[rows], fields)
            momentum, spin, modal = momentum + terms[0], spin + terms[1], modal + terms[2]

    at = {start: (np.zeros((3, count - 6, count - 6)), np.zeros((3, count - 6, count - 6)))}
    settle(start, at[start])
    order, per_pass = _outward(beams, start), max(1, _AT_ONCE // (len(POINTS) * 3 * count**2))
    for first_of in range(0, len(order), per_pass):
        some = order[first_of : first_of + per_pass]
        elements = np.array([element for element, _ in some])
        ends = model.dof_map[beams.nodes[elements]].reshape(len(some), 12)
        fields = line_fields(beams, elements, relative[ends])
        inside = _along(beams, some, fields, at)
        for element, backward in some:
            far = int(beams.nodes[element, 0 if backward else 1])
            settle(far, at[far])
        if not beams.lumped:
            whole = line_fields(beams, elements, shapes[ends])
            terms = _line_terms(model, beams, elements, fields, inside, whole, start, phi)
            momentum, spin, modal = momentum + terms[0], spin + terms[1], modal + terms[2]
    return SecondOrder(reference, momentum, spin, modal, nodes, stored[0], stored[1])


def relative_to(model: FEModel, shapes: Array, start: int) -> Array:
    """(d, m) the modes without the rigid-body motion of the node ``start``; zero in the rigid-body modes."""
    motions = model.rigid_body_modes()
    rows = model.dof_map[start]
    result = np.zeros_like(shapes)
    result[:, 6:] = shapes[:, 6:] - motions @ np.linalg.solve(motions[rows], shapes[rows, 6:])
    return result


def _outward(beams: BeamLines, start: int) -> list[tuple[int, bool]]:
    """Elements from ``start`` outward, and whether each is passed from its second node to its first."""
    touching: dict[int, list[int]] = {}
    for element, pair in enumerate(beams.nodes.tolist()):
        for node in pair:
            touching.setdefault(node, []).append(element)
    result: list[tuple[int, bool]] = []
    passed: set[int] = set()
    front = [start]
    while front:
        node = front.pop()
        for element in touching[node]:
            if element not in passed:
                passed.add(element)
                first, second = beams.nodes[element].tolist()
                result.append((element, second == node))
                front.append(first if second == node else second)
    return result


def _along(beams: BeamLines, some: list[tuple[int, bool]], fields: LineFields, at: dict[int, Pair]) -> Pair:
    """Ψ at the points of some elements in the order of `_outward`, (e, 5, 3, n, n) each; those of their far ends are
    added to ``at``.
    """
    theta, kappa, gamma = (f[..., 6:] for f in (fields.rotation, fields.curvature, fields.strain))
    tangent = fields.tangent[:, None]
    turning = paired(theta, kappa)
    rotation, far_rotation = _integrated((turning + np.swapaxes(turning, -1, -2)) / 2, beams, some, at, 1)
    flat = rotation.reshape(*rotation.shape[:3], theta.shape[-1] ** 2)
    sheared = paired(theta, gamma)
    slope = np.cross(flat, tangent[..., None], axisa=-2, axisb=-2, axisc=-2).reshape(rotation.shape)
    slope = slope + twice_turned(theta, tangent) + sheared + np.swapaxes(sheared, -1, -2)
    displacement, far_displacement = _integrated(slope, beams, some, at, 0)
    at.update((node, (far_displacement[node], turned)) for node, turned in far_rotation.items())
    return displacement, rotation


def _integrated(
    rate: Array, beams: BeamLines, some: list[tuple[int, bool]], at: dict[int, Pair], which: int
) -> tuple[Array, dict[int, Array]]:
    """A field at the points of elements, and at their far ends, from its derivative along them at the points; ``which``
    tells its place in pairs of those ``at`` nodes before.
    """
    elements = [element for element, _ in some]
    flat = rate.reshape(*rate.shape[:2], int(np.prod(rate.shape[2:])))
    grown = (INTEGRALS @ flat).reshape(len(rate), len(INTEGRALS), *rate.shape[2:])
    grown *= beams.lengths[elements].reshape(-1, 1, 1, 1, 1)
    starts, found = np.empty_like(grown[:, 0]), dict[int, Array]()
    for k, (element, backward) in enumerate(some):
        near, far = beams.nodes[element].tolist()[:: -1 if backward else 1]
        before = found[near] if near in found else at[near][which]
        found[far] = before - grown[k, -1] if backward else before + grown[k, -1]
        starts[k] = found[far] if backward else before
    return starts[:, None] + grown[:, :-1], found


def _line_terms(
    model: FEModel,
    beams: BeamLines,
    elements: IntArray,
    fields: LineFields,
    inside: Pair,
    whole: LineFields,
    start: int,
    phi: Array,
) -> tuple[Array, Array, Array]:
    """Momentum, spin and modal terms of the mass along elements; ``fields`` are relative to the reference, which turns
    by ``phi``.
    """
    lengths, axes = beams.lengths[elements], beams.axes[elements]
    along = (lengths[:, None] * POINTS)[..., None] * fields.tangent[:, None]
    places = model.nodes[beams.nodes[elements, 0], None] + along
    full = composed(inside[0], fields.displacement, phi, places - model.nodes[start])
    masses = (beams.mass[elements] * lengths)[:, None] * WEIGHTS
    momentum, spin = of_masses(masses.ravel(), places.reshape(-1, 3), full.reshape(-1, *full.shape[2:]))
    modal = of_modes(whole.displacement[..., 6:], masses[..., None, None, None] * full)
    if beams.rotary[elements].any():
        turned = composed_rotation(inside[1], fields.rotation, phi)
        inertia = axes.swapaxes(1, 2) @ (beams.rotary[elements][..., None] * axes) * lengths[:, None, None]
        weighted = (WEIGHTS[:, None, None] * inertia[:, None]).reshape(-1, 3, 3)
        theta = whole.rotation
        theta = theta.reshape(-1, *theta.shape[2:])
        terms = of_inertias(weighted, theta, turned.reshape(-1, *turned.shape[2:]))
        momentum, spin = momentum + terms[0], spin + terms[1]
        modal = modal + of_modes(theta[..., 6:], terms[2])
    return momentum, spin, modal


def _point_masses(model: FEModel, lumped: bool) -> dict[int, tuple[float, Array]]:
    """Mass and inertia of the nodes that have any of their own: given point masses, and lumped elements."""
    blocks = model.mass if lumped else model.added_mass
    if blocks is None:
        return {}
    rows = sp.csr_array(blocks)
    result = {}
    for node, dofs in enumerate(model.dof_map):
        block = rows[dofs][:, dofs].toarray()
        if block.any():
            result[node] = float(np.trace(block[:3, :3]) / 3), block[3:, 3:]
    return result
