"""Points of integration of CalculiX's elements, which has fewer for wedges and for the mass of tetrahedra.

With them our shape functions give its matrices to their digits; ours are exact for straight elements.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from fe_import.elements.elasticity import isotropic_moduli
from fe_import.elements.reference_cells import Cell
from fe_import.elements.solid import SolidMaterial
from fe_import.elements.solid_assembly import element_masses, element_stiffnesses
from fe_import.elements.solid_elements import SOLID_ELEMENTS, SolidElement
from fe_import.elements.solid_mesh import SolidMesh
from fe_import.model import Array

Rule = tuple[tuple[float, ...], ...]  # x, y, z, weight of each point


@dataclass(frozen=True)
class Points(Cell):
    """A cell with the points of another program."""

    rule: Rule = ()

    def quadrature(self, order: int) -> tuple[Array, Array]:
        x, y, z, w = np.array(self.rule).T
        return np.stack([x, y, z]), w


def wedge_rule(corners: list[tuple[float, float]], heights: int) -> Rule:
    z, w = np.polynomial.legendre.leggauss(heights)
    share = 0.5 / len(corners)
    return tuple((x, y, (c + 1) / 2, v / 2 * share) for c, v in zip(z, w, strict=True) for x, y in corners)


NEAR, FAR = 0.5 - 0.5 / 3**0.5, 0.5 + 0.5 / 3**0.5
EIGHT = tuple((x, y, z, 0.125) for x in (NEAR, FAR) for y in (NEAR, FAR) for z in (NEAR, FAR))
ALONE, OTHERS = (5 + 3 * 5**0.5) / 20, (5 - 5**0.5) / 20
FOUR = tuple((*(ALONE if i == k else OTHERS for k in range(3)), 1 / 24) for i in range(4))
RULES: dict[str, tuple[Rule | None, Rule | None]] = {  # of the stiffness, of the mass; None: ours
    "tet4": (None, ((0.25, 0.25, 0.25, 1 / 6),)),
    "tet10": (FOUR, FOUR),
    "hex8": (EIGHT, EIGHT),
    "hex20": (None, None),
    "wedge6": (wedge_rule([(1 / 3, 1 / 3)], 2),) * 2,
    "wedge15": (wedge_rule([(1 / 6, 1 / 6), (2 / 3, 1 / 6), (1 / 6, 2 / 3)], 3),) * 2,
}


def element_matrices(name: str, corners: Array, material: SolidMaterial) -> tuple[Array, Array]:
    """Stiffness and mass (m, 3k, 3k) of elements with nodes at (m, k, 3), by the points of CalculiX."""
    stiff, heavy = (_with(SOLID_ELEMENTS[name], rule) for rule in RULES[name])
    masses = np.kron(element_masses(heavy, corners, material.density), np.eye(3))
    return element_stiffnesses(stiff, corners, isotropic_moduli(*material.lame)), masses


def _with(element: SolidElement, rule: Rule | None) -> SolidElement:
    if rule is None:
        return element
    fields = {name: getattr(element.cell, name) for name in Cell.__dataclass_fields__}
    return replace(element, cell=Points(**fields, rule=rule))


def assembled(mesh: SolidMesh, material: SolidMaterial) -> tuple[sp.csc_array, sp.csc_array]:
    """Stiffness and mass of a mesh, by the points of CalculiX."""
    size = 3 * len(mesh.nodes)
    sums = [sp.csc_array((size, size)), sp.csc_array((size, size))]
    for block in mesh.blocks:
        rows = (3 * block.elements[:, :, None] + np.arange(3)).reshape(len(block), -1)
        whole = (*rows.shape, rows.shape[1])
        places = [np.broadcast_to(part, whole).ravel() for part in (rows[:, :, None], rows[:, None])]
        for k, found in enumerate(element_matrices(block.type, mesh.nodes[block.elements], material)):
            sums[k] += sp.coo_array((found.ravel(), places), shape=(size, size)).tocsc()
    return sums[0], sums[1]
