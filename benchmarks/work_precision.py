"""Error against time of the integrators that run compiled: the steel flat L and robots of two and three links.

Each row is a setting: step of generalized-alpha, tolerance of lobatto. Error: largest distance of the last named point
from a run of lobatto at 1e-9 m, at 301 times. Time: processor time of the integration alone, the least of several runs.

Run: python benchmarks/work_precision.py [--scenes l18,l30,robot2,robot3] [--runs 3] [--also dop853]
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np
from vs_exudyn import error, robot_scene

from erls.equations.registry import formulate
from erls.integrate.base import Options, Solution
from erls.integrate.registry import integrator_named
from erls.run.chain.run import ChainRun
from erls.scene.build import build_mechanism
from erls.scene.chain import Scene
from erls.scene.read import load_scene

DATA = Path(__file__).resolve().parent.parent / "data"
STEPS = (4e-3, 2e-3, 1e-3, 5e-4, 2.5e-4, 1.25e-4)
TOLERANCES = (1e-3, 1e-4, 3e-5, 1e-5, 3e-6, 1e-6, 1e-7)
LEVELS = (1e-4, 1e-5, 1e-6)


def scene_of(name: str, folder: Path) -> Scene:
    """A scene by its short name."""
    if name.startswith("robot"):
        return load_scene(robot_scene(folder, int(name.removeprefix("robot"))))
    modes = int(name.removeprefix("l"))
    more = f"links.l.reduction={{fixed_interface_modes={modes - 6}, elastic_modes={modes}}}"
    overrides = [f"links.l.elastic_modes={modes}"] if modes <= 18 else [more, f"links.l.elastic_modes={modes}"]
    return load_scene(DATA / "l_shape/steel_flat.toml", overrides)


def settings(name: str) -> list[tuple[str, Options]]:
    """Label and options of each rung of an integrator's ladder."""
    if name == "generalized_alpha":
        return [(f"step {h:g} s", Options(step=h)) for h in STEPS]
    if name == "lobatto":
        return [(f"tolerance {t:g} m", Options(tolerance=t)) for t in TOLERANCES]
    return [(f"rtol {t:g}", Options(rtol=t, atol=t / 100)) for t in TOLERANCES[1:]]


def study(scene: Scene, names: list[str], runs: int) -> None:
    """Print the table of a scene."""
    formulation = formulate(build_mechanism(scene, lambda text: None).mechanism, scene.record.simulation)
    y, v = formulation.initial_state()
    span = (0.0, scene.record.simulation.duration)
    at, point = np.linspace(*span, 301), scene.record.points[-1].name

    def positions(found: Solution) -> np.ndarray:
        return ChainRun(scene, formulation, found, 0.0).position(point, at)

    def integrate(name: str, options: Options) -> Solution:
        return integrator_named(name)(formulation, span, y, v, options, None)

    tight = positions(integrate("lobatto", Options(tolerance=1e-9)))
    print(f"  reference: runs at 1e-9 and 1e-8 m differ by "
          f"{error(positions(integrate('lobatto', Options(tolerance=1e-8))), tight):.1e} m")
    cheapest = dict.fromkeys(LEVELS, (np.inf, ""))
    for name in names:
        for label, options in settings(name):
            spent = []
            for _ in range(runs):
                begun = time.process_time()
                found = integrate(name, options)
                spent.append(1e3 * (time.process_time() - begun))
            if found.failure is not None:
                print(f"  {name:18s} {label:18s} failed: {found.failure.cause}")
                continue
            off, work = error(positions(found), tight), found.work
            print(f"  {name:18s} {label:18s} {off:9.1e} m {min(spent):8.1f} ms {work.steps:7d} steps "
                  f"{work.rhs_calls:7d} evaluations {work.factorizations:5d} factorizations", flush=True)
            for level in LEVELS:
                if off <= level:
                    cheapest[level] = min(cheapest[level], (min(spent), f"{name}, {label}"))
    for level, (spent_ms, label) in cheapest.items():
        print(f"  below {level:g} m: {spent_ms:.1f} ms ({label})" if label else f"  below {level:g} m: none")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--scenes", default="l18,l30,robot2,robot3", help="separated by commas")
    parser.add_argument("--runs", type=int, default=3, help="of each setting; the least time counts")
    parser.add_argument("--also", default="", help="more integrators, separated by commas (they run uncompiled)")
    options = parser.parse_args()
    names = ["generalized_alpha", "lobatto", *filter(None, options.also.split(","))]
    for name in options.scenes.split(","):
        with tempfile.TemporaryDirectory() as place:
            (Path(place) / "links").mkdir()
            print(name)
            study(scene_of(name, Path(place)), names, options.runs)


if __name__ == "__main__":
    main()
