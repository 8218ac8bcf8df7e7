"""What a run of a random scene is off: itself against runs that are better in one respect after the other.

| part | distance between |
|---|---|
| integration | the run, and the same equations integrated to a hundredth of the tolerance |
| modes | that one, and links of many modes on finer meshes |
| effects | that one, and all effects |
| total | the run, and the last of these |
| links | the last of these, and nodal elements refined in mesh and step (asked for apart: it takes long) |

Distances are the largest of named points over times up to each tenth of the run. Doubts are what references move by:
``integration`` from a thirtieth of the tolerance to a hundredth, ``total`` to another formulation. What is in doubt by
more than `random_statements.DOUBTFUL` of what it judges is not judged by; in doubt by more than
`random_statements.CHAOTIC` of the mechanism's size, the motion itself is chaotic. Meshes of better runs are three times
as fine; of nodal scenes steps fall to an eighth or the tolerance to a tenth. All runs are limited by their work.
"""

from __future__ import annotations

import dataclasses
import math
import tempfile
import time
import traceback
from pathlib import Path
from typing import Any

import numpy as np
from random_kept import Kept, KeptReferences
from random_scenes import RandomScene, random_scene
from random_statements import FLOOR

from erls.errors import Cause, SceneError, SimulationError
from erls.maths.so3 import Array
from erls.mechanism.effects import ALL, in_order
from erls.run.chain.run import ChainRun
from erls.run.watches.base import NOTHING, Finding, Knots, Watch
from erls.run.watches.checkpoint import Checkpoint
from erls.scene.chain import Scene, Simulation
from erls.scene.read import load_chain
from erls.simulation.asked import Asked
from erls.simulation.chains import run_chain
from fe_import.errors import ReportedError

MOST_CALLS, MOST_NODAL_CALLS = 150_000, 40_000  # evaluations of the equations
PER_BALANCE = 20  # evaluations of all modes in one of those that follow statically
MORE = 3  # times as much may references take
TIGHTER, TIGHT = 100.0, 30.0
_TIMES, _EVERY = 201, 20
_LONG = 2.0  # s: times of runs that take longer vary little
_UNTIL = 0.9  # of runs that an event ends, at the end of the step in which it happens: better runs take other steps


class WorkLimit(Watch):
    """Ends a run that takes more evaluations than it may."""

    def __init__(self, calls: int) -> None:
        self._calls, self._looks = calls, 0

    def during(self, t: float, knots: Knots) -> Finding:
        """Every so many looks."""
        self._looks += 1
        if self._looks % _EVERY and self._looks > _EVERY:
            return NOTHING
        work = knots().work
        if work.rhs_calls <= self._calls:
            return NOTHING
        message = f"{work.steps} steps and {work.rhs_calls} evaluations up to t = {t:.6g} s"
        return Finding(failure=SimulationError(Cause.BUDGET, message, remedy="shorten the run"))


@dataclasses.dataclass(frozen=True)
class Limited(Asked):
    """A simulation with a `WorkLimit`."""

    calls: int = MOST_CALLS

    def watches(self, checkpoint: Checkpoint | None) -> list[Any]:
        """Those asked for and the limit."""
        return [*super().watches(checkpoint), WorkLimit(self.calls)]


def limited_run(scene: Scene, more: float = 1.0, verdict: bool = False) -> ChainRun:
    """A run of a scene whose work is limited.

    Parameters
    ----------
    scene : Scene
    more : float
        How many times as much work it may take as a scene itself.
    verdict : bool
        Whether it states its accuracy.
    """
    settings = scene.record.simulation
    calls = MOST_NODAL_CALLS if settings.formulation == "nodal" else MOST_CALLS
    if settings.bandwidth is not None:
        calls //= PER_BALANCE
    asked = Limited(None, lambda text: None, None, False, None, verdict, calls=round(more * calls))
    return run_chain(scene, asked)


def tightened(scene: RandomScene, formulation: str, factor: float, **more: Any) -> RandomScene:
    """The same scene to a part of its tolerance, in a formulation that has an adaptive integrator."""
    s = scene.tables["simulation"]
    tolerance = s.get("tolerance", Simulation(duration=1.0).tolerance)
    plain = {"integrator": "lobatto", "step": None, "output_step": None, "coordinates": None, "rtol": None}
    settings = {**plain, "formulation": formulation, "tolerance": tolerance / factor}
    if formulation == "nodal" and "step" in s:  # of second order: errors fall by 16, and by 64
        settings = {"output_step": None, "step": s["step"] / (8 if factor == TIGHTER else 4)}
    elif formulation == "nodal":
        settings |= {"integrator": "auto", "tolerance": tolerance / math.sqrt(factor)}
    of_links = {k: v for k, v in more.items() if k in ("reduction", "elements")}
    return scene.changed({**settings, **{k: v for k, v in more.items() if k not in of_links}}, **of_links)


ALL_MODES = {"reduction": {"method": "craig-bampton", "fixed_interface_modes": 20}, "elements": 3, "bandwidth": None}
"""As good as all: these, with those of the interfaces, of meshes three times as fine."""

ALL_EFFECTS = {**ALL_MODES, "effects": "all", "gauge": None, "body_frame": None}


class Judge:
    """Runs of one scene and its references; what failed is None."""

    def __init__(self, scene: RandomScene, folder: Path, kept: Path | None = None) -> None:
        self.scene, self.folder = scene, folder
        self.kept = KeptReferences(kept, scene.seed)
        self.path = scene.write(folder / "own")
        self.names = tuple(point["name"] for point in scene.tables["points"])
        self.problems: dict[str, str] = {}

    def places(self, run: ChainRun, end: float) -> Array:
        """(times, points, 3) up to a time that the run covers [m]."""
        states = run.series(np.linspace(0.0, end, _TIMES))
        points = [run.point_position(states, run.point_names.index(name)) for name in self.names]
        return np.stack(points, axis=1)

    def reference(self, name: str, scene: RandomScene, end: float) -> Array | None:
        """Places of a better run, None where it failed."""
        found = self.kept.find(scene, end)
        if found is None:
            found = self._made(name, scene, end)
            self.kept.keep(scene, found)
        if found.problem:
            self.problems[name] = found.problem
        return found.places

    def _made(self, name: str, scene: RandomScene, end: float) -> Kept:
        try:
            run = limited_run(load_chain(scene.write(self.folder / name)), MORE)
        except ReportedError as problem:
            return Kept(end, None, f"{type(problem).__name__}: {problem.cause}")
        if run.end < end:
            return Kept(end, None, f"an event ends it at {run.end:.6g} s")
        return Kept(end, self.places(run, end), "")


def judge(
    seed: int, parts: str = "all", nodal_s: float = 0.0, work: float = 1.0, kept: str | None = None
) -> dict[str, Any]:
    """Run a random scene and its references.

    Parameters
    ----------
    seed : int
    parts : str
        ``all``; ``integration`` alone; ``statement``: no references; ``none``: nor the cost of the statement.
    nodal_s : float
        Time that a reference of beam elements may take [s]; none is made unless given.
    work : float
        Of the limits of work, what the run itself may take.
    kept : str or None
        Folder of references that outlast this call.

    Returns
    -------
    dict
        A row for `summarize`: plain numbers and texts.
    """
    scene, begun = random_scene(seed), time.perf_counter()
    row: dict[str, Any] = {"seed": seed, "labels": scene.labels, "outcome": "ran"}
    try:
        with tempfile.TemporaryDirectory() as folder:
            _judged(Judge(scene, Path(folder), Path(kept) if kept else None), row, parts, nodal_s, work)
    except (SceneError, SimulationError, ReportedError) as problem:
        kind = "failed" if isinstance(problem, SimulationError) else "refused"
        row |= {"outcome": f"{kind}: {problem.cause}", "message": str(problem).replace(folder, "")[:400]}
    except Exception as problem:  # what users must never see
        row |= {"outcome": f"BUG: {type(problem).__name__}", "message": traceback.format_exc(limit=-4)[-1500:]}
    return {**row, "judged_s": round(time.perf_counter() - begun, 2)}


def _judged(judge: Judge, row: dict[str, Any], parts: str, nodal_s: float, work: float) -> None:
    scene, loaded = judge.scene, load_chain(judge.path)
    run = limited_run(loaded, work, verdict=True)
    end = judge.kept.end(run.end if run.end >= loaded.record.simulation.duration else _UNTIL * run.end)
    own = judge.places(run, end)
    row |= {"steps": run.solution.work.steps, "evaluations": run.solution.work.rhs_calls, "wall_s": run.wall_s}
    row |= {"tolerance": loaded.record.simulation.tolerance, "end": end, "warnings": len(run.warnings)}
    if not np.isfinite(own).all():
        row |= {"outcome": "BUG: not finite"}
        return
    row |= _statement(run)
    row["size"] = float(np.ptp(own.reshape(-1, 3), axis=0).max()) + max(_lengths(scene))
    if parts == "none":
        return
    row["cost"] = _cost(loaded, run.wall_s > _LONG)
    if parts == "statement":
        return
    formulation = scene.tables["simulation"]["formulation"]
    if scene.tables["simulation"]["effects"] == "auto":  # those that it chose
        chosen = run.formulation.mechanism.effects
        scene = judge.scene = scene.changed({"effects": "all" if chosen == ALL else in_order(chosen)})
    tight = judge.reference("tight", tightened(scene, formulation, TIGHT), end)
    best = judge.reference("tighter", tightened(scene, formulation, TIGHTER), end)
    row["actual"] = {"integration": _growing(own, best)}
    row["doubt"] = {"integration": _growing(tight, best)}
    row["problems"] = judge.problems
    if parts == "integration":
        return
    modes, every, other = _of_model(judge, end, best)
    row["actual"] |= {"modes": _growing(best, modes), "effects": _growing(modes, every), "total": _growing(own, every)}
    row["doubt"] |= {"total": _growing(every, other)}
    if nodal_s and every is not None and formulation != "nodal" and scene.links:
        row["links"] = _from_beams(judge, every, end, row["actual"]["total"][-1], nodal_s)


def _of_model(judge: Judge, end: float, best: Array | None) -> tuple[Array | None, Array | None, Array | None]:
    """Places with all modes, with all effects too, and in another formulation."""
    scene = judge.scene
    s = scene.tables["simulation"]
    formulation = s["formulation"]
    if not scene.links and s["effects"] == "all":
        modes = every = best
    elif formulation == "nodal":  # the mesh in place of modes
        modes = every = judge.reference("mesh", tightened(scene, "nodal", TIGHTER).changed({}, elements=3), end)
        return modes, every, None
    else:
        every = judge.reference("every", tightened(scene, formulation, TIGHTER, **ALL_EFFECTS), end)
        modes = every
        if s["effects"] != "all" or "gauge" in s or "body_frame" in s:
            modes = judge.reference("modes", tightened(scene, formulation, TIGHTER, **ALL_MODES), end)
    pieces = any(link.get("substructures") for link in scene.tables["links"])
    beside = formulation if pieces else "ffr" if formulation == "erls" else "erls"
    return modes, every, judge.reference("other", tightened(scene, beside, TIGHT, **ALL_EFFECTS), end)


def _from_beams(judge: Judge, every: Array, end: float, judged: float, budget: float) -> dict[str, Any]:
    """Distance of the best modal run from exact beams, and what those are off themselves [m]."""
    from erls.studies.reference import make_reference

    loaded = load_chain(judge.scene.write(judge.folder / "nodal"))
    try:
        found = make_reference(loaded, "nodal", judge.names, max(judged, FLOOR), budget)
    except ReportedError as problem:
        return {"problem": f"{type(problem).__name__}: {problem.cause}"}
    places = found.positions[np.searchsorted(found.times, np.linspace(0.0, end, _TIMES)).clip(max=len(found.times) - 1)]
    return {"actual": _growing(every, places), "doubt": found.error, "made_by": found.made_by}


def _lengths(scene: RandomScene) -> list[float]:
    ends = [frame["frame"]["nodes"]["tip"] for frame in scene.links.values()]
    bodies = [link["rigid"]["points"] for link in scene.tables["links"] if "rigid" in link]
    ends += [points["tip"] for points in bodies if "tip" in points]
    return [math.hypot(*end) for end in ends]


def _growing(one: Array | None, other: Array | None) -> list[float] | None:
    """(10,) largest distance up to each tenth of the run [m]."""
    if one is None or other is None:
        return None
    apart = np.maximum.accumulate(np.linalg.norm(one - other, axis=2).max(axis=1))
    return [float(f"{value:.4g}") for value in apart[_EVERY::_EVERY]]


def _statement(run: ChainRun) -> dict[str, Any]:
    """What a run says of its accuracy; nothing where it says nothing."""
    accuracy, trust = getattr(run, "accuracy", None), getattr(run, "trust", None)
    return {
        "stated": None if accuracy is None else accuracy.summary(),
        "unjudged": {} if accuracy is None else dict(accuracy.unjudged),
        "verdict": None if trust is None else trust.verdict,
        "reasons": [] if trust is None else list(trust.reasons),
    }


def _cost(scene: Scene, long: bool) -> float:
    """Time of the statement over that of the run without it: the least of two of each, compiled before; one of each
    where they are long.
    """
    spent = {True: math.inf, False: math.inf}
    for verdict in (True, False) if long else (True, False, True, False):
        begun = time.process_time()
        limited_run(scene, verdict=verdict)
        spent[verdict] = min(spent[verdict], time.process_time() - begun)
    return spent[True] / max(spent[False], 1e-9) - 1
