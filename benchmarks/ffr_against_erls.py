"""FFR against ERLS-CMS and against nonlinear beams, at full length: what the tests check over shorter times.

    python benchmarks/ffr_against_erls.py [--quick] [--explicit]

Where two formulations are compared generalized-alpha without numerical damping, steps of 50 us, or with ``--explicit``
DOP853 at rtol 1e-9 (half an hour); the shipped scenes with their own integrators. Distances in metres, the largest over
the run. Acceptance: single link, tangent frame, 2e-6 over 2 s; two aluminium links 3e-5 over 0.3 s; E doubled, a
quarter of the distance; L flat, tall, aluminium and the robot within 5e-5, 2e-4, 5e-4 and 5e-4 of the nonlinear beams;
joint torques within 1 % of their peak. ``--quick`` runs a tenth of each time.

Figures of ``--quick``: one link, tangent frame 2e-15; two links 6.6e-7 over 0.03 s, 1.6e-7 with E doubled; from the
beams 1.0e-5, 8.1e-6, 2.2e-5 on the L, 7.8e-5 (ERLS) and 2.1e-5 (FFR) on the robot; joint torques within 3.6e-4 of their
peak, 3.5e-5 from static equilibrium. In full, one link with 2 modes over 2 s: tangent frame 8e-15, mean axes 2.6e-5.
"""

from __future__ import annotations

import argparse
import itertools
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

import erls

ROOT = Path(__file__).parents[1]
VARIANTS: dict[str, list[str]] = {
    "erls": [],
    "ffr tangent": ['simulation.formulation="ffr"'],
    "ffr mean-axis": ['simulation.formulation="ffr"', 'simulation.body_frame="mean-axis"'],
}
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
torsion = "polar"
[frame.nodes]
root = [0.0, 0.0, 0.0]
elbow = [0.5, 0.0, 0.0]
{corner}
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
fixed_interface_modes = {fixed}
elastic_modes = {modes}
"""
LEG = """[[frame.members]]
from = "elbow"
to = "tip"
elements = 2
material = "m"
section = "s"
"""


def write_scene(folder: Path, links: int, modes: int, stiffer: float, simulation: str) -> Path:
    """The steel L, tall, or a chain of two aluminium links, released from rest under gravity."""
    if links == 1:
        values: dict[str, Any] = {"modulus": 2e11 * stiffer, "density": 7800.0, "height": 0.03, "end": "tip"}
        values |= {"corner": "tip = [0.5, 0.5, 0.0]", "leg": LEG, "fixed": 18}
    else:
        values = {"modulus": 7e10 * stiffer, "density": 2700.0, "height": 0.01, "end": "elbow"}
        values |= {"corner": "", "leg": "", "fixed": 6}
    (folder / "link.toml").write_text(LINK.format(**values, modes=modes), encoding="utf-8")
    lines = ["[simulation]", simulation, "[base]", "rotation_deg = [-90.0, 0.0, 0.0]"]
    for k in range(links):
        a = 0.0 if links == 1 else 0.5
        lines += ["[[joints]]", f'name = "j{k}"', f'dh = {{ convention = "standard", a = {a}, alpha_deg = 90.0 }}']
        lines += ["[[links]]", f'name = "l{k}"', 'model = "link.toml"', 'mesh_pose = { frame = "joint" }']
    lines += ["[[points]]", 'name = "tip"', f'link = "l{links - 1}"', f'node = "{values["end"]}"']
    path = folder / "scene.toml"
    path.write_text("\n".join(lines), encoding="utf-8")
    return path


def compare_formulations(quick: bool, explicit: bool) -> None:
    """Distances between the formulations, each against ERLS, at two stiffnesses."""
    print("links  elastic  modulus  duration  tangent [m]  mean-axis [m]  energy drift [J]")
    for (links, modes, seconds), stiffer in itertools.product(((1, 2, 2.0), (1, 12, 2.0), (2, 6, 0.3)), (1.0, 2.0)):
        seconds = seconds / 10 if quick else seconds
        method = 'step = 0.1\nintegrator = "dop853"\nrtol = 1e-9' if explicit else "step = 5e-5\nspectral_radius = 1.0"
        times = np.linspace(0, seconds, 1001)
        with tempfile.TemporaryDirectory() as folder:
            settings = f'duration = {seconds}\neffects = "linear"\n{method}'
            path = write_scene(Path(folder), links, modes, stiffer, settings)
            runs = {name: erls.simulate(erls.load_scene(path, changes)) for name, changes in VARIANTS.items()}
        tips = {name: run.position("tip", times) for name, run in runs.items()}
        away = [np.linalg.norm(tips[n] - tips["erls"], axis=1).max() for n in list(VARIANTS)[1:]]
        drift = max(float(np.ptp(run.energy(times).total)) for run in runs.values())
        print(
            f"{links:5d}  {modes * links:7d}  {stiffer:7.0f}  {seconds:8g}  {away[0]:11.2e}  {away[1]:13.2e}  "
            f"{drift:16.1e}",
            flush=True,
        )


def against_beams(quick: bool) -> None:
    """The shipped scenes against the nonlinear beams of tests/data, for every formulation."""
    print("\nscene                    point  " + "  ".join(f"{name:>13s}" for name in VARIANTS) + "  [m]")
    cases = [(f"l_shape/{case}", "l_shape", "tip", case) for case in ("steel_flat", "steel_tall", "aluminium")]
    cases += [("robot/two_link", "two_link", "end2", "end2")]
    for scene, table, point, prefix in cases:
        path = ROOT / "tests" / "data" / f"{table}_nonlinear_beam.csv"
        text = path.read_text(encoding="utf-8")
        columns = [line for line in text.splitlines() if line.startswith("#")][-1].lstrip("# ").split(",")
        values = np.loadtxt(path, delimiter=",")
        distances = []
        for changes in VARIANTS.values():
            end = values[-1, 0] / 10 if quick else values[-1, 0]
            rows = values[values[:, 0] <= end + 1e-12]
            expected = rows[:, [columns.index(f"{prefix}_{axis}") for axis in "xyz"]]
            loaded = erls.load_scene(ROOT / f"data/{scene}.toml", [*changes, f"simulation.duration={end}"])
            found = erls.simulate(loaded).position(point, rows[:, 0].clip(max=end))
            distances.append(np.linalg.norm(found - expected, axis=1).max())
        print(f"{scene:24s} {point:5s}  " + "  ".join(f"{d:13.2e}" for d in distances), flush=True)


def compare_torques(quick: bool) -> None:
    """Joint torques of the prescribed robot, FFR against ERLS, as a share of their peak.

    Released undeformed the links vibrate undamped, and frequencies that differ in first order of the deflection drift
    out of phase; from static equilibrium what is left is second order.
    """
    print("\nrobot/two_link: joint torque, distance from ERLS over peak")
    end = 0.15 if quick else 1.5
    times = np.linspace(0, end, 751)
    for start in ("zero", "static"):
        torques = {}
        for name, changes in VARIANTS.items():
            more = [f"simulation.duration={end}", f"initial.deformation={start}", "simulation.step=2e-4"]
            run = erls.simulate(erls.load_scene(ROOT / "data/robot/two_link.toml", [*changes, *more]))
            torques[name] = {joint: run.joint_effort(joint, times) for joint in run.joint_names}
        for joint, expected in torques["erls"].items():
            peak = np.abs(expected).max()
            away = {name: np.abs(torques[name][joint] - expected).max() / peak for name in list(VARIANTS)[1:]}
            shares = ", ".join(f"{name} {share:.2e}" for name, share in away.items())
            print(f"start {start:6s} {joint:11s}: peak {peak:.4g} N m; {shares}", flush=True)


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--explicit", action="store_true")
    given = parser.parse_args()
    compare_formulations(given.quick, given.explicit)
    against_beams(given.quick)
    compare_torques(given.quick)


if __name__ == "__main__":
    main()
