"""Exact sticking in closed loops: closed forms, formulations against one another, shares of loads."""

from __future__ import annotations

import itertools
import math
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
import scenes
from test_sticking import TIGHT, switches

import erls
from erls.accuracy.energy_balance import energy_balance
from erls.accuracy.looked_at import LookedAt
from erls.equations.switches.law import at_rest
from erls.equations.switches.shares import independent, shared
from erls.errors import SceneError
from erls.maths.so3 import Array
from erls.run.chain.run import ChainRun

STIFFNESS, FORCE, START = 200.0, 3.0, 0.1
BLOCKS = 1.0, 0.5  # kg
OMEGA = math.sqrt(STIFFNESS / (BLOCKS[0] + 2 * BLOCKS[1]))  # the second block goes as far across as along


def _body(mass: float) -> dict[str, Any]:
    return {"mass": mass, "inertia": [0.01, 0.02, 0.03], "points": {"root": [0.0] * 3, "tip": [0.2, 0.0, 0.0]}}


def run_scene(folder: Path, data: dict[str, Any], verdict: bool = True) -> ChainRun:
    path = scenes.write_toml(folder / "scene.toml", data)
    return cast(ChainRun, erls.simulate(erls.load_scene(path), verdict=verdict))


def stick(force: float, static: float | None = None) -> dict[str, Any]:
    return {"law": "stick", "force": force} | ({} if static is None else {"static_force": static})


def _guided(
    folder: Path, forces: tuple[float, float, float], pull: dict[str, Any] | None = None, **settings: Any
) -> ChainRun:
    """A block on a slide, with another one across it, whom a guide at 45° holds: one coordinate, two joints, and the
    guide, all of which may rub.
    """
    first = {"name": "up", "type": "prismatic", "dh": {"convention": "standard", "alpha_deg": 90.0}}
    second = {"name": "across", "type": "prismatic", "dh": {"convention": "standard"}}
    joints: list[dict[str, Any]] = [first | (pull or {"stiffness": STIFFNESS, "initial": {"position": START}}), second]
    joints[1]["initial"] = joints[0].get("initial", {})
    guide = {"name": "guide", "link": "b", "node": "root", "type": "prismatic", "axis": [0.0, -1.0, 1.0]}
    for joint, force in zip([*joints, guide], forces, strict=True):
        if force:
            joint["friction"] = stick(force, force if pull is None else 5 / 3 * force)
    data = {
        "gravity": [0.0] * 3,
        "simulation": {"duration": 1.1, **settings},
        "joints": joints,
        "links": [{"name": name, "rigid": _body(mass)} for name, mass in zip("ab", BLOCKS, strict=True)],
        "loops": [guide],
        "points": [{"name": "block", "link": "b", "node": "root"}],
    }
    return run_scene(folder, data)


def on_spring(t: float, start: float, shift: float, omega: float) -> float:
    """Half cycles about ± shift, whose amplitude falls by twice that, until it rests."""
    x, half = start, math.pi / omega
    for number in itertools.count():
        middle = math.copysign(shift, x)
        if abs(x) <= shift:
            return x
        if t < (number + 1) * half:
            return middle + (x - middle) * math.cos(omega * (t - number * half))
        x = 2 * middle - x
    raise AssertionError


@pytest.mark.parametrize(
    ("formulation", "integrator"),
    [("erls", "lobatto"), ("ffr", "lobatto"), ("ffr", "generalized_alpha"), ("erls", "dop853")],
)
def test_blocks_on_a_spring_between_guides(formulation: str, integrator: str, tmp_path: Path) -> None:
    """One joint rests because the other does: both rub, both rest, and share what the spring pulls."""
    forces = 2.0, 1.0
    run = _guided(tmp_path, (*forces, 0.0), integrator=integrator, formulation=formulation, **TIGHT[integrator])
    times = np.linspace(0.0, run.end, 151)
    exact = np.array([on_spring(t, START, FORCE / STIFFNESS, OMEGA) for t in times.tolist()])
    off = float(np.abs(run.position("block", times)[:, 2] - exact).max())
    assert off < 1e-6
    assert run.accuracy is not None
    assert run.accuracy.integration is not None
    assert off <= run.accuracy.integration
    found = switches(run)
    assert found == pytest.approx([math.pi / OMEGA * k for k in (1, 2, 3)], abs=1e-6)
    rest = np.linspace(found[-1], run.end, 7)
    assert not run.joint_rate("up", rest).any()
    assert not run.joint_rate("across", rest).any()
    pulled = STIFFNESS * float(run.joint_coordinate("up", 1.05))
    up, across = run.joint_effort("up", 1.05) + pulled, run.joint_effort("across", 1.05)  # without the spring
    assert up + across == pytest.approx(pulled, rel=1e-9)
    assert up / forces[0] == pytest.approx(across / forces[1], rel=1e-9)  # in like shares


@pytest.mark.parametrize("forces", [(2.0, 1.0, 0.0), (0.0, 0.0, FORCE / math.sqrt(2))])
def test_blocks_behind_a_spring_that_is_pulled(forces: tuple[float, float, float], tmp_path: Path) -> None:
    """Both joints hold what they can together, and break away at once; the guide, which goes as far as both, alone."""
    force, static, pull = 3.0, 5.0, 0.05
    motion = {"shape": "spin_up", "rate": pull, "duration": 0.02}
    drive = {"type": "pd", "proportional_gain": STIFFNESS, "derivative_gain": 0.0, "motion": motion}
    run = _guided(tmp_path, forces, {"drive": drive}, duration=2.0, integrator="lobatto", tolerance=1e-6)
    first = static / (STIFFNESS * pull) + 0.01
    slides = (2 * math.pi - 2 * math.atan((static - force) * OMEGA / (STIFFNESS * pull))) / OMEGA
    rests = 2 * (static - force) / (STIFFNESS * pull)
    expected = np.cumsum([first, *[slides, rests] * 5])
    found = [t for t in switches(run) if t > 0.03]
    assert found == pytest.approx(expected[expected < run.end], abs=1e-6)
    assert len(found) > 3
    rates = np.abs(run.joint_rate("across", np.array([0.1, expected[1] + rests / 2])))
    assert rates.max() <= (SEEN if forces[2] else 0.0)


SEEN = 1e-9  # m, rad or per second: of joints that are held by stiff springs, where closing joints stick

LENGTHS = 0.4, 0.7  # m, of cranks and of the coupler


def _rod(length: float, mass: float) -> dict[str, Any]:
    across = mass * length**2 / 12
    centre, points = [length / 2, 0.0, 0.0], {"root": [0.0] * 3, "tip": [length, 0.0, 0.0]}
    return {"rigid": {"mass": mass, "centre_of_mass": centre, "inertia": [0.0, across, across], "points": points}}


MASSES = 0.6, 1.1, 0.8
INERTIA = (MASSES[0] + MASSES[2]) * LENGTHS[0] ** 2 / 3 + MASSES[1] * LENGTHS[0] ** 2
LEVEL = math.radians(70.0)


def parallelogram(
    crank: dict[str, Any], others: dict[str, Any], closing: dict[str, Any], start: float
) -> dict[str, Any]:
    """A four-bar whose coupler does not turn: J q̈ = what acts along its joints, q the angle of both cranks."""
    angles = start, -start, start - math.pi
    lengths = LENGTHS[0], LENGTHS[1], LENGTHS[0]
    joints: list[dict[str, Any]] = []
    for number, (angle, a) in enumerate(zip(angles, (0.0, *lengths[:2]), strict=True)):
        joint = {"name": f"j{number}", "dh": {"convention": "modified", "a": a}, "initial": {"position": angle}}
        joints.append(scenes.merged(joint, others if number else crank))
    links = [
        {"name": f"l{k}", **_rod(length, mass), "mesh_pose": {"frame": "joint"}}
        for k, (length, mass) in enumerate(zip(lengths, MASSES, strict=True))
    ]
    loop = {"name": "close", "link": "l2", "node": "tip", "type": "revolute", "axis": [0.0, 0.0, 1.0], **closing}
    return {
        "gravity": [0.0] * 3,
        "joints": joints,
        "links": links,
        "loops": [loop],
        "points": [{"name": "pin", "link": "l0", "node": "tip"}],
    }


def pin(q: Array) -> Array:
    return LENGTHS[0] * np.column_stack([np.cos(q), np.sin(q), 0 * q])


@pytest.mark.parametrize(
    ("formulation", "rub"),
    [("erls", (0.5, 0.0, 0.0)), ("ffr", (0.2, 0.15, 0.0)), ("ffr", (0.0, 0.0, 0.5)), ("erls", (0.2, 0.05, 0.2))],
)
def test_four_bar_comes_to_rest(formulation: str, rub: tuple[float, float, float], tmp_path: Path) -> None:
    """A sticking joint, three of them, the one that closes the loop, and all four, of a linkage with one coordinate."""
    spring, force = 40.0, rub[0] + 2 * rub[1] + rub[2]
    start = LEVEL + 0.07
    others, closing = ({"friction": stick(size)} if size else {} for size in rub[1:])
    crank = {"stiffness": spring, "rest": LEVEL, **({"friction": stick(rub[0])} if rub[0] else {})}
    settings = {"duration": 1.5, "formulation": formulation, "integrator": "lobatto", "tolerance": 1e-6}
    run = run_scene(tmp_path, {**parallelogram(crank, others, closing, start), "simulation": settings})
    omega = math.sqrt(spring / INERTIA)
    times = np.linspace(0.0, run.end, 101)
    exact = LEVEL + np.array([on_spring(t, 0.07, force / spring, omega) for t in times.tolist()])
    off = float(np.abs(run.position("pin", times) - pin(exact)).max())
    assert off < 1e-6
    assert run.accuracy is not None
    assert run.accuracy.integration is not None
    assert off <= run.accuracy.integration
    found = switches(run)
    assert found == pytest.approx([math.pi / omega * (k + 1) for k in range(len(found))], abs=1e-6)
    assert len(found) >= 2
    crept = np.ptp(run.position("pin", np.linspace(found[-1], run.end, 5)), axis=0).max()
    assert crept <= (SEEN if rub[2] else 0.0)
    held = np.array([run.joint_effort("j0", run.end), *([run.loop_effort("close", run.end)] if rub[2] else [])])
    assert not rub[2] or _shared(held, float(run.joint_coordinate("j0", run.end)), spring, rub)
    balance = energy_balance(LookedAt(run))
    assert balance is not None
    assert abs(balance.off) < 1e-6 * balance.exchanged


def _shared(efforts: Array, angle: float, spring: float, rub: tuple[float, float, float]) -> bool:
    """Whether joints share what the spring asks as the squares of their friction, and the spring itself is told."""
    pulled, squares = spring * (angle - LEVEL), rub[0] ** 2 + 2 * rub[1] ** 2 + rub[2] ** 2
    expected = pulled * np.array([rub[0] ** 2 / squares - 1.0, rub[2] ** 2 / squares])
    # forces are what springs of 1e-9 rad hold, of a coordinate known to rounding
    return bool(np.allclose(np.abs(efforts), np.abs(expected), atol=1e-6))


def flexible_linkage(folder: Path, **settings: Any) -> ChainRun:
    """A four-bar of flexible links that swings and comes to rest; all joints of the tree rub."""
    links = []
    for name, length in zip("abc", (0.3, 0.5, 0.4), strict=True):
        model = scenes.merged(scenes.ARM_LINK, {"frame": {"nodes": {"root": [0.0] * 3, "tip": [length, 0.0, 0.0]}}})
        scenes.write_toml(folder / f"{name}.toml", scenes.merged(model, {"damping": {"ratio": 0.02}}))
        links.append({"name": name, "model": f"{name}.toml", "mesh_pose": {"frame": "joint"}})
    angles = _closing_angles(1.1)
    joints = [
        {"name": f"j{k}", "dh": {"convention": "modified", "a": a}, "initial": {"position": angle}, "friction": rub}
        for k, (a, angle, rub) in enumerate(
            zip((0.0, 0.3, 0.5), angles, (stick(0.4, 0.6), stick(0.3), stick(0.2)), strict=True)
        )
    ]
    loop = {"name": "close", "link": "c", "node": "tip", "type": "revolute", "axis": [0.0, 0.0, 1.0]}
    joints[0]["initial"] |= {"rate": 3.0}
    data = {
        "gravity": [0.0] * 3,
        "simulation": {"duration": 0.14, "integrator": "lobatto", "tolerance": 1e-5, **settings},
        "joints": joints,
        "links": links,
        "loops": [{**loop, "position": [0.5, 0.0, 0.0]}],
        "points": [{"name": "pin", "link": "a", "node": "tip"}, {"name": "end", "link": "b", "node": "tip"}],
    }
    return run_scene(folder, data, False)


def _closing_angles(crank: float) -> tuple[float, float, float]:
    """Joint coordinates of bars of 0.3, 0.5 and 0.4 m between points 0.5 m apart."""
    pin = 0.3 * np.exp(1j * crank)
    apart = 0.5 - pin
    reach, along = abs(apart), float(np.angle(apart))
    at_pin = math.acos((0.5**2 + reach**2 - 0.4**2) / (2 * 0.5 * reach))
    coupler = along + at_pin
    rocker = float(np.angle(0.5 - pin - 0.5 * np.exp(1j * coupler)))
    return crank, coupler - crank, rocker - coupler


def test_flexible_linkage(tmp_path: Path) -> None:
    """Links that bend let each joint rest by itself: ERLS, FFR and equal steps, and energy balances."""
    runs = {
        "erls": flexible_linkage(tmp_path),
        "ffr": flexible_linkage(tmp_path, formulation="ffr"),
        "equal": flexible_linkage(tmp_path, integrator="generalized_alpha", step=2e-4),
    }
    times = np.linspace(0.0, 0.14, 29)
    places = {name: run.position("end", times) for name, run in runs.items()}
    solution = runs["erls"].solution
    stuck = [float(np.diff(solution.t)[solution.v[1:, k] == 0.0].sum()) for k in range(3)]
    assert min(stuck) > 0.005
    assert max(stuck) < 0.135
    balance = energy_balance(LookedAt(runs["erls"]))
    assert balance is not None
    assert abs(balance.off) < 1e-6 * balance.exchanged
    moved = float(np.ptp(places["erls"], axis=0).max())
    assert np.abs(places["ffr"] - places["erls"]).max() < 1e-5
    assert np.abs(places["equal"] - places["erls"]).max() < 1e-3 * moved


@pytest.mark.parametrize("seed", range(6))
def test_law_of_joints_in_loops(seed: int) -> None:
    """Fewer motions than joints: what is found fulfils the law, and no other way to hold them asks less of a joint."""
    rng = np.random.default_rng(seed)
    m, ways = 4, 1 + seed % 3
    root = rng.normal(size=(m, ways))
    compliance, limits = root @ root.T, rng.uniform(0.5, 2.0, m)
    alone = compliance.diagonal() + 1.0
    free = compliance @ rng.normal(scale=0.4 + 0.5 * (seed // 3), size=m)
    modes, given = at_rest(compliance, free, limits, limits, alone)
    accelerations = free + compliance @ given
    assert np.abs(accelerations[modes == 0]).max(initial=0.0) < 1e-7
    assert (np.abs(given) <= limits * (1 + 1e-9)).all()
    assert (accelerations * modes)[modes != 0].min(initial=1.0) > 0.0
    assert len(independent(compliance, alone)) == ways
    held, motion = shared(compliance, free, limits, alone)
    assert free + compliance @ held == pytest.approx(np.zeros(m), abs=1e-12)
    nothing = np.linalg.svd(compliance)[2][ways:]
    others = held + rng.normal(scale=0.1, size=(2000, m - ways)) @ nothing
    largest = np.abs(held / limits).max()
    assert (np.abs(others / limits).max(axis=1) >= largest - 1e-9).all()
    # what begins to move does so against the friction, along a motion that joints can make, and takes as much power
    assert (motion * held <= 0.0).all()
    assert motion.any()
    both = np.concatenate([motion[motion != 0], np.abs(held / limits)[motion != 0]])
    assert both[len(both) // 2 :] == pytest.approx(largest, rel=1e-7)


def test_closing_joint_that_sticks_and_does_not_rub_is_refused(tmp_path: Path) -> None:
    data = parallelogram({}, {}, {"friction": stick(0.0, 1.0)}, LEVEL)
    with pytest.raises(SceneError, match=r"rubs while it slides") as caught:
        run_scene(tmp_path, {**data, "simulation": {"duration": 0.1}})
    assert caught.value.where.endswith("loops[0].friction.force")
    assert caught.value.exit_code == 2


@pytest.mark.parametrize("closing", [{}, {"friction": stick(5.0)}])
def test_static_start_that_friction_holds(closing: dict[str, Any], tmp_path: Path) -> None:
    """A linkage of flexible links that would fall: it stays where it is put, and joints bear what that takes."""
    efforts = {}
    for name, settings in {"erls": {}, "nodal": {"integrator": "generalized_alpha", "step": 5e-3}}.items():
        data = parallelogram({"friction": stick(5.0)}, {"friction": stick(5.0)}, closing, LEVEL)
        data |= {"gravity": [0.0, -9.81, 0.0], "initial": {"deformation": "static"}}
        data["simulation"] = {"duration": 0.05, "formulation": name, **settings}
        for link, length in zip(data["links"], (LENGTHS[0], LENGTHS[1], LENGTHS[0]), strict=True):
            beam = {"frame": {"nodes": {"root": [0.0] * 3, "tip": [length, 0.0, 0.0]}}}
            scenes.write_toml(tmp_path / f"{link['name']}.toml", scenes.merged(scenes.ARM_LINK, beam))
            link.pop("rigid")
            link["model"] = f"{link['name']}.toml"
        run = run_scene(tmp_path, data, False)
        moves = max(abs(float(run.joint_rate(f"j{k}", 0.05))) for k in range(3))
        assert moves <= (SEEN if closing and name != "nodal" else 0.0)
        assert run.stability is not None
        assert run.stability.root is not None
        assert run.stability.root.real <= 1e-6  # what friction holds does not grow
        efforts[name] = [float(run.joint_effort(f"j{k}", 0.04)) for k in range(3)]
    assert abs(efforts["erls"][0]) > 0.1
    assert efforts["nodal"] == pytest.approx(efforts["erls"], abs=1e-3)
