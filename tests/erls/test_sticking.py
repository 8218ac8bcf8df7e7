"""Exact sticking of joints: against closed forms, between formulations and integrators, with several joints at once."""

from __future__ import annotations

import itertools
import math
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
import scenes

import erls
from erls.accuracy.energy_balance import energy_balance
from erls.accuracy.looked_at import LookedAt
from erls.equations.registry import formulate
from erls.equations.switched import switched
from erls.equations.switches.law import at_rest
from erls.errors import Cause, SceneError, SimulationError
from erls.integrate.switching import Switching
from erls.run.chain.run import ChainRun

MASS, STIFFNESS, FORCE, START = 2.0, 200.0, 3.0, 0.1
OMEGA = math.sqrt(STIFFNESS / MASS)
TIGHT: dict[str, dict[str, Any]] = {
    "lobatto": {"tolerance": 1e-6},
    "generalized_alpha": {"step": 2e-4},
    "rk45": {"rtol": 1e-9, "atol": 1e-10},
    "dop853": {},
    "radau": {},
    "bdf": {},
    "lsoda": {},
}
"""Settings at which each integrator follows half a cycle of a vibration to 1e-7 of its amplitude."""
BODY = {"name": "body", "rigid": {"mass": MASS, "inertia": [0.01, 0.02, 0.03], "points": {"root": [0.0, 0.0, 0.0]}}}


def sliding(folder: Path, friction: dict[str, Any], joint: dict[str, Any], **settings: Any) -> ChainRun:
    """A block on a slide."""
    along = {"name": "slide", "type": "prismatic", "dh": {"convention": "standard"}, **joint}
    path = scenes.write_toml(
        folder / "scene.toml",
        {
            "gravity": [0.0, 0.0, 0.0],
            "simulation": {"duration": 1.1, **settings},
            "joints": [{**along, "friction": {"law": "stick", **friction}}],
            "links": [BODY],
            "points": [{"name": "block", "link": "body", "node": "root"}],
        },
    )
    return cast(ChainRun, erls.simulate(erls.load_scene(path)))


def switches(run: ChainRun) -> list[float]:
    """Times at which the run begins anew."""
    t = run.solution.t
    return [float(x) for x in np.unique(t[1:][np.diff(t) == 0])]


def block_on_spring(t: float) -> tuple[float, float]:
    """Place, and time at which it rests for good: half cycles about ± F/k, whose amplitude falls by 2 F/k."""
    x, half, shift = START, math.pi / OMEGA, FORCE / STIFFNESS
    for number in itertools.count():
        if abs(x) <= shift:
            return x, number * half
        middle = math.copysign(shift, x)
        if t < (number + 1) * half:
            rest = block_on_spring(math.inf)[1] if t < math.inf else 0.0
            return middle + (x - middle) * math.cos(OMEGA * (t - number * half)), rest
        x = 2 * middle - x
    raise AssertionError


@pytest.mark.parametrize("integrator", TIGHT)
def test_block_on_a_spring(integrator: str, tmp_path: Path) -> None:
    """Released from a displaced place: positions to 1e-6 m, the times of rest to 1e-6 s, and the stated error holds."""
    joint = {"stiffness": STIFFNESS, "initial": {"position": START}}
    run = sliding(tmp_path, {"force": FORCE}, joint, integrator=integrator, **TIGHT[integrator])
    times = np.linspace(0.0, run.end, 151)
    exact = np.array([block_on_spring(t)[0] for t in times.tolist()])
    off = float(np.abs(run.position("block", times)[:, 2] - exact).max())
    rest = block_on_spring(0.0)[1]
    assert off < 1e-6
    assert run.accuracy is not None
    assert run.accuracy.integration is not None
    assert off <= run.accuracy.integration
    found = switches(run)
    assert found == pytest.approx([math.pi / OMEGA * k for k in (1, 2, 3)], abs=1e-6)
    assert found[-1] == pytest.approx(rest, abs=1e-6)
    held = run.joint_rate("slide", np.linspace(found[-1], run.end, 7))
    assert (held == 0.0).all()  # it does not creep
    place, (before, after) = run.position("block", run.end)[2], run.joint_effort("slide", [0.1, 1.0])
    assert before == pytest.approx(-STIFFNESS * block_on_spring(0.1)[0] + FORCE, abs=1e-4)  # it moves back
    assert after == pytest.approx(0.0, abs=1e-9)  # spring and friction balance
    path = sum(abs(block_on_spring(b)[0] - block_on_spring(a)[0]) for a, b in itertools.pairwise([0.0, *found]))
    lost = STIFFNESS / 2 * (START**2 - place**2)
    assert lost == pytest.approx(FORCE * path, rel=1e-6)  # the work of friction, as precise as the places


def test_block_behind_a_spring_that_is_pulled(tmp_path: Path) -> None:
    """Stick-slip: static friction larger than that of sliding, the end of the spring pulled at v.

    It breaks away where the spring pulls by the static force, slides for (2π - 2 atan((S - F) ω / (k v))) / ω, and
    rests until the spring is as long again: 2 (S - F) / (k v).
    """
    static, pull = 5.0, 0.05
    drive = {
        "type": "pd",
        "proportional_gain": STIFFNESS,
        "derivative_gain": 0.0,
        "motion": {"shape": "spin_up", "rate": pull, "duration": 0.02},  # lags behind v t by 0.01 s from then on
    }
    friction = {"force": FORCE, "static_force": static}
    run = sliding(tmp_path, friction, {"drive": drive}, duration=2.5, integrator="lobatto", tolerance=1e-6)
    first = static / (STIFFNESS * pull) + 0.01
    slides = (2 * math.pi - 2 * math.atan((static - FORCE) * OMEGA / (STIFFNESS * pull))) / OMEGA
    rests = 2 * (static - FORCE) / (STIFFNESS * pull)
    expected = np.cumsum([first, *[slides, rests] * 5])
    found = switches(run)
    assert [t for t in found if t > 0.03] == pytest.approx(expected[expected < run.end], abs=1e-6)
    assert len(found) > 5
    moved = run.joint_coordinate("slide", (expected[1] + expected[2]) / 2)
    assert moved == pytest.approx(pull * (slides + rests), abs=1e-6)
    assert run.joint_effort("slide", 0.2) == pytest.approx(0.0, abs=1e-12)  # held by as much as it is pulled


@pytest.mark.parametrize("seed", range(4))
def test_law_of_joints_at_rest(seed: int) -> None:
    """Against a trial of all combinations: exactly one fulfils the law, and it is the one that is found."""
    rng = np.random.default_rng(seed)
    m = 4
    root = rng.normal(size=(m, m))
    compliance, limits = root @ root.T + 0.1 * np.eye(m), rng.uniform(0.5, 2.0, m)
    free = compliance @ rng.normal(scale=1.5, size=m)
    right = []
    for trial in itertools.product((-1.0, 0.0, 1.0), repeat=m):
        modes = np.array(trial)
        given = -modes * limits
        held = modes == 0.0
        given[held] = np.linalg.solve(compliance[np.ix_(held, held)], -(free + compliance @ given)[held])
        accelerations = free + compliance @ given
        if (np.abs(given[held]) <= limits[held]).all() and (accelerations[~held] * modes[~held] >= 0).all():
            right.append((modes, given))
    assert len(right) == 1
    modes, given = at_rest(compliance, free, limits, limits)
    assert np.array_equal(modes, right[0][0])
    assert given == pytest.approx(right[0][1], abs=1e-12)
    alone = at_rest(compliance, free, 0.5 * limits, limits)[0]
    assert (alone[modes != 0] == modes[modes != 0]).all()  # whoever breaks away slides on with less


ROD = {"mass": 1.0, "centre_of_mass": [0.5, 0.0, 0.0], "inertia": [0.0, 0.1, 0.1]}


def arm(folder: Path, forces: tuple[float, float], flexible: bool = False, **changes: Any) -> Path:
    """A level arm of two links that hangs on its joints' friction."""
    scenes.arm_link(folder, damping={"ratio": 0.02})
    rod = {"rigid": {**ROD, "points": {"root": [0.0, 0.0, 0.0], "tip": [1.0, 0.0, 0.0]}}}
    link = scenes.ARM if flexible else rod
    frame = {"mesh_pose": {"frame": "joint"}}
    data: dict[str, Any] = {
        "base": {"rotation_deg": [-90.0, 0.0, 0.0]},
        "gravity": [0.0, 0.0, -9.81],
        "simulation": {"duration": 0.3},
        "joints": [
            {"name": "first", "dh": {"convention": "modified"}},
            {"name": "second", "dh": {"convention": "modified", "a": 0.5 if flexible else 1.0}},
        ],
        "links": [{"name": "upper", **link, **frame}, {"name": "lower", **link, **frame}],
        "points": [{"name": "end", "link": "lower", "node": "tip"}],
    }
    for joint, force in zip(data["joints"], forces, strict=True):
        joint["friction"] = {"force": force, "law": "stick"}
    return scenes.write_toml(folder / "scene.toml", scenes.merged(data, changes))


WEIGHT = 9.81 * 1.0 * (0.5 + 1.5), 9.81 * 0.5  # moments about both joints [N m]


def test_joints_that_friction_holds(tmp_path: Path) -> None:
    """Both joints at rest: friction balances the weight exactly, and the arm starts where one holds too little."""
    run = erls.simulate(erls.load_scene(arm(tmp_path, (20.0, 5.0))))
    times = np.array([0.0, 0.1, 0.3])
    assert np.ptp(run.position("end", np.linspace(0, 0.3, 5)), axis=0).tolist() == [0.0, 0.0, 0.0]
    for joint, moment in zip(("first", "second"), WEIGHT, strict=True):
        assert np.abs(run.joint_effort(joint, times)) == pytest.approx(moment, rel=1e-12)
    run = erls.simulate(erls.load_scene(arm(tmp_path, (20.0, 4.9))))
    assert run.joint_rate("first", 0.01) == 0.0
    assert run.joint_rate("second", 0.01) == pytest.approx(0.01 * (WEIGHT[1] - 4.9) / (0.1 + 0.25), rel=1e-4)


def test_static_start_that_friction_holds(tmp_path: Path) -> None:
    """It stands up and would fall; friction holds it, so that nothing is said to grow."""
    up = {"initial": {"deformation": "static"}, "base": {"rotation_deg": [0, 0, 0]}, "simulation": {"duration": 0.1}}
    roots = []
    sticks: dict[str, Any] = {"force": 5.0, "law": "stick"}
    for friction in (sticks, {"force": 0.0}):
        joints = [
            {"name": "first", "dh": {"convention": "modified", "alpha_deg": -90.0}, "initial": {"position_deg": -91.0},
             "friction": friction},
            {"name": "second", "dh": {"convention": "modified", "a": 0.5}, "friction": friction},
        ]  # fmt: skip
        run = erls.simulate(erls.load_scene(arm(tmp_path, (5.0, 5.0), True, **up, joints=joints)), verdict=False)
        assert run.stability is not None
        assert run.stability.root is not None
        roots.append(run.stability.root.real)
        assert (run.joint_rate("first", 0.1) == 0.0) == (friction["force"] > 0)
    assert roots[0] <= 0.0
    assert roots[1] > 1.0


def test_formulations_agree(tmp_path: Path) -> None:
    """Flexible links, both joints stick and slide: ERLS, FFR and steps of generalized-α; energy balances."""
    settings = {"duration": 0.25, "tolerance": 1e-4, "integrator": "lobatto"}
    first = {"friction": {"force": 1.5, "law": "stick"}, "initial": {"position_deg": 60.0}}
    second = {"friction": {"force": 0.3, "law": "stick", "static_force": 0.4}, "initial": {"rate": 4.0}}
    swing = {
        "joints": [
            {"name": "first", "dh": {"convention": "modified"}, **first},
            {"name": "second", "dh": {"convention": "modified", "a": 0.5}, **second},
        ]
    }
    runs = {}
    for name, own in {"erls": {}, "ffr": {}, "equal": {"integrator": "generalized_alpha", "step": 1e-4}}.items():
        formulation = {"formulation": name} if name != "equal" else {}
        path = arm(tmp_path, (1.5, 0.3), True, simulation={**settings, **formulation, **own}, **swing)
        runs[name] = erls.simulate(erls.load_scene(path), verdict=False)
    times = np.linspace(0.0, 0.25, 26)
    places = {name: run.position("end", times) for name, run in runs.items()}
    one = runs["erls"]
    stuck = [float(np.diff(one.solution.t)[one.solution.v[1:, k] == 0.0].sum()) for k in (0, 1)]
    assert min(stuck) > 0.01  # both
    assert max(stuck) < 0.24
    balance = energy_balance(LookedAt(one))
    assert balance is not None
    assert abs(balance.off) < 1e-6 * balance.exchanged
    moved = float(np.ptp(places["erls"], axis=0).max())
    assert moved > 0.01
    assert np.abs(places["ffr"] - places["erls"]).max() < 1e-5  # the tolerance, and what switches make of it
    assert np.abs(places["equal"] - places["erls"]).max() < 1e-3 * moved  # steps of second order


@pytest.mark.parametrize(
    ("changes", "field", "words"),
    [
        ({"friction": {"force": 1.0, "law": "stik"}}, "friction.law", "'stick'"),
        ({"friction": {"force": 1.0, "law": "stick", "static_force": 0.5}}, "friction.static_force", "at least"),
        ({"friction": {"force": 1.0, "law": "stick", "transition_rate": 0.1}}, "friction.transition_rate", "remove it"),
        ({"friction": {"force": 1.0, "static_force": 2.0}}, "friction.static_force", "law = 'stick'"),
    ],
)
def test_faulty_friction(changes: dict[str, Any], field: str, words: str, tmp_path: Path) -> None:
    scenes.l_link(tmp_path)
    joints = [{**scenes.L_SCENE["joints"][0], **changes}]
    path = scenes.write_toml(tmp_path / "scene.toml", {**scenes.L_SCENE, "joints": joints})
    with pytest.raises(SceneError, match=words) as caught:
        erls.simulate(path)
    assert caught.value.where.endswith(f"joints[0].{field}")
    assert caught.value.exit_code == 2


@pytest.mark.parametrize(
    "settings",
    [
        {"formulation": "ffr", "coordinates": "absolute", "integrator": "auto"},
        {"gauge": "minimum-norm"},
        {"bandwidth": 100.0},
    ],
)
def test_what_sticking_does_not_go_with(settings: dict[str, Any], tmp_path: Path) -> None:
    scenes.l_link(tmp_path)
    joints = [{**scenes.L_SCENE["joints"][0], "friction": {"force": 1.0, "law": "stick"}}]
    changed = scenes.merged(scenes.L_SCENE, {"simulation": settings})
    path = scenes.write_toml(tmp_path / "scene.toml", {**changed, "joints": joints})
    with pytest.raises(SceneError, match=r"exact sticking does not go with .*use law = 'smooth'") as caught:
        erls.simulate(path)
    assert caught.value.where.endswith("joints[0].friction.law")


def test_what_makes_steps_of_its_own_refuses_it(tmp_path: Path) -> None:
    """Steppers take the compiled equations, which leave this friction out, and so do derivatives of nodal runs."""
    scene = erls.load_scene(arm(tmp_path, (20.0, 5.0)))
    with pytest.raises(SceneError, match="where a joint sticks") as caught:
        erls.stepper(scene)
    assert caught.value.where.endswith("friction.law")
    settings = {"formulation": "nodal", "integrator": "generalized_alpha", "step": 1e-3, "duration": 0.1}
    scene = erls.load_scene(arm(tmp_path, (20.0, 5.0), simulation=settings))
    with pytest.raises(SceneError, match="joints stick are not known yet") as refused:
        erls.sensitivities(scene, {"end": lambda run: run.position("end", 0.1)}, ["joints.second.friction.force"])
    assert refused.value.cause == Cause.NO_DERIVATIVE


def _switch_on_and_on(looking: Switching) -> None:
    at_rest = np.zeros(2)
    for _ in range(1000):
        looking._end_modes(0.25, at_rest, at_rest, at_rest, np.array([1]))


def test_chatter_ends(tmp_path: Path) -> None:
    """As many switches at one instant end the run, with the joint's name."""
    scene = erls.load_scene(arm(tmp_path, (20.0, 5.0)))
    looking = Switching(switched(formulate(scenes.mechanism(scene.path), scene.record.simulation)))
    with pytest.raises(SimulationError, match="'second' switches") as caught:
        _switch_on_and_on(looking)
    assert caught.value.cause == Cause.STEP_TOO_SMALL


def test_load_that_comes_and_goes(tmp_path: Path) -> None:
    """A joint at rest moves nothing while the load grows, so that steps grow, and yet breaks away in time."""
    load = {"shape": "sine_burst", "start": 0.0, "amplitude": 4.5, "frequency_hz": 1.0, "cycles": 1.0}
    friction = {"force": FORCE, "static_force": 4.0}
    run = sliding(tmp_path, friction, {"drive": {"type": "torque", "profiles": [load]}}, integrator="lobatto")
    first = math.asin(4.0 / 4.5) / (2 * math.pi)
    assert switches(run)[0] == pytest.approx(first, abs=1e-9)
    assert (run.joint_rate("slide", np.linspace(0.0, first, 5)[:-1]) == 0.0).all()
    assert run.joint_effort("slide", 0.1) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("formulation", ["erls", "nodal"])
def test_friction_on_a_prescribed_motion(formulation: str, tmp_path: Path) -> None:
    """The motor gives what friction takes, against the rate."""
    motion = {"shape": "sine", "amplitude": 0.1, "frequency_hz": 1.0}
    nodal = {"formulation": "nodal", "integrator": "generalized_alpha", "step": 1e-3}
    settings: dict[str, Any] = {} if formulation == "erls" else nodal
    run = sliding(tmp_path, {"force": FORCE}, {"drive": {"type": "motion", "motion": motion}}, **settings)
    t, omega = np.array([0.1, 0.3]), 2 * math.pi
    expected = -MASS * 0.1 * omega**2 * np.sin(omega * t) + FORCE * np.sign(np.cos(omega * t))
    precise = 1e-9 if formulation == "erls" else 1e-4  # steps of 1 ms
    assert run.joint_effort("slide", t) == pytest.approx(expected, rel=precise)
