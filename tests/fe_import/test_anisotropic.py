"""Orthotropic and anisotropic solids of decks and bulk data: closed forms, rotations, CalculiX."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from calculix import NEEDS_CALCULIX, calculix_matrices
from decks import part
from link_files import SOLID, merged, random_rotation, write_toml
from solid_meshes import box

from fe_import.description.link import load_link
from fe_import.elements.elasticity import (
    PAIRS,
    average_lame_parameters,
    checked_moduli,
    isotropic_moduli,
    lame_parameters,
    orthotropic_moduli,
    stress_of_gradient,
    turned_moduli,
)
from fe_import.elements.solid import SolidMaterial, assemble_solid
from fe_import.elements.solid_stress import solid_stress
from fe_import.errors import FEImportError
from fe_import.model import FEModel
from fe_import.models.model import build_model
from fe_import.reduce import reduce_link

YOUNGS, RATIOS, SHEAR = (1.4e11, 1e10, 8e9), (0.3, 0.25, 0.4), (5e9, 4e9, 3e9)
WOOD = orthotropic_moduli(YOUNGS, RATIOS, SHEAR)
CONSTANTS = "*ELASTIC, TYPE=ENGINEERING CONSTANTS\n1.4e11, 1e10, 8e9, .3, .25, .4, 5e9, 4e9\n3e9,"
DENSITY = "*DENSITY\n1600.,"


def tensor(moduli: np.ndarray) -> np.ndarray:
    """(3, 3, 3, 3) of (6, 6)."""
    full = np.zeros((3, 3, 3, 3))
    for row, (i, j) in enumerate(PAIRS):
        for column, (k, l) in enumerate(PAIRS):
            for a, b in {(i, j), (j, i)}:
                for c, d in {(k, l), (l, k)}:
                    full[a, b, c, d] = moduli[row, column]
    return full


def test_constants_of_a_material():
    """Compliances are the inverse constants; the same of an isotropic material as by Lamé's parameters."""
    compliance = np.linalg.inv(WOOD)
    np.testing.assert_allclose(1 / np.diag(compliance), [*YOUNGS, SHEAR[0], SHEAR[2], SHEAR[1]], rtol=1e-12)
    np.testing.assert_allclose(-compliance[[0, 0, 1], [1, 2, 2]] * [1.4e11, 1.4e11, 1e10], RATIOS, rtol=1e-12)
    same = orthotropic_moduli((7e10,) * 3, (0.33,) * 3, (7e10 / 2.66,) * 3)
    expected = isotropic_moduli(*SolidMaterial(7e10, 0.33, 1.0).lame)
    np.testing.assert_allclose(same, expected, rtol=1e-12, atol=1e-3)
    assert lame_parameters(expected) is not None
    assert lame_parameters(WOOD) is None
    np.testing.assert_allclose(average_lame_parameters(expected), SolidMaterial(7e10, 0.33, 1.0).lame, rtol=1e-12)
    turned = turned_moduli(WOOD, random_rotation(5)[None])[0]
    np.testing.assert_allclose(average_lame_parameters(turned), average_lame_parameters(WOOD), rtol=1e-12)


def test_a_turned_material():
    """The moduli turn as a tensor of fourth order; stress follows from the gradient as σ = C : ε."""
    axes = random_rotation(3)
    turned = turned_moduli(WOOD, axes[None])[0]
    expected = np.einsum("ai,bj,ck,dl,ijkl->abcd", axes, axes, axes, axes, tensor(WOOD))
    np.testing.assert_allclose(tensor(turned), expected, rtol=0, atol=1e-12 * np.abs(expected).max())
    gradient = np.random.default_rng(0).standard_normal((3, 3))
    stress = stress_of_gradient(gradient[None, None, :, :, None], turned[None])[0, 0, :, 0]
    full = np.einsum("abcd,cd->ab", expected, (gradient + gradient.T) / 2)
    np.testing.assert_allclose(stress, [full[i, j] for i, j in PAIRS], rtol=1e-12)


@pytest.mark.parametrize("kind", ["tet4", "tet10", "pyramid13", "wedge15", "hex8", "hex8i", "hex20"])
def test_constant_strain(kind):
    """A distorted mesh of an anisotropic material holds a linear field with the nodal forces of its stress alone."""
    mesh = box(kind, (2, 2, 2), distortion=0.15)
    moduli = turned_moduli(WOOD, random_rotation(1)[None])[0]
    material = SolidMaterial(1.0, 0.0, 1.0, own_moduli=moduli)
    _, stiffness = assemble_solid(mesh, [material])
    gradient = np.random.default_rng(2).standard_normal((3, 3))
    field = (mesh.nodes @ gradient).ravel()
    force = (stiffness @ field).reshape(-1, 3)
    inner = ((mesh.nodes > 1e-9) & (mesh.nodes < 1 - 1e-9)).all(axis=1)
    assert np.abs(force[inner]).max() < 1e-11 * np.abs(force).max()
    full = np.einsum("abcd,cd->ab", tensor(moduli), (gradient + gradient.T) / 2)
    assert field @ stiffness @ field == pytest.approx(np.einsum("ab,ab->", full, gradient), rel=1e-11)
    rows = np.arange(len(field)).reshape(-1, 3)
    dof_map = np.hstack([rows, np.full_like(rows, -1)])
    source = solid_stress(mesh, [material])
    stress = source.evaluate(field[:, None], dof_map, np.arange(len(mesh.nodes)))[:, :, 0]
    np.testing.assert_allclose(stress, np.tile([full[i, j] for i, j in PAIRS], (len(stress), 1)), rtol=1e-9)
    error, energy = source.energy_of_error(field[:, None], dof_map)
    assert error[0] < 1e-20 * energy[0]
    assert 2 * energy[0] == pytest.approx(field @ stiffness @ field, rel=1e-11)


def link(folder: Path, kind: str, *lines: str, shift: tuple[float, float, float] = (0, 0, 0), **solid: Any) -> FEModel:
    """A box of a deck with further lines, as a link of the deck's own materials."""
    return build_model(load_link(description(folder, kind, *lines, shift=shift, **solid)))


def deck(kind: str, *lines: str, shift: tuple[float, float, float] = (0, 0, 0)) -> list[str]:
    given = part(box(kind, (2, 1, 2), (0.2, 0.03, 0.02)), shift, 1, "A")[:-1]
    return [*given, "*MATERIAL, NAME=M", *"\n".join(lines).splitlines()]


def description(folder: Path, kind: str, *lines: str, shift: Any = (0, 0, 0), **solid: Any) -> Path:
    (folder / "two.inp").write_text("\n".join(deck(kind, *lines, shift=shift)) + "\n")
    hub = {"name": "hub", "face": "A-x0"}
    table = {"solid": {"mesh": "two.inp", "material": "", **solid}, "interfaces": [hub]}
    return write_toml(folder / "link.toml", merged(SOLID, table))


SECTION = "*SOLID SECTION, ELSET=A, MATERIAL=M"
ORIENTED = SECTION + ", ORIENTATION=O"
RECTANGULAR = "*ORIENTATION, NAME=O\n1., 2., .5, -1., 1., 0.\n3, 30."
CYLINDRICAL = "*ORIENTATION, NAME=O, SYSTEM=CYLINDRICAL\n.1, -1., 0., .1, -1., 1."
CASES = {
    "along the axes": ("hex20", (CONSTANTS, DENSITY, SECTION)),
    "turned": ("hex20", (CONSTANTS, DENSITY, RECTANGULAR, ORIENTED)),
    "tetrahedra": ("tet10", (CONSTANTS, DENSITY, RECTANGULAR, ORIENTED)),
    "stiffnesses": (
        "hex8",
        ("*ELASTIC, TYPE=ORTHO\n2e11,5e10,9e10,4e10,3e10,8e10,5e9,4e9\n3e9,", DENSITY, RECTANGULAR, ORIENTED),
    ),
    "all stiffnesses": (
        "hex8",
        (
            "*ELASTIC, TYPE=ANISO\n2e11,5e10,9e10,4e10,3e10,8e10,1e9,2e9\n1.5e9,9e9,-1e9,1.2e9,7e8,5e8,8e9,3e8\n"
            "-4e8,6e8,7e8,2e8,7e9",
            DENSITY,
            SECTION,
        ),
    ),
}


@NEEDS_CALCULIX
@pytest.mark.parametrize("name", CASES)
def test_stiffness_as_calculix_has_it(tmp_path, name):
    """Matrices of the same deck, to the 14 digits that CalculiX writes."""
    kind, lines = CASES[name]
    model = link(tmp_path, kind, *lines, hex8="compatible")
    rows, stiffness, _ = calculix_matrices(tmp_path, deck(kind, *lines))
    place = 3 * (rows[:, 0] - 1) + rows[:, 1] - 1
    found = model.stiffness.toarray()[np.ix_(place, place)]
    np.testing.assert_allclose(found, stiffness, rtol=0, atol=1e-12 * np.abs(stiffness).max())


def test_a_cylindrical_orientation(tmp_path):
    """Each element has the axes of its centre: radial, around, along; turned about the last, they exchange."""
    model = link(tmp_path, "hex8", CONSTANTS, DENSITY, CYLINDRICAL, ORIENTED)
    source = model.stress
    mesh = source.mesh
    centres = mesh.centres(np.arange(mesh.count))
    for k, centre in enumerate(centres):
        outward = centre - [0.1, -1, centre[2]]
        outward /= np.linalg.norm(outward)
        axes = np.stack([outward, np.cross([0, 0, 1], outward), [0, 0, 1]], axis=1)
        expected = np.einsum("ai,bj,ck,dl,ijkl->abcd", axes, axes, axes, axes, tensor(WOOD))
        found = tensor(source.moduli_of(np.array([k]))[0])
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * np.abs(expected).max())
    turned = link(tmp_path, "hex8", CONSTANTS, DENSITY, CYLINDRICAL + "\n3, 90.", ORIENTED)
    around = orthotropic_moduli((1e10, 1.4e11, 8e9), (0.3 * 1e10 / 1.4e11, 0.4, 0.25), (5e9, 3e9, 4e9))
    same = CONSTANTS.split("\n")[0] + f"\n1e10, 1.4e11, 8e9, {0.3 * 1e10 / 1.4e11!r}, .4, .25, 5e9, 3e9\n4e9,"
    expected = link(tmp_path, "hex8", same, DENSITY, CYLINDRICAL, ORIENTED).stiffness
    assert abs(turned.stiffness - expected).max() < 1e-12 * abs(expected).max()
    assert np.linalg.eigvalsh(around)[0] > 0


def test_the_whole_reduction(tmp_path):
    """Sound, with stress and the second-order field."""
    lines = (CONSTANTS, DENSITY, RECTANGULAR, ORIENTED)
    path = description(tmp_path, "hex20", *lines, mesh_error=10.0)
    table = path.read_text() + "recovery = { all = true }\nreduction = { fixed_interface_modes = 6 }\n"
    path.write_text(table)
    modal = reduce_link(path)
    assert all(check.ok for check in modal.health)
    assert modal.second_order is not None
    assert modal.recovery is not None
    assert "left out" not in modal.provenance


FAULTS = {
    "unknown": ((CONSTANTS, DENSITY, ORIENTED), "orientation O is not there"),
    "spherical": ((CONSTANTS, DENSITY, CYLINDRICAL.replace("CYLINDRICAL", "SPHERICAL"), ORIENTED), "neither"),
    "one line": ((CONSTANTS, DENSITY, "*ORIENTATION, NAME=O\n1.,0.,0.,2.,0.,0.", ORIENTED), "that are parallel"),
    "few": ((CONSTANTS.replace("3e9,", ""), DENSITY, SECTION), "another number of constants"),
    "not definite": ((CONSTANTS.replace(".4", "1.4"), DENSITY, SECTION), "not positive definite"),
    "negative": ((CONSTANTS.replace("5e9", "-5e9"), DENSITY, SECTION), "moduli must be positive"),
    "nodes": ((CONSTANTS, DENSITY, RECTANGULAR.replace("=O", "=O, DEFINITION=NODES"), ORIENTED), "not given"),
    "axis": ((CONSTANTS, DENSITY, RECTANGULAR.replace("3, 30.", "4, 30."), ORIENTED), "axis 1, 2 or 3"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_what_cannot_be_used(tmp_path, name):
    lines, words = FAULTS[name]
    with pytest.raises(FEImportError) as caught:
        link(tmp_path, "hex8", *lines)
    assert words in str(caught.value)


def test_moduli_that_no_material_has():
    with pytest.raises(ValueError, match="finite"):
        checked_moduli(np.full((6, 6), np.nan))
