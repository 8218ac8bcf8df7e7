"""Modes above a bandwidth follow statically: statics, accuracy against all modes, algebra, faults, work, warnings."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scenes
import scipy.optimize

import erls
from erls.equations.erls.formulation import Erls
from erls.equations.quasi_static.formulation import QuasiStatic
from erls.equations.registry import formulate
from erls.errors import Cause, SimulationError
from erls.integrate.base import hermite
from erls.run.chain.run import ChainRun
from erls.run.file import load_run, save_run
from erls.run.watches.static_following import static_error
from erls.scene.build import build_mechanism

FLAT, ROBOT = scenes.ROOT / "data/l_shape/steel_flat.toml", scenes.ROOT / "data/robot/two_link.toml"
TIGHT = ["simulation.integrator=lobatto", "simulation.tolerance=1e-7"]
STATIC_START = 'initial.deformation="static"'


def _run(path: Path, *overrides: str) -> ChainRun:
    return erls.simulate(erls.load_scene(path, [scenes.LINEAR, *overrides]))


def _reduced(path: Path, *overrides: str) -> QuasiStatic:
    scene = erls.load_scene(path, [scenes.LINEAR, *overrides])
    found = formulate(build_mechanism(scene).mechanism, scene.record.simulation)
    assert isinstance(found, QuasiStatic)
    return found


def _points(run: ChainRun, times: np.ndarray) -> np.ndarray:
    states = run.states(times)
    return np.array([[run.point_position(s, k) for s in states] for k in range(len(run.point_names))])


def _error(run: ChainRun, whole: ChainRun, count: int = 16) -> float:
    """Largest distance of a named point; not at jumps of forces."""
    times = np.linspace(2e-3, run.end - 2e-3, count)
    return float(np.linalg.norm(_points(run, times) - _points(whole, times), axis=-1).max())


def _prescribed(folder: Path, duration: float, degrees: float = 40.0, **changes: Any) -> Path:
    """The steel L with a driven joint that turns smoothly, at rest under its weight before."""
    scenes.l_link(folder)
    motion = {"shape": "polynomial", "from_deg": 0.0, "to_deg": degrees, "duration": duration, "degree": 7}
    joint = {**scenes.L_SCENE["joints"][0], "drive": {"type": "motion", "motion": motion}}
    simulation = {"duration": duration, "integrator": "lobatto", "tolerance": 1e-8}
    initial = {"deformation": "static"}
    return scenes.l_scene(folder, joints=[joint], simulation=simulation, initial=initial, **changes)


# (1) statics


def _equilibrium(system: Any, start: np.ndarray) -> np.ndarray:
    zero = np.zeros(system.size)
    scale = 1 / np.maximum(np.abs(np.diag(system.stiffness_and_damping(0.0, start, zero)[0])), 1.0)
    found = scipy.optimize.root(lambda y: scale * system.residual(0.0, y, zero, zero), start, tol=1e-15)
    return np.asarray(found.x)


@pytest.mark.parametrize("bandwidth", [0.5, 25.0, 60.0, 150.0, 300.0])
def test_equilibrium_is_that_of_all_modes(tmp_path: Path, bandwidth: float) -> None:
    """An L that hangs in a joint spring at 12 deg: every node within 1e-10 m, the joint angle within 1e-10 rad."""
    scenes.l_link(tmp_path)
    joint = {**scenes.L_SCENE["joints"][0], "stiffness": 40.0}
    path = scenes.l_scene(tmp_path, joints=[joint])
    system = _reduced(path, f"simulation.bandwidth={bandwidth}")
    whole = system.inner
    y = _equilibrium(whole, whole.initial_state()[0])
    z = _equilibrium(system, system.initial_state()[0])
    expected, found = whole.state(0.0, y, 0 * y), system.state(0.0, z, 0 * z)
    assert expected.angles[0] > 0.2
    assert abs(found.angles[0] - expected.angles[0]) <= 1e-10
    shapes = whole.mechanism.links[0].model.translation_shapes
    assert np.abs(shapes @ (found.modal[0] - expected.modal[0])).max() <= 1e-10
    for mine, theirs in zip(system.reactions(0.0, z, 0 * z), whole.reactions(0.0, y, 0 * y), strict=True):
        np.testing.assert_allclose(mine.force, theirs.force, atol=1e-7)
        assert mine.effort == pytest.approx(theirs.effort, rel=1e-9)


def test_a_start_at_rest_stays_at_rest(tmp_path: Path) -> None:
    """Held joints, links in equilibrium: nothing moves, by 1e-12 m, and the motor carries what it carries with all."""
    path = _prescribed(tmp_path, 0.05, degrees=0.0)
    whole, run = _run(path), _run(path, "simulation.bandwidth=60")
    times = np.linspace(0, 0.05, 11)
    assert np.abs(_points(run, times) - _points(whole, np.zeros(11))).max() <= 1e-12
    assert run.joint_effort("shoulder", 0.03) == pytest.approx(whole.joint_effort("shoulder", 0.0), rel=1e-9)


def _rod(folder: Path, rate: float) -> Path:
    """A rod in its full finite element model, without weight, turned up to a rate [rad/s] within 0.05 s."""
    scenes.arm_link(
        folder,
        frame={
            "nodes": {"root": [0.0, 0.0, 0.0], "tip": [0.5, 0.0, 0.0]},
            "members": [{"from": "root", "to": "tip", "elements": 6, "material": "m", "section": "s"}],
        },
        reduction={"fixed_interface_modes": 30, "elastic_modes": 36},
    )
    motion = {"shape": "spin_up", "rate": rate, "duration": 0.05, "ramp": "sine"}
    data = {
        "simulation": {"duration": 0.1, "bandwidth": 1.0},
        "gravity": [0.0, 0.0, 0.0],
        "joints": [{"name": "hub", "dh": {"convention": "standard"}, "drive": {"type": "motion", "motion": motion}}],
        "links": [{"name": "arm", "model": "arm.toml", "mesh_pose": {"frame": "joint"}}],
        "points": [{"name": "tip", "link": "arm", "node": "tip"}],
    }
    return scenes.write_toml(folder / "rod.toml", data)


def test_centrifugal_stretch(tmp_path: Path) -> None:
    """A rod at 60 rad/s, all modes static, nothing left to integrate: the stretch of all modes, and ρ ω² L³ / (3 E)
    within 0.2 % (0.14 % from 6 elements; a quarter of that from 12).
    """
    run = _run(_rod(tmp_path, 60.0))
    system = run.formulation
    assert isinstance(system, QuasiStatic)
    assert system.size == 0
    stretch = np.linalg.norm(run.position("tip", 0.09)) - 0.5
    assert stretch == pytest.approx(2700.0 * 60.0**2 * 0.5**3 / (3 * 7e10), rel=2e-3)
    zero = np.zeros(system.inner.size)
    scale = 1 / np.diag(system.inner.stiffness_and_damping(0.09, zero, zero)[0])
    y = scipy.optimize.root(lambda y: scale * system.inner.residual(0.09, y, zero, zero), zero, tol=1e-15).x
    difference = system.inner.state(0.09, y, zero).modal[0] - run.states([0.09])[0].modal[0]
    assert np.abs(run.formulation.mechanism.links[0].model.translation_shapes @ difference).max() <= 1e-14


def test_no_equilibrium_is_told(tmp_path: Path) -> None:
    """At 600 rad/s, three times its bending frequency, the rod without geometric stiffening has none."""
    with pytest.raises(SimulationError, match="find no static equilibrium") as caught:
        _run(_rod(tmp_path, 600.0))
    assert caught.value.cause == Cause.NO_EQUILIBRIUM


# (2) motion, against all modes and against leaving the same modes out


@pytest.mark.parametrize(
    ("path", "overrides", "bandwidth", "error", "gain"),
    [  # largest error [m], and by how much leaving the modes out is worse; the latter about half of what it is
        (ROBOT, [STATIC_START, "simulation.duration=0.9"], 20.0, 2e-4, 2.0),
        (ROBOT, [STATIC_START, "simulation.duration=0.9"], 60.0, 3e-7, 15.0),
        (FLAT, ["simulation.duration=0.5"], 50.0, 1.5e-5, 6.0),
    ],
)
def test_closer_than_truncation(path: Path, overrides: list[str], bandwidth: float, error: float, gain: float) -> None:
    """Named points of the robot, which starts smoothly, and of the L, which is let go."""
    given = [*overrides, *TIGHT, f"simulation.bandwidth={bandwidth}"]
    whole, run = _run(path, *overrides, *TIGHT), _run(path, *given)
    truncated = _run(path, *given, 'effects=["linear", "-static_correction"]')
    found = _error(run, whole)
    assert truncated.formulation.size == run.formulation.size < whole.formulation.size / 3
    assert found <= error
    assert _error(truncated, whole) >= gain * found


def test_payload_on_the_robot(tmp_path: Path) -> None:
    """Interface loads: half the arm's mass at its end, off the axis. Positions, joint torques, reactions."""
    text = ROBOT.read_text(encoding="utf-8").replace("links/arm.toml", str(ROBOT.parent / "links/arm.toml"))
    text += '[[payloads]]\npoint = "end2"\nmass = 0.07\noffset = [0.0, 0.03, 0.02]\n'
    path = tmp_path / "loaded.toml"
    path.write_text(text)
    common = [STATIC_START, "simulation.duration=0.9", *TIGHT]
    whole = _run(path, *common)
    times = np.linspace(0.01, 0.89, 9)

    def efforts(run: ChainRun) -> np.ndarray:
        return np.array([run.joint_effort(name, times) for name in run.joint_names])

    def reactions(run: ChainRun) -> np.ndarray:
        return np.concatenate([np.hstack(run.reaction(name, times)) for name in run.joint_names])

    run = _run(path, *common, "simulation.bandwidth=60")
    truncated = _run(path, *common, "simulation.bandwidth=60", 'effects=["linear", "-static_correction"]')
    assert _error(run, whole) <= min(5e-7, _error(truncated, whole) / 5)
    for quantity in (efforts, reactions):
        expected = quantity(whole)
        assert np.abs(quantity(run) - expected).max() <= 1e-4 * np.abs(expected).max()


def _errors(path: Path, bandwidth: float) -> tuple[float, float, float]:
    """Error of the points, its estimate from the run alone, and the static deflection [m]."""
    whole, run = _run(path), _run(path, f"simulation.bandwidth={bandwidth}")
    assert isinstance(run.formulation, QuasiStatic)
    found = static_error(run.formulation, run.solution)
    assert found is not None
    return _error(run, whole, 60), found.error, found.deflection


def test_error_falls_with_the_square_of_the_frequency(tmp_path: Path) -> None:
    """Relative to the static deflection, (Ω/ω)²: four times as stiff, modes are twice as fast."""
    relative = []
    for modulus in (2e11, 8e11):
        path = _prescribed(tmp_path, 1.0)
        scenes.l_link(tmp_path, materials={"m": {"youngs_modulus": modulus}})
        error, _, deflection = _errors(path, 5.0)
        relative.append(error / deflection)
    assert np.log2(relative[0] / relative[1]) == pytest.approx(2.0, abs=0.3)


@pytest.mark.parametrize(
    ("path", "overrides", "bandwidth"),
    [
        (FLAT, ["simulation.duration=0.5"], 50.0),  # a sudden load
        (FLAT, ["simulation.duration=0.5"], 200.0),
        (ROBOT, [STATIC_START, "simulation.duration=0.9"], 20.0),
        (None, 1.0, 5.0),  # a driven L, and its duration
        (None, 1.0, 20.0),
        (None, 2.0, 5.0),
    ],
)
def test_error_estimate(path: Path | None, overrides: Any, bandwidth: float, tmp_path: Path) -> None:
    """From the run alone, within a factor of 3 of the distance from all modes, from 1e-8 to 1e-4 m."""
    if path is None:
        found, estimate, _ = _errors(_prescribed(tmp_path, overrides), bandwidth)
    else:
        whole, run = _run(path, *overrides, *TIGHT), _run(path, *overrides, *TIGHT, f"simulation.bandwidth={bandwidth}")
        assert isinstance(run.formulation, QuasiStatic)
        judged = static_error(run.formulation, run.solution)
        assert judged is not None
        found, estimate = _error(run, whole), judged.error
    assert found / 3 <= estimate <= 3 * found


# (4) the algebra, by other means


def test_states_solve_the_algebraic_equations(tmp_path: Path) -> None:
    """In a run of a spatial chain: accelerations of the slow coordinates and the static deflection are the roots that
    SciPy finds of the forces of all modes, as far as iterations go: 1e-6 of either.
    """
    path = scenes.three_links(tmp_path, "prescribed")
    settings = ["simulation.duration=0.01", "simulation.step=1e-3", "simulation.bandwidth=60"]
    run = _run(path, *settings, "simulation.integrator=generalized_alpha")
    system, s, t = run.formulation, run.solution, 0.006
    assert isinstance(system, QuasiStatic)
    whole, modes, n = Erls(system.inner.mechanism), system.modes, system.size
    (z,), (v,) = hermite(s.t, s.y, s.v, s.a, np.array([t]))
    eta = system.deflection(t, z, v)
    a = system.acceleration(t, z, v)
    place, rates, _ = system.all_modes(t, z, v, a)
    np.testing.assert_allclose(place, modes.slow @ z + modes.static @ eta, atol=1e-13)
    scale = np.sqrt(modes.stiffness)

    def balance(x: np.ndarray) -> np.ndarray:
        force = whole.residual(t, modes.slow @ z + modes.static @ (x[n:] / scale), rates, modes.slow @ x[:n])
        return np.concatenate([modes.slow.T @ force, modes.static.T @ force / scale])

    found = scipy.optimize.root(balance, np.concatenate([0 * a, 0 * eta]), tol=1e-11)
    assert found.success
    assert np.abs(modes.metres * (eta - found.x[n:] / scale)).max() <= 1e-6 * np.abs(modes.metres * eta).max()
    np.testing.assert_allclose(a, found.x[:n], atol=1e-6 * np.abs(found.x[:n]).max())


def test_rates_of_the_static_deflection(tmp_path: Path) -> None:
    """They are its differences along the run, but for what deformation adds to inertia."""
    run = _run(_prescribed(tmp_path, 0.5), "simulation.bandwidth=60")
    system, s, step = run.formulation, run.solution, 2e-4
    assert isinstance(system, QuasiStatic)
    for t in (0.12, 0.31):
        times = (t - step, t, t + step)
        ys, vs = hermite(s.t, s.y, s.v, s.a, np.array(times))
        before, _, after = (system.deflection(*at) for at in zip(times, ys, vs, strict=True))
        rates = system.all_modes(t, ys[1], vs[1], system.acceleration(t, ys[1], vs[1]))[1]
        found = np.linalg.lstsq(system.modes.static, rates - system.modes.slow @ vs[1])[0]
        expected = (after - before) / (2 * step)
        metres = system.modes.metres
        assert np.abs(metres * (found - expected)).max() <= 0.02 * np.abs(metres * expected).max()


def test_floating_frames() -> None:
    """FFR (mean axis) with 20 of 24 modes static comes as near to all modes as ERLS; leaving them out is worse."""
    common = [STATIC_START, "simulation.duration=0.2", "simulation.integrator=lobatto", "simulation.tolerance=1e-5"]
    common += ['simulation.formulation="ffr"', 'simulation.body_frame="mean-axis"']
    whole, run = _run(ROBOT, *common), _run(ROBOT, *common, "simulation.bandwidth=60")
    truncated = _run(ROBOT, *common, "simulation.bandwidth=60", 'effects=["linear", "-static_correction"]')
    assert (whole.formulation.size, run.formulation.size) == (24, 4)
    found = _error(run, whole, 8)
    assert found <= min(4e-7, _error(truncated, whole, 8) / 8)


def test_energy_does_not_drift() -> None:
    """The L swings freely, modes above 50 Hz static: energy within 1e-4 of what it turns over, at the end as before."""
    run = _run(FLAT, *TIGHT, "simulation.duration=1.5", "simulation.bandwidth=50")
    times = np.linspace(0.01, 1.49, 45)
    energy = run.energy(times)
    error = np.abs(energy.total - energy.total[0])
    assert error.max() <= 1e-4 * energy.kinetic.max()
    assert error[30:].max() <= 1.5 * error[:30].max()


# (5) faults, and what needs nothing


def test_bandwidth_above_all_modes_changes_nothing() -> None:
    """Nor does it in a scene of rigid links."""
    for overrides in (["simulation.bandwidth=1e6"], ["simulation.bandwidth=50", "links.l.flexible=false"]):
        scene = erls.load_scene(FLAT, overrides)
        assert isinstance(formulate(build_mechanism(scene).mechanism, scene.record.simulation), Erls)


def test_massless_chain_is_told(tmp_path: Path) -> None:
    """A joint whose motion nothing resists is named as with all modes."""
    scenes.l_link(tmp_path)
    massless = {"name": "b", "rigid": {"mass": 0.0, "points": {"start": [0, 0, 0], "end": [1, 0, 0]}}}
    joints = [{"name": n, "dh": {"convention": "standard", "a": 0.4, "alpha_deg": 30.0}} for n in "ab"]
    links = [{"name": "a", "model": "link.toml", "mesh_pose": {"frame": "joint"}}, massless]
    path = scenes.l_scene(tmp_path, joints=joints, links=links, points=[])
    with pytest.raises(SimulationError, match="joint 'b'") as caught:
        _run(path, "simulation.bandwidth=50")
    assert caught.value.cause == Cause.SINGULAR_MASS


# (6) work


def test_fewer_coordinates_and_steps() -> None:
    """Half a second of the L at 1e-6 m (measured: 84 instead of 777 steps), and with an explicit method, whose steps
    the highest frequency limits (measured: 618 instead of 8757 evaluations in 0.02 s).
    """
    common = ["simulation.duration=0.5", "simulation.integrator=lobatto", "simulation.tolerance=1e-5"]
    whole, run = _run(FLAT, *common), _run(FLAT, *common, "simulation.bandwidth=50")
    assert (whole.formulation.size, run.formulation.size) == (19, 3)
    assert whole.solution.work.steps >= 5 * run.solution.work.steps
    assert run.solution.work.steps <= 110
    explicit = ["simulation.duration=0.02", "simulation.integrator=dop853", "simulation.rtol=1e-6"]
    all_modes = _run(FLAT, *explicit).solution.work.rhs_calls
    assert all_modes >= 10 * _run(FLAT, *explicit, "simulation.bandwidth=50").solution.work.rhs_calls


# (7) what the user is told; files; automatic effects


def test_static_modes_that_vibrate_are_told(tmp_path: Path) -> None:
    """A run whose loads jump says what it leaves out, with its size; one that starts smoothly says nothing."""
    run = _run(FLAT, "simulation.duration=0.2", "simulation.bandwidth=20")
    told = [text for text in run.warnings if "follow statically" in text]
    assert len(told) == 1
    assert "loads that jump would make them vibrate by" in told[0]
    fast = _run(_prescribed(tmp_path, 0.25, degrees=90.0), "simulation.bandwidth=5")
    told = [text for text in fast.warnings if "follow statically" in text]
    assert len(told) == 1
    assert "inertia would add" in told[0]
    assert not [
        text for text in _run(_prescribed(tmp_path, 1.0), "simulation.bandwidth=20").warnings if "static" in text
    ]


def test_run_files_hold_what_does_not_depend_on_the_modes(tmp_path: Path) -> None:
    """Written and read: the same states, from knots in the coordinates of all modes."""
    run = _run(ROBOT, "simulation.duration=0.1", "simulation.bandwidth=60")
    path = tmp_path / "run.h5"
    save_run(path, run)
    again = load_run(path)
    times = np.linspace(0.005, 0.095, 5)
    np.testing.assert_allclose(_points(again, times), _points(run, times), atol=1e-12)
    assert again.formulation.describe()["static_modes"] == 20


def test_automatic_effects_go_with_a_bandwidth(tmp_path: Path) -> None:
    """The certificate looks at all modes; the run stays in slow coordinates."""
    path = _prescribed(tmp_path, 0.3)
    changed = ["effects=auto", "simulation.effects_tolerance=1e-2", "simulation.bandwidth=60"]
    run = _run(path, *changed)
    assert isinstance(run.formulation, QuasiStatic)
    assert run.certificate is not None
    assert np.isfinite(run.certificate.error)
