"""What the model of links leaves out, as stated and as it is against exact beams: scenes of data/, softer and stiffer.

    python benchmarks/links_error.py [--only NAME] [--factors 0.1,0.3,1,3] [--formulation erls] [--step 2e-4]

Per scene, multiple of Young's modulus, and set of effects (all, linear): the largest distance of named points from
elements of the nodal formulation, extrapolated over their number (8 and 16 per member) and over the step (``--step``
and twice it), with the size of these extrapolations; the part ``links`` of the stated error, and their ratio; what it
costs against the run. Runs have a tolerance of 1e-6 m. Modes that a link leaves out, and what the extrapolation leaves,
hide distances near 1e-5 m: such rows are marked.

Damping, which nodal elements do not know, is taken out of links. At the end: quantiles of the ratio of unmarked rows.
"""

from __future__ import annotations

import argparse
import re
import shutil
import tempfile
import time
from pathlib import Path

import numpy as np

import erls
from erls.accuracy.links import links_error
from erls.errors import SimulationError
from erls.run.chain.places import node_positions, watched_nodes
from erls.run.chain.run import ChainRun
from erls.run.deflection.errors import link_errors
from erls.scene.read import load_scene

DATA = Path(__file__).resolve().parent.parent / "data"
SCENES = (
    "l_shape/steel_flat.toml",
    "l_shape/steel_tall.toml",
    "l_shape/aluminium.toml",
    "l_shape/steel_soft.toml",
    "l_shape/torque.toml",
    "robot/two_link.toml",
    "robot/three_link.toml",
    "spin_up/beam.toml",
    "slider_crank/flexible.toml",
    "four_bar/flexible.toml",
    "five_bar/parallel_robot.toml",
    "tree/two_arms.toml",
    "parallel/three_legs.toml",
    "six_joints",
    "rubber",
)


def bar(name: str, length: float, width: float, height: float, modulus: float = 7e10, density: float = 2700.0) -> str:
    """A straight link as a description."""
    return f"""name = "{name}"
[materials.m]
youngs_modulus = {modulus!r}
poissons_ratio = 0.33
density = {density}
[sections.s]
shape = "rectangular"
width = {width}
height = {height}
[frame.nodes]
root = [0.0, 0.0, 0.0]
tip = [{length}, 0.0, 0.0]
[[frame.members]]
from = "root"
to = "tip"
elements = 16
material = "m"
section = "s"
[[interfaces]]
name = "root"
node = "root"
[[interfaces]]
name = "tip"
node = "tip"
[reduction]
fixed_interface_modes = 6
"""


def six_joints(folder: Path) -> Path:
    """An arm of six links that follows prescribed angles with 1 kg in its hand."""
    links = ((0.15, 0.04, 0.03), (0.45, 0.03, 0.02), (0.4, 0.025, 0.015), (0.12, 0.02, 0.02), (0.1, 0.02, 0.015))
    lines = ["[simulation]", "duration = 1.5"]
    turns, ends = (90, 0, 0, 90, -90, 0), (60, 50, -70, 40, 60, 90)
    for k, (section, alpha, end) in enumerate(zip((*links, (0.15, 0.015, 0.012)), turns, ends, strict=True)):
        (folder / "links" / f"s{k}.toml").write_text(bar(f"s{k}", *section), encoding="utf-8")
        motion = f'shape = "polynomial", from_deg = 0.0, to_deg = {end}, duration = 1.0, degree = 7'
        dh = f'convention = "standard", a = {section[0]}, alpha_deg = {alpha}'
        lines += ["[[joints]]", f'name = "j{k}"', f"dh = {{ {dh} }}"]
        lines += [f'drive = {{ type = "motion", motion = {{ {motion} }} }}']
        lines += ["[[links]]", f'name = "l{k}"', f'model = "links/s{k}.toml"', 'mesh_pose = { frame = "joint" }']
    lines += ["[[points]]", 'name = "hand"', 'link = "l5"', 'node = "tip"']
    lines += ["[[payloads]]", 'point = "hand"', "mass = 1.0"]
    path = folder / "scene.toml"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def rubber(folder: Path) -> Path:
    """A bar of rubber, 1 m, that falls as a pendulum."""
    (folder / "links" / "bar.toml").write_text(bar("bar", 1.0, 0.04, 0.05, 2e7, 1100.0), encoding="utf-8")
    lines = ["[simulation]", "duration = 1.5", "[base]", "rotation_deg = [90.0, 0.0, 0.0]"]
    lines += ["[[joints]]", 'name = "pivot"', 'dh = { convention = "modified" }']
    lines += ["[[links]]", 'name = "bar"', 'model = "links/bar.toml"']
    lines += ["[[points]]", 'name = "end"', 'link = "bar"', 'node = "tip"']
    path = folder / "scene.toml"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


OWN = {"six_joints": six_joints, "rubber": rubber}


def prepared(folder: Path, scene: str, factor: float) -> Path:
    """A copy of a scene, with so many times the modulus and without damping."""
    if scene in OWN:
        (folder / "links").mkdir(parents=True)
        path = OWN[scene](folder)
    else:
        source = DATA / scene
        shutil.copytree(source.parent, folder)
        path = folder / source.name
    for file in folder.rglob("*.toml"):
        text = file.read_text(encoding="utf-8")
        text = re.sub(r"(youngs_modulus = )(\S+)", lambda found: f"{found[1]}{float(found[2]) * factor!r}", text)
        file.write_text(re.sub(r"(?m)^(\[(links\.)?damping\]|ratio\s*=.*)$", "", text), encoding="utf-8")
    return path


def simulated(path: Path, *changes: str) -> ChainRun:
    """A run with some settings of the simulation."""
    run = erls.simulate(load_scene(path, [f"simulation.{change}" for change in changes]))
    assert isinstance(run, ChainRun)
    return run


def places(run: ChainRun, times: np.ndarray) -> np.ndarray:
    """(k, p, 3) of the nodes that are judged."""
    states, mechanism = run.series(times), run.formulation.mechanism
    nodes = watched_nodes(mechanism)
    return np.stack([node_positions(mechanism, states, k, np.array([n]))[..., 0, :] for k, n in nodes], axis=1)


def exact(path: Path, times: np.ndarray, step: float) -> tuple[np.ndarray, float]:
    """Places by nodal elements, and how far they moved by extrapolation."""
    fine, coarse, slow = (
        places(simulated(path, "formulation=nodal", f"elements_per_member={n}", f"step={h}"), times)
        for n, h in ((16, step), (8, step), (16, 2 * step))
    )
    result = fine + (fine - coarse) / 3 + (fine - slow) / 3
    return result, apart(result, fine)


def apart(one: np.ndarray, other: np.ndarray) -> float:
    """Largest distance [m]."""
    return float(np.linalg.norm(one - other, axis=-1).max())


def main() -> None:
    """Print one line per run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="")
    parser.add_argument("--factors", default="0.1,0.3,1,3")
    parser.add_argument("--formulation", default="erls")
    parser.add_argument("--step", type=float, default=2e-4)
    given = parser.parse_args()
    ratios = []
    print(f"{'scene':30}{'E x':>5} {'effects':8}{'actual':>9}{'moved':>9}{'stated':>9}{'ratio':>8}{'cost':>8}")
    for scene in (name for name in SCENES if given.only in name):
        for factor in map(float, given.factors.split(",")):
            with tempfile.TemporaryDirectory() as name:
                path = prepared(Path(name) / "scene", scene, factor)
                times = np.linspace(0.0, load_scene(path).record.simulation.duration, 201)  # type: ignore[union-attr]
                try:
                    beams, moved = exact(path, times, given.step)
                except SimulationError as problem:
                    print(f"{scene:30}{factor:5g} no reference: {problem}", flush=True)
                    continue
                for effects in ("all", "linear"):
                    settings = f"effects={effects}", f"formulation={given.formulation}"
                    try:
                        run = simulated(path, *settings)
                        actual = apart(places(simulated(path, *settings, "tolerance=1e-6"), times), beams)
                    except SimulationError as problem:
                        print(f"{scene:30}{factor:5g} {effects:8} {problem}", flush=True)
                        continue
                    begun = time.perf_counter()
                    link_errors(run)
                    cost = (time.perf_counter() - begun) / run.wall_s
                    stated, why = links_error(run)
                    if stated is None:
                        print(f"{scene:30}{factor:5g} {effects:8}{actual:9.1e}{moved:9.1e} {why}", flush=True)
                        continue
                    hidden = actual < max(3 * moved, 3e-5)
                    ratios += [] if hidden else [stated / actual]
                    row = (
                        f"{scene:30}{factor:5g} {effects:8}{actual:9.1e}{moved:9.1e}{stated:9.1e}{stated / actual:8.2f}"
                    )
                    print(f"{row}{100 * cost:7.1f}%{' hidden' if hidden else ''}", flush=True)
    if ratios:
        low, middle, high = np.quantile(ratios, [0.0, 0.5, 0.9])
        print(f"stated / actual of {len(ratios)} runs: least {low:.2f}, median {middle:.2f}, nine in ten {high:.2f}")


if __name__ == "__main__":
    main()
