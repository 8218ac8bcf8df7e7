"""Every scene of data/: what `erls simulate --json` states, read as a script would, against what the run is off.

    python benchmarks/shipped_scenes.py [--only TEXT] [--budget 60] [--json rows.jsonl]

Of what a run states, ``accuracy.total`` and ``trust.verdict`` alone are read. A row is MISLED where the actual error
passes the total, or the verdict is good and the error passes the tolerance, by more than the reference itself is in
doubt of; the exit code is 1 where one is. Without a total the verdict must be broken. What a run is off is its largest
distance, of named points over the whole run, from

- ``nodal``: geometrically exact beams, refined in mesh and step within the budget (chains of frames without loops);
- ``fine``: a hundredth of the tolerance, all effects, FFR in place of ERLS and the reverse, frames of three times the
  elements, 24 fixed-interface modes (12 of solids and matrices, whose mesh is the same one);
- ``own``: the same in the scene's own formulation, where no other one can run it;
- ``mesh``: bodies: four times the elements, an eighth of the step or a thirtieth of the tolerance;
- ``twice``: the same with twice the elements, where a mesh of four times would take too long.

Doubts are what the references move by: from one refinement to the next, from a thirtieth of the tolerance, from twice
the elements; of ``twice`` a third of what they move from the scene's own. Rows go to the file as they come, and scenes
that stand there are not run again.
"""

from __future__ import annotations

import argparse
import json
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import tomlkit

import erls
from erls.accuracy.bodies import refined
from erls.errors import SceneError, SimulationError
from erls.run.bodies.rest import BodyRest
from erls.run.file import load_run
from erls.run.record import Run
from erls.scene.bodies.analyses import Dynamics
from erls.scene.bodies.schema import BodyScene
from erls.scene.chain import Scene
from erls.scene.read import AnyScene
from erls.studies.reference import default_reference, make_reference
from fe_import.errors import ReportedError

DATA = Path(__file__).resolve().parents[1] / "data"
FLOOR = 1e-7  # m; below it errors are none
SAMPLES, ELEMENTS = 401, 3
MODES = {True: 24, False: 12}  # of frames and of others, whose cross sections quick modes deform
MOST_ELEMENTS = 5000  # of a mesh of four times as many each way
COMMAND = "import sys; from erls.cli.main import main; sys.exit(main())"

Places = np.ndarray[Any, np.dtype[np.float64]]
Found = tuple[Places, float, str]  # places (k, points, 3), what they are in doubt by [m], how they were made


def scenes() -> list[Path]:
    """All files that are simulated."""
    found = sorted(DATA.rglob("*.toml"))
    return [path for path in found if "simulation" in tomllib.loads(path.read_text(encoding="utf-8"))]


def stated(scene: Path, folder: Path) -> tuple[dict[str, Any], Run | None]:
    """The JSON of a command, and its run; of one that fails what it says, and None.

    `erls simulate` runs as a process of its own, so that nothing is known but what it prints and writes.
    """
    file = folder / "own.run.h5"
    file.unlink(missing_ok=True)
    command = [sys.executable, "-c", COMMAND, "simulate", str(scene), "--json", "-o", str(file)]
    made = subprocess.run(command, capture_output=True, encoding="utf-8", check=False)
    if made.returncode:
        return {"code": made.returncode, "says": made.stderr.strip().splitlines()[-1]}, None
    return json.loads(made.stdout), load_run(file)


def axis_of(run: Run) -> Places:
    """Times at which runs are compared."""
    return np.linspace(float(run.times[0]), float(run.times[-1]), SAMPLES)


def places(run: Run, at: Places) -> Places:
    """(k, points, 3) [m]; of equilibria that under the whole load."""
    if isinstance(run, BodyRest):
        at = run.times[-1:]
    return np.stack([run.position(name, at) for name in run.point_names], axis=1)  # type: ignore[attr-defined]


def fine_data(folder: Path) -> Path:
    """A copy of data/ whose links have finer frames and many modes."""
    copy = folder / "data"
    if copy.exists():
        return copy
    shutil.copytree(DATA, copy)
    for path in copy.rglob("*.toml"):
        table = tomllib.loads(path.read_text(encoding="utf-8"))
        if "interfaces" not in table or "reduction" not in table:
            continue
        for member in table.get("frame", {}).get("members", []):
            member["elements"] = ELEMENTS * member.get("elements", 1)
        modes = MODES["frame" in table]
        table["reduction"] = {"method": "craig-bampton", "fixed_interface_modes": modes}
        path.write_text(tomlkit.dumps(table), encoding="utf-8")
    return copy


def fine_scene(path: Path, folder: Path, tolerance: float, formulation: str) -> AnyScene:
    """A scene of a chain with links of `fine_data`, all effects, and a tolerance of its own."""
    copy = fine_data(folder) / path.relative_to(DATA)
    table = tomllib.loads(path.read_text(encoding="utf-8"))
    settings = table["simulation"]
    for name in ("step", "output_step", "integrator", "bandwidth", "coordinates", "gauge", "body_frame", "rtol"):
        settings.pop(name, None)
    settings |= {"tolerance": tolerance, "effects": "all", "formulation": formulation}
    for link in table.get("links", []):
        link.pop("elastic_modes", None)
        link.pop("reduction", None)
    copy.write_text(tomlkit.dumps(table), encoding="utf-8")
    return erls.load_scene(copy)


def by_beams(scene: Scene, run: Run, at: Places, budget: float, judged: float) -> Found:
    """By exact beams, refined until they can judge an error of this size."""
    names = tuple(run.point_names)  # type: ignore[attr-defined]
    found = make_reference(scene, "nodal", names, judged, budget)
    assert np.allclose(found.times, at)
    return found.positions, found.error, "nodal"


def by_fine_links(path: Path, folder: Path, at: Places, scene: Scene, other: bool) -> Found:
    """By links of many modes on finer meshes, in another formulation where there is one."""
    own = scene.record.simulation.formulation
    beside = {"erls": "ffr", "ffr": "erls"}.get(own, own) if other else own
    tolerance = scene.record.simulation.tolerance
    runs = [
        erls.simulate(fine_scene(path, folder, tolerance / factor, beside), verdict=False) for factor in (30.0, 100.0)
    ]
    for run in runs:
        if run.failure is not None:
            raise run.failure
    coarse, fine = (places(run, at) for run in runs)
    return fine, distance(coarse, fine), "fine" if other else "own"


def by_finer_mesh(scene: BodyScene, at: Places) -> Found:
    """By bodies of more elements and smaller steps."""
    settings = scene.record.simulation
    if isinstance(settings, Dynamics):
        step = None if settings.step is None else settings.step / 8
        settings = msgspec.structs.replace(settings, step=step, tolerance=settings.tolerance / 30)
    tight = replace(scene, record=msgspec.structs.replace(scene.record, simulation=settings))
    twice = refined(tight)
    shells = twice.record.shells
    small = all(shell.corners is not None and 4 * np.prod(shell.elements) <= MOST_ELEMENTS for shell in shells)
    meshes = [twice, refined(twice)] if small else [tight, twice]
    if not (scene.record.beams or shells):  # nothing but the integration
        meshes = [replace(scene, record=msgspec.structs.replace(scene.record, simulation=coarser(settings))), tight]
    runs = [erls.simulate(mesh, verdict=False) for mesh in meshes]
    for run in runs:
        if run.failure is not None:
            raise run.failure
    coarse, fine = (places(run, at) for run in runs)
    moved = distance(coarse, fine)
    return (
        (fine, moved / 3, "twice") if meshes[0] is tight else (fine, moved, "mesh")
    )  # of second order: a third is left


def coarser(settings: Any) -> Any:
    """Steps of twice the size, or three times the tolerance."""
    if not isinstance(settings, Dynamics):
        return settings
    step = None if settings.step is None else 2 * settings.step
    return msgspec.structs.replace(settings, step=step, tolerance=3 * settings.tolerance)


def distance(one: Places, other: Places) -> float:
    """Largest of any point [m]."""
    return float(np.linalg.norm(one - other, axis=2).max(initial=0.0))


def references(path: Path, run: Run, folder: Path, budget: float, judged: float) -> tuple[list[Found], str]:
    """All that can be made, and what the last one says that cannot."""
    scene, at = erls.load_scene(path), axis_of(run)
    ways: list[Callable[[], Found]] = []
    if isinstance(scene, BodyScene):
        ways.append(lambda: by_finer_mesh(scene, at))
    else:
        assert isinstance(scene, Scene)
        ways.append(lambda: by_fine_links(path, folder, at, scene, other=True))
        if default_reference(scene) == "nodal":
            ways.append(lambda: by_beams(scene, run, at, budget, judged))
        ways.append(lambda: by_fine_links(path, folder, at, scene, other=False))
    found: list[Found] = []
    says = ""
    for way in ways:
        if (
            found and way is ways[-1] and len(ways) > 1
        ):  # what shares the scene's formulation only where nothing else is
            break
        try:
            found.append(way())
        except (SceneError, SimulationError, ReportedError) as problem:
            says = " ".join(str(problem).split())[:150]
    return found, says


def judge(path: Path, folder: Path, budget: float) -> dict[str, Any]:
    """A row."""
    said, run = stated(path, folder)
    row: dict[str, Any] = {"scene": str(path.relative_to(DATA))}
    if run is None:
        return {**row, "outcome": f"exit code {said['code']}: {said['says']}"}
    total, verdict = said["accuracy"]["total"], said["trust"]["verdict"]
    tolerance = erls.load_scene(path).record.simulation.tolerance
    row |= {"total": total, "verdict": verdict, "horizon": said["accuracy"].get("horizon"), "outcome": ""}
    begun = time.perf_counter()
    found, says = references(path, run, folder, budget, max(total or tolerance, FLOOR))
    row["reference_s"] = round(time.perf_counter() - begun, 1)
    if not found:
        return {**row, "outcome": f"no reference: {says}"}
    own = places(run, axis_of(run))
    row["by"] = {by: (distance(own, better), doubt) for better, doubt, by in found}
    least = max(FLOOR, *(actual - doubt for actual, doubt in row["by"].values()))
    if total is not None and least > max(total, FLOOR):
        row["outcome"] = "MISLED: off by more than the total"
    elif verdict == "good" and least > max(tolerance, FLOOR):
        row["outcome"] = "MISLED: good, and off by more than the tolerance"
    elif total is None and verdict != "broken":
        row["outcome"] = "MISLED: no total, and not broken"
    return row


def best(row: dict[str, Any]) -> float | None:
    """What a run is off by the reference that is least in doubt [m]."""
    return min(row["by"].values(), key=lambda pair: pair[1])[0] if row.get("by") else None


def line(row: dict[str, Any]) -> str:
    """Of the table."""
    total, actual = row.get("total"), best(row)
    ratio = "" if total is None or actual is None else f"{total / max(actual, FLOOR):.1f}"
    shown = "" if total is None else f"{total:.1e}"
    by = ", ".join(
        f"{actual:.1e} by {name} (in doubt by {doubt:.0e})" for name, (actual, doubt) in row.get("by", {}).items()
    )
    return f"{row['scene']:36} {row.get('verdict', ''):8} {shown:>8} {ratio:>6}  {by} {row['outcome']}"


def main() -> int:
    """Print the table; 1 where a script would be misled."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", help="scenes whose path contains this")
    parser.add_argument("--budget", type=float, default=60.0, help="seconds for each reference of beams")
    parser.add_argument("--json", type=Path, help="file of rows, one JSON object a line")
    given = parser.parse_args()
    rows: dict[str, dict[str, Any]] = {}
    if given.json is not None and given.json.exists():
        known = [json.loads(text) for text in given.json.read_text(encoding="utf-8").splitlines()]
        rows = {row["scene"]: row for row in known}
    print(f"{'scene':36} {'verdict':8} {'stated':>8} {'ratio':>6}  actual [m]")
    with tempfile.TemporaryDirectory() as name:
        for path in scenes():
            key = str(path.relative_to(DATA))
            if given.only not in key:
                continue
            if key not in rows:
                rows[key] = judge(path, Path(name), given.budget)
                if given.json is not None:
                    with given.json.open("a", encoding="utf-8") as stream:
                        stream.write(json.dumps(rows[key]) + "\n")
            print(line(rows[key]), flush=True)
    wrong = [row for row in rows.values() if row["outcome"].startswith("MISLED")]
    over = [
        row["total"] / max(best(row) or 0.0, FLOOR)
        for row in rows.values()
        if row.get("by") and row["total"] is not None
    ]
    judged = f"{len(over)} judged, {len(wrong)} mislead"
    print(f"{len(rows)} scenes, {judged}; stated over actual {np.median(over):.1f} (median)")
    return 1 if wrong else 0


if __name__ == "__main__":
    raise SystemExit(main())
