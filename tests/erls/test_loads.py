"""Forces and moments on points: virtual power, work against potential, agreement of formulations."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import loop_scenes
import numpy as np
import pytest
import scenes
from scipy.integrate import solve_ivp

import erls
from benchmarks.follower_flutter import CASES
from erls.accuracy.audits import audits
from erls.accuracy.energy_balance import States, energy_of, power_taken
from erls.equations.erls.formulation import Erls
from erls.equations.erls.paper.dense_chain import DenseChain
from erls.equations.ffr.formulation import Ffr
from erls.equations.nodal.equations import Nodal
from erls.equations.registry import formulate
from erls.equations.serial.state_series import energy_series, state_series
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.run.chain.places import point_position
from erls.scene.build import build_mechanism
from erls.scene.read import load_scene
from erls.simulation.simulate import simulate

FORCE, MOMENT = [3.0, -2.0, 5.0], [0.4, 0.2, -0.7]
WAVE = [{"shape": "sine_burst", "start": 0.0, "amplitude": 1.0, "frequency_hz": 20.0, "cycles": 50}]
KINDS: dict[str, dict[str, Any]] = {
    "world": {"force": FORCE, "moment": MOMENT},
    "link": {"force": FORCE, "moment": MOMENT, "axes": "link", "factor": WAVE},
    "follower": {"force": FORCE, "moment": MOMENT, "follower": True, "factor": WAVE},
}
TREES: dict[str, Callable[[Mechanism], Any]] = {
    "erls": Erls,
    "minimum-norm": DenseChain,
    "ffr": Ffr,
    "mean-axis": lambda mechanism: Ffr(mechanism, "mean-axis"),
}
AT = 0.013  # s, within the wave


def _three(folder: Path, loads: list[dict[str, Any]], effects: str = "all", kind: str = "revolute") -> Mechanism:
    points = [{"name": "end", "link": "c", "node": "tip"}, {"name": "middle", "link": "b", "node": "tip"}]
    path = scenes.three_links(folder, kind, points=points, loads=loads, simulation={"effects": effects})
    return build_mechanism(load_scene(path)).mechanism


def _state(equations: Any) -> tuple[Array, Array, Array]:
    """Joints anywhere, links bent by some millimetres."""
    rng = np.random.default_rng(7)
    y, v, a = rng.standard_normal((3, equations.size))
    free = len(equations.free_joints)
    y[free:] *= 2e-3
    v[free:] *= 0.1
    return y, v, a


@pytest.mark.parametrize("effects", ["linear", "all"])
@pytest.mark.parametrize("name", TREES)
def test_generalized_forces_are_those_of_virtual_power(tmp_path: Path, name: str, effects: str) -> None:
    """What loads take from the residual is F · ∂x/∂y of the point that is reported (differences: 1e-8), and its
    power that of the load, to rounding, in all axes.
    """
    bare = TREES[name](_three(tmp_path, [], effects))
    y, v, a = _state(bare)
    without = bare.residual(AT, y, v, a)
    pulled = TREES[name](_three(tmp_path, [{"point": "end", "force": FORCE}], effects))
    gradient = np.empty(bare.size)
    for k in range(bare.size):
        both, step = np.array([y, y]), 1e-7
        both[:, k] += step, -step
        series = state_series(pulled, np.full(2, AT), both, np.zeros_like(both))
        ahead, behind = point_position(pulled.mechanism, series, 0)
        gradient[k] = FORCE @ (ahead - behind) / (2 * step)
    np.testing.assert_allclose(without - pulled.residual(AT, y, v, a), gradient, atol=1e-8 * np.abs(gradient).max())
    for load in KINDS.values():
        loads = [{"point": "end", **load}, {"point": "middle", **load}]
        equations = TREES[name](_three(tmp_path, loads, effects))
        taken = v @ (without - equations.residual(AT, y, v, a))
        assert equations.load_power(np.array([AT]), y[None], v[None])[0] == pytest.approx(taken, rel=1e-10)


def test_dense_form_of_the_paper_agrees(tmp_path: Path) -> None:
    """Residuals of ERLS by recursion and in the paper's matrices, links linear, to rounding; a prescribed joint too."""
    loads = [{"point": point, **load} for point in ("end", "middle") for load in KINDS.values()]
    mechanism = _three(tmp_path, loads, "linear", "prescribed")
    one, other = Erls(mechanism), DenseChain(mechanism, "joint-angle")
    at = _state(one)
    expected = other.residual(AT, *at)
    np.testing.assert_allclose(one.residual(AT, *at), expected, atol=1e-11 * np.abs(expected).max())


@pytest.mark.parametrize("name", ["erls", "ffr"])
@pytest.mark.parametrize("kind", KINDS)
def test_work_of_loads_closes_the_balance_of_energy(tmp_path: Path, name: str, kind: str) -> None:
    """Energy changes by the integral of the power, within 1e-9 of what is exchanged, along motions integrated to 1e-12;
    a constant force in the world takes it from its potential -F · x.
    """
    load = {"force": FORCE} if kind == "world" else KINDS[kind]
    path = scenes.three_links(
        tmp_path,
        points=[{"name": "end", "link": "c", "node": "tip"}],
        loads=[{"point": "end", **load}],
        links=[{"name": n, **scenes.ARM, "mesh_pose": {"frame": "joint"}, "elastic_modes": 2} for n in "abc"],
    )
    equations = TREES[name](build_mechanism(load_scene(path)).mechanism)
    gained, times, ends = _closes(equations, 0.03)
    if kind == "world":
        places = point_position(equations.mechanism, state_series(equations, times, *ends), 0)
        exchanged = np.abs(np.diff(energy_series(equations, times, *ends), axis=0)).max()
        assert gained == pytest.approx(FORCE @ (places[1] - places[0]), abs=1e-9 * exchanged)


@pytest.mark.parametrize("kind", KINDS)
def test_it_does_in_loops(tmp_path: Path, kind: str) -> None:
    """The same of a load on the coupler of a four-bar."""
    load = {"force": FORCE} if kind == "world" else KINDS[kind]
    data = loop_scenes.four_bar(loads=[{"point": "coupler middle", **load}], gravity=[0.0, 0.0, -9.81])
    scene = load_scene(scenes.write_toml(tmp_path / "four_bar.toml", data))
    _closes(formulate(build_mechanism(scene).mechanism, scene.record.simulation), 0.2)


def _closes(equations: Any, end: float) -> tuple[float, Array, tuple[Array, Array]]:
    """Assert it; energy gained, the times 0 and ``end``, and the states there."""
    n = equations.size

    def motion(t: float, x: Array) -> Array:
        y, v = x[:n], x[n : 2 * n]
        power = equations.load_power(np.array([t]), y[None], v[None])
        return np.concatenate([v, equations.acceleration(t, y, v), power])

    y, v = equations.initial_state()
    x = solve_ivp(motion, (0.0, end), [*y, *v, 0.0], "DOP853", rtol=1e-12, atol=1e-14).y.T
    times = np.array([0.0, end])
    ends = x[[0, -1], :n], x[[0, -1], n : 2 * n]
    energies = energy_series(equations, times, *ends)
    exchanged = np.abs(np.diff(energies, axis=0)).max()
    assert exchanged > 0.02
    gained = float(np.diff(energies.sum(axis=1))[0])
    assert gained == pytest.approx(x[-1, -1], abs=1e-9 * exchanged)
    return gained, times, ends


@pytest.mark.parametrize("kind", KINDS)
def test_power_of_loads_on_nodes(tmp_path: Path, kind: str) -> None:
    """Of the nodal formulation: what loads take from the residual, to rounding, on a rigid link besides; its tangent
    is that of the residual (differences: 1e-6).
    """
    rigid = {"mass": 1.0, "points": {"root": [0, 0, 0], "tip": [0.3, 0.1, 0.0], "side": [0.1, 0.3, 0.2]}}
    points = [{"name": "end", "link": "l", "node": "tip"}, {"name": "side", "link": "r", "node": "side"}]
    second = {"name": "wrist", "dh": {"convention": "standard", "alpha_deg": 30.0}}
    scenes.l_link(tmp_path)

    def system(*loads: dict[str, Any]) -> Any:
        path = scenes.l_scene(
            tmp_path,
            joints=[*scenes.L_SCENE["joints"], second],
            links=[*scenes.L_SCENE["links"], {"name": "r", "rigid": rigid}],
            points=points,
            loads=list(loads),
            simulation={"formulation": "nodal"},
        )
        return Nodal(build_mechanism(load_scene(path)).mechanism).system

    bare, loaded = system(), system(*({"point": p["name"], **KINDS[kind]} for p in points))
    rng = np.random.default_rng(3)
    q = bare.compose(bare.start, 0.3 * rng.standard_normal(bare.size))
    v, zero = rng.standard_normal(bare.size), np.zeros(bare.size)
    without = bare.residual(AT, q, v, zero)
    rounding = 1e-15 * np.abs(without).max()
    taken = v @ (without - loaded.residual(AT, q, v, zero))
    assert loaded.kinds.loads.power(AT, q.poses, v.reshape(-1, 6)) == pytest.approx(taken, abs=10 * rounding)

    def of_loads(system: Any) -> Array:
        lines = zero[: system.constraints] if system.constraints <= len(zero) else np.zeros(system.constraints)
        found = system.stiffness_and_damping(AT, q, zero, zero, lines)[0]
        return np.asarray(found.todense() if hasattr(found, "todense") else found)

    tangent = of_loads(loaded) - of_loads(bare)
    for direction in rng.standard_normal((3, bare.size)):
        both = [bare.compose(q, step * direction) for step in (1e-5, -1e-5)]
        forces = [loaded.residual(AT, x, zero, zero) - bare.residual(AT, x, zero, zero) for x in both]
        expected = (forces[0] - forces[1]) / 2e-5
        atol = 1e-6 * np.abs(expected).max() + rounding / 1e-5
        np.testing.assert_allclose(tangent @ direction, expected, rtol=0, atol=atol)


@pytest.mark.parametrize("kind", KINDS)
def test_formulations_agree(tmp_path: Path, kind: str) -> None:
    """The L under a wave at its tip: ERLS and FFR within 1e-6 m, exact beams within 2e-5 m, over 0.06 s."""
    scenes.l_link(tmp_path)
    load = {"point": "tip", **KINDS[kind], "factor": WAVE}
    path = scenes.l_scene(tmp_path, loads=[load], simulation={"duration": 0.06, "step": 5e-4})
    runs = [erls.simulate(load_scene(path, changes), verdict=False) for changes in CASES.values()]
    places = [run.position("tip", np.linspace(0.02, 0.06, 9)) for run in runs]
    still = scenes.l_scene(tmp_path, simulation={"duration": 0.06, "step": 5e-4})
    moved = erls.simulate(load_scene(still), verdict=False).position("tip", np.linspace(0.02, 0.06, 9)) - places[0]
    assert np.abs(moved).max() > 1e-3  # the load matters
    assert np.abs(places[1] - places[0]).max() < 1e-6
    assert np.abs(places[2] - places[0]).max() < 2e-5


def test_absolute_coordinates_agree(tmp_path: Path) -> None:
    """Loads on links that float freely, tied by joints: the motion of independent coordinates within 1e-8 m."""
    scenes.l_link(tmp_path)
    loads = [{"point": point, **load} for point in ("tip", "elbow") for load in KINDS.values()]
    path = scenes.l_scene(tmp_path, loads=loads, simulation={"duration": 0.02, "step": 5e-4, "formulation": "ffr"})
    one, other = (
        erls.simulate(load_scene(path, [f"simulation.coordinates={x}"]), verdict=False)
        for x in ("independent", "absolute")
    )
    times = np.linspace(0.0, 0.02, 5)
    np.testing.assert_allclose(other.position("tip", times), one.position("tip", times), atol=1e-8)
    np.testing.assert_allclose(other.joint_effort("shoulder", times), one.joint_effort("shoulder", times), atol=1e-6)


@pytest.mark.parametrize("kind", KINDS)
def test_loads_on_links_in_pieces(tmp_path: Path, kind: str) -> None:
    """A static deflection of 1e-5 of the length is that of the whole link to as much; axes of the link are those of its
    first piece.
    """
    scenes.l_link(tmp_path, elements=3)
    load = {k: [x / 100 for x in v] if k in ("force", "moment") else v for k, v in KINDS[kind].items() if k != "factor"}
    tips = []
    for pieces in (1, 3):
        path = scenes.l_scene(
            tmp_path,
            joints=[{**scenes.L_SCENE["joints"][0], "type": "fixed"}],
            links=[{**scenes.L_SCENE["links"][0], "substructures": pieces}],
            loads=[{"point": "tip", **load}],
            gravity=[0.0, 0.0, 0.0],
            initial={"deformation": "static"},
            simulation={"formulation": "ffr"},
        )
        scene = load_scene(path)
        equations = formulate(build_mechanism(scene).mechanism, scene.record.simulation)
        state = equations.state(0.0, *equations.initial_state())
        tips.append(point_position(equations.mechanism, state, 1) - [0.5, 0.5, 0.0])
        power = equations.load_power(np.zeros(1), *(x[None] for x in equations.initial_state()))
        assert power == pytest.approx(0.0, abs=1e-12)
    assert 1e-6 < np.linalg.norm(tips[0]) < 1e-4
    assert tips[1] == pytest.approx(tips[0], abs=1e-4 * float(np.linalg.norm(tips[0])))


def test_loads_on_a_closed_chain(tmp_path: Path) -> None:
    """A load on the coupler of a four-bar: ERLS and FFR within 1e-9 m, and the balance of energy of their knots as the
    accuracy of runs takes it: power of loads against differences of energy over a step (Gauss-Lobatto: 1e-6).
    """
    data = loop_scenes.four_bar(loads=[{"point": "coupler middle", **KINDS["follower"]}])
    runs = [
        loop_scenes.run(tmp_path, data, name, integrator="lobatto", duration=0.1, tolerance=1e-10)
        for name in ("erls", "ffr")
    ]
    times = np.linspace(0.0, 0.1, 11)
    one, other = (run.position("coupler tip", times) for run in runs)
    np.testing.assert_allclose(one, other, atol=1e-8)
    run, (nodes, weights) = runs[0], np.polynomial.legendre.leggauss(6)
    edges = np.linspace(0.0, 0.1, 41)
    inside = (edges[:-1, None] + np.diff(edges)[:, None] * (nodes + 1) / 2).ravel()
    _, t, y, v = run._interpolated(inside)
    power, _ = power_taken(States(run.formulation, t, y, v, np.zeros_like(v)))
    work = (power.reshape(40, 6) @ weights / 2 * np.diff(edges)).sum()
    stored = energy_series(energy_of(run.formulation), *run._interpolated(edges[[0, -1]])[1:])
    assert np.diff(stored.sum(axis=1))[0] == pytest.approx(work, rel=1e-6)
    assert not run.conservative


def test_audits_hold_where_a_load_acts_along_a_free_joint(tmp_path: Path) -> None:
    """No momentum is expected to stay: it is the impulse of 2 N half a metre beside the axis, but for how that lever
    bends; steps end where the load jumps.
    """
    scenes.l_link(tmp_path)
    jump = [{"shape": "step", "start": 0.0123, "value": 1.0, "end": 0.0217}]
    path = scenes.l_scene(
        tmp_path,
        gravity=[0.0, 0.0, 0.0],
        loads=[{"point": "tip", "force": [0.0, 0.0, 2.0], "follower": True, "factor": jump}],
        simulation={"duration": 0.03},
    )
    run = simulate(load_scene(path), verdict=False)
    assert all(audit.ok for audit in audits(run))
    assert {0.0123, 0.0217} <= set(run.solution.t.tolist())
    y, v = run.solution.y[-1], run.solution.v[-1]
    momentum = run.formulation.mass_matrix(run.end, y)[0] @ v
    assert momentum == pytest.approx(-2.0 * 0.5 * (0.0217 - 0.0123), rel=1e-2)


@pytest.mark.parametrize("name", ["erls", "ffr", "nodal"])
def test_a_motor_holds_a_load(tmp_path: Path, name: str) -> None:
    """At rest under 2 N half a metre beside a joint that is held: 1 N m, but for the square of a slope of 1e-3."""
    scenes.l_link(tmp_path)
    held = {"type": "motion", "motion": {"shape": "waypoints", "times": [0.0, 1.0], "values": [0.0, 0.0]}}
    path = scenes.l_scene(
        tmp_path,
        gravity=[0.0, 0.0, 0.0],
        initial={"deformation": "static"},
        joints=[{**scenes.L_SCENE["joints"][0], "drive": held}],
        loads=[{"point": "tip", "force": [0.0, 0.0, 2.0]}],
        simulation={"duration": 1e-3, "formulation": name},
    )
    run = erls.simulate(path, verdict=False)
    assert run.joint_effort("shoulder", [0.0, 1e-3]) == pytest.approx(1.0, rel=1e-5)


@pytest.mark.parametrize("effects", ["linear", "all"])
@pytest.mark.parametrize("name", TREES)
def test_a_force_on_all_mass_is_gravity(tmp_path: Path, name: str, effects: str) -> None:
    """Residuals, in the place of gravity, on links with a payload, to rounding; so is the power against its energy."""
    pull, more = [1.0, -2.0, -9.0], {"payloads": [{"point": "end", "mass": 0.5, "offset": [0.0, 0.1, 0.0]}]}
    points = [{"name": "end", "link": "c", "node": "tip"}]
    both = []
    for given in ({"gravity": pull}, {"gravity": [0.0, 0.0, 0.0], "loads": [{"force_per_mass": pull}]}):
        path = scenes.three_links(tmp_path, points=points, simulation={"effects": effects}, **more, **given)
        both.append(TREES[name](build_mechanism(load_scene(path)).mechanism))
    y, v, a = _state(both[0])
    expected = both[0].residual(AT, y, v, a)
    np.testing.assert_allclose(both[1].residual(AT, y, v, a), expected, atol=1e-11 * np.abs(expected).max())
    places = np.array([y - 1e-7 * v, y + 1e-7 * v])
    stored = energy_series(both[0], np.full(2, AT), places, np.zeros_like(places))[:, 2]
    power = both[1].load_power(np.array([AT]), y[None], v[None])[0]
    assert power == pytest.approx((stored[0] - stored[1]) / 2e-7, rel=1e-6)


@pytest.mark.parametrize("formulation", ["nodal", "pieces", "absolute"])
def test_a_force_on_all_mass_moves_as_gravity_does(tmp_path: Path, formulation: str) -> None:
    """The L under it instead, to 1e-8 m; of nodal elements, whose halves of mass bear it, to their square: 2e-5 m."""
    scenes.l_link(tmp_path, 6)
    settings: dict[str, dict[str, Any]] = {
        "nodal": {"simulation": {"formulation": "nodal"}},
        "pieces": {"links": [{**scenes.L_SCENE["links"][0], "substructures": 2}]},
        "absolute": {"simulation": {"coordinates": "absolute"}},
    }
    tips = []
    for given in ({}, {"gravity": [0.0, 0.0, 0.0], "loads": [{"link": "l", "force_per_mass": [0.0, 0.0, -9.81]}]}):
        short = {"simulation": {"duration": 0.05, "step": 5e-4, "formulation": "ffr"}}
        path = scenes.l_scene(tmp_path, **scenes.merged(short, settings[formulation]), **given)
        tips.append(erls.simulate(load_scene(path), verdict=False).position("tip", np.linspace(0.0, 0.05, 6)))
    assert np.abs(tips[0][-1] - tips[0][0]).max() > 5e-3
    np.testing.assert_allclose(tips[1], tips[0], atol=2e-5 if formulation == "nodal" else 1e-8)
