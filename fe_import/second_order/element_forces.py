"""Nodal forces of the strains of second order, ∫ ε(δ) : C : (twice the strain of second order of two modes) dV.

In a mode pair the strains of Green and Lagrange hold ½ sym(∇φ_aᵀ ∇φ_b); of shells those of the reference surface, with
directors that turn finitely, shear taken where that of first order is.
"""

from __future__ import annotations

import numpy as np

from fe_import.elements.elasticity import stress_of_gradient
from fe_import.elements.shell import element_matrices
from fe_import.elements.shell_strains import products, strains
from fe_import.elements.shell_stress import ShellStress, nodal_motion
from fe_import.elements.solid_assembly import chunks, motion_of_modes, slopes
from fe_import.elements.solid_stress import SolidStress
from fe_import.model import Array, IntArray

_CHUNK_VALUES = 4_000_000  # of strains of pairs held at a time


def solid_forces(solid: SolidStress, dof_map: IntArray, fields: Array, first: IntArray, second: IntArray) -> Array:
    """(d, pairs) ∫ ε(δ) : C : sym(∇φ_aᵀ ∇φ_b) dV."""
    mesh = solid.mesh
    result = np.zeros((len(fields), len(first)))
    for element, nodes, some in chunks(mesh):
        points, weights = element.quadrature(element.stiffness_order)
        corners, k = mesh.nodes[nodes], element.size
        derivatives, volume = slopes(element, corners, points)  # ∂_a of shape k
        volume *= weights
        moduli = solid.moduli_of(some)
        modes = motion_of_modes(element, corners, moduli)
        moved = fields[dof_map[nodes, :3]]  # (e, k, 3, n)
        gradient = np.einsum("eqak,ekcn->eqacn", derivatives[..., :k], moved)  # ∂_a u_c
        for begin in range(0, len(first), 64):
            pairs = slice(begin, begin + 64)
            product = np.einsum("eqacp,eqbcp->eqabp", gradient[..., first[pairs]], gradient[..., second[pairs]])
            parts = stress_of_gradient(product, moduli)
            stress = parts[:, :, ((0, 3, 5), (3, 1, 4), (5, 4, 2))]
            forces = np.einsum("eqak,eqacp,eq->ekcp", derivatives, stress, volume, optimize=True)
            inner = forces[:, k:].reshape(len(nodes), -1, forces.shape[3])
            forces = forces[:, :k] + (modes.swapaxes(1, 2) @ inner).reshape(len(nodes), k, 3, -1)
            np.add.at(result[:, pairs], dof_map[nodes, :3].ravel(), forces.reshape(-1, forces.shape[-1]))
    return result


def shell_forces(shell: ShellStress, dof_map: IntArray, fields: Array, first: IntArray, second: IntArray) -> Array:
    """(d, pairs) of the shells of a link, fields and forces in SI."""
    result, length = np.zeros((len(fields), len(first))), shell.length
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
            np.add.at(result, dof_map[block.nodes].ravel(), scaled.reshape(-1, len(first)))
    return result
