"""Modes of reduced links as pictures and films: the shapes of the modal file, without a scale."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest
import scenes
from PIL import Image

from erls.cli.main import main
from erls.errors import SceneError
from erls.run.link_mode import LinkMode, link_mode
from erls.view import picture, write_view
from erls.view.figures import figure_of


@pytest.fixture(scope="module")
def modal_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The L-shaped link."""
    folder = tmp_path_factory.mktemp("link")
    assert main(["reduce", str(scenes.l_link(folder, elements=4)), "-o", str(folder / "l.modal.h5"), "--quiet"]) == 0
    return folder / "l.modal.h5"


@pytest.fixture(scope="module")
def mode(modal_file: Path) -> LinkMode:
    """Its third one."""
    return link_mode(modal_file, 3)


def test_a_mode_is_that_of_the_file(mode: LinkMode, tmp_path: Path) -> None:
    """Its shape over a period, a tenth of the size at most, in interfaces, figures and exports alike."""
    model = mode.model
    shape = model.translation_shapes[:, :, 6 + 3 - 1]
    farthest, middle, other = mode.displacements([0.0, 0.25, 0.5])
    assert np.linalg.norm(farthest, axis=1).max() == pytest.approx(0.1 * np.hypot(0.5, 0.5))
    np.testing.assert_allclose(farthest / np.linalg.norm(farthest), shape / np.linalg.norm(shape), atol=1e-12)
    np.testing.assert_allclose(middle, 0.0, atol=1e-15)
    np.testing.assert_allclose(other, -farthest, atol=1e-15)
    tip = next(interface.node for interface in model.interface_nodes if interface.name == "tip")
    np.testing.assert_allclose(mode.position("tip", 0.5), model.nodes[tip] - farthest[tip])
    (pose,) = figure_of(mode).poses([0.5])
    np.testing.assert_allclose(pose.nodes(1.0)[0], model.nodes - farthest)
    np.testing.assert_allclose(pose.values()[0], 1e3 * np.linalg.norm(farthest, axis=1))
    write_view(mode, tmp_path / "l.pvd", times=[0.5])
    (file,) = (tmp_path / "l_files").iterdir()
    np.testing.assert_allclose(meshio.read(file).points, model.nodes - farthest)
    assert f"mode 3, {model.kinds[8]}, {model.frequencies_hz[8]:.4g} Hz" in mode.title


def test_pictures_and_films(mode: LinkMode, modal_file: Path, tmp_path: Path) -> None:
    """Half a period later the link is elsewhere; the command makes a film of several frames, and a table."""
    found = []
    for phase in (0.0, 0.5):
        picture(mode, tmp_path / "l.png", times=[phase], size=(400, 300))
        with Image.open(tmp_path / "l.png") as image:
            found.append(np.asarray(image.convert("RGB")).astype(int))
    assert (np.abs(found[0] - found[1]).max(axis=2) > 60).sum() > 100
    command = ["view", str(modal_file), "--mode", "3", "--quiet", "-o"]
    assert main([*command, str(tmp_path / "l.gif"), "--fps", "10"]) == 0
    with Image.open(tmp_path / "l.gif") as film:
        assert film.n_frames > 5  # type: ignore[attr-defined]
    assert main([*command, str(tmp_path / "l.csv")]) == 0
    assert (tmp_path / "l.csv").read_text(encoding="utf-8").startswith("phase [1],root.x [m]")


def test_refusals(mode: LinkMode, modal_file: Path, tmp_path: Path) -> None:
    """Modes that are not there, what has no scale, reports, coordinates that are no modes, files that are none."""
    for number in (0, 19):
        with pytest.raises(SceneError, match=r"no such elastic mode.*1 to 18"):
            link_mode(modal_file, number)
    with pytest.raises(SceneError, match="no scale"):
        figure_of(mode, 1.0, "stress")
    with pytest.raises(SceneError, match="not of a mode"):
        write_view(mode, tmp_path / "l.html")
    physical = scenes.l_link(tmp_path, reduction={"form": "physical"})
    assert main(["reduce", str(physical), "-o", str(tmp_path / "p.modal.h5"), "--quiet"]) == 0
    with pytest.raises(SceneError, match="physical form"):
        link_mode(tmp_path / "p.modal.h5", 1)
    assert main(["view", str(physical), "--mode", "1", "-o", str(tmp_path / "l.png")]) == 2
