"""erls against exudyn (C++ core), the same flexible links in one process, single-threaded: time at equal error.

Needs ``pip install 'erls[benchmarks]'``. Scenes: the steel flat L (18 elastic modes, 2 s), the two-link robot and the
same with a third link (0.4 m, -30 deg), 12 elastic modes per link, 1.5 s. Links carry their mass lumped at the nodes,
since exudyn's flexible bodies know translations only; `benchmarks/exudyn_models.py` makes both programs start from the
same nodes, masses, shapes and stiffness.

Each program runs a ladder of steps or tolerances; error is the largest distance of the last named point from a tight
run of the program's own equations (erls: Equivalent Rigid Link System; exudyn: floating frame of reference; links
linear in both). How far the two tight runs are apart is printed: it is of second order in the deflection, and no error
of either program. Time is the median of the integration alone. exudyn runs generalized-alpha with modified Newton and
its best settings found here: rotation Rxyz for one link, Euler parameters for more, spectral radius 0.95, relative
tolerance 1e-5; gravity as forces on nodal masses.

Run: python benchmarks/vs_exudyn.py [--scenes l,robot2,robot3] [--runs 5]
"""

from __future__ import annotations

import argparse
import itertools
import tempfile
from collections.abc import Callable
from pathlib import Path

import exudyn_models
import numpy as np
import tomlkit

import erls
from erls.scene.build import build_mechanism
from erls.scene.chain import Scene
from erls.scene.integrators import INTEGRATORS
from erls.scene.read import load_scene
from fe_import import load_link

DATA = Path(__file__).resolve().parent.parent / "data"
LEVELS = (1e-4, 1e-5)
Ladder = list[tuple[float, float]]  # time [s], error [m]
SCIPY = ("rk45", "dop853", "radau", "bdf", "lsoda")


def lumped(source: Path, target: Path, length: float | None = None) -> None:
    """Copy a link description with lumped mass, its second node moved to ``length`` along x."""
    document = tomlkit.parse(source.read_text(encoding="utf-8"))
    document.setdefault("frame", tomlkit.table())["mass"] = "lumped"
    if length is not None:
        document["frame"]["nodes"]["tip"] = [length, 0.0, 0.0]
    target.write_text(tomlkit.dumps(document), encoding="utf-8")


def l_scene(folder: Path) -> Path:
    """The steel flat L."""
    lumped(DATA / "l_shape/links/steel_flat.toml", folder / "links/steel_flat.toml")
    path = folder / "l.toml"
    path.write_text((DATA / "l_shape/steel_flat.toml").read_text(encoding="utf-8"), encoding="utf-8")
    return path


def robot_scene(folder: Path, links: int) -> Path:
    """The robot with two or three links."""
    lumped(DATA / "robot/links/arm.toml", folder / "links/arm.toml")
    lumped(DATA / "robot/links/arm.toml", folder / "links/hand.toml", 0.4)
    text = (DATA / "robot/two_link.toml").read_text(encoding="utf-8")
    if links == 3:
        text += (
            '\n[[joints]]\nname = "wrist"\ndh = { convention = "standard", a = 0.4 }\n'
            'drive = { type = "motion", motion = { shape = "polynomial", '
            "from_deg = 0.0, to_deg = -30.0, duration = 1.0 } }\n"
            '\n[[links]]\nname = "hand"\nmodel = "links/hand.toml"\nmesh_pose = { frame = "joint" }\n'
            '\n[[points]]\nname = "end3"\nlink = "hand"\nnode = "tip"\n'
        )
    path = folder / f"robot{links}.toml"
    path.write_text(text, encoding="utf-8")
    return path


SCENES: dict[str, Callable[[Path], Path]] = {
    "l": l_scene,
    "robot2": lambda folder: robot_scene(folder, 2),
    "robot3": lambda folder: robot_scene(folder, 3),
}


def sections(scene: Scene) -> list[exudyn_models.Section]:
    """Of each link, whose members are all alike."""
    result = []
    for link in scene.record.links:
        description = load_link(scene.folder / link.model).description
        (section,), (material,) = description.sections.values(), description.materials.values()
        line_mass = material.density * section.width * section.height
        result.append(exudyn_models.Section(section.width, section.height, line_mass))
    return result


def error(positions: np.ndarray, reference: np.ndarray) -> float:
    """Largest distance [m]."""
    return float(np.linalg.norm(positions - reference, axis=1).max())


def at_level(ladder: Ladder, level: float) -> float:
    """Time at an error, between the rungs around it on double logarithmic axes, or that of a rung below it."""
    best = np.inf
    for (t0, e0), (t1, e1) in itertools.pairwise(ladder):
        if e1 <= level <= e0:
            share = (np.log(e0) - np.log(level)) / max(np.log(e0) - np.log(e1), 1e-12)
            best = min(best, float(np.exp(np.log(t0) + share * (np.log(t1) - np.log(t0)))))
    return min([best, *(t for t, e in ladder if e <= level)])


def ours(path: Path, point: str, times: np.ndarray, runs: int) -> tuple[np.ndarray, dict[str, Ladder]]:
    """Tight positions, and (time, error) for every integrator of ours."""

    def simulate(*overrides: str, repeat: int = 1) -> tuple[np.ndarray, float]:
        scene = load_scene(path, ["simulation.effects=linear", *overrides])
        done = [erls.simulate(scene) for _ in range(repeat)]
        return done[0].position(point, times), float(np.median([run.wall_s for run in done]))

    names = [name for name in INTEGRATORS if name not in (*SCIPY, "auto")]
    fine = next(name for name in names if name != "generalized_alpha")
    tight, _ = simulate(f"simulation.integrator={fine}", "simulation.tolerance=1e-8")
    check, _ = simulate(f"simulation.integrator={fine}", "simulation.tolerance=1e-7")
    print(f"  erls: tight runs of {fine} at 1e-9 and 1e-8 differ by {error(tight, check):.1e} m")
    ladders: dict[str, Ladder] = {}
    for name in names:
        rungs = [f"simulation.step={h}" for h in (4e-3, 2e-3, 1e-3, 5e-4, 2.5e-4, 1.25e-4)]
        if name != "generalized_alpha":
            rungs = [f"simulation.tolerance={t:.1e}" for t in 10.0 ** np.arange(-2, -6, -0.5)]
        ladders[name] = []
        for rung in rungs:
            positions, spent = simulate(f"simulation.integrator={name}", rung, repeat=runs)
            ladders[name].append((spent, error(positions, tight)))
            print(f"  erls {name:20s} {rung:28s} {1e3 * spent:9.2f} ms  {ladders[name][-1][1]:.2e} m", flush=True)
    return tight, ladders


def theirs(path: Path, times: np.ndarray, runs: int) -> tuple[np.ndarray, Ladder]:
    """Tight positions, and (time, error) of exudyn."""
    scene = load_scene(path)
    mechanism = build_mechanism(scene).mechanism
    shapes = sections(scene)
    duration = scene.record.simulation.duration

    def simulate(step: float, tolerance: float = 1e-5) -> tuple[np.ndarray, float]:
        model = exudyn_models.build(mechanism, shapes, len(mechanism.points) - 1, duration)
        return exudyn_models.run(model, step, times, tolerance=tolerance)

    fine, half = simulate(2.5e-5, 1e-9)[0], simulate(5e-5, 1e-9)[0]
    tight = fine + (fine - half) / 3  # second order
    print(f"  exudyn: tight runs with 25 and 50 microseconds differ by {error(fine, half):.1e} m")
    ladder = []
    for step in (4e-3, 2e-3, 1e-3, 5e-4, 2.5e-4, 1.25e-4, 1e-4):
        done = [simulate(step) for _ in range(runs)]
        ladder.append((float(np.median([spent for _, spent in done])), error(done[0][0], tight)))
        spent, off = ladder[-1]
        print(f"  exudyn generalized-alpha  step {step:<21g} {1e3 * spent:9.2f} ms  {off:.2e} m", flush=True)
    return tight, ladder


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--scenes", default=",".join(SCENES), help="separated by commas")
    parser.add_argument("--runs", type=int, default=5, help="of each setting; the median counts")
    options = parser.parse_args()
    for name in options.scenes.split(","):
        with tempfile.TemporaryDirectory() as place:
            folder = Path(place)
            (folder / "links").mkdir()
            path = SCENES[name](folder)
            scene = load_scene(path)
            duration = scene.record.simulation.duration
            times = np.linspace(0.0, duration, round(duration / 0.02) + 1)  # whole numbers of all steps
            print(f"{name}: {len(scene.record.links)} links")
            tight, ladders = ours(path, scene.record.points[-1].name, times, options.runs)
            other, ladder = theirs(path, times, options.runs)
            print(f"  the two formulations are {error(tight, other):.1e} m apart")
            for level in LEVELS:
                spent = at_level(ladder, level)
                best = min(ladders, key=lambda n: at_level(ladders[n], level))
                ms = 1e3 * at_level(ladders[best], level)
                print(
                    f"  at {level:.0e} m: exudyn {1e3 * spent:.1f} ms, erls {ms:.2f} ms ({best}): "
                    f"{1e3 * spent / ms:.1f} times faster"
                )


if __name__ == "__main__":
    main()
