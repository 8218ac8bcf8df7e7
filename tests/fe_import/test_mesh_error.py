"""Incompatible modes, raised order, and the estimated error of a mesh, against fine meshes and closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scipy.linalg as la
from link_files import solid_link, write_box
from solid_meshes import box, mixed_box

from fe_import.elements.solid import SolidMaterial, assemble_solid
from fe_import.elements.solid_assembly import _with_modes, slopes
from fe_import.elements.solid_mesh import SolidMesh, surface_triangles
from fe_import.elements.solid_orders import raised, with_incompatible_modes
from fe_import.elements.solid_stress import solid_stress
from fe_import.errors import Cause, FEImportError
from fe_import.health.mesh_error import check_mesh_error, frequency_errors
from fe_import.mesh.checks import check_mesh
from fe_import.modal.model import ModalModel
from fe_import.models.model import build_model
from fe_import.reduce import reduce_link

STEEL = SolidMaterial(2.1e11, 0.3, 7850.0)
SIZES = {
    "bar": ((10, 1, 1), (1.0, 0.1, 0.1)),
    "strip": ((12, 1, 1), (1.0, 0.03, 0.01)),
    "block": ((3, 3, 3), (1.0, 0.8, 0.9)),
}


def free_modes(mesh: SolidMesh) -> tuple[np.ndarray, np.ndarray]:
    """Angular frequencies and shapes of the free solid, dense, nine of them."""
    mass, stiffness = assemble_solid(mesh, [STEEL])
    squares, shapes = la.eigh(stiffness.toarray(), mass.toarray(), subset_by_index=[0, 8])
    return np.sqrt(np.abs(squares)), shapes


@pytest.fixture(scope="module")
def fine() -> dict[str, float]:
    """First elastic frequency of each body by hex27 elements, within 0.5 % of converged ones."""
    return {name: free_modes(box("hex27", n, size))[0][6] for name, (n, size) in SIZES.items()}


@pytest.mark.parametrize("body", SIZES)
@pytest.mark.parametrize("name", ["tet4", "wedge6", "pyramid5", "hex8", "hex8i", "tet10"])
def test_estimate_of_the_error(fine, body, name):
    """0.4 to 2.2 times the true error of the first frequency where that is 1 to 100 %; small and large elsewhere."""
    mesh = box(name, *SIZES[body])
    omega, shapes = free_modes(mesh)
    true = omega[6] / fine[body] - 1
    source = solid_stress(mesh, [STEEL])
    dof_map = np.arange(len(shapes)).reshape(-1, 3)
    error, energy = source.energy_of_error(shapes[:, 6:7], dof_map)
    estimate = frequency_errors(error, energy).item()
    if true > 0.01:
        assert 0.4 * min(true, 1.0) < estimate < 2.2 * true
    else:
        assert estimate < 0.01
    if name in ("tet4", "wedge6", "pyramid5") and body != "block":
        assert true > 0.05


def test_pure_bending_of_hexahedra():
    """A bar of rectangular elements, bent: the energy ½ M κ L of beam theory at ν = 0.3, to rounding.

    u = κ x z, w = -κ (x² + ν (y² … z²)) / 2 ... is quadratic, so the compatible element misses it by a third and more.
    """
    mesh = box("hex8", (4, 1, 1), (1.0, 0.1, 0.05))
    x, y, z = (mesh.nodes - [0.0, 0.05, 0.025]).T
    curvature, nu = 1e-3, STEEL.poissons_ratio
    exact = curvature * np.stack([x * z, -nu * y * z, -(x**2 + nu * (z**2 - y**2)) / 2], axis=1)
    moment = STEEL.youngs_modulus * 0.1 * 0.05**3 / 12 * curvature
    energies = [
        exact.ravel() @ assemble_solid(m, [STEEL])[1] @ exact.ravel() / 2 for m in (mesh, with_incompatible_modes(mesh))
    ]
    assert energies[1] == pytest.approx(moment * curvature / 2, rel=1e-10)
    assert energies[0] > 2 * energies[1]
    source = solid_stress(with_incompatible_modes(mesh), [STEEL])
    dof_map = np.arange(exact.size).reshape(-1, 3)
    stress = source.evaluate(exact.reshape(-1, 1), dof_map, np.arange(len(x)))[:, :, 0]
    expected = np.zeros_like(stress)
    expected[:, 0] = STEEL.youngs_modulus * curvature * z
    np.testing.assert_allclose(stress, expected, atol=1e-9 * expected.max())


# eigenvalues [1/s²] that CalculiX prints for its verification example dloadlinIf: a cantilever plate of 15 elements
# C3D8I, 300 x 30 x 1 mm, in N, mm, t
CALCULIX = [3627.918, 143128.7, 1159478.0, 2448617.0, 3035468.0, 4603063.0, 13038730.0, 30381100.0, 36620630.0]


def test_incompatible_modes_against_calculix():
    """To half of its last digit, 5e-7, when the incompatible modes have inertia, as there; statics are the same.

    Rounding of its matrices adds the machine's precision times the largest eigenvalue, 3e-5 of the first one. Without
    that inertia, as here, the first frequency is the same within 1e-4.
    """
    mesh = with_incompatible_modes(box("hex8", (15, 1, 1), (300.0, 30.0, 1.0)))
    steel = SolidMaterial(209000.0, 0.3, 7.85e-9)
    element, corners = mesh.only.element, mesh.nodes[mesh.only.elements]
    points, weights = element.quadrature(3)
    full = _with_modes(element, corners, steel.moduli)
    values = np.vstack([element.shape_values(points), 1 - (2 * points - 1) ** 2])
    volume = slopes(element, corners, points)[1] * weights
    size = 3 * len(mesh.nodes)
    stiffness, mass = np.zeros((2, size + 9 * mesh.count, size + 9 * mesh.count))
    for k, nodes in enumerate(mesh.only.elements):
        rows = np.concatenate([(3 * nodes[:, None] + np.arange(3)).ravel(), size + 9 * k + np.arange(9)])
        stiffness[np.ix_(rows, rows)] += full[k]
        mass[np.ix_(rows, rows)] += np.kron(steel.density * (values * volume[k]) @ values.T, np.eye(3))
    held = (3 * mesh.node_sets["x0"][:, None] + np.arange(3)).ravel()
    free = np.setdiff1d(np.arange(len(mass)), held)
    inverse = la.eigh(mass[np.ix_(free, free)], stiffness[np.ix_(free, free)], eigvals_only=True)
    found = 1 / inverse[::-1][:9]
    own_mass, own_stiffness = (m.toarray() for m in assemble_solid(mesh, [steel]))
    free = np.setdiff1d(np.arange(size), held)
    own = la.eigh(own_stiffness[np.ix_(free, free)], own_mass[np.ix_(free, free)], eigvals_only=True)
    assert own[0] == pytest.approx(CALCULIX[0], rel=2e-4)
    tolerance = 5e-7 * found + np.finfo(float).eps * own[-1]
    assert (np.abs(found - CALCULIX) < tolerance).all()


def test_raised_order():
    """Every shape: a sound mesh of second order with the same volume and sets with the nodes on their faces."""
    mesh = mixed_box()
    found, expected = raised(mesh), mixed_box(quadratic=True)
    check_mesh(found)
    assert [b.type for b in found.blocks] == [b.type for b in expected.blocks]
    for ours, theirs in zip(found.blocks, expected.blocks, strict=True):
        np.testing.assert_allclose(found.nodes[ours.elements], expected.nodes[theirs.elements], atol=1e-14)
    for name in ("x0", "x1"):
        ours, theirs = (np.sort(m.nodes[m.node_sets[name]] @ [1, 10, 100]) for m in (found, expected))
        np.testing.assert_allclose(ours, theirs, atol=1e-12)
    assert raised(found) is found
    assert len(surface_triangles(found)) > len(surface_triangles(mesh))


def test_linear_elements_are_refused(tmp_path):
    """A link of compatible hexahedra, one element thick: refused with the remedies, which work."""

    def reduced(**solid: Any) -> ModalModel:
        link = solid_link(tmp_path, solid=solid)
        write_box(tmp_path / "box.inp", kind="hex8", along=8)
        return reduce_link(link)

    with pytest.raises(FEImportError, match="hex8 elements are too stiff") as caught:
        reduced(hex8="compatible", mesh_error=0.05)
    assert caught.value.cause is Cause.MESH
    assert caught.value.where.endswith("solid.mesh_error")
    locked, modes, quadratic = (reduced(**s) for s in ({"hex8": "compatible"}, {}, {"raise_order": True}))
    first = [m.frequencies_hz[6] for m in (locked, modes, quadratic)]
    assert first[0] > 1.2 * first[1]
    assert first[1] == pytest.approx(first[2], rel=0.03)
    check = next(c for c in quadratic.health if c.name.startswith("error of the first frequencies"))
    assert check.value < 0.02


def test_without_elastic_modes(tmp_path):
    model = build_model(solid_link(tmp_path))
    assert check_mesh_error(model, [model.stress], np.zeros((3, 6)), np.zeros(6), 0.05, "link.toml") == ()
