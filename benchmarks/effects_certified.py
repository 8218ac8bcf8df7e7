"""What `effects = "auto"` saves, and how far the errors that it certifies are from the actual ones.

    python benchmarks/effects_certified.py [random scenes, 24] [times] [errors]

Times: every shipped scene of modal links, and long runs with stiff links or slow motion, at a tolerance of 1e-4 m with
`all` and with `auto`; processor time of the whole `erls.simulate`, deciding and certifying included, the least of
several runs taken in turn; where nothing is left out, that with `all` and the time of deciding. No scene should take
longer with `auto` (5 % count as measurement), and the long ones led by prescribed motions at most 1 / 1.5 of the time.
With controllers joints keep coordinates that have to be integrated; what is saved there is told.

Errors: for shipped scenes and random chains of one to three links, a third of them led by prescribed motions, what the
tolerance allows to leave out, whatever deciding costs, and every single cut; the largest distance of named points
against a run with all effects at the same settings should be at most three times the certified one. Where two motions
part by more than 0.3 m they have nothing in common any more, and no ratio counts. `SHORTER` says which scenes are cut
short.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests/erls"))

import scenes  # noqa: E402
from effect_scenes import random_chain, random_led_chain  # noqa: E402

import erls  # noqa: E402
from erls.auto.automatic import named  # noqa: E402
from erls.auto.certify import certify  # noqa: E402
from erls.auto.choice import Choice, choose_effects  # noqa: E402
from erls.auto.cuts import Cut, possible_cuts  # noqa: E402
from erls.auto.outputs import Outputs, largest_distance, watched_nodes  # noqa: E402
from erls.auto.probe import needed  # noqa: E402
from erls.auto.static import may_follow, static_cut  # noqa: E402
from erls.equations.registry import formulate  # noqa: E402
from erls.errors import SimulationError  # noqa: E402
from erls.mechanism.chain import Mechanism  # noqa: E402
from erls.run.chain.run import ChainRun  # noqa: E402
from erls.scene.build import build_mechanism  # noqa: E402

SHIPPED = [
    "l_shape/steel_flat.toml",
    "l_shape/steel_tall.toml",
    "l_shape/steel_soft.toml",
    "l_shape/aluminium.toml",
    "l_shape/torque.toml",
    "l_shape/table3_fit.toml",
    "l_shape/mode_study.toml",
    "l_shape/solid.toml",
    "calculix/l_pendulum.toml",
    "robot/two_link.toml",
    "four_bar/rigid.toml",
    "four_bar/flexible.toml",
    "five_bar/parallel_robot.toml",
    "slider_crank/flexible.toml",
    "slider_crank/fast.toml",
    "spin_up/beam.toml",
]
SHORTER = {
    "four_bar/flexible.toml": 0.2,
    "five_bar/parallel_robot.toml": 0.1,
    "slider_crank/flexible.toml": 0.2,
    "slider_crank/fast.toml": 0.03,
}
TOLERANCE = "simulation.effects_tolerance=1e-4"
WITHIN, FASTER, NOISE = 3.0, 1.5, 1.05
FLOOR = 1e-8  # m: what the iterations of a run leave
APART = 0.3  # m
TIMES = 201
LONGEST = 3.0  # s of measurements
CONTROLLED = "_controlled"
CONTROLLER = {"type": "pd", "proportional_gain": 3000.0, "derivative_gain": 60.0, "feed_forward": True}


def long_scenes(folder: Path) -> list[Path]:
    """L-shaped links, and robots of two and three links, some of them stiff, that move slowly for a long time: led by
    prescribed motions, then by controllers that know the weight of the rigid chain.
    """
    bar = scenes.read_toml(ROOT / "data/l_shape/links/steel_flat.toml")
    arm = scenes.read_toml(ROOT / "data/robot/links/arm.toml")
    for link, name, section, size in (
        (bar, "flat", "leg", (0.03, 0.01)),
        (bar, "bulky", "leg", (0.09, 0.06)),
        (arm, "arm", "bar", (0.01, 0.01)),
        (arm, "thick", "bar", (0.06, 0.06)),
        (arm, "column", "bar", (0.12, 0.12)),
    ):
        sections = {section: {"width": size[0], "height": size[1]}}
        scenes.write_toml(folder / f"{name}.toml", scenes.merged(link, {"sections": sections}))
    pendulum = scenes.read_toml(ROOT / "data/l_shape/steel_flat.toml")
    turning = {"drive": {"type": "motion", "motion": {"shape": "polynomial", "from_deg": 0.0, "to_deg": 90.0}}}
    l_shape = {**pendulum, "joints": [{**pendulum["joints"][0], **turning}]}
    robot = scenes.read_toml(ROOT / "data/robot/two_link.toml")
    third = {**robot["joints"][1], "name": "wrist", "dh": {"convention": "standard", "a": 0.4}}
    three = {**robot, "joints": [*robot["joints"], third], "points": [{"name": "end", "link": "c", "node": "tip"}]}
    three["links"] = [{**k, "name": n} for k, n in zip(robot["links"] * 2, "abc", strict=False)]
    result = []
    for controlled in (False, True):
        for name, scene, models, moving, lasting in (
            ("slow_l", l_shape, ("flat",), 60.0, 120.0),
            ("stiff_l", l_shape, ("bulky",), 5.0, 60.0),
            ("slow_robot", robot, ("arm", "arm"), 60.0, 120.0),
            ("stiff_column", robot, ("column", "arm"), 20.0, 60.0),
            ("stiff_robot", robot, ("column", "thick"), 5.0, 60.0),
            ("slow_three_links", three, ("arm", "arm", "arm"), 30.0, 60.0),
        ):
            data = scenes.merged(scene, {"simulation": {"duration": lasting}, "initial": {"deformation": "static"}})
            data["joints"] = [_slower(joint, moving, controlled) for joint in scene["joints"]]
            data["links"] = [{**k, "model": f"{m}.toml"} for k, m in zip(scene["links"], models, strict=True)]
            result.append(scenes.write_toml(folder / f"{name}{CONTROLLED if controlled else ''}.toml", data))
    return result


def _slower(joint: dict[str, Any], duration: float, controlled: bool) -> dict[str, Any]:
    slow = scenes.merged(joint, {"drive": {"motion": {"duration": duration}}})
    return {**slow, "motor": {"rotor_inertia": 5e-3}, "drive": {**slow["drive"], **CONTROLLER}} if controlled else slow


def timed(path: Path, changes: list[str], most: int = 6) -> tuple[float, float, ChainRun, str]:
    """Least time with all and with auto [s], a run with auto, and what it decided.

    Where auto keeps all, both runs are the same but for deciding, whose time is added to that with all.
    """
    best: dict[str, float] = {}
    told: list[str] = []
    runs, total = {}, 0.0
    for count in range(most):
        for effects in ("all", "auto") if count % 2 else ("auto", "all"):
            scene = erls.load_scene(path, [*changes, TOLERANCE, f"effects={effects}"])
            begun = time.process_time()
            runs[effects] = erls.simulate(scene, tell=told.append)
            spent = time.process_time() - begun
            if count:  # the first ones compile and reduce
                best[effects] = min(best.get(effects, np.inf), spent)
                total += spent
        if count > 1 and total > LONGEST:
            break
    kept = [(run.formulation.mechanism.effects, run.formulation.size) for run in runs.values()]
    if kept[0] == kept[1]:
        best["all"] = min(best.values())
        best["auto"] = best["all"] + min(deciding(path, changes) for _ in range(8))
    decision = [text.removeprefix("effects: ") for text in told if text.startswith("effects: a")][-1]
    return best["all"], best["auto"], runs["auto"], decision


def deciding(path: Path, changes: list[str]) -> float:
    """Processor time of a decision [s]."""
    scene = erls.load_scene(path, [*changes, TOLERANCE, "effects=auto"])
    mechanism = build_mechanism(scene).mechanism
    begun = time.process_time()
    choose_effects(scene, mechanism)
    return time.process_time() - begun


def times(folder: Path) -> tuple[list[float], ...]:
    """Ratios all / auto of shipped scenes, long ones, long ones with controllers, printed."""
    jobs = [(ROOT / "data" / name, _changes(name)) for name in SHIPPED]
    ratios: tuple[list[float], ...] = ([], [], [])
    for number, (path, changes) in enumerate([*jobs, *((p, []) for p in long_scenes(folder))]):
        whole, auto, run, decision = timed(path, changes)
        kind = 0 if number < len(jobs) else 1 + path.stem.endswith(CONTROLLED)
        ratios[kind].append(whole / auto)
        print(
            f"{path.parent.name + '/' + path.stem if not kind else path.stem:27s} {run.end:6.2f} s: "
            f"all {whole:6.3f} s, auto {auto:6.3f} s, {whole / auto:5.2f} times; {decision}",
            flush=True,
        )
    return ratios


def _changes(name: str) -> list[str]:
    return [f"simulation.duration={SHORTER[name]}"] if name in SHORTER else []


def distance(run: ChainRun, other: ChainRun) -> float:
    """Largest distance of watched points."""
    at = np.linspace(0.0, other.end, TIMES)
    sides = []
    for one in (run, other):
        outputs = Outputs(one.scene, one.formulation, watched_nodes(other.formulation.mechanism))
        sides.append([outputs.positions(state) for state in one.states(at)])
    return largest_distance(*sides)


def errors(path: Path, changes: list[str]) -> list[float]:
    """Ratios of actual to certified errors of what a scene may leave out, printed."""
    scene = erls.load_scene(path, changes)
    whole = build_mechanism(scene).mechanism
    try:
        reference = erls.simulate(scene)
    except SimulationError as problem:  # a random chain may be too soft for its own weight
        print(f"{path.stem:18s} {scene.record.simulation.formulation:4s} {problem.cause}", flush=True)
        return []
    allowed = choose_effects(scene, whole, thrifty=False)
    choices = {"allowed": allowed} if allowed.cuts else {}
    for cut in [*possible_cuts(whole, scene.record.simulation.formulation), *following(scene, whole)]:
        if [_kind(cut)] != [_kind(c) for c in allowed.cuts]:
            choices[label(cut)] = Choice((cut,))
    ratios, found = [], []
    for name, choice in choices.items():
        try:
            actual, certified = compared(scene, whole, choice, reference)
        except SimulationError as problem:
            found.append(f"{name}: {problem.cause}")
            continue
        found.append(f"{name} {actual:.1e} / {certified:.1e} = {ratio(actual, certified):.2f}")
        if actual < APART:
            ratios.append(ratio(actual, certified))
    print(f"{path.stem:18s} {scene.record.simulation.formulation:4s} {'; '.join(found)}", flush=True)
    return ratios


def following(scene: erls.Scene, whole: Mechanism) -> list[Cut]:
    """All links following statically, where they can."""
    settings = scene.record.simulation
    if not may_follow(whole, settings):
        return []
    formulation = formulate(whole, settings)
    forced = needed(settings, formulation)[0].forced
    cut = None if forced is None else static_cut(scene, formulation, forced)
    return [] if cut is None else [cut]


def _kind(cut: Cut) -> tuple[frozenset[str], str, float]:
    return cut.off, cut.link, cut.bandwidth


def label(cut: Cut) -> str:
    """Of a cut, in a word."""
    if cut.bandwidth:
        return "static"
    if cut.link:
        return f"rigid {cut.link}"
    return "rigid" if "flexibility" in cut.off else f"{len(cut.off)} off"


def compared(scene: erls.Scene, whole: Mechanism, choice: Choice, reference: ChainRun) -> tuple[float, float]:
    """Actual and certified error of a run without something."""
    run = erls.simulate(named(scene, whole, choice))
    return distance(run, reference), certify(run, following(run, whole)).error


def ratio(actual: float, certified: float) -> float:
    """Actual over certified error, both raised to what a run resolves."""
    return max(actual, FLOOR) / max(certified, FLOOR)


def certificates(folder: Path, count: int) -> list[float]:
    """Ratios of actual to certified errors of the shipped and of random scenes, printed."""
    ratios: list[float] = []
    for scene in SHIPPED:
        ratios += errors(ROOT / "data" / scene, [*_changes(scene), TOLERANCE, "effects=all"])
        if "l_shape/steel" in scene:
            changes = [TOLERANCE, "simulation.formulation=ffr", "simulation.duration=0.5"]
            ratios += errors(ROOT / "data" / scene, changes)
    for seed in range(count):
        formulation = "ffr" if seed % 8 == 3 else "erls"
        ratios += errors(random_chain(folder, seed), [f"simulation.formulation={formulation}"])
    for seed in range(count // 2):
        ratios += errors(random_led_chain(folder, seed), ['initial.deformation="static"'])
    return ratios


def main() -> None:
    """What is asked for, then whether the claims hold."""
    count = next((int(a) for a in sys.argv[1:] if a.isdigit()), 24)
    parts = {"times", "errors"} & set(sys.argv[1:]) or {"times", "errors"}
    with tempfile.TemporaryDirectory() as name:
        if "times" in parts:
            shipped, long, controlled = times(Path(name))
            holds = min(shipped) >= 1 / NOISE and min(long) >= FASTER
            print(
                f"times: auto at least {min(shipped):.2f} times as fast on {len(shipped)} shipped scenes, "
                f"{min(long):.2f} on {len(long)} long ones: {'holds' if holds else 'DOES NOT HOLD'}; "
                f"{min(controlled):.2f} to {max(controlled):.2f} on {len(controlled)} with controllers",
                flush=True,
            )
        if "errors" in parts:
            ratios = certificates(Path(name), count)
            print(
                f"errors: {len(ratios)} certified, actual at most {max(ratios):.2f} times as large, "
                f"{sum(r > WITHIN for r in ratios)} above {WITHIN:.0f}: "
                f"{'holds' if max(ratios) <= WITHIN else 'DOES NOT HOLD'}"
            )


if __name__ == "__main__":
    main()
