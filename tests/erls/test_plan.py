"""Planned motions from rest to rest: bounds kept in forward runs, closed forms, the command ``erls plan``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scenes

import erls
from erls.cli.main import main
from erls.errors import Cause, SceneError, SimulationError
from erls.tracking.goal import goal_of
from erls.tracking.laws import polynomial, shaper
from erls.tracking.plan import Planned, plan, run_law
from erls.tracking.vibration import swing

ROBOT = scenes.ROOT / "data" / "inverse" / "planned.toml"
QUICK = ("simulation.integrator=generalized_alpha", "simulation.step=0.002")
ARM = scenes.ROOT / "data" / "inverse" / "arm.toml"
BOUNDS = "plan={ swing=1e-3, joints={ hub={ to_deg=60.0, effort=4.0, rate_deg=300.0 } } }"
RIGID = (*QUICK, "links.0.flexible=false", "links.1.flexible=false")
STILL = "elbow={ to_deg=90.0 }"


def both(scene: Any) -> tuple[Planned, Planned]:
    """The shaped motion, from which the optimal one goes on, and that."""
    seen: list[Planned] = []
    found = plan(scene, method="optimal", told=seen.append)
    return next(one for one in seen if one.kept), found


def test_rigid_motions_take_what_their_laws_need() -> None:
    """One joint of inertia J by Δ within τ: the polynomial of degree 7 takes √(84 √5 / 25 JΔ/τ), its largest s̈ being
    that, to 2 % of the durations that are tried; any law takes no less than 2 √(JΔ/τ), with which the effort jumps, and
    what is found less than 1.2 times that.
    """
    one = (*RIGID, f"plan.joints={{ shoulder={{ to_deg=90.0, effort=2.0 }}, {STILL} }}")
    goal = goal_of(erls.load_scene(ROBOT, one))
    still = np.zeros(1)
    inertia = float(goal.rigid(still, still, np.ones(1))[0, 0]) / goal.moved[0]
    least = 2 * np.sqrt(inertia * goal.moved[0] / 2.0)
    shaped, optimal = both(erls.load_scene(ROBOT, one))
    assert shaped.kept
    assert optimal.kept
    assert 1.0 < shaped.law.duration / (least / 2 * np.sqrt(84 * np.sqrt(5) / 25)) < 1.021
    assert 1.0 < optimal.law.duration / least < 1.2


def test_rates_are_kept() -> None:
    """s' of degree 7 is at most 35/16: a duration of 35/16 Δ / rate, to 2 % of those that are tried."""
    joints = f"plan.joints={{ shoulder={{ to_deg=90.0, rate_deg=60.0, effort=50.0 }}, {STILL} }}"
    slow = plan(erls.load_scene(ROBOT, (*RIGID, joints)))
    assert 1.0 <= slow.law.duration / (35 / 16 * 1.5) < 1.021
    assert slow.rates[0] <= np.radians(60.0)


def test_a_single_vibration_is_as_foretold_and_shaped_away() -> None:
    """Two degrees of a rigid robot with a passive elbow on a spring: what a polynomial leaves in a forward run is what
    the model says, to 1 %, and at the first zero of j_3, a duration of 2.2243 periods, or with a shaper, a hundredth.
    """
    small = "plan.joints={ shoulder={ to_deg=2.0, effort=2.0 } }"
    spring = ("joints.1.stiffness=3.0", "joints.1.rest_deg=90.0", small)
    goal = goal_of(erls.load_scene(ROBOT, (*RIGID, *spring)))
    (mode,) = goal.modes
    period = 2 * np.pi / mode.omega
    laws = [polynomial(x * period, 7, 401) for x in (1.3, 6.987932 / np.pi)]
    laws.append(polynomial(1.3 * period, 7, 401, shaper(mode.omega, mode.damping)))
    plain, silent, shaped = (run_law(goal, law).swing for law in laws)
    assert plain == pytest.approx(swing(goal.modes, laws[0]), rel=0.01)
    assert silent < plain / 100
    assert shaped < plain / 100


def test_flexible_arm_rests_when_it_arrives() -> None:
    """The thin arm in three modes by 60 degrees: within all bounds by either method; the optimal one is shorter, and
    the polynomial of its duration that no shaper folds leaves ten times the bound.
    """
    arm = erls.load_scene(ARM, (*QUICK, "links.0.elastic_modes=4", BOUNDS))
    shaped, optimal = both(arm)
    for found in (shaped, optimal):
        assert found.kept
        assert found.swing <= 1e-3
        assert found.peaks[0] <= 4.0
    assert optimal.law.duration < shaped.law.duration
    assert swing(optimal.goal.modes, polynomial(optimal.law.duration, 7, 401)) > 1e-2


SHORT = ["--set", "plan.joints.shoulder.to_deg=2.0", "--set", "plan.joints.elbow.to_deg=91.0"]


def test_scenes_take_the_table_as_it_is(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The drives that are printed, put into the scene, give the forward run: it rests within the bound, and its efforts
    are those of the table. A table is replaced by a table; JSON has all keys.
    """
    table = tmp_path / "motion.csv"
    words = [str(ROBOT), *(w for change in RIGID for w in ("--set", change)), *SHORT]
    assert main(["plan", *words, "-o", str(table)]) == 0
    out = capsys.readouterr().out
    assert 'shoulder: drive = { type = "motion"' in out
    drives = [
        f'joints.{k}.drive={{type="motion", motion={{shape="table", file="{table}", column={k + 1}}}}}' for k in (0, 1)
    ]
    run: Any = erls.simulate(erls.load_scene(ROBOT, [*RIGID, *drives, "joints.1.initial={}"]), verdict=False)
    assert run.joint_angle("shoulder", 2.0) == pytest.approx(np.radians(2.0), abs=1e-12)
    rows = np.loadtxt(table, delimiter=",", skiprows=1)
    np.testing.assert_allclose(run.joint_effort("elbow", rows[50:60, 0]), rows[50:60, 6], rtol=1e-3)
    assert main(["plan", *words, "-o", str(table), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    keys = "scene method duration kept joints swing swing_limit vibrations_hz passes wall_s output"
    assert set(keys.split()) <= set(found)
    assert found["joints"]["elbow"]["to"] == pytest.approx(np.radians(91.0))


@pytest.mark.parametrize(
    ("changes", "cause", "names"),
    [
        (["plan={}"], Cause.BAD_FIELD, "nothing is planned"),
        (["plan.joints.wrist={ to=1.0 }"], Cause.BAD_REFERENCE, "plan.joints"),
        (["plan.joints.elbow.to_deg=90.0", "plan.joints.shoulder.to_deg=0.0"], Cause.BAD_FIELD, "no length"),
        (["plan.joints.elbow={}"], Cause.BAD_FIELD, "plan.joints.elbow.to"),
        (["plan.joints.elbow.effort=-1.0"], Cause.BAD_FIELD, "plan.joints.elbow.effort"),
        (["plan.joints={ elbow={ to=1.0 } }"], Cause.BAD_FIELD, "moves freely"),
        (["plan.joints={ elbow={ to=1.0 }, shoulder={ to=1.0 } }"], Cause.BAD_FIELD, "nothing bounds"),
        (["plan.swing=0.0"], Cause.BAD_FIELD, "plan.swing"),
        (["plan.uncertainty=0.7"], Cause.BAD_FIELD, "plan.uncertainty"),
        (["points=[]", "payloads=[]"], Cause.BAD_FIELD, "no point"),
        (["simulation.formulation=nodal"], Cause.BAD_FIELD, "--confirm nodal"),
        (["gravity=[0.0, -9.81, 0.0]"], Cause.NO_PLAN, "plan.joints.shoulder.effort"),
    ],
)
def test_what_cannot_be_planned_is_refused(changes: list[str], cause: Cause, names: str) -> None:
    """By the field, or by the bound that no motion keeps."""
    with pytest.raises((SceneError, SimulationError), match=names) as caught:
        plan(erls.load_scene(ROBOT, [*RIGID, *changes]))
    assert caught.value.cause == cause


def test_a_bound_that_no_run_keeps_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    """Exit code 4, with the last law: frequencies on the way are not those at the end."""
    passive = ["joints.1.stiffness=3.0", "joints.1.rest_deg=90.0", "plan.swing=1e-8", "plan.uncertainty=0.0"]
    passive.append("plan.joints={ shoulder={ to_deg=90.0, effort=2.0 } }")
    words = [w for change in (*RIGID, *passive) for w in ("--set", change)]
    assert main(["plan", str(ROBOT), *words, "--json"]) == 4
    out, err = capsys.readouterr()
    assert json.loads(out)["kept"] is False
    assert "no law was found" in err
