"""Energy drift of free swings with all modes: what the tests check with few modes, at full size.

    python benchmarks/energy_drift.py [--modes 18] [--seconds 2]

Explicit reference integrator (DOP853, rtol 1e-8, atol 1e-12 m) on one and two flexible links, lumped and consistent
mass, both gauges. Acceptance: drift at most 1e-7 J. High modes force small steps: with 18 modes this takes two hours.
"""

from __future__ import annotations

import argparse
import itertools
import tempfile
import time
from pathlib import Path

import numpy as np

import erls

LINK = """
[materials.m]
youngs_modulus = {modulus}
poissons_ratio = 0.33
density = {density}
[sections.s]
shape = "rectangular"
width = 0.01
height = {height}
[frame]
theory = "euler-bernoulli"
mass = "{mass}"
[frame.nodes]
root = [0.0, 0.0, 0.0]
elbow = [0.5, 0.0, 0.0]
{tip}
[[frame.members]]
from = "root"
to = "elbow"
elements = 2
material = "m"
section = "s"
{leg}
[[interfaces]]
name = "root"
node = "root"
[[interfaces]]
name = "tip"
node = "{end}"
[reduction]
elastic_modes = {modes}
"""
LEG = """[[frame.members]]
from = "elbow"
to = "tip"
elements = 2
material = "m"
section = "s"
"""


def scene(folder: Path, links: int, mass: str, gauge: str, modes: int, seconds: float) -> Path:
    """The steel L, or two straight aluminium links, swinging freely from rest."""
    if links == 1:
        values = {"modulus": 2e11, "density": 7800.0, "height": 0.03, "tip": "tip = [0.5, 0.5, 0.0]", "leg": LEG}
        text = LINK.format(**values, mass=mass, end="tip", modes=modes)
    else:
        values = {"modulus": 7e10, "density": 2700.0, "height": 0.01, "tip": "", "leg": ""}
        text = LINK.format(**values, mass=mass, end="elbow", modes=min(modes, 12))
    (folder / "link.toml").write_text(text, encoding="utf-8")
    lines = [
        "[simulation]",
        f"duration = {seconds}",
        'integrator = "dop853"',
        f'gauge = "{gauge}"',
        'effects = "linear"',
        "[base]",
        "rotation_deg = [-90.0, 0.0, 0.0]",
    ]
    for k in range(links):
        lines += ["[[joints]]", f'name = "j{k}"', 'dh = { convention = "standard", a = 0.5, alpha_deg = 90.0 }']
        lines += ["[[links]]", f'name = "l{k}"', 'model = "link.toml"', 'mesh_pose = { frame = "joint" }']
    path = folder / "scene.toml"
    path.write_text("\n".join(lines), encoding="utf-8")
    return path


def main() -> None:
    """Print one row per case."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--modes", type=int, default=18)
    parser.add_argument("--seconds", type=float, default=2.0)
    given = parser.parse_args()
    print("links  mass        gauge         elastic  steps   wall [s]  drift [J]")
    for links, mass, gauge in itertools.product(
        (1, 2), ("lumped", "consistent"), ("joint-angle", "minimum-norm")
    ):
        with tempfile.TemporaryDirectory() as folder:
            begun = time.perf_counter()
            run = erls.simulate(scene(Path(folder), links, mass, gauge, given.modes, given.seconds))
            drift = np.ptp(run.energy(np.linspace(0, given.seconds, 1001)).total)
            elastic = run.formulation.describe()["elastic_coordinates"]
            wall = time.perf_counter() - begun
            print(
                f"{links:5d}  {mass:10s}  {gauge:12s}  {elastic:7d}  {run.solution.work.steps:5d}  {wall:8.1f}  "
                f"{drift:.1e}",
                flush=True,
            )


if __name__ == "__main__":
    main()
