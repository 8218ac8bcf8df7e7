"""Impacts: rebound against the closed form, and how far runs are off beside what they state and what they aim at.

    python benchmarks/contacts.py

A body falls from 0.3 m onto the ground and bounces for a second, or meets it at 2 m/s without weight; a pendulum meets
a stop. Errors are those against a run at a tolerance of 1e-9 m. ``share`` is the actual error over the stated one.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np

import erls
from erls.run.chain.run import ChainRun
from erls.scene.read import load_scene

BALL = """
gravity = [0.0, 0.0, {gravity}]
[simulation]
duration = 1.0
[[joints]]
name = "joint"
type = "prismatic"
dh = {{ convention = "standard" }}
initial = {{ position = 0.3, rate = {rate} }}
[[links]]
name = "ball"
rigid = {{ mass = 1.0, points = {{ centre = [0.0, 0.0, 0.0], side = [1.0, 0.0, 0.0] }} }}
[[points]]
name = "point"
link = "ball"
node = "centre"
[[contacts]]
name = "ground"
point = "point"
plane = {{ normal = [0.0, 0.0, 1.0] }}
stiffness = 1e7
restitution = {restitution}
"""
PENDULUM = """
gravity = [0.0, 0.0, 0.0]
[simulation]
duration = 1.0
[[joints]]
name = "joint"
dh = {{ convention = "standard" }}
initial = {{ rate = 1.0 }}
stops = {{ lower_deg = -20.0, upper_deg = 20.0, stiffness = 1e5, restitution = {restitution} }}
[[links]]
name = "arm"
[links.rigid]
mass = 1.0
centre_of_mass = [0.5, 0.0, 0.0]
inertia = [0.01, 0.1, 0.1]
points = {{ a = [0.0, 0.0, 0.0], b = [1.0, 0.0, 0.0] }}
[[points]]
name = "point"
link = "arm"
node = "b"
"""
RESTITUTIONS = (0.0, 0.5, 0.9, 1.0)
TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6)
FIXED = ("generalized_alpha, 0.1 ms", ["simulation.integrator=generalized_alpha", "simulation.step=1e-4"])


class Case(NamedTuple):
    """Name, scene as text, and rate before the impact [1/s]; 0 where it is not compared."""

    name: str
    text: str
    rate: float


def cases(restitution: float) -> list[Case]:
    """All of a restitution."""
    return [
        Case("bounces", BALL.format(gravity=-9.81, rate=0.0, restitution=restitution), 0.0),
        Case("rebounds", BALL.format(gravity=0.0, rate=-2.0, restitution=restitution), 2.0),
        Case("stop", PENDULUM.format(restitution=restitution), 1.0),
    ]


def simulated(path: Path, changes: list[str]) -> ChainRun:
    """A run of a scene with changes."""
    run = erls.simulate(load_scene(path, changes))
    assert isinstance(run, ChainRun)
    return run


def main() -> None:
    """Print the table."""
    heads = f"{'steps':>6}{'rebound':>11}{'error [m]':>11}{'stated':>10}{'share':>7}"
    print(f"{'case':<10}{'e':>5}  {'integrator':<27}{heads}")
    t = np.linspace(0.0, 1.0, 401)
    with tempfile.TemporaryDirectory() as folder:
        for restitution in RESTITUTIONS:
            for case in cases(restitution):
                path = Path(folder) / "scene.toml"
                path.write_text(case.text, encoding="utf-8")
                best = simulated(path, ["simulation.tolerance=1e-9"]).position("point", t)
                ways = [(f"lobatto, tolerance {x:.0e}", [f"simulation.tolerance={x}"]) for x in TOLERANCES]
                for name, changes in [*ways, FIXED]:
                    run = simulated(path, changes)
                    off = float(np.linalg.norm(run.position("point", t) - best, axis=1).max())
                    stated = run.accuracy.integration if run.accuracy else None
                    rebound = abs(float(run.solution.v[-1, 0])) / case.rate if case.rate else np.nan
                    share = np.nan if stated is None else off / stated
                    row = f"{run.solution.work.steps:>6}{rebound:>11.6f}{off:>11.1e}{stated:>10.1e}{share:>7.2f}"
                    print(f"{case.name:<10}{restitution:>5}  {name:<27}{row}", flush=True)


if __name__ == "__main__":
    main()
