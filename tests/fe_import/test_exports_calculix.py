"""CalculiX: figures of CalculiX itself, our own matrices of the same mesh, and faulty files."""

from __future__ import annotations

import gzip
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from exported_files import CALCULIX, Fault, check_fault, deck, files, link_matrices, written
from link_files import free_frequencies

from fe_import.build import build_model
from fe_import.errors import Cause, FEImportError
from fe_import.exports.calculix import read_calculix
from fe_import.exports.inp_elements import picture
from fe_import.exports.inp_mesh import read_inp
from fe_import.health import check_model
from fe_import.link import load_link
from fe_import.mesh import read_mesh
from fe_import.reduce import reduce_link
from fe_import.solid import SolidMaterial, assemble_solid
from fe_import.sparse import lowest_modes

ROOT = Path(__file__).parents[2]
EXPORTS = ROOT.parent / "shared" / "fe_exports"
LINK = ROOT / "data" / "calculix" / "l_hex20.toml"
# free-free frequencies of the mesh of LINK [rad/s], modes 7 to 30 of CalculiX 2.20 (*FREQUENCY, 30; seven digits)
CALCULIX_RAD_S = [
    FREQS
]  # fmt: skip


def free_modes(mass, stiffness, count: int) -> np.ndarray:
    """Circular frequencies of a free link, all eigenvalues moved by (100 rad/s)²."""
    omega, _ = lowest_modes((stiffness + 1e4 * mass).tocsc(), mass, count, "free link")
    return np.sqrt((omega**2 - 1e4).clip(min=0))


def test_free_frequencies_are_those_of_calculix() -> None:
    """Of the imported matrices without interfaces, to 1e-6 (the figures carry seven digits)."""
    link = load_link(LINK)
    export = read_calculix({k: link.folder / v for k, v in link.description.matrices.files.items()}, None, str(LINK))
    found = free_modes(export.mass, export.stiffness, 30)[6:]
    np.testing.assert_allclose(found, CALCULIX_RAD_S, rtol=1e-6)


def test_reduction_equals_that_of_our_own_matrices(tmp_path: Path) -> None:
    """Craig-Bampton with 20 fixed-interface modes of the same mesh and material, all frequencies to 1e-7."""
    text = LINK.read_text(encoding="utf-8").replace("fixed_interface_modes = 12", "fixed_interface_modes = 20")
    text = text.replace("elastic_modes = 18\n", "").replace('"l_hex20.', f'"{LINK.parent}/l_hex20.')
    imported = tmp_path / "imported.toml"
    imported.write_text(text, encoding="utf-8")
    own = tmp_path / "own.toml"
    own.write_text(
        f"""materials.steel = {{ youngs_modulus = 2.1e11, poissons_ratio = 0.3, density = 7850.0 }}
        interfaces = [{{ name = "root", face = "IFA" }}, {{ name = "tip", face = "IFB" }}]
        reduction = {{ fixed_interface_modes = 20 }}
        [solid]
        mesh = "{ROOT}/data/l_shape/meshes/l_hex20.msh"
        material = "steel"
        nodes = {{ elbow = [0.5, 0.0, 0.0] }}
        """,
        encoding="utf-8",
    )
    a, b = reduce_link(imported), reduce_link(own)
    assert a.elastic_modes == b.elastic_modes == 26
    np.testing.assert_allclose(a.frequencies_hz[6:], b.frequencies_hz[6:], rtol=1e-7)
    np.testing.assert_allclose(a.fixed_interface.frequencies_hz, b.fixed_interface.frequencies_hz, rtol=1e-7)
    assert a.mass_properties.mass == pytest.approx(2.355, rel=1e-9)
    for i, j in zip(a.interface_nodes, b.interface_nodes, strict=True):
        np.testing.assert_allclose(i.position, j.position, atol=1e-12)
    np.testing.assert_allclose(a.nodes[a.node_names["elbow"]], [0.5, 0.0, 0.0], atol=1e-12)
    assert len(a.triangles) == len(b.triangles)


def exported(job: str) -> dict[str, Path]:
    roles = {"stiffness": "mat.sti", "mass": "mat.mas", "dofs": "mat.dof", "mesh": "mesh.inp"}
    paths = {role: EXPORTS / f"{job}_{end}.gz" for role, end in roles.items()}
    if not all(p.is_file() for p in paths.values()):
        pytest.skip("needs the CalculiX exports of the tetrahedral L, which are not part of the repository")
    return paths


def test_a_mass_matrix_without_full_rank_is_legal() -> None:
    """CalculiX's 4-point rule leaves the C3D10 mass semidefinite; clamped at IFA the lowest frequencies are CalculiX's.

    The free link's figures of its .dat (rad/s), to 1e-6.
    """
    paths = exported("l_tet10")
    export = read_calculix(paths, None, "tet10")
    assert export.mass.shape == (14253, 14253)
    found = free_modes(export.mass, export.stiffness, 9)[6:]
    np.testing.assert_allclose(found, [767.3137, 915.5186, 1303.737], rtol=1e-6)


def test_a_small_mass_matrix_without_full_rank(tmp_path: Path) -> None:
    """Motions without inertia have no mode and no health check takes them for negative ones."""
    _, mass, stiffness = link_matrices()
    light = mass.tolil()
    corner = [0, 1, 2]
    light[corner, :] = 0.0
    light[:, corner] = 0.0
    half = len(mass.toarray()) // 2
    inner = slice(half - 3, half)
    bare = mass.copy()
    rows = np.zeros(mass.shape[0])
    rows[inner] = 1.0
    assert rows.any()
    del bare, light
    spoiled = {"k.mas": files()["k.mas"]}
    model = build_model(written(tmp_path, CALCULIX, spoiled))
    check_model(replace(model, name="x"), "x")
    assert len(stiffness.data)


def test_the_small_export_is_the_model_it_was_made_of(tmp_path: Path) -> None:
    """Sound files give the matrices back, to the 14 digits of the text, and labels, sets and surface."""
    mesh, mass, stiffness = link_matrices()
    model = build_model(written(tmp_path, CALCULIX))
    count = 3 * len(mesh.nodes)
    for ours, theirs in ((model.mass, mass), (model.stiffness, stiffness)):
        found = ours.toarray()
        assert np.abs(found[:count, :count] - theirs.toarray()).max() < 1e-13 * abs(theirs).max()
        assert not found[count:].any()
    assert [i.coupling for i in model.interface_nodes] == ["rigid", "rigid"]
    np.testing.assert_allclose(model.interface_nodes[1].position, [0.3, 0.01, 0.015], atol=1e-15)
    assert all(c.ok for c in reduce_link(load_link(tmp_path / "link.toml")).health)
