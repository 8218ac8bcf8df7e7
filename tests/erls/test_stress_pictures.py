"""Stress in colour, and shells with their thickness: closed forms, what pictures and exports hold, refusals."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest
import scenes
from numpy.typing import NDArray
from PIL import Image
from test_shell_chains import arm, described, run_of, strip

import erls
from erls.errors import SceneError
from erls.run.bodies.mode import mode_of
from erls.run.bodies.rest import BodyRest
from erls.run.recovery import recovery_places
from erls.view import picture, write_view
from erls.view.figures import figure_of
from erls.view.shapes import thick
from fe_import.modal.recovery_maps import von_mises

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def rolled() -> BodyRest:
    """A strip as a full circle."""
    run = erls.simulate(erls.load_scene(ROOT / "data/shells/roll_up.toml"), verdict=False)
    assert isinstance(run, BodyRest)
    return run


def test_stress_of_a_strip_rolled_up_is_that_of_a_beam(rolled: BodyRest, tmp_path: Path) -> None:
    """E t κ / 2 at both surfaces of every node, to rounding; an export holds it."""
    bent = 1e-6 * 1200.0 * 0.05 * 2 * np.pi / 12.0
    (pose,) = figure_of(rolled, 1.0, color="stress").poses([1.0])
    np.testing.assert_allclose(pose.values()[0], bent, rtol=1e-9)
    write_view(rolled, tmp_path / "strip.pvd", times=[1.0], color="stress")
    (file,) = (tmp_path / "strip_files").iterdir()
    np.testing.assert_allclose(meshio.read(file).point_data["von_mises_MPa"], bent, rtol=1e-9)


def test_a_picture_of_stress_says_so(rolled: BodyRest, tmp_path: Path) -> None:
    """Other colours than those of deflection: as much stress at the clamp, which does not move, as anywhere."""
    blue = []
    for color in ("deflection", "stress"):
        picture(rolled, tmp_path / "it.png", times=[1.0], size=(400, 300), color=color)
        with Image.open(tmp_path / "it.png") as image:
            pixels = np.asarray(image.convert("RGB")).astype(int)
        blue.append((pixels[..., 2] - pixels[..., 0] > 60).sum())
    assert blue[0] > 2 * blue[1] > 0  # the scale itself has some


def test_links_of_shells_show_theirs(tmp_path: Path) -> None:
    """A strip that a hinge swings: ERLS recovers it, nodal shells tell their own. In its middle they are 9.9 % of the
    largest apart on eight elements, and 3.3 % on sixteen; opposite at top and bottom.
    """
    described(tmp_path, strip(8, 2), recovery={"all": True})
    found, times = [], np.linspace(0.0, 0.1, 21)
    for formulation in ("erls", "nodal"):
        run = run_of(arm(tmp_path, formulation))
        (pose,) = figure_of(run, 1.0, color="stress").poses([0.1])
        stress = erls.stress(run, "strip", times)
        assert np.fmax.reduce(pose.values()[0]) == pytest.approx(1e-6 * von_mises(stress[-1]).max(), rel=1e-12)
        nodes = run.formulation.mechanism.links[0].model.nodes
        middle = int(np.argmin(np.linalg.norm(nodes - [0.3, 0.0, 0.0], axis=1)))
        bottom, _, top = np.moveaxis(stress[:, recovery_places(run, "strip").nodes == middle, 0], 1, 0)
        assert np.abs(bottom + top).max() < 0.05 * np.abs(top).max()
        found.append(top)
    assert np.abs(found[0]).max() > 4e6
    assert np.abs(found[1] - found[0]).max() < 0.12 * np.abs(found[0]).max()


def test_links_of_beams_show_their_section_forces(tmp_path: Path) -> None:
    """At every node the larger length of those of the ends that meet there, in pictures and exports."""
    scenes.l_link(tmp_path, recovery={"all": True})
    run = erls.simulate(scenes.l_scene(tmp_path, simulation={"duration": 0.02}), verdict=False)
    places = recovery_places(run, "l").nodes
    forces = erls.section_forces(run, "l", 0.02)
    for color, parts, array in (("section-force", slice(0, 3), "section_force_N"),
                                ("section-moment", slice(3, 6), "section_moment_Nm")):  # fmt: skip
        (pose,) = figure_of(run, 1.0, color).poses([0.02])
        (values,) = pose.values()
        sizes = np.linalg.norm(forces[:, parts], axis=1)
        for node in np.unique(places):
            assert values[node] == pytest.approx(sizes[places == node].max(), rel=1e-12)
        write_view(run, tmp_path / "l.pvd", times=[0.02], color=color)
        (file,) = (tmp_path / "l_files").iterdir()
        np.testing.assert_allclose(meshio.read(file).point_data[array], values, rtol=1e-12)
    with pytest.raises(SceneError, match="holds stress"):
        figure_of(run, 1.0, "stress")
    with pytest.raises(SceneError, match="section-moment"):
        figure_of(run, 1.0, "moments")


def test_refusals(rolled: BodyRest, tmp_path: Path) -> None:
    """Where nothing holds stress, of modes, in tables."""
    beams = erls.simulate(erls.load_scene(ROOT / "data/statics/bend_45.toml"), verdict=False)
    heavy = ["materials.rubber.density=1.0", 'simulation={type="frequencies"}', "loads=[]"]
    found = erls.simulate(erls.load_scene(ROOT / "data/shells/roll_up.toml", heavy), verdict=False)
    for run in (beams, mode_of(found, 1)):
        with pytest.raises(SceneError, match=r"holds stress|no scale"):
            figure_of(run, 1.0, color="stress")
    with pytest.raises(SceneError, match="do not show it"):
        write_view(rolled, tmp_path / "strip.csv", color="stress")


def _volume(places: NDArray[np.float64], triangles: NDArray[np.int64]) -> float:
    a, b, c = (places[triangles[:, k]] for k in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


def test_thickness_closes_a_surface() -> None:
    """Two unit squares, flat and folded by a right angle: with a rim they enclose thickness times area, seen from
    outside; at the fold both sides keep their thickness, as far at one end of it as at the other, however they are cut.
    """
    flat = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0], [2, 1, 0]], dtype=float)
    folded = flat.copy()
    folded[4:] = [[1, 0, 1], [1, 1, 1]]
    triangles = np.array([[0, 1, 2], [0, 2, 3], [1, 4, 5], [1, 5, 2]])
    heights = np.tile([-0.05, 0.05], (6, 1))
    for places in (flat, folded):
        where, whole, values = thick(places, triangles, heights, np.arange(6.0))
        edges = np.sort(whole[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
        assert _volume(where, whole) == pytest.approx(0.2, rel=1e-9)
        np.testing.assert_allclose(where[7] - places[1], where[8] - places[2], atol=1e-12)
        np.testing.assert_array_equal(values, np.tile(np.arange(6.0), 3))
