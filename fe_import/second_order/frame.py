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
from fe_import.second_order.moments import Pair, of_body, of_inertia, of_masses, of_modes


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
    relative = relative_to(model, shapes, start)
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
    for element, backward in _outward(beams, start):
        near, far = beams.nodes[element][:: -1 if backward else 1]
        ends = relative[model.dof_map[beams.nodes[element]]].reshape(12, count)
        fields = line_fields(beams, element, ends)
        inside, at[int(far)] = _along(fields, float(beams.lengths[element]), at[int(near)], backward)
        settle(int(far), at[int(far)])
        if not beams.lumped:
            whole = line_fields(beams, element, shapes[model.dof_map[beams.nodes[element]]].reshape(12, count))
            terms = _line_terms(model, beams, element, fields, inside, whole, start)
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


def _along(fields: LineFields, length: float, near: Pair, backward: bool) -> tuple[Pair, Pair]:
    """Ψ at the points of an element, (5, 3, n, n) each, and at its far end."""
    theta, kappa, gamma = (f[..., 6:] for f in (fields.rotation, fields.curvature, fields.strain))
    tangent = np.broadcast_to(fields.tangent, (len(POINTS), 3))
    turning = paired(theta, kappa)
    turning = (turning + np.swapaxes(turning, -1, -2)) / 2
    rotation, rotation_end = _integrated(turning, length, near[1], backward)
    sheared = paired(theta, gamma)
    slope = np.cross(rotation, fields.tangent[:, None, None], axisa=-3, axisb=0, axisc=-3)
    slope = slope + twice_turned(theta, tangent) + sheared + np.swapaxes(sheared, -1, -2)
    displacement, displacement_end = _integrated(slope, length, near[0], backward)
    return (displacement, rotation), (displacement_end, rotation_end)


def _integrated(rate: Array, length: float, near: Array, backward: bool) -> tuple[Array, Array]:
    """A field at the points and at the far end from its derivative along the element at the points."""
    grown = length * np.einsum("pq,q...->p...", INTEGRALS, rate)
    if backward:
        return near + grown[:-1] - grown[-1], near - grown[-1]
    return near + grown[:-1], near + grown[-1]


def _line_terms(
    model: FEModel, beams: BeamLines, element: int, fields: LineFields, inside: Pair, whole: LineFields, start: int
) -> tuple[Array, Array, Array]:
    """Momentum, spin and modal terms of the mass along an element; ``fields`` are relative to the reference."""
    length, axes = float(beams.lengths[element]), beams.axes[element]
    first = model.nodes[beams.nodes[element, 0]]
    places = first + np.outer(POINTS * length, fields.tangent)
    phi = (whole.rotation - fields.rotation)[0]
    full = composed(inside[0], fields.displacement, phi, places - model.nodes[start])
    masses = beams.mass[element] * length * WEIGHTS
    momentum, spin = of_masses(masses, places, full)
    modal = of_modes(whole.displacement[..., 6:], masses[:, None, None, None] * full)
    if beams.rotary[element].any():
        turned = composed_rotation(inside[1], fields.rotation, phi)
        inertia = axes.T @ (beams.rotary[element][:, None] * axes) * length
        for weight, theta, field in zip(WEIGHTS, whole.rotation, turned, strict=True):
            terms = of_inertia(weight * inertia, theta, field)
            momentum, spin = momentum + terms[0], spin + terms[1]
            modal = modal + of_modes(theta[:, 6:], terms[0][3:])
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
