"""Links that were reduced before the import: what is exact, and what kept nodes cannot know."""

from __future__ import annotations

import re
import shutil
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from link_files import frame_link, solid_link, write_toml
from superelements import Reduced, condensed, description, frame_model, punch

import erls
from fe_import.description.link import LinkFile, load_link
from fe_import.health.rotation_terms import rotation_departure
from fe_import.modal.file import read_modal_file, write_modal_file
from fe_import.modal.model import ModalModel
from fe_import.models.model import build_model
from fe_import.reduce import reduce_link

ROOT = Path(__file__).parents[2]
SCENE = ROOT / "data" / "calculix" / "l_pendulum.toml"
OP4 = ROOT / "tests" / "data" / "llink_cb_pyyeti_bin.op4"


def imported(folder: Path, parts: Reduced, **changes: object) -> LinkFile:
    """A DMIG link in a folder."""
    (folder / "k.pch").write_text(punch(parts), encoding="utf-8")
    return description(folder, "nastran-dmig", {"stiffness": "k.pch"}, parts, **changes)


def frame_superelement(folder: Path, kept: tuple[int, ...], modes: int) -> ModalModel:
    """The frame of `link_files` condensed, and imported without another reduction."""
    return reduce_link(imported(folder, condensed(frame_model(folder), kept, modes)))


@pytest.mark.parametrize(("kept", "modes"), [((0, 6), 0), ((0, 6), 10), ((0, 3, 6), 10)])
def test_rigid_motion_is_exact(tmp_path: Path, kept: tuple[int, ...], modes: int) -> None:
    """Mass, centre and inertia are those of the frame; the modal file passes all of its checks."""
    modal = frame_superelement(tmp_path, kept, modes)
    full = reduce_link(frame_link(tmp_path))
    assert modal.elastic_modes == 6 * len(kept) + modes - 6
    assert modal.mass_properties.mass == pytest.approx(full.mass_properties.mass, rel=1e-10)
    np.testing.assert_allclose(modal.mass_properties.centre_of_mass, full.mass_properties.centre_of_mass, atol=1e-10)
    np.testing.assert_allclose(modal.mass_properties.inertia, full.mass_properties.inertia, rtol=1e-9, atol=1e-12)
    write_modal_file(tmp_path / "s.modal.h5", modal)
    again = read_modal_file(tmp_path / "s.modal.h5")
    assert all(check.ok for check in again.health)
    assert again.lines.tolist() == [[k, k + 1] for k in range(len(kept) - 1)]


def test_units(tmp_path: Path) -> None:
    """Matrices in t, mm and s: the same link, modal coordinates too."""
    parts = condensed(frame_model(tmp_path), (0, 3, 6), 6)
    expected = reduce_link(imported(tmp_path, parts))
    scale = np.concatenate([np.tile([1e-3, 1e-3, 1e-3, 1, 1, 1], 3), np.full(6, 7.0)])  # any scale of modal coordinates
    inner = np.outer(scale, scale)
    scaled = Reduced(1e3 * inner * parts.mass, 1e3 * inner * parts.stiffness, 1e3 * parts.positions)
    found = reduce_link(imported(tmp_path, scaled, units={"length": "mm", "mass": "t"}))
    np.testing.assert_allclose(found.frequencies_hz[6:], expected.frequencies_hz[6:], rtol=1e-9)
    np.testing.assert_allclose(found.mass_properties.inertia, expected.mass_properties.inertia, rtol=1e-9, atol=1e-12)


def test_rotation_terms_of_full_models_are_exact(tmp_path: Path) -> None:
    """A solid's mass matrix commutes with rotations of all nodes, so its terms are those of a rigid body."""
    assert rotation_departure(reduce_link(solid_link(tmp_path)).invariants) < 1e-12
    frame = reduce_link(frame_link(tmp_path, reduction={"method": "none"})).invariants
    assert rotation_departure(frame) < 0.02  # consistent mass of beams, three elements per member


def test_rotation_terms_converge_with_kept_nodes(tmp_path: Path) -> None:
    """Ends alone do not know the corner: with it the departure falls by a factor of three and more, then on."""
    members = [
        {"from": a, "to": b, "elements": 8, "material": "m", "section": "s"}
        for a, b in (("root", "elbow"), ("elbow", "tip"))
    ]
    model = frame_model(tmp_path, frame={"members": members})
    names = model.node_names
    way = [names["root"], *(names[f"root-elbow/{k}"] for k in range(1, 8)), names["elbow"]]
    way += [*(names[f"elbow-tip/{k}"] for k in range(1, 8)), names["tip"]]
    found = []
    for step in (16, 8, 4, 2):
        modal = reduce_link(imported(tmp_path, condensed(model, way[::step])))
        check = next(c for c in modal.health if c.name.startswith("centrifugal"))
        assert check.value == rotation_departure(modal.invariants)
        assert check.ok  # said, not refused
        found.append(check.value)
    assert found[0] > 0.2
    assert all(after < before / 3 for before, after in pairwise(found)), found


def scene(folder: Path, link: str, extra: str = "") -> Path:
    """The pendulum of data/calculix with another link, its tip the only point."""
    text = SCENE.read_text(encoding="utf-8").replace("l_hex20.toml", link)
    text = re.sub(r'\[\[points\]\]\nname = "elbow".*?\n\n', "", text, flags=re.DOTALL)
    text = text.replace("dh = {", f"{extra}\ndh = {{").replace("step = 5e-4", "step = 1e-3")
    path = folder / f"scene_{link}"
    path.write_text(text, encoding="utf-8")
    return path


def links(folder: Path) -> tuple[str, str]:
    """The L of 100 hexahedra with all its nodes, and as a superelement of its two ends and 20 modes."""
    full = load_link(ROOT / "data" / "calculix" / "l_hex20.toml")
    assert full.description.matrices is not None
    for name in full.description.matrices.files.values():
        shutil.copy(full.folder / name, folder)
    text = full.path.read_text(encoding="utf-8").replace("fixed_interface_modes = 12", "fixed_interface_modes = 20")
    (folder / "full.toml").write_text(text, encoding="utf-8")
    shutil.copy(OP4, folder / "k.op4")
    positions = {"1": [0.0, 0.0, 0.0], "2": [0.5, 0.5, 0.0]}
    table = {
        "matrices": {
            "format": "nastran-op4",
            "files": {"stiffness": "k.op4"},
            "options": {"boundary": [1, 2], "positions": positions},
        },
        "interfaces": [{"name": "root", "node": "1"}, {"name": "tip", "node": "2"}],
        "reduction": {"method": "none", "elastic_modes": 18},
    }
    write_toml(folder / "ends.toml", table)
    return "full.toml", "ends.toml"


def test_pendulum_of_a_superelement(tmp_path: Path) -> None:
    """Half a second of free swing, up to 6.6 rad/s: within 2e-4 m of the model with all nodes.

    The tip moves by 0.9 m and deflects by 0.6 mm; our own figure is 1.5e-4 m, by an angle that differs by 3e-4 rad.
    """
    times = np.linspace(0, 0.5, 51)
    full, ends = (
        np.array([run.position("tip", t) for t in times])
        for run in (
            erls.simulate(erls.load_scene(scene(tmp_path, name), ["simulation.duration=0.5"]))
            for name in links(tmp_path)
        )
    )
    assert np.linalg.norm(full - ends, axis=1).max() < 2e-4


def test_spinning_superelement(tmp_path: Path) -> None:
    """At 10 rad/s without gravity the ends alone misjudge the centrifugal deflection by 10 to 20 %, as the note says.

    Mean deflections of the tip over 0.3 s in the frame of the link; our own figures, 14 % and 17 %.
    """
    changes = ["simulation.duration=0.3", "gravity=[0.0,0.0,0.0]"]
    means = []
    for name in links(tmp_path):
        run = erls.simulate(erls.load_scene(scene(tmp_path, name, "initial = { rate = 10.0 }"), changes))
        times = np.linspace(0, 0.3, 151)
        tip = np.array([run.position("tip", t) for t in times])
        angle = np.array([run.joint_angle("shoulder", t) for t in times])
        along = np.cos(angle) * tip[:, 0] - np.sin(angle) * tip[:, 2]
        means.append([along.mean() - 0.5, tip[:, 1].mean() - 0.5])
    ratio = np.array(means[1]) / np.array(means[0])
    assert ((ratio > 1.1) & (ratio < 1.2)).all(), ratio


def test_superelement_of_a_superelement(tmp_path: Path) -> None:
    """The frame condensed to seven, then to three nodes is the frame condensed to three nodes."""
    model = frame_model(tmp_path)
    whole = build_model(imported(tmp_path, condensed(model, range(7))))
    twice = condensed(whole, (0, 3, 6), 4)
    once = condensed(model, (0, 3, 6), 4)
    scale = np.sqrt(np.outer(np.diag(once.stiffness), np.diag(once.stiffness)))[:18, :18]
    np.testing.assert_allclose(twice.stiffness[:18, :18] / scale, once.stiffness[:18, :18] / scale, atol=1e-9)
    np.testing.assert_allclose(np.diag(twice.stiffness)[18:], np.diag(once.stiffness)[18:], rtol=1e-9)
