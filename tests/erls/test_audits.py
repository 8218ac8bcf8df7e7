"""Audits hold over scenes of the repository with room to spare, and tell what was made wrong.

Tampering is by a thousandth, or what a hundred times the tolerance is; the parallelogram at its change point is one
where the default integrator is known to gain energy before it stops.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import loop_scenes
import numpy as np
import pytest
import scenes

from erls.accuracy.audits import AUDITS, Audit, audits
from erls.accuracy.body_audits import body_audits
from erls.accuracy.looked_at import LookedAt
from erls.accuracy.panels import panels_of, within_legs
from erls.accuracy.power import known_power
from erls.equations.formulation import Energy
from erls.equations.loops.closed_chain import ClosedChain
from erls.equations.serial.formulation import SerialFormulation
from erls.equations.serial.state_series import ReactionSeries, energy_series
from erls.errors import SimulationError
from erls.run.bodies.motion import BodyMotion
from erls.run.chain.run import ChainRun
from erls.scene.read import load_scene
from erls.simulation.simulate import simulate

DATA = scenes.ROOT / "data"
ALPHA = ("simulation.integrator=generalized_alpha",)
SHORT = "simulation.duration=0.2"

HOLD = {
    "swing": ("l_shape/steel_tall.toml", ()),
    "swing, floating frames": ("l_shape/steel_tall.toml", ("simulation.formulation=ffr",)),
    "swing, minimum norm": ("l_shape/steel_tall.toml", ("simulation.gauge=minimum-norm", SHORT)),
    "swing, steps": ("l_shape/steel_tall.toml", (*ALPHA, "simulation.step=1e-3")),
    "swing, nodes": ("l_shape/steel_tall.toml", ("simulation.formulation=nodal", "simulation.step=1e-3", SHORT)),
    "swing, static modes": ("l_shape/steel_tall.toml", ("simulation.bandwidth=500",)),
    "torque": ("l_shape/torque.toml", ()),
    "follower force": ("beck/column.toml", ()),
    "follower force, floating frames": ("beck/column.toml", ("simulation.formulation=ffr", SHORT)),
    "follower force, nodes": ("beck/column.toml", ("simulation.formulation=nodal", "simulation.step=5e-4", SHORT)),
    "torque, steps": ("l_shape/torque.toml", (*ALPHA, "simulation.step=1e-3")),
    "torque, coarse steps": ("l_shape/torque.toml", (*ALPHA, "simulation.step=1e-2")),
    "torque, most damping": (
        "l_shape/torque.toml",
        (*ALPHA, "simulation.step=1e-2", "simulation.spectral_radius=0.0"),
    ),
    "torque, static modes": ("l_shape/torque.toml", ("simulation.bandwidth=500",)),
    "robot": ("robot/two_link.toml", ()),
    "robot, absolute": (
        "robot/two_link.toml",
        ("simulation.formulation=ffr", "simulation.coordinates=absolute", "simulation.step=1e-3", SHORT),
    ),
    "robot of three links": ("robot/three_link.toml", ()),
    "four-bar": ("four_bar/flexible.toml", ()),
    "four-bar, steps": ("four_bar/flexible.toml", (*ALPHA, "simulation.step=5e-4")),
    "rigid four-bar": ("four_bar/rigid.toml", ()),
    "five-bar": ("five_bar/parallel_robot.toml", ()),
    "slider-crank": ("slider_crank/flexible.toml", ()),
    "fast slider-crank": ("slider_crank/fast.toml", ()),
    "spin": ("spin_up/beam.toml", ()),
    "tree": ("tree/two_arms.toml", ()),
    "tree, nodes": ("tree/two_arms.toml", ("simulation.formulation=nodal", "simulation.step=1e-3", SHORT)),
    "three legs": ("parallel/three_legs.toml", ()),
}


def simulated(path: Path | str, overrides: Sequence[str] = ()) -> ChainRun:
    run = simulate(load_scene(DATA / path, overrides))
    assert isinstance(run, ChainRun)
    return run


def found(run: ChainRun, **more: Any) -> dict[str, Audit]:
    return {audit.name: audit for audit in audits(run, **more)}


def breaches(run: ChainRun, **more: Any) -> set[str]:
    return {name for name, audit in found(run, **more).items() if not audit.ok}


@pytest.mark.parametrize("name", HOLD)
def test_audits_hold(name: str) -> None:
    path, overrides = HOLD[name]
    run = simulated(path, overrides)
    seen = found(run, reported=True)
    assert {"energy", "rates"} <= set(seen) <= set(AUDITS)
    assert ("constraints" in seen) == (bool(run.formulation.mechanism.loops) or "nodes" in name)
    for audit in seen.values():  # half of a limit, so that none holds by chance
        assert audit.value <= 0.5 * audit.limit, audit
        assert audit.ok
        assert np.isfinite(audit.limit)
        assert audit.text


def _knots(run: ChainRun, **changes: Any) -> ChainRun:
    return replace(run, solution=replace(run.solution, **changes))


@pytest.mark.parametrize("path", ["l_shape/steel_tall.toml", "l_shape/torque.toml", "four_bar/flexible.toml"])
def test_velocities_off_by_a_thousandth_are_told(path: str) -> None:
    run = simulated(path)
    assert not breaches(run)
    assert "rates" in breaches(_knots(run, v=run.solution.v * 1.001))


@pytest.mark.parametrize("path", ["l_shape/torque.toml", "robot/two_link.toml", "five_bar/parallel_robot.toml"])
def test_a_jump_is_told(path: str) -> None:
    """A hundred times the tolerance, from a knot on that no audit picks by itself."""
    run = simulated(path)
    look = LookedAt(run)
    y = run.solution.y.copy()
    y[len(y) // 3 + 1 :] += 100 * run.scene.record.simulation.tolerance / look.metres
    assert "rates" in breaches(_knots(run, y=y))


def test_lost_energy_is_told() -> None:
    """One per cent of the energy of a swing, lost from its middle on, with rates that are those of the positions."""
    run = simulated("l_shape/steel_tall.toml")
    s = run.solution
    half = len(s.t) // 2
    slow = 0.995  # time passes more slowly from there on
    t = np.concatenate([s.t[:half], s.t[half] + (s.t[half:] - s.t[half]) / slow])
    share = np.where(np.arange(len(t)) < half, 1.0, slow)[:, None]
    assert "energy" in breaches(_knots(run, t=t, v=s.v * share, a=s.a * share**2))


def test_wrong_efforts_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    for path, kind in (("robot/two_link.toml", SerialFormulation), ("five_bar/parallel_robot.toml", ClosedChain)):
        run, own = simulated(path), kind.reaction_series

        def wrong(*at: Any, own: Any = own) -> ReactionSeries:
            given = own(*at)
            return ReactionSeries(given.force, given.moment, 1.05 * given.effort)

        with monkeypatch.context() as patch:
            patch.setattr(kind, "reaction_series", wrong)
            assert "efforts" in breaches(run, reported=True)
        assert not breaches(run, reported=True)


def test_a_wrong_power_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """A torque that gives a tenth more than the equations say."""
    run = simulated("l_shape/torque.toml")
    monkeypatch.setattr("erls.accuracy.energy_balance.known_power", lambda *at: 1.1 * known_power(*at))
    assert breaches(run) == {"energy"}


@pytest.mark.parametrize("name", ["erls", "ffr"])
def test_power_of_a_load_that_is_forgotten_is_told(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    """A follower force, of which the balance of energy knows."""
    run = simulated("beck/column.toml", (f"simulation.formulation={name}", SHORT))
    assert not breaches(run)
    monkeypatch.setattr(SerialFormulation, "load_power", lambda self, t, y, v: np.zeros(len(t)))
    assert breaches(run) == {"energy"}


PARALLELOGRAM = {**loop_scenes.parallelogram(), "simulation": {"duration": 2.0}}


def _ended(path: Path) -> ChainRun:
    """What was computed, whether it came to its end or not."""
    try:
        run: object = simulate(path)
    except SimulationError as problem:
        run = problem.run
    assert isinstance(run, ChainRun)
    return run


def test_a_parallelogram_at_its_change_point(tmp_path: Path) -> None:
    """All links in line: conditions of the loop lose rank. Energy that is won or lost there is told, and so is half of
    it in a run that says to be 2 mm off.
    """
    run = _ended(scenes.write_toml(tmp_path / "scene.toml", PARALLELOGRAM))
    energy = run.energy(run.times)
    wrong = np.ptp(np.asarray(energy.total)) > 1e-3 * np.ptp(np.asarray(energy.gravity))
    assert ("energy" in breaches(run)) == wrong
    s = run.solution
    share = np.where(np.arange(len(s.t)) < len(s.t) // 2, 1.0, np.sqrt(0.5))[:, None]
    assert "energy" in breaches(_knots(run, v=s.v * share), integration=2e-3)


def test_momentum_about_a_free_joint(tmp_path: Path) -> None:
    """An arm of two links swings by itself, without weight, about a joint that nothing acts on; a step of velocity in
    one of them is told.
    """
    scene = {
        "gravity": [0.0, 0.0, 0.0],
        "simulation": {"duration": 1.0},
        "joints": [
            {**loop_scenes.joint("first", 0.2), "initial": {"rate": 3.0}},
            {**loop_scenes.joint("second", 0.5, 40.0), "initial": {"position_deg": 40.0, "rate": -8.0}},
        ],
        "links": PARALLELOGRAM["links"][:2],
        "points": PARALLELOGRAM["points"],
    }
    run = simulated(scenes.write_toml(tmp_path / "scene.toml", scene))
    assert "momentum" in found(run)
    assert not breaches(run)
    s = run.solution
    late = (np.arange(len(s.t)) > len(s.t) // 2)[:, None]
    assert "momentum" in breaches(_knots(run, v=s.v * np.where(late, 1.01, 1.0)))


def test_bodies() -> None:
    run = simulate(load_scene(DATA / "heavy_top/slow.toml"))
    assert isinstance(run, BodyMotion)
    seen = {audit.name: audit for audit in body_audits(run)}
    assert set(seen) == {"energy", "constraints"}
    assert all(audit.value <= 0.5 * audit.limit for audit in seen.values()), seen
    s = run.solution
    late = (np.arange(len(s.t)) > len(s.t) // 2)[:, None]
    faster = replace(run, solution=replace(s, v=s.v * np.where(late, 1.05, 1.0)))
    assert {audit.name for audit in body_audits(faster) if not audit.ok} == {"energy"}


def test_rules_of_panels() -> None:
    """Cubics over uneven knots are integrated to rounding, also by what a leg has left beyond whole panels; values on
    either side of a jump never mix.
    """
    random = np.random.default_rng(1)
    for count in (4, 5, 6, 7, 23):
        t = np.sort(random.random(count))
        panels = panels_of(t)
        powers = np.array([[at**k for k in range(4)] for at in t.tolist()])
        exact = [(t[-1] ** (k + 1) - t[0] ** (k + 1)) / (k + 1) for k in range(4)]
        assert np.abs(panels.integrals(powers).sum(axis=0) - exact).max() <= 1e-13  # rounding of sums of order 1
    t = np.array([0.0, 0.1, 0.2, 0.3, 0.4, 0.4, 0.5, 0.6])
    late = np.arange(8) > 4
    panels = panels_of(t)
    assert panels.integrals(late[:, None].astype(np.float64)).sum() == pytest.approx(0.2, abs=1e-15)
    assert (np.sign(within_legs(t) - t) == [1, 0, 0, 0, -1, 1, 0, -1]).all()


@pytest.mark.parametrize("path", ["l_shape/steel_tall.toml", "four_bar/flexible.toml"])
def test_energies_at_many_times_are_those_at_each(path: str) -> None:
    run = simulated(path, ["simulation.duration=0.1"])
    s, f = run.solution, run.formulation
    many = energy_series(f, s.t, s.y, s.v)
    each = [f.energy(*at) for at in zip(s.t.tolist(), s.y, s.v, strict=True)]
    assert (many == [[e.kinetic, e.elastic, e.gravity, e.springs] for e in each]).all()
    assert isinstance(run.energy(0.05), Energy)
