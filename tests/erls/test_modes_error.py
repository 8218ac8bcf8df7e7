"""What a run states of modes left out and of meshes, against runs with all modes on finer meshes."""

from __future__ import annotations

import tomllib
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import scenes

from erls.accuracy.compared_links import Motion
from erls.accuracy.joint_drift import joint_drift
from erls.accuracy.judged import LEAST, Judged
from erls.accuracy.modes import modes_error
from erls.accuracy.slow_motion import averages
from erls.accuracy.unbalanced_forces import Unbalanced
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
    error = modes_error(run).error
    assert error is not None
    return error


def check(run: ChainRun, actual: float, most: float = 20.0) -> None:
    """What is foretold is never less than the error, and seldom five times as large; nor is twice the distance of a run
    with all modes less, whose meshes are half as large alone.
    """
    judged = modes_error(run)
    assert judged.error is not None
    assert actual <= judged.error + FLOOR
    assert judged.error <= most * max(actual, FLOOR)
    if judged.apart is not None:
        assert actual / LEAST <= judged.apart + FLOOR
        assert judged.apart <= 3 * max(actual, FLOOR)


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
    check(run, actual)


def test_free_joints_that_drift_are_told(tmp_path: Path) -> None:
    """Three free links: their joints move on by what slow loads make of the links' shape."""
    scene = scenes.three_links(tmp_path, simulation={"duration": 0.25})
    few = [f"links.{link['name']}.elastic_modes=3" for link in scenes.read_toml(scene)["links"]]
    run = run_of(scene, *few)
    actual = distance_of_ends(run, run_of(scene, *finer(tmp_path, scene, 2)))
    check(run, actual)


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
    assert modes_error(run).apart is not None
    check(run, actual)


def undriven_four_bar(folder: Path, **changes: Any) -> Path:
    """The flexible four-bar, its crank free."""
    source = scenes.ROOT / "data" / "four_bar" / "flexible.toml"
    data = scenes.merged(scenes.read_toml(source), changes)
    crank = {key: value for key, value in data["joints"][0].items() if key != "drive"}
    joints = [{**crank, "initial": {"position_deg": 60.0}}, *data["joints"][1:]]
    links = [{**link, "model": str(source.parent / link["model"])} for link in data["links"]]
    return scenes.write_toml(folder / "undriven.toml", {**data, "joints": joints, "links": links})


def test_loops_in_static_equilibrium_begin_where_their_links_let_them(tmp_path: Path) -> None:
    """With one mode each, links of the loop bear their weight in another shape, and joints follow."""
    scene = undriven_four_bar(tmp_path, simulation={"duration": 0.02}, initial={"deformation": "static"})
    run = run_of(scene, *(f"links.{name}.elastic_modes=1" for name in ("crank", "coupler", "rocker")))
    better = run_of(scene, *finer(tmp_path, scene, 2))
    begin = max(float(np.linalg.norm(run.position(n, 0.0) - better.position(n, 0.0))) for n in run.point_names)
    assert begin > FLOOR
    actual = distance(run, better)
    check(run, actual)


def test_loops_that_swing_drift(tmp_path: Path) -> None:
    """A four-bar that nothing drives: what its links leave out makes it swing otherwise."""
    scene = undriven_four_bar(tmp_path, simulation={"duration": 0.5})
    run = run_of(scene, *(f"links.{name}.elastic_modes=6" for name in ("crank", "coupler", "rocker")))
    actual = distance(run, run_of(scene, *finer(tmp_path, scene, 2)))
    check(run, actual)


def test_loops_of_modal_files_are_not_held_against_themselves(tmp_path: Path) -> None:
    """One link of three lies in a file, which holds no more modes: a run with all of them would leave it as it is."""
    scene = undriven_four_bar(tmp_path, simulation={"duration": 0.02})
    source = scenes.ROOT / "data" / "four_bar" / "links" / "coupler.toml"
    write_modal_file(tmp_path / "coupler.modal.h5", reduce_link(load_link(source)))
    data = scenes.read_toml(scene)
    filed = {"name": "coupler", "modal_file": "coupler.modal.h5"}
    links = [filed if link["name"] == "coupler" else link for link in data["links"]]
    error, note, apart = modes_error(run_of(scenes.write_toml(tmp_path / "filed.toml", {**data, "links": links})))
    assert error is not None
    assert error > 0
    assert "highest third" in note
    assert apart is None


def test_a_part_lies_within_what_a_better_run_tells() -> None:
    """No more than three times its distance, and no less than twice what the error of the integration leaves of it."""
    assert Judged(1e-4, apart=2e-5).grown(1.0, 5e-6).error == pytest.approx(6e-5)
    assert Judged(1e-6, apart=2e-5).grown(1.0, 5e-6).error == pytest.approx(3e-5)
    assert Judged(1e-6, apart=2e-5).grown(1.0, 1e-3).error == pytest.approx(1e-6)
    assert Judged(1e-5, apart=2e-5).grown(3.0, 1e-3).error == pytest.approx(3e-5)  # growing disturbances
    assert Judged(1e-5).grown(3.0, 1e-3).error == pytest.approx(3e-5)
    assert Judged(None, apart=2e-5).grown(3.0, None).error == pytest.approx(6e-5)
    assert Judged(None).grown(3.0, None).error is None


def test_rotation_vectors_that_are_exchanged_make_no_error(tmp_path: Path) -> None:
    """A link that turns more than once in a spherical joint: coordinates jump by full turns, the motion does not."""
    scenes.l_link(tmp_path, 2, reduction={"method": "craig-bampton", "elastic_modes": 4})
    turning = {"turn_z": {"initial": {"rate": 9.0}}, "turn_x": {"initial": {"rate": 1.0}}}
    joint = {"name": "shoulder", "type": "spherical", "dh": {"convention": "standard"}, "coordinates": turning}
    scene = scenes.l_scene(tmp_path, joints=[joint], simulation={"duration": 1.0})
    run = run_of(scene)
    jumps = np.abs(np.diff(run.solution.y[:, :3], axis=0)).max()
    assert jumps > np.pi
    actual = distance(run, run_of(scene, *finer(tmp_path, scene, 4)))
    check(run, actual)


def test_rigid_links_of_lumped_masses_have_a_mesh_too(tmp_path: Path) -> None:
    """Lumped masses of two elements a leg are not those of four: a pendulum swings otherwise, rigid as it is."""
    scenes.l_link(tmp_path, 2, frame={"mass": "lumped"})
    scene = scenes.l_scene(tmp_path, simulation={"duration": 0.4})
    rigid = "links.l.flexible=false"
    run = run_of(scene, rigid)
    actual = distance(run, run_of(scene, rigid, *finer(tmp_path, scene, 6)))
    assert actual > 1e-5
    check(run, actual)


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


def test_a_link_that_cannot_expand_says_so(tmp_path: Path) -> None:
    """Its three modes bend alone: it lacks α ΔT L of its long leg, about which it would swing."""
    warm = {"materials": {"m": {"thermal_expansion": 1.2e-5}}, "temperature_change": 60.0}
    scenes.l_link(tmp_path, 4, reduction={"method": "craig-bampton", "fixed_interface_modes": 6}, **warm)
    scene = scenes.l_scene(tmp_path, simulation={"duration": 0.05})
    run = run_of(scene, "links.l.elastic_modes=3")
    actual = distance(run, run_of(scene, *finer(tmp_path, scene, 2)))
    cold = run_of(scene, "links.l.elastic_modes=3", "links.l.temperature_change=0")
    assert stated(cold) < actual / 2
    check(run, actual, 5.0)


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


def test_a_column_near_flutter_is_judged_as_pressed(tmp_path: Path) -> None:
    """Beck's column at 0.9 of its load: its second frequency is five times as far off by the mesh as without load."""
    scene = scenes.ROOT / "data/beck/column.toml"
    run = run_of(scene)
    actual = distance(run, run_of(scene, *finer(tmp_path, scene, 3)))
    assert actual > 2e-5
    check(run, actual, 5.0)


def test_rigid_links_leave_nothing_out(tmp_path: Path) -> None:
    scenes.l_link(tmp_path)
    scene = scenes.l_scene(tmp_path, simulation={"duration": 0.05})
    assert modes_error(run_of(scene, "links.l.flexible=false")) == (0.0, "", None)


def test_a_modal_file_is_judged_by_its_own_modes(tmp_path: Path) -> None:
    scenes.l_link(tmp_path, 4, reduction={"method": "craig-bampton", "fixed_interface_modes": 6})
    write_modal_file(tmp_path / "l.modal.h5", reduce_link(load_link(tmp_path / "link.toml")))
    scene = scenes.l_scene(tmp_path, simulation={"duration": 0.05})
    described = stated(run_of(scene))
    link = {"name": "l", "modal_file": "l.modal.h5"}
    filed = scenes.write_toml(tmp_path / "filed.toml", {**scenes.read_toml(scene), "links": [link]})
    error, note, _ = modes_error(run_of(filed))
    assert "highest third" in note
    assert error is not None
    assert error >= described


def test_a_link_that_has_changed_is_not_judged(tmp_path: Path) -> None:
    scenes.l_link(tmp_path, 4, reduction={"method": "craig-bampton", "fixed_interface_modes": 3})
    run = run_of(scenes.l_scene(tmp_path, simulation={"duration": 0.02}))
    scenes.l_link(tmp_path, 5)
    error, note, _ = modes_error(run)
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


def one_way(
    stiffness: float, damping: float, push: float, ways: list[Any] | None, turn: float = 0.0, carry: float = 0.0
) -> Any:
    """Equations of joints of unit mass that an answer of 1 on a last coordinate pushes, as `joint_drift` asks them;
    its rate takes momentum ``turn``, and ``carry`` (1 + t) is what both share of the mass.
    """

    def forces(t: Any, y: Any, v: Any, a: Any, *_: Any) -> Any:
        shared = carry * ((1 + t)[:, None] * a[:, -1:] + v[:, -1:])
        return stiffness * y + damping * v + a + push * y[:, -1:] + turn * v[:, -1:] + shared

    free = 1 if ways is None else 2
    link = SimpleNamespace(mechanism=SimpleNamespace(rotation_vector_places=()))
    tied = None if ways is None else SimpleNamespace(held=forces)
    masses = np.broadcast_to(np.eye(free + 1), (601, free + 1, free + 1))
    return SimpleNamespace(
        free=free, tied=tied, whole=link, run=np.arange(free + 1), forces=forces,
        lesser_forces=forces, lesser_masses=lambda t, y: masses,
    )  # fmt: skip


@pytest.mark.parametrize(("stiffness", "damping"), [(400.0, 0.0), (400.0, 6.0), (-9.0, 0.0)])
@pytest.mark.parametrize("loop", [False, True])
def test_drift_is_that_of_an_oscillator(stiffness: float, damping: float, loop: bool) -> None:
    """ë + c ė + k e = -ΔR, constant, from rest: closed forms, to 2 % of the largest in 600 steps of 5 periods; of two
    joints that a loop lets move only together, too, with the little damping of its method.
    """
    t = np.linspace(0.0, 1.5, 601)
    way = np.array([[1.0], [1.0]]) / np.sqrt(2)
    compared = one_way(stiffness, damping, 3.0, [way] * len(t) if loop else None)
    n = compared.free + 1
    still, answer = np.zeros((len(t), n)), np.zeros((len(t), n))
    answer[:, -1] = 1.0
    motion = Motion(t, (still, still, still), (still, still, still))
    joints = np.zeros((len(t), compared.free))
    rows = np.zeros((len(t), 1, n) if loop else (len(t), 0, n))
    found = Unbalanced(still, joints, joints, rows, np.zeros(rows.shape[:2]))
    drift = joint_drift(compared, motion, found, answer, answer[0], [way] * len(t) if loop else None)
    roots = np.roots([1.0, damping, stiffness]).astype(complex)
    c = np.linalg.solve(np.array([[1.0, 1.0], roots]), [1.0, 0.0])
    exact = -3.0 / stiffness * (1 - (c[0] * np.exp(roots[0] * t) + c[1] * np.exp(roots[1] * t)).real)
    assert np.abs(drift - exact[:, None]).max() < (0.06 if loop else 0.02) * np.abs(exact).max()


def test_a_force_that_comes_beside_pushes_against_its_sign() -> None:
    """A free joint of unit mass under a residual force of 2, from rest: e = -t²; Newmark's method is exact."""
    t = np.linspace(0.0, 1.5, 61)
    still = np.zeros((len(t), 2))
    found = Unbalanced(still, still[:, :1], still[:, :1], np.zeros((len(t), 0, 2)), np.zeros((len(t), 0)))
    motion = Motion(t, (still, still, still), (still, still, still))
    more = np.full((len(t), 1), 2.0)
    drift = joint_drift(one_way(0.0, 0.0, 0.0, None), motion, found, still, still[0], None, False, more)
    assert drift[:, 0] == pytest.approx(-(t**2), rel=0, abs=1e-9)


@pytest.mark.parametrize("carry", [0.0, 0.4])
@pytest.mark.parametrize(("borne", "rate"), [(0.0, 0.0), (1.0, 0.0), (0.5, 2.0)])
def test_links_that_are_stretched_take_momentum_from_joints(borne: float, rate: float, carry: float) -> None:
    """A free joint of unit mass whose momentum is ė + g δ + c (1 + t) δ̇, from rest: by δ that comes at once, and grows
    evenly, ė = -g (δ - δ₀) - c (1 + t) δ̇, and e jumps by -c Δδ; Newmark's method is exact for such parabolas.
    """
    t = np.linspace(0.0, 1.5, 61)
    compared = one_way(0.0, 0.0, 0.0, None, 3.0, carry)
    still, answer = np.zeros((len(t), 2)), np.zeros((len(t), 2))
    answer[:, -1] = 1.0 + rate * t
    found = Unbalanced(still, still[:, :1], still[:, :1], np.zeros((len(t), 0, 2)), np.zeros((len(t), 0)))
    motion = Motion(t, (still, still, still), (still, still, still))
    drift = joint_drift(compared, motion, found, answer, np.array([0.0, borne]), None)
    exact = -3.0 * ((1.0 - borne) * t + rate * t**2 / 2) - carry * (1.0 - borne + rate * (t + t**2 / 2))
    assert drift[:, 0] == pytest.approx(exact, rel=0, abs=1e-9)
