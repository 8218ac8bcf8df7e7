"""How far the section forces of shells are from smooth ones, in energy.

Forces and moments of the exact solution are continuous along a smooth surface of one make, those of elements are not
(O. C. Zienkiewicz & J. Z. Zhu, Int. J. Numer. Methods Eng. 24 (1987) 337-357). At the nodes they are averaged, as
tensors in space, over elements that are joined smoothly: not across folds, branches, or other makes.

Moments tell a third of what they cost: of a bending wave with k h ≪ 1, elements of linear displacement and rotation
with tied shear have ω (1 + (k h)²/8), by cos, sin and tan of k h/2 in energy and consistent mass, and their moments,
constant over each element, differ from linear ones by (k h)²/12 of the energy, (k h)²/24 in ω. So moments count thrice.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from fe_import.elements.shell import element_matrices
from fe_import.elements.shell_strains import ShellPoints, strains
from fe_import.elements.shell_stress import ShellPart, ShellStress, extrapolation, nodal_motion
from fe_import.model import Array, IntArray

_SMOOTH = np.cos(np.radians(35.0))  # between normals: a circle of twelve elements is smooth, a fold is not
_MOMENTS = 3.0  # how often their energy counts
_CHUNK = 4000  # elements at a time


def energy_of_error(source: ShellStress, fields: Array, dof_map: IntArray) -> tuple[Array, Array]:
    """(m,) energy of the difference of the forces of elements to those averaged at the nodes, and of the former.

    Parameters
    ----------
    source : ShellStress
    fields : (d, m) array
        Displacements [m, rad].
    dof_map : (n, 6) int array

    Returns
    -------
    error, energy : (m,) arrays
        [J]; without what resists rotation about the normal.
    """
    slots, fronts = _slots(source)
    count = 1 + max(int(own.max()) for own in slots)
    average, times = np.zeros((count, 3, 3, 3, fields.shape[1])), np.zeros(count)
    for part, rows, at, forces in _forces(source, fields, dof_map):
        to_corners = extrapolation(part.block)
        frames = np.einsum("kq,eqic->ekic", to_corners, at.axes)
        frames /= np.linalg.norm(frames, axis=-1, keepdims=True)
        nodal = np.einsum("kq,eqim->ekim", to_corners, forces)
        own, sides = slots[rows[0]][rows[1]], fronts[rows[0]][rows[1]]
        np.add.at(average, own, _in_space(nodal, frames, sides))
        np.add.at(times, own, 1.0)
    average /= times[:, None, None, None, None]
    totals, weights = np.zeros((2, fields.shape[1])), np.sqrt(np.repeat([1.0, _MOMENTS, 1.0], (3, 3, 2)))
    for part, rows, at, forces in _forces(source, fields, dof_map):
        shapes, _ = part.block.element.shapes(part.block.element.points)
        sides = fronts[rows[0]][rows[1]]
        smooth = _along(np.einsum("qk,ekabcm->eqabcm", shapes, _seen(average[slots[rows[0]][rows[1]]], sides)), at.axes)
        compliance = np.linalg.inv(part.block.stiffness)
        for total, field in zip(totals, ((smooth - forces) * weights[:, None], forces), strict=True):
            total += np.einsum("eqim,eij,eqjm,eq->m", field, compliance, field, at.area, optimize=True) / 2
    totals *= source.scale * source.length**3
    return totals[0], totals[1]


def _forces(
    source: ShellStress, fields: Array, dof_map: IntArray
) -> Iterator[tuple[ShellPart, tuple[int, slice], ShellPoints, Array]]:
    """Some elements of a part, which ones, their points, and (e, q, 8, m) section forces there, in mesh units."""
    for k, whole in enumerate(source.parts):
        for begin in range(0, len(whole.block.nodes), _CHUNK):
            rows = slice(begin, begin + _CHUNK)
            part = whole.some(rows)
            block, corners = part.block, source.positions[part.block.nodes]
            moved = nodal_motion(block, fields, dof_map, source.length)
            _, _, inner = element_matrices(block, corners, part.drilling)
            at = block.points(corners)
            variables = np.concatenate([moved, inner @ moved], axis=1)
            strained = np.einsum("eqin,enm->eqim", strains(at), variables, optimize=True)
            yield part, (k, rows), at, np.einsum("eij,eqjm->eqim", block.stiffness, strained)


def _slots(source: ShellStress) -> tuple[list[IntArray], list[Array]]:
    """Of each part (e, k): where corners are averaged, and the sign of their normal against that of the place."""
    nodes = [part.block.nodes for part in source.parts]
    normals = np.concatenate([_normals(source.positions[own]) for own in nodes])
    first = np.cumsum([0, *map(len, nodes)])
    edges, owner, make = [], [], np.repeat(np.arange(len(nodes)), np.diff(first))
    for start, own in zip(first, nodes, strict=False):
        edges.append(np.sort(np.stack([own, np.roll(own, -1, axis=1)], axis=2).reshape(-1, 2), axis=1))
        owner.append(np.repeat(start + np.arange(len(own)), own.shape[1]))
    every, of = np.concatenate(edges), np.concatenate(owner)
    _, which, times = np.unique(every, axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(which.ravel(), kind="stable")
    order = order[np.repeat(times == 2, times)]
    one, other = of[order[::2]], of[order[1::2]]
    makes = [part.laminate for part in source.parts]
    alike = np.array([[a == b for b in range(len(makes))] for a in range(len(makes))])
    smooth = alike[make[one], make[other]] & (np.abs(np.einsum("ec,ec->e", normals[one], normals[other])) > _SMOOTH)
    pairs = (np.ones(smooth.sum()), (one[smooth], other[smooth]))
    _, surface = connected_components(sp.coo_array(pairs, shape=(len(normals),) * 2), directed=False)
    corners = np.concatenate([own.ravel() for own in nodes])
    element = np.concatenate([np.repeat(s + np.arange(len(n)), n.shape[1]) for s, n in zip(first, nodes, strict=False)])
    keys = surface[element].astype(np.int64) * (corners.max() + 1) + corners
    _, leader, slot = np.unique(keys, return_index=True, return_inverse=True)
    side = np.sign(np.einsum("ec,ec->e", normals[element], normals[element[leader[slot.ravel()]]]))
    cut = np.cumsum([own.size for own in nodes])[:-1]
    shapes = [own.shape for own in nodes]
    split = (np.split(slot.ravel(), cut), np.split(np.where(side == 0, 1.0, side), cut))
    return (
        [part.reshape(shape) for part, shape in zip(split[0], shapes, strict=True)],
        [part.reshape(shape) for part, shape in zip(split[1], shapes, strict=True)],
    )


def _normals(corners: Array) -> Array:
    """(e, 3) of elements (e, k, 3), by their diagonals or sides."""
    last = corners[:, 3] - corners[:, 1] if corners.shape[1] == 4 else corners[:, 2] - corners[:, 0]
    first = corners[:, 2] - corners[:, 0] if corners.shape[1] == 4 else corners[:, 1] - corners[:, 0]
    normal = np.cross(first, last)
    return np.asarray(normal / np.linalg.norm(normal, axis=1, keepdims=True))


def _in_space(forces: Array, frames: Array, sides: Array) -> Array:
    """(e, k, 3, 3, 3, m): forces and moments as tensors, shear forces as the first row of the third."""
    e, k, _, m = forces.shape
    result = np.zeros((e, k, 3, 3, 3, m))
    axes = frames[:, :, :2]
    for which in range(2):
        local = np.zeros((e, k, 2, 2, m))
        for row, (i, j) in enumerate(((0, 0), (1, 1), (0, 1))):
            local[:, :, i, j] = local[:, :, j, i] = forces[:, :, 3 * which + row]
        result[:, :, which] = np.einsum("ekia,ekijm,ekjb->ekabm", axes, local, axes, optimize=True)
    result[:, :, 2, 0] = np.einsum("ekia,ekim->ekam", axes, forces[:, :, 6:])
    return _seen(result, sides)


def _seen(tensors: Array, sides: Array) -> Array:
    """Moments and shear forces change their sign with the normal."""
    result = tensors.copy()
    result[:, :, 1:] *= sides[:, :, None, None, None, None]
    return result


def _along(tensors: Array, axes: Array) -> Array:
    """(e, q, 8, m) of tensors in space, in the axes of elements."""
    result = np.zeros((*axes.shape[:2], 8, tensors.shape[-1]))
    plane = axes[:, :, :2]
    for which in range(2):
        local = np.einsum("eqia,eqabm,eqjb->eqijm", plane, tensors[:, :, which], plane, optimize=True)
        for row, (i, j) in enumerate(((0, 0), (1, 1), (0, 1))):
            result[:, :, 3 * which + row] = local[:, :, i, j]
    result[:, :, 6:] = np.einsum("eqia,eqam->eqim", plane, tensors[:, :, 2, 0])
    return result
