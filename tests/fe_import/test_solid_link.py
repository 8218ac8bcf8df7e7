"""The L-shaped link's mesh: another code's matrices, and the mass of the drawing."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp

from fe_import.elements.solid import SolidMaterial, assemble_solid
from fe_import.mesh.read import read_mesh

ROOT = Path(__file__).parents[2]
STEEL = SolidMaterial(2.1e11, 0.3, 7850.0)


def exported(path: Path, row: np.ndarray) -> sp.csc_array:
    """Upper triangle in text -> symmetric matrix in our numbering."""
    i, j, value = np.loadtxt(path).T
    i, j = row[i.astype(int) - 1], row[j.astype(int) - 1]
    below = i != j
    coordinates = (np.concatenate([i, j[below]]), np.concatenate([j, i[below]]))
    return sp.csc_array((np.concatenate([value, value[below]]), coordinates), shape=(len(row), len(row)))


def test_same_matrices_as_calculix():
    """K and M of the L mesh against CalculiX 2.20's export, to 1e-11 relative (4e-12 seen)."""
    exports = ROOT.parent / "shared" / "fe_exports"
    if not exports.is_dir():
        pytest.skip("needs the CalculiX exports of the L mesh, which are not part of the repository")
    mesh = read_mesh(ROOT / "data" / "l_shape" / "meshes" / "l_hex20.msh")
    mass, stiffness = assemble_solid(mesh, [STEEL])
    with gzip.open(exports / "l_hex20_mat.dof.gz", "rt") as lines:
        dofs = np.array([line.strip().split(".") for line in lines], dtype=int)
    row = 3 * (dofs[:, 0] - 1) + dofs[:, 1] - 1
    for ours, suffix in ((stiffness, "sti"), (mass, "mas")):
        theirs = exported(exports / f"l_hex20_mat.{suffix}.gz", row)
        assert sp.linalg.norm(ours - theirs) < 1e-11 * sp.linalg.norm(theirs)
        assert abs(ours - theirs).max() < 1e-11 * abs(theirs).max()


def test_mesh_of_the_link_weighs_what_it_should():
    """Mass of the L from its drawing, 7850 · 0.01 · 0.03 · 1.0 = 2.355 kg, to 1e-9 (digits of the file)."""
    mesh = read_mesh(ROOT / "data" / "l_shape" / "meshes" / "l_hex20.msh")
    mass, _ = assemble_solid(mesh, [STEEL])
    x = np.tile([1.0, 0.0, 0.0], len(mesh.nodes))
    assert x @ mass @ x == pytest.approx(2.355, rel=1e-9)
