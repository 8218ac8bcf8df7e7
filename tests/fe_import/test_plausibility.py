"""Slipped units: each common slip is named, by a failed check or a refusal; links as they are built pass."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from link_files import frame_link, solid_link, write_box

from fe_import.description.link import load_link
from fe_import.description.records import Material
from fe_import.errors import Cause, FEImportError
from fe_import.health.plausibility import plausible_link, plausible_materials
from fe_import.mesh.read import read_mesh
from fe_import.modal.model import HealthCheck
from fe_import.reduce import reduce_link

L_SHAPE = Path(__file__).parents[2] / "data" / "l_shape"
NODES = read_mesh(L_SHAPE / "meshes" / "l_hex20.msh").nodes
MASS, FIRST = 2.34, 82.9  # kg, Hz: of data/l_shape/links/solid.toml


def failed(checks: tuple[HealthCheck, ...]) -> list[str]:
    return [c.name for c in checks if c.name.startswith("units: ") and not c.ok]


def exported(mass: float = 1.0, stiffness: float = 1.0, length: float = 1.0) -> tuple[HealthCheck, ...]:
    """The L as exported matrices, its figures wrong by factors."""
    return plausible_link(NODES * length, MASS * mass, FIRST * math.sqrt(stiffness / mass), True, "l.toml")


SUSPICIOUS = {  # wrong by, what is found
    "mass in g": ({"mass": 1e3}, "a tenth of its length thick", 'units.mass = "g"'),
    "mass in t": ({"mass": 1e-3}, "box around it", 'units.mass = "t"'),
    "stiffness by 1e9": ({"stiffness": 1e9}, "first frequency times size", "units"),
    "stiffness by 1e-12": ({"stiffness": 1e-12}, "first elastic frequency", "units"),
}
IMPOSSIBLE = {  # wrong by, words of the message
    "mesh in mm": ({"length": 1e3}, 'units.length = "mm"'),
    "mesh in m, units in mm": ({"length": 1e-3}, 'units.length = "m"'),
    "mass by 1e-12": ({"mass": 1e-12}, 'units.mass = "t"'),
    "mass by 1e12": ({"mass": 1e12}, "mass of the link"),
    "stiffness by 1e12": ({"stiffness": 1e12}, "check units"),
    "length by 1e9": ({"length": 1e9}, "size of the link"),
    "no mass": ({"mass": 1e-300}, "mass of the link"),
}


@pytest.mark.parametrize("slip", SUSPICIOUS)
def test_slips_of_exported_matrices(slip):
    factors, *words = SUSPICIOUS[slip]
    found = failed(exported(**factors))
    assert any(all(w in name for w in words) for name in found), found


@pytest.mark.parametrize("slip", IMPOSSIBLE)
def test_impossible_matrices(slip):
    factors, words = IMPOSSIBLE[slip]
    with pytest.raises(FEImportError, match="a unit slipped") as caught:
        exported(**factors)
    assert words in str(caught.value)
    assert caught.value.cause is Cause.BAD_FIELD
    assert caught.value.where == "l.toml: units"
    assert caught.value.remedy


def test_the_link_itself_is_plausible():
    assert failed(exported()) == []
    assert all(math.isfinite(c.value) for c in exported())


def test_beams_on_a_line_have_no_volume():
    """A steel rod of 1 m as exported beam matrices; its box is flat, and nothing is said about its density."""
    rod = np.column_stack([np.linspace(0, 1, 5), np.zeros((5, 2))])
    checks = plausible_link(rod, 0.7, 40.0, True, "rod.toml")
    assert failed(checks) == []
    assert not any("box around it against 1" in c.name for c in checks)


STEEL, RUBBER, DIAMOND, FOAM = (
    Material(2.1e11, 0.3, 7850.0),
    Material(1e6, 0.49, 1100.0),
    Material(1.1e12, 0.1, 3500.0),
    Material(1e6, 0.1, 30.0),
)


@pytest.mark.parametrize("material", [STEEL, RUBBER, DIAMOND, FOAM])
def test_materials_that_exist(material):
    assert failed(plausible_materials({"m": material}, 1.0, 1.0, 1.0, "l.toml")) == []


def test_materials_in_other_units():
    """Steel in t, mm, s is the same material."""
    steel = Material(2.1e5, 0.3, 7.85e-9)
    ours, theirs = (
        plausible_materials({"m": m}, *units, "l.toml")
        for m, units in ((STEEL, (1.0, 1.0, 1.0)), (steel, (1e-3, 1e3, 1.0)))
    )
    np.testing.assert_allclose([c.value for c in ours], [c.value for c in theirs], rtol=1e-12)


def link_of(folder: Path, youngs_modulus: float, density: float, scale: float = 1.0, **units: str | bool):
    changes = {"materials": {"m": {"youngs_modulus": youngs_modulus, "density": density}}}
    link = solid_link(folder, units=units, **changes)
    write_box(folder / "box.inp", scale)
    return load_link(link.path)


DESCRIBED = {  # E, density, scale of the mesh, units -> words of a failed check, or of a refusal
    "density in g/cm3": ((7e10, 2.7), {}, "density"),
    "modulus in MPa": ((7e4, 2700.0), {}, "Young's modulus"),
    "modulus in GPa": ((70.0, 2700.0), {}, "Young's modulus"),
    "density in g/m3": ((7e10, 2.7e6), {}, "refused: density"),
    "mesh in mm": ((7e10, 2700.0, 1e3), {}, "size of the link"),
    "t mm s without units": ((7e4, 2.7e-9, 1e3), {}, "refused: density"),
    "units of mm for SI": ((7e10, 2700.0), {"length": "mm"}, "refused: density"),
    "t without mm": ((7e4, 2.7e-9, 1e3), {"mass": "t"}, "density"),
    "right": ((7e10, 2700.0), {}, ""),
    "right in t mm s": ((7e4, 2.7e-9, 1e3), {"length": "mm", "mass": "t"}, ""),
}


@pytest.mark.parametrize("slip", DESCRIBED)
def test_slips_of_descriptions(tmp_path: Path, slip):
    """A solid of 0.3 m: its refusal says which figure is odd; one that is said to be unusual has it in its report."""
    numbers, units, words = DESCRIBED[slip]
    link = link_of(tmp_path, *numbers, **units)
    if not words:
        assert failed(reduce_link(link).health) == []
        return
    figure = words.removeprefix("refused: ")
    with pytest.raises(FEImportError, match="a unit s.*" if figure == words else f"{figure}.*a unit slipped") as caught:
        reduce_link(link)
    assert figure in str(caught.value)
    assert caught.value.cause is Cause.BAD_FIELD
    assert caught.value.remedy
    if figure == words:
        unusual = reduce_link(link_of(tmp_path, *numbers, **units, unusual=True))
        assert any(figure in check.name and not check.judged for check in unusual.health)


def test_frames_are_checked_too(tmp_path: Path):
    """A frame in mm, its materials in SI."""
    nodes = {"root": [100.0, 0.0, 0.0], "elbow": [500.0, 100.0, 50.0], "tip": [600.0, 500.0, -100.0]}
    section = {"shape": "rectangular", "width": 10.0, "height": 20.0}
    with pytest.raises(FEImportError, match=r'size of the link.*units.length = "mm".*unusual = true'):
        reduce_link(frame_link(tmp_path, frame={"nodes": nodes}, sections={"s": section}))
    assert failed(reduce_link(frame_link(tmp_path)).health) == []
