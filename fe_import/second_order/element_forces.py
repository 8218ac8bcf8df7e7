"""Work of the strains of second order of two modes on test fields, ∫ ε(δ) : C : (twice those strains) dV.

In a mode pair the strains of Green and Lagrange hold ½ sym(∇φ_aᵀ ∇φ_b); of shells those of the reference surface, with
directors that turn finitely, shear taken where that of first order is.
"""

from __future__ import annotations

import numpy as np

from fe_import.elements.elasticity import PAIRS, stress_of_gradient
from fe_import.elements.shell import element_matrices
from fe_import.elements.shell_strains import products, strains
from fe_import.elements.shell_stress import ShellStress, nodal_motion
from fe_import.elements.solid_assembly import chunks, motion_of_modes, slopes
from fe_import.elements.solid_stress import SolidStress
from fe_import.model import Array, IntArray

_CHUNK_VALUES = 4_000_000  # of strains of pairs held at a time
_CACHED_VALUES = 400_000  # the same of solids, which are read as soon as they are made


def solid_work(
    solid: SolidStress, dof_map: IntArray, tests: Array, fields: Array, first: IntArray, second: IntArray
) -> Array:
    """(p, pairs) ∫ ε(δ) : C : sym(∇φ_aᵀ ∇φ_b) dV for tests δ (d, p) and pairs of fields φ (d, n)."""
    mesh, n, p = solid.mesh, fields.shape[1], tests.shape[1]
    if not len(first):
        return np.zeros((p, 0))
    # σ : sym(∇φ_aᵀ ∇φ_b) is h_ab + h_ba with half of the normal stresses in h = Σ_i<=j σ_ij ∂_iφ_a · ∂_jφ_b
    halves = np.where(np.arange(6) < 3, 0.5, 1.0)[:, None]
    half = np.zeros((p, n * n))
    for element, nodes, some in chunks(mesh):
        points, weights = element.quadrature(element.stiffness_order)
        corners, k = mesh.nodes[nodes], element.size
        derivatives, volume = slopes(element, corners, points)  # ∂_a of shape k
        moduli, volume = solid.moduli_of(some), volume * weights
        modes = motion_of_modes(element, corners, moduli)
        step = max(1, _CACHED_VALUES // (6 * len(weights) * max(1, n * n, p)))
        for begin in range(0, len(nodes), step):
            part = slice(begin, begin + step)
            rows, there = dof_map[nodes[part], :3], derivatives[part]
            gradient = _gradients(there[..., :k], fields[rows]).reshape(-1, 3, 3, n)  # points, derivative, component
            nodal = tests[rows].reshape(len(rows), 3 * k, p)
            moved = np.concatenate([nodal, modes[part] @ nodal], axis=1).reshape(len(rows), there.shape[3], 3, p)
            weight = volume[part, :, None, None] * halves
            stress = stress_of_gradient(_gradients(there, moved), moduli[part]) * weight
            strain = np.empty((len(gradient), 6, n, n))
            for row, (a, b) in enumerate(PAIRS):
                np.matmul(gradient[:, a].swapaxes(1, 2), gradient[:, b], out=strain[:, row])
            half += stress.reshape(-1, p).T @ strain.reshape(-1, n * n)
    whole = half.reshape(p, n, n)
    return np.asarray(whole[:, first, second] + whole[:, second, first])


def _gradients(derivatives: Array, moved: Array) -> Array:
    """(e, q, derivative, component, n) of fields (e, k, 3, n)."""
    e, q, _, k = derivatives.shape
    found = derivatives.reshape(e, 3 * q, k) @ moved.reshape(e, k, -1)
    return found.reshape(e, q, 3, 3, moved.shape[3])


def shell_work(
    shell: ShellStress, dof_map: IntArray, tests: Array, fields: Array, first: IntArray, second: IntArray
) -> Array:
    """The same of the shells of a link, in SI."""
    result, length = np.zeros((tests.shape[1], len(first))), shell.length
    step = max(1, _CHUNK_VALUES // (4 * 8 * 26 * max(1, len(first))))
    for part in shell.parts:
        for begin in range(0, len(part.block.nodes), step):
            block = part.some(slice(begin, begin + step)).block
            corners = shell.positions[block.nodes]
            at, (_, _, inner) = block.points(corners), element_matrices(block, corners, part.drilling)
            moved = nodal_motion(block, fields, dof_map, length)
            whole = np.concatenate([moved, inner @ moved], axis=1)
            twice = 2 * products(at, whole[..., first], whole[..., second])
            stress = np.einsum("eij,eqjp,eq->eqip", block.stiffness, twice, at.area, optimize=True)
            force = np.einsum("eqin,eqip->enp", strains(at), stress, optimize=True)
            nodes, size = len(block.nodes), moved.shape[1]
            force = force[:, :size] + inner.swapaxes(1, 2) @ force[:, size:]
            # energy in stress times volume of the mesh's units; moments have one length more than forces
            scale = np.repeat([1.0, length], 3) * length**2 * shell.scale
            scaled = force.reshape(nodes, -1, 6, len(first)) * scale[:, None]
            result += tests[dof_map[block.nodes].ravel()].T @ scaled.reshape(-1, len(first))
    return result
