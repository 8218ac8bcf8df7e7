"""Geometry of CAD programs to links in one step: volumes, units, faces by places, and what cannot be meshed."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from link_files import SOLID, merged, write_toml
from test_sound_extremes import FREE_FREE

from fe_import.description.link import LinkFile, load_link
from fe_import.errors import Cause, FEImportError
from fe_import.models.meshed import mesh_of, meshed_model
from fe_import.reduce import reduce_link

try:
    import gmsh
except (ImportError, OSError) as problem:  # its library may lack others of the system
    pytest.skip(f"gmsh cannot be imported: {problem}", allow_module_level=True)
E, NU, RHO = 7e10, 0.33, 2700.0  # of SOLID


def written(folder: Path, shapes: Callable[[Any], object], name: str = "g.step") -> Path:
    """Shapes as a CAD program writes them, in mm."""
    gmsh.initialize(interruptible=False, readConfigFiles=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.model.add("made")
    shapes(gmsh.model.occ)
    gmsh.model.occ.synchronize()
    gmsh.write(str(folder / name))
    gmsh.finalize()
    return folder / name


def eye(occ: Any) -> None:
    """A bar of 80 x 12 x 6 with a bore of radius 3 at its end."""
    bar, bore = occ.addBox(0, -6, -3, 80, 12, 6), occ.addCylinder(72, 0, -4, 0, 0, 8, 3)
    occ.cut([(3, bar)], [(3, bore)])


def link(folder: Path, unit: str = "mm", **solid: Any) -> LinkFile:
    scale = {"mm": 1.0, "m": 1e-3}[unit]
    faces = {"end": [0.0, 0.0, 0.0], "bore": [72 * scale, 0.0, 0.0]}
    if solid.get("size", 1.0) is None:
        del solid["size"]
    else:
        solid = {"size": 5.0 * scale, **solid}
    changes = {
        "units": {"length": unit, "mass": "t" if unit == "mm" else "kg"},
        "materials": {"m": {"youngs_modulus": E * (1e-6 if unit == "mm" else 1.0), "poissons_ratio": NU,
                            "density": RHO * (1e-12 if unit == "mm" else 1.0)}},
        "solid": {"mesh": "g.step", "faces": faces, **solid},
        "interfaces": [{"name": "root", "face": "end"}, {"name": "tip", "face": "bore"}],
    }  # fmt: skip
    return load_link(write_toml(folder / "l.toml", merged(SOLID, changes)))


def test_a_bore_in_two_units(tmp_path: Path) -> None:
    """A file in mm is meshed in the unit of the description: the same link; mass of the shape, to what second-order
    edges leave of circles; the interface in the middle of the bore, on all of its nodes.
    """
    written(tmp_path, eye)
    models = [reduce_link(link(tmp_path, unit)) for unit in ("mm", "m")]
    exact = RHO * (80 * 12 * 6 - np.pi * 9 * 6) * 1e-9
    for model in models:
        assert model.mass_properties.mass == pytest.approx(exact, rel=2e-4)
        assert all(check.ok for check in model.health)
        tip = model.interface_nodes[1]
        np.testing.assert_allclose(tip.position, [0.072, 0.0, 0.0], atol=2e-5)
        arms = model.nodes[tip.coupled_nodes] - [0.072, 0.0, 0.0]
        np.testing.assert_allclose(np.linalg.norm(arms[:, :2], axis=1), 0.003, rtol=1e-6)
        assert arms[:, 0].min() < -0.0029  # both halves
        assert arms[:, 0].max() > 0.0029
        assert model.second_order is not None
    np.testing.assert_allclose(models[0].frequencies_hz[6:], models[1].frequencies_hz[6:], rtol=1e-6)


def test_parts_that_touch_are_one_bar(tmp_path: Path) -> None:
    """Two boxes with a face in common: the bending of a bar 40 times as long as thick, within 0.5 % (shear 0.3)."""
    written(tmp_path, lambda occ: (occ.addBox(0, 0, 0, 80, 4, 4), occ.addBox(80, 0, 0, 80, 4, 4)))
    faces = {"end": [0.0, 2.0, 2.0], "bore": [160.0, 2.0, 2.0]}
    made = link(tmp_path, faces=faces, size=8.0)
    mesh = mesh_of(made)
    assert set(mesh.element_sets) == {"volume:1", "volume:2"}
    assert {"end", "bore", "surface:1"} < set(mesh.node_sets)
    bending = FREE_FREE / (2 * np.pi) * np.sqrt(E / RHO / 12) * 0.004 / 0.16**2
    assert reduce_link(made).frequencies_hz[6] == pytest.approx(bending, rel=5e-3)


def overlapping(occ: Any) -> object:
    return occ.addBox(0, 0, 0, 8, 4, 4), occ.addBox(4, 0, 0, 8, 4, 4)


@pytest.mark.parametrize(
    ("shapes", "solid", "cause", "words"),
    [
        (eye, {"size": None}, Cause.BAD_FIELD, "give size = LENGTH"),
        (eye, {"size": -1.0}, Cause.BAD_FIELD, "a size must be positive"),
        (eye, {"size": 1e-3}, Cause.MESH, "too many elements of this size"),
        (lambda occ: occ.addDisk(0, 0, 0, 4, 4), {}, Cause.MESH, "no solids"),
        (overlapping, {}, Cause.MESH, "solids overlap"),
        (lambda occ: occ.addBox(0, 0, 0, 1, 1, 1), {"mesh": "text.stp"}, Cause.NOT_READABLE, "cannot be read"),
        (lambda occ: occ.addBox(0, 0, 0, 1, 1, 1), {"mesh": "box.inp"}, Cause.BAD_FIELD, "is a mesh, no geometry"),
    ],
)
def test_what_cannot_be_meshed_says_why(
    tmp_path: Path, shapes: Callable[[Any], object], solid: dict[str, Any], cause: Cause, words: str
) -> None:
    written(tmp_path, shapes)
    for name in ("text.stp", "box.inp"):
        (tmp_path / name).write_text("no geometry\n", encoding="utf-8")
    with pytest.raises(FEImportError, match=words) as caught:
        meshed_model(link(tmp_path, **solid))
    assert caught.value.cause == cause
    assert not gmsh.isInitialized()


def test_without_gmsh(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    written(tmp_path, eye)
    monkeypatch.setitem(sys.modules, "gmsh", None)
    with pytest.raises(FEImportError, match=r"pip install 'erls\[geometry\]'"):
        meshed_model(link(tmp_path))
