"""Mass and stiffness of shells: Reissner and Mindlin's plates along a surface, with rotations about its normal.

These resist the rotation of the surface itself by a penalty, ½ d G h ∫ (θ·n - rot u)² dA (T. J. R. Hughes & F. Brezzi,
Comput. Methods Appl. Mech. Eng. 72 (1989) 105-121), G h the membrane's shear stiffness and d the stated ``drilling``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fe_import.elements.shell_elements import ShellElement
from fe_import.elements.shell_strains import ShellPoints, drilling, shell_points, strains
from fe_import.model import Array, IntArray


@dataclass(frozen=True)
class ShellBlock:
    """Shell elements of one type and what they are made of.

    Attributes
    ----------
    element : ShellElement
    nodes : (e, k) int array
    stiffness : (e, 8, 8) array
        Membrane forces, bending moments and shear forces, all per length, from the eight strains, see
        `fe_import.elements.shell_strains`; about the nodes' surface, in the axes of the element [N/m, N, N m].
    moments : (e, 3) array
        ∫ρ dz, ∫ρ z dz and ∫ρ z² dz over the thickness, z from the nodes [kg/m², kg/m, kg].
    reference : (e, 3) array or None
        Directions whose projections on the surface are the first axes; from the elements' sides when None.
    """

    element: ShellElement
    nodes: IntArray
    stiffness: Array
    moments: Array
    reference: Array | None = None

    def points(self, corners: Array) -> ShellPoints:
        """At the points of the quadrature; ``corners`` (e, k, 3)."""
        return shell_points(self.element, corners, self.reference)


def element_matrices(block: ShellBlock, corners: Array, drilling_factor: float) -> tuple[Array, Array, Array]:
    """Matrices of elements with ``corners`` (e, k, 3), node by node u then θ.

    Returns
    -------
    mass, stiffness : (e, 6 k, 6 k) arrays
        Consistent; symmetric to the last bit [kg, kg m, kg m²; N/m, N, N m].
    motion : (e, inner, 6 k) array
        Inner variables that go with the nodes.
    """
    at = block.points(corners)
    full = whole_stiffness(block, at, drilling_factor)
    size = 6 * block.element.corners
    motion = np.asarray(-np.linalg.solve(full[:, size:, size:], full[:, size:, :size]), dtype=np.float64)
    stiffness = full[:, :size, :size] + full[:, :size, size:] @ motion
    return _mass(block, at), (stiffness + stiffness.swapaxes(1, 2)) / 2, motion


def whole_stiffness(block: ShellBlock, at: ShellPoints, drilling_factor: float) -> Array:
    """(e, variables, variables), inner variables included."""
    strain = strains(at)
    count, q, _, n = strain.shape
    weighted = np.einsum("eij,eqjn,eq->eqin", block.stiffness, strain, at.area, optimize=True)
    full = strain.reshape(count, q * 8, n).swapaxes(1, 2) @ weighted.reshape(count, q * 8, n)
    off = drilling(at)
    shear = drilling_factor * block.stiffness[:, 2, 2]
    return np.asarray(full + (off * (shear[:, None] * at.area)[..., None]).swapaxes(1, 2) @ off)


def _mass(block: ShellBlock, at: ShellPoints) -> Array:
    """(e, 6 k, 6 k) ∫∫ρ (u + z a)·(u + z a) dz dA, of linear displacements along the sides."""
    element = block.element
    shapes, _ = element.shapes(element.points)
    pairs = np.einsum("eq,qi,qj->eij", at.area, shapes, shapes)
    turn = np.cross(np.eye(3), at.directors[:, :, None]).swapaxes(2, 3)  # (e, k, 3, 3) a per θ
    k = element.corners
    mass = np.zeros((len(block.nodes), k, 6, k, 6))
    m0, m1, m2 = (block.moments[:, i, None, None, None, None] for i in range(3))
    whole = pairs[:, :, None, :, None]
    mass[:, :, :3, :, :3] = m0 * whole * np.eye(3)[:, None]
    coupled = m1 * whole * turn[:, None].transpose(0, 1, 3, 2, 4)
    mass[:, :, :3, :, 3:] = coupled
    mass[:, :, 3:, :, :3] = coupled.transpose(0, 3, 4, 1, 2)
    mass[:, :, 3:, :, 3:] = m2 * whole * np.einsum("eica,ejcb->eiajb", turn, turn)
    return mass.reshape(len(block.nodes), 6 * k, 6 * k)


def lumped(mass: Array) -> Array:
    """(e, 6 k, 6 k) the same mass at the nodes, diagonal blocks in the shares of the consistent ones.

    E. Hinton, T. Rock & O. C. Zienkiewicz, Earthq. Eng. Struct. Dyn. 4 (1976) 245-249.
    """
    count, size = mass.shape[:2]
    blocks = mass.reshape(count, size // 6, 6, size // 6, 6)
    diagonal = np.einsum("eiaib->eiab", blocks)
    result = np.zeros_like(blocks)
    nodes = np.arange(size // 6)
    for part in (slice(0, 3), slice(3, 6)):
        total = np.einsum("eiaja->e", blocks[:, :, part, :, part])
        own = np.einsum("eiaa->e", diagonal[:, :, part, part])
        share = np.divide(total, own, out=np.zeros_like(total), where=own != 0)
        result[:, nodes, part, nodes, part] = (diagonal[:, :, part, part] * share[:, None, None, None]).swapaxes(0, 1)
    return result.reshape(mass.shape)
