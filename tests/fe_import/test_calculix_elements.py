"""Element matrices beside those of CalculiX, which integrates wedges and the mass of tetrahedra with fewer points.

With its points (C3D6: two, C3D15: three by three, C3D10: four) our shape functions give its matrices to their digits;
ours are exact for straight elements.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from calculix import NEEDS_CALCULIX, calculix_matrices
from decks import part
from solid_meshes import box

from fe_import.elements.elasticity import isotropic_moduli
from fe_import.elements.reference_cells import Cell
from fe_import.elements.solid import SolidMaterial
from fe_import.elements.solid_assembly import element_masses, element_stiffnesses
from fe_import.elements.solid_elements import SOLID_ELEMENTS
from fe_import.model import Array

ALU = SolidMaterial(7e10, 0.33, 2700.0)
LINES = ["*MATERIAL, NAME=M", "*ELASTIC", "7e10, .33", "*DENSITY", "2700.,"]


@dataclass(frozen=True)
class Points(Cell):
    """A cell with the points of another program."""

    rule: tuple[tuple[float, ...], ...] = ()  # x, y, z, weight

    def quadrature(self, order: int) -> tuple[Array, Array]:
        x, y, z, w = np.array(self.rule).T
        return np.stack([x, y, z]), w


def wedge_rule(corners: list[tuple[float, float]], heights: int) -> tuple[tuple[float, ...], ...]:
    z, w = np.polynomial.legendre.leggauss(heights)
    share = 0.5 / len(corners)
    return tuple((x, y, (c + 1) / 2, v / 2 * share) for c, v in zip(z, w, strict=True) for x, y in corners)


FAR, NEAR = (5 + 3 * 5**0.5) / 20, (5 - 5**0.5) / 20
FOUR = tuple((*(FAR if i == k else NEAR for k in range(3)), 1 / 24) for i in range(4))
RULES = {  # points of the stiffness, of the mass; None: ours
    "tet4": (None, ((0.25, 0.25, 0.25, 1 / 6),)),
    "tet10": (None, FOUR),
    "hex8": (None, None),
    "hex20": (None, None),
    "wedge6": (wedge_rule([(1 / 3, 1 / 3)], 2),) * 2,
    "wedge15": (wedge_rule([(1 / 6, 1 / 6), (2 / 3, 1 / 6), (1 / 6, 2 / 3)], 3),) * 2,
}


@NEEDS_CALCULIX
@pytest.mark.parametrize("name", RULES)
def test_matrices(tmp_path: Path, name: str) -> None:
    mesh = box(name, (2, 1, 1), (0.2, 0.03, 0.02))
    lines = [*part(mesh, (0, 0, 0), 1, "A"), *LINES]
    rows, *judged = calculix_matrices(tmp_path, lines)
    place = 3 * (rows[:, 0] - 1) + rows[:, 1] - 1
    nodes = mesh.only.elements
    dofs = (3 * nodes[:, :, None] + np.arange(3)).reshape(len(nodes), -1)
    for kind, (rule, judge) in enumerate(zip(RULES[name], judged, strict=True)):
        element = SOLID_ELEMENTS[name]
        if rule is not None:
            old = element.cell
            cell = Points(**{f: getattr(old, f) for f in Cell.__dataclass_fields__}, rule=rule)
            element = replace(element, cell=cell)
        corners = mesh.nodes[nodes]
        if kind == 0:
            blocks = element_stiffnesses(element, corners, isotropic_moduli(*ALU.lame))
        else:
            blocks = np.kron(element_masses(element, corners, ALU.density), np.eye(3))
        full = np.zeros((3 * len(mesh.nodes),) * 2)
        for own, block in zip(dofs, blocks, strict=True):
            full[np.ix_(own, own)] += block
        found = full[np.ix_(place, place)]
        np.testing.assert_allclose(found, judge, rtol=0, atol=1e-11 * np.abs(judge).max())
