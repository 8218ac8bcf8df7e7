"""Distance of modal links from exact beams: linear, with stiffening, foreshortening, modal inertia; and its price.

    python benchmarks/geometric_stiffening.py

Tip over the whole motion, steps of 0.25 ms (spin-up: 10 ms, lag and steady stretch against exact beams); CPU time of
all of `erls.simulate`. Then the price for `erls`: `lobatto` over 2 s at its default tolerance, least CPU time of some
runs, against links without stiffening and against the same equations on NumPy.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import erls
from erls.equations.erls.formulation import Erls
from erls.integrate.base import Options, Solution
from erls.integrate.lobatto import lobatto
from erls.scene.build import build_mechanism

ROOT = Path(__file__).parents[1]
EFFECTS = ("linear", "linear,geometric_stiffening", "-modal_inertia", "all")
CASES = (
    ("l_shape/steel_flat.toml", "tip", "l_shape_nonlinear_beam", "steel_flat", ("erls",)),
    ("l_shape/steel_tall.toml", "tip", "l_shape_nonlinear_beam", "steel_tall", ("erls",)),
    ("l_shape/aluminium.toml", "tip", "l_shape_nonlinear_beam", "aluminium", ("erls",)),
    ("robot/two_link.toml", "end2", "two_link_nonlinear_beam", "end2", ("erls", "ffr")),
)
PRICED = ("l_shape/steel_tall.toml", "robot/two_link.toml")
LARGEST_LAG, STRETCH = -0.57384, 5.145e-4  # of the exact spin-up beam [m]


def table(name: str) -> dict[str, np.ndarray]:
    """Columns of a reference trajectory by name."""
    path = ROOT / f"tests/data/{name}.csv"
    text = path.read_text(encoding="utf-8")
    columns = [line for line in text.splitlines() if line.startswith("#")][-1].lstrip("# ").split(",")
    return dict(zip(columns, np.loadtxt(path, delimiter=",").T, strict=True))


class OnNumPy:
    """Equations without their compiled form."""

    def __init__(self, equations: Erls) -> None:
        self.equations = equations

    def __getattr__(self, name: str) -> Any:
        if name == "compiled":
            raise AttributeError(name)
        return getattr(self.equations, name)


def least(call: Callable[[], object], repeats: int) -> float:
    """Seconds of CPU, at best."""
    times = []
    for _ in range(repeats):
        begun = time.process_time()
        call()
        times.append(time.process_time() - begun)
    return min(times)


def run_lobatto(system: Erls | OnNumPy) -> Solution:
    """Two seconds from the start."""
    return lobatto(system, (0.0, 2.0), *system.initial_state(), Options())


def prices() -> None:
    """Print one line per scene."""
    for scene in PRICED:
        spent = []
        for effects in (EFFECTS[0], EFFECTS[3]):
            equations = Erls(build_mechanism(erls.load_scene(ROOT / "data" / scene, [f"effects={effects}"])).mechanism)
            assert equations.compiled is not None
            spent.append(least(partial(run_lobatto, equations), 7))
        plain = least(partial(run_lobatto, OnNumPy(equations)), 2)
        linear, curved = spent
        print(
            f"{scene:28}lobatto, 2 s: linear {1e3 * linear:.1f} ms, all effects {1e3 * curved:.1f} ms "
            f"({curved / linear:.2f} times as long; on NumPy {plain:.2f} s, {plain / curved:.0f} times)"
        )


def main() -> None:
    """Print one line per run."""
    for scene, point, reference, prefix, formulations in CASES:
        exact = table(reference)
        places = np.stack([exact[f"{prefix}_{axis}"] for axis in "xyz"], axis=1)
        for formulation in formulations:
            for effects in EFFECTS:
                changes = [f"effects={effects}", "simulation.step=2.5e-4", f"simulation.formulation={formulation}"]
                short = [*changes, "simulation.duration=0.01"]  # compiles
                erls.simulate(erls.load_scene(ROOT / "data" / scene, short))
                begun = time.process_time()
                run = erls.simulate(erls.load_scene(ROOT / "data" / scene, changes))
                spent = time.process_time() - begun
                far = np.linalg.norm(run.position(point, exact["t"]) - places, axis=1).max()
                print(f"{scene:28}{formulation:6}{effects:46}{far:9.1e} m{spent:7.1f} s", flush=True)
    prices()
    for formulation in ("erls", "ffr"):
        run = erls.simulate(erls.load_scene(ROOT / "data/spin_up/beam.toml", [f"simulation.formulation={formulation}"]))
        times = np.linspace(0.0, 20.0, 2001)
        x, y, _ = run.position("tip", times).T
        angle = run.joint_angle("hub", times)
        lag = (np.cos(angle) * y - np.sin(angle) * x).min() / LARGEST_LAG - 1
        stretch = (np.hypot(x[-1], y[-1]) - 10.0) / STRETCH - 1
        print(f"spin_up/beam.toml {formulation}: lag {100 * lag:+.2f} %, steady stretch {100 * stretch:+.2f} %")


if __name__ == "__main__":
    main()
