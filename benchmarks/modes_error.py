"""What runs state of modes left out and of meshes, against runs with all that counts on finer meshes.

    python benchmarks/modes_error.py [--quick]

Each scene runs with few modes, in several ways of leaving them out, and with the modes that it ships with; the
reference has each element of a frame divided, and many fixed-interface modes. All integrate to the same small
tolerance, with the same effects. Columns: largest distance of a named point over the run, what is stated, their ratio
(floor 1e-7 m), and what the statement takes of the time of a run.
"""

from __future__ import annotations

import argparse
import tempfile
import time
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

import erls
from erls.accuracy.modes import modes_error
from erls.errors import SceneError, SimulationError
from erls.run.chain.run import ChainRun
from fe_import.errors import FEImportError

DATA = Path(__file__).parents[1] / "data"
TOLERANCE = "simulation.tolerance=1e-8"
FLOOR = 1e-7  # m
ELASTIC, FIXED = (1, 2, 4, 6, 9, 12, 18), (1, 2, 4, 6, 12)
# scene, divisions of elements and fixed-interface modes of its reference, further overrides
SCENES: list[tuple[str, int, int, tuple[str, ...]]] = [
    ("l_shape/steel_tall.toml", 3, 30, ()),
    ("l_shape/steel_flat.toml", 3, 30, ()),
    ("l_shape/aluminium.toml", 3, 30, ()),
    ("robot/two_link.toml", 2, 20, ()),
    ("robot/two_link.toml", 2, 20, ("simulation.formulation=ffr",)),
    ("robot/three_link.toml", 2, 16, ()),
    ("four_bar/flexible.toml", 3, 12, ()),
    ("five_bar/parallel_robot.toml", 2, 12, ()),
    ("slider_crank/flexible.toml", 2, 12, ()),
    ("tree/two_arms.toml", 2, 10, ()),
]


def finer(scene: Path, factor: int, fixed: int, folder: Path) -> list[str]:
    """Overrides by which the links of a scene get the reference's model."""
    result = []
    for link in tomllib.loads(scene.read_text(encoding="utf-8"))["links"]:
        if "model" not in link:
            continue
        source = scene.parent / link["model"]
        table: dict[str, Any] = tomllib.loads(source.read_text(encoding="utf-8"))
        for member in table["frame"]["members"]:
            member["elements"] = factor * member.get("elements", 1)
        table["reduction"] = {"method": "craig-bampton", "fixed_interface_modes": fixed}
        path = folder / f"{scene.stem}_{source.stem}_{factor}_{fixed}.toml"
        path.write_text(tomlkit.dumps(table), encoding="utf-8")
        result.append(f"links.{link['name']}.model={path}")
    return result


def run_of(scene: Path, overrides: list[str]) -> ChainRun:
    found = erls.simulate(erls.load_scene(scene, [TOLERANCE, *overrides]), verdict=False)
    assert isinstance(found, ChainRun)
    return found


def reduced(scene: Path, quick: bool) -> list[tuple[str, list[str]]]:
    """Ways of leaving out modes: a name, and overrides."""
    names = [k["name"] for k in tomllib.loads(scene.read_text(encoding="utf-8"))["links"] if "model" in k]
    ways: list[tuple[str, list[str]]] = [("as shipped", [])]
    for count in ELASTIC[1:4:2] if quick else ELASTIC:
        ways.append((f"{count} elastic", [f"links.{name}.elastic_modes={count}" for name in names]))
    for count in FIXED[1:3] if quick else FIXED:
        ways.append((f"{count} fixed-interface", [f"links.{n}.reduction.fixed_interface_modes={count}" for n in names]))
        ways[-1][1].extend(f"links.{n}.reduction.elastic_modes={6 + count}" for n in names)
    return ways


def row(scene: Path, overrides: list[str], reference: ChainRun) -> tuple[float, float | None, float]:
    """Error [m], what is stated [m], share of the time."""
    run = run_of(scene, overrides)
    t = np.linspace(0.0, min(run.end, reference.end), 401)
    actual = max(
        float(np.linalg.norm(run.position(k, t) - reference.position(k, t), axis=1).max()) for k in run.point_names
    )
    error = modes_error(run).error  # once before it is timed: what links leave out is found, then remembered
    begun = time.perf_counter()
    modes_error(run)
    return actual, error, (time.perf_counter() - begun) / run.wall_s


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="two counts of each kind")
    quick = parser.parse_args().quick
    ratios = []
    print(f"{'scene':44} {'modes':20} {'actual [m]':>10} {'stated [m]':>10} {'ratio':>7} {'time':>6}")
    with tempfile.TemporaryDirectory() as folder:
        for name, factor, fixed, more in SCENES:
            scene = DATA / name
            reference = run_of(scene, [*more, *finer(scene, factor, fixed, Path(folder))])
            for way, overrides in reduced(scene, quick):
                what = " ".join((name, *(text.rpartition("=")[2] for text in more)))
                try:
                    actual, stated, share = row(scene, [*more, *overrides], reference)
                except (SceneError, SimulationError, FEImportError) as problem:
                    print(f"{what:44} {way:20} {str(problem)[:60]}")
                    continue
                if stated is None:
                    print(f"{what:44} {way:20} {actual:10.2e} {'none':>10}")
                    continue
                ratios.append(stated / max(actual, FLOOR) if actual > FLOOR else np.inf)
                shown = f"{stated / max(actual, FLOOR):7.2f}"
                print(f"{what:44} {way:20} {actual:10.2e} {stated:10.2e} {shown} {share:6.1%}", flush=True)
    known = np.array([r for r in ratios if np.isfinite(r)])
    print(
        f"{len(ratios)} runs: stated at least the error in {np.mean(np.array(ratios) >= 1):.1%}; "
        f"ratio median {np.median(known):.2f}, 90th percentile {np.percentile(known, 90):.2f}, least {known.min():.2f}"
    )


if __name__ == "__main__":
    main()
