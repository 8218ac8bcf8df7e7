"""Element matrices beside those of CalculiX, which integrates wedges and the mass of tetrahedra with fewer points.

With its points (C3D6: two, C3D15: three by three, C3D10: four) our shape functions give its matrices to their digits;
ours are exact for straight elements.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from calculix import NEEDS_CALCULIX, calculix_matrices
from calculix_points import RULES, element_matrices
from decks import part
from solid_meshes import box

from fe_import.elements.solid import SolidMaterial

ALU = SolidMaterial(7e10, 0.33, 2700.0)
LINES = ["*MATERIAL, NAME=M", "*ELASTIC", "7e10, .33", "*DENSITY", "2700.,"]


@NEEDS_CALCULIX
@pytest.mark.parametrize("name", RULES)
def test_matrices(tmp_path: Path, name: str) -> None:
    mesh = box(name, (2, 1, 1), (0.2, 0.03, 0.02))
    lines = [*part(mesh, (0, 0, 0), 1, "A"), *LINES]
    rows, *judged = calculix_matrices(tmp_path, lines)
    place = 3 * (rows[:, 0] - 1) + rows[:, 1] - 1
    nodes = mesh.only.elements
    dofs = (3 * nodes[:, :, None] + np.arange(3)).reshape(len(nodes), -1)
    for blocks, judge in zip(element_matrices(name, mesh.nodes[nodes], ALU), judged, strict=True):
        full = np.zeros((3 * len(mesh.nodes),) * 2)
        for own, block in zip(dofs, blocks, strict=True):
            full[np.ix_(own, own)] += block
        found = full[np.ix_(place, place)]
        np.testing.assert_allclose(found, judge, rtol=0, atol=1e-11 * np.abs(judge).max())
