"""What a run states of modes left out and of meshes, against runs with all modes on finer meshes."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scenes

from erls.accuracy.modes import modes_error
from erls.accuracy.slow_motion import averages
from erls.run.chain.run import ChainRun
from erls.scene.read import load_scene
from erls.simulation.simulate import simulate
from fe_import.description.link import load_link
from fe_import.modal.file import write_modal_file
from fe_import.reduce import reduce_link

EXACT = "simulation.tolerance=1e-7"  # of the integration: a tenth of the smallest error judged, and less
FLOOR = 1e-7  # m: what integration leaves


def run_of(scene: Path, *overrides: str) -> ChainRun:
    found = simulate(load_scene(scene, [EXACT, *overrides]), verdict=False)
    assert isinstance(found, ChainRun)
    return found


def finer(folder: Path, scene: Path, factor: int) -> list[str]:
    """Overrides that give each link of a scene more elements and 20 fixed-interface modes."""
    result = []
    for link in scenes.read_toml(scene)["links"]:
        source = scene.parent / link.get("model", "")
        if not source.is_file():
            continue
        data = tomllib.loads(source.read_text(encoding="utf-8"))
        members = [{**m, "elements": factor * m.get("elements", 1)} for m in data["frame"]["members"]]
        reduction = {"method": "craig-bampton", "fixed_interface_modes": 20}
        data = {**data, "frame": {**data["frame"], "members": members}, "reduction": reduction}
        path = scenes.write_toml(folder / f"finer_{source.stem}.toml", data)
        result += [f"links.{link['name']}.model={path}"]
        result += [f"links.{link['name']}.elastic_modes=none"] * ("elastic_modes" in link)
    return result


def distance(first: ChainRun, second: ChainRun) -> float:
    """Largest distance of any point [m]."""
    t = np.linspace(0.0, first.end, 301)
    gaps = [first.position(name, t) - second.position(name, t) for name in first.point_names]
    return float(np.linalg.norm(gaps, axis=-1).max())


def stated(run: ChainRun) -> float:
    error, _ = modes_error(run)
    assert error is not None
    return error


# kept modes of the links, elements per member; wanted: never less than the error, seldom more than five times that
CASES: dict[str, tuple[dict[str, Any], int]] = {
    "two modes": ({"method": "craig-bampton", "elastic_modes": 2}, 4),
    "six modes": ({"method": "craig-bampton", "elastic_modes": 6}, 4),
    "two fixed-interface modes": ({"method": "craig-bampton", "fixed_interface_modes": 2}, 4),
    "free modes": ({"method": "mode-displacement", "free_modes": 8}, 4),
    "all modes of a coarse mesh": ({"method": "none"}, 2),
    "lumped masses": ({"method": "craig-bampton", "fixed_interface_modes": 6}, 4),
}


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("formulation", ["erls", "ffr"])
def test_a_pendulum_states_what_its_links_leave_out(tmp_path: Path, case: str, formulation: str) -> None:
    reduction, elements = CASES[case]
    frame = {"mass": "lumped"} if "lumped" in case else {}
    scenes.l_link(tmp_path, elements, reduction=reduction, frame=frame)
    scene = scenes.l_scene(tmp_path, simulation={"duration": 0.3, "formulation": formulation})
    run = run_of(scene)
    actual = distance(run, run_of(scene, *finer(tmp_path, scene, 4)))
    assert actual <= stated(run) + FLOOR
    assert stated(run) <= 20 * max(actual, FLOOR)


def test_free_joints_that_drift_are_told(tmp_path: Path) -> None:
    """Three free links: their joints move on by what slow loads make of the links' shape."""
    scene = scenes.three_links(tmp_path, simulation={"duration": 0.25})
    few = [f"links.{link['name']}.elastic_modes=3" for link in scenes.read_toml(scene)["links"]]
    run = run_of(scene, *few)
    actual = distance_of_ends(run, run_of(scene, *finer(tmp_path, scene, 2)))
    assert actual <= stated(run) <= 20 * actual


def distance_of_ends(first: ChainRun, second: ChainRun) -> float:
    """Largest distance of the outboard ends [m]."""
    t = np.linspace(0.0, first.end, 101)
    names = first.point_names
    if names:
        return distance(first, second)
    ends = []
    for run in (first, second):
        states = run.series(t)
        link = run.formulation.mechanism.links[-1]
        node = link.model.node_names["tip"]
        local = link.model.nodes[node] + states.modal[-1] @ link.model.translation_shapes[node].T
        ends.append(np.einsum("kij,kj->ki", states.poses[-1][:, :3, :3], local) + states.poses[-1][:, :3, 3])
    return float(np.linalg.norm(ends[0] - ends[1], axis=1).max())


def test_loops_state_what_their_links_leave_out(tmp_path: Path) -> None:
    scene = scenes.ROOT / "data" / "four_bar" / "flexible.toml"
    few = [f"links.{name}.reduction.fixed_interface_modes=1" for name in ("crank", "coupler", "rocker")]
    few += [f"links.{name}.reduction.elastic_modes=7" for name in ("crank", "coupler", "rocker")]
    short = "simulation.duration=0.3"
    run = run_of(scene, short, *few)
    actual = distance(run, run_of(scene, short, *finer(tmp_path, scene, 2)))
    assert actual <= stated(run) <= 20 * actual


@pytest.mark.parametrize(
    "overrides",
    [
        ["simulation.gauge=minimum-norm"],
        ["simulation.formulation=ffr", "simulation.body_frame=mean-axis"],
        ["simulation.formulation=ffr", "simulation.coordinates=absolute"],
    ],
    ids=["minimum norm", "mean axes", "absolute"],
)
def test_other_coordinates_state_the_same(tmp_path: Path, overrides: list[str]) -> None:
    """Within a factor of 2: the motions are the same but for what integrators and samples differ by."""
    scenes.l_link(tmp_path, 4, reduction={"method": "craig-bampton", "fixed_interface_modes": 2})
    scene = scenes.l_scene(tmp_path, simulation={"duration": 0.05})
    error = stated(run_of(scene))
    assert error / 2 < stated(run_of(scene, *overrides)) < 2 * error


def test_pieces_and_slow_modes_are_judged(tmp_path: Path) -> None:
    scenes.l_link(tmp_path, 4, reduction={"method": "craig-bampton", "elastic_modes": 8})
    scene = scenes.l_scene(tmp_path, simulation={"duration": 0.05})
    split = ["simulation.formulation=ffr", "links.l.substructures=2"]
    error = stated(run_of(scene, *split))
    assert error > 0
    # the same motion in other coordinates: but for what integrators and samples differ by
    assert error / 2 < stated(run_of(scene, *split, "simulation.coordinates=absolute")) < 2 * error
    assert stated(run_of(scene, "simulation.bandwidth=300")) > 0


def test_nodal_links_state_what_their_mesh_leaves_out(tmp_path: Path) -> None:
    """Against 16 elements per member, whose own error is a sixteenth of that of 4: elements are of second order."""
    scene = scenes.l_scene(tmp_path, simulation={"duration": 0.1, "formulation": "nodal"})
    scenes.l_link(tmp_path, 16)
    exact, errors = run_of(scene), []
    for elements in (2, 4):
        scenes.l_link(tmp_path, elements)
        run = run_of(scene)
        actual = distance(run, exact)
        errors.append(stated(run))
        assert actual <= errors[-1] <= 20 * actual
    assert 2 < errors[0] / errors[1] < 8  # second order would make it 4


def test_rigid_links_leave_nothing_out(tmp_path: Path) -> None:
    scenes.l_link(tmp_path)
    scene = scenes.l_scene(tmp_path, simulation={"duration": 0.05})
    assert modes_error(run_of(scene, "links.l.flexible=false")) == (0.0, "")


def test_a_modal_file_is_judged_by_its_own_modes(tmp_path: Path) -> None:
    scenes.l_link(tmp_path, 4, reduction={"method": "craig-bampton", "fixed_interface_modes": 6})
    write_modal_file(tmp_path / "l.modal.h5", reduce_link(load_link(tmp_path / "link.toml")))
    scene = scenes.l_scene(tmp_path, simulation={"duration": 0.05})
    described = stated(run_of(scene))
    link = {"name": "l", "modal_file": "l.modal.h5"}
    filed = scenes.write_toml(tmp_path / "filed.toml", {**scenes.read_toml(scene), "links": [link]})
    error, note = modes_error(run_of(filed))
    assert "highest third" in note
    assert error is not None
    assert error >= described


def test_a_link_that_has_changed_is_not_judged(tmp_path: Path) -> None:
    scenes.l_link(tmp_path, 4, reduction={"method": "craig-bampton", "fixed_interface_modes": 3})
    run = run_of(scenes.l_scene(tmp_path, simulation={"duration": 0.02}))
    scenes.l_link(tmp_path, 5)
    error, note = modes_error(run)
    assert error is None
    assert "not the one" in note


def test_windows_see_the_slow_motion_through_a_quick_vibration() -> None:
    """A parabola with a tenth of a millimetre at 40 Hz, whose accelerations are three times its own: to a hundredth."""
    t = np.linspace(0.0, 2.0, 401)
    quick = 1e-4 * np.sin(2 * np.pi * 40 * t)
    middles, (place, rate, acceleration) = averages(t, (0.3 + 0.5 * t + 1.0 * t**2 + quick)[:, None], 16)
    assert len(middles) == 24
    assert np.allclose(rate[:, 0], 0.5 + 2.0 * middles, rtol=0, atol=0.01)
    assert np.allclose(acceleration, 2.0, rtol=0, atol=0.02)
    assert np.allclose(place[:, 0], 0.3 + 0.5 * middles + middles**2, rtol=0, atol=1e-3)
