"""A hard case: a scene, the formulations that run it, and what judges each run; `judged` makes a row of the table.

Rules for a further case:

1. It is a `Case` in the file of its subject; its scene is a table, or a file of ``data/``. Nothing else is registered.
2. ``truth`` judges by what shares nothing with the run: a closed form or an independent integration (`closed`), a
   finer run of another formulation (`fine`), the same motion described differently (`same_as`), a published number.
3. A formulation that cannot run it stands in ``not_here`` with the reason; one that must end stands in ``ends`` with
   the cause. A case leaves no formulation of `FORMULATIONS` out in silence.
4. ``fast`` names the formulations whose rows run in the tests: a second each, on kernels that other tests compile.
"""

from __future__ import annotations

import dataclasses
import math
import re
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import scenes

import erls
from erls.errors import Cause
from erls.maths.so3 import Array
from erls.run.accuracy import BROKEN
from erls.run.chain.run import ChainRun
from erls.scene.read import load_chain
from fe_import.errors import ReportedError

FORMULATIONS: dict[str, tuple[str, ...]] = {
    "erls": ("simulation.formulation=erls",),
    "ffr": ("simulation.formulation=ffr",),
    "nodal": ("simulation.formulation=nodal",),
}
"""Settings of each by its name in the table."""

TIMES = 201
ROUNDING = 1e-8  # of the way that points go, and of a mechanism's reach: distances below are none
_DOUBTFUL = 0.3  # of what is stated: the doubt of a truth that still judges it
LONGEST = 900.0  # s: a run that takes longer hangs


class Measure(NamedTuple):
    """Something else than places that is judged: its name, and what it may be at most."""

    name: str
    value: float
    most: float


class Off(NamedTuple):
    """What a run is off: metres (None: not judged by places), the doubt of what judges, by what, and other measures."""

    metres: float | None
    doubt: float
    by: str
    others: tuple[Measure, ...] = ()


@dataclasses.dataclass(frozen=True)
class Made:
    """A run that is judged.

    Attributes
    ----------
    case : Case
    formulation : str
        A key of `FORMULATIONS`.
    run : ChainRun
    folder : Path
        For further scenes.
    until : float
        Time up to which it is judged [s].
    """

    case: Case
    formulation: str
    run: ChainRun
    folder: Path
    until: float

    @property
    def times(self) -> Array:
        """(k,) times at which places are compared."""
        return np.linspace(self.run.start, self.until, TIMES)

    def places(self, run: ChainRun | None = None, times: Array | None = None) -> Array:
        """(k, points, 3) of this run or another [m]."""
        at = self.times if times is None else times
        chosen = self.run if run is None else run
        states = chosen.series(at)
        numbers = [chosen.point_names.index(name) for name in self.run.point_names]
        return np.stack([chosen.point_position(states, k) for k in numbers], axis=1)

    def other(self, case: Case) -> ChainRun:
        """A run of another case in this formulation, unless its changes say otherwise; it states nothing."""
        with tempfile.TemporaryDirectory(dir=self.folder) as name:
            return simulated(case, self.formulation, Path(name), verdict=False)


Truth = Callable[[Made], Off]


@dataclasses.dataclass(frozen=True)
class Case:
    """A row for each formulation.

    Attributes
    ----------
    name : str
        What the scene is, and why it is hard.
    scene : dict or Path
        Tables of a scene, or a file.
    truth : Truth, optional
        What judges runs; needed unless each ends with a cause.
    links : dict
        Tables of link descriptions by file name.
    changes : tuple of str
        ``KEY=VALUE`` for all formulations.
    also : mapping
        Further ones by formulation.
    not_here : mapping
        Why a formulation does not run it.
    ends : mapping
        The cause with which a formulation must end; ``"all"`` for each that has none of its own.
    told : str
        Pattern that a warning, the reasons of the verdict or the message of the failure must match.
    fast : tuple of str
        Formulations whose rows run in the tests.
    """

    name: str
    scene: Mapping[str, Any] | Path
    truth: Truth | None = None
    links: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    changes: tuple[str, ...] = ()
    also: Mapping[str, tuple[str, ...]] = dataclasses.field(default_factory=dict)
    not_here: Mapping[str, str] = dataclasses.field(default_factory=dict)
    ends: Mapping[str, Cause] = dataclasses.field(default_factory=dict)
    told: str = ""
    fast: tuple[str, ...] = ()
    subject: str = ""

    def end(self, formulation: str) -> Cause | None:
        """The cause with which a formulation must end."""
        return self.ends.get(formulation, self.ends.get("all"))

    def changed(self, *changes: str) -> Case:
        """The same with further ``KEY=VALUE``."""
        return dataclasses.replace(self, changes=(*self.changes, *changes))


def of_subject(subject: str, cases: Iterable[Case]) -> tuple[Case, ...]:
    """Cases under one head of the table."""
    return tuple(dataclasses.replace(case, subject=subject) for case in cases)


def simulated(case: Case, formulation: str, folder: Path, verdict: bool = True) -> ChainRun:
    """The run of a case.

    Parameters
    ----------
    case : Case
    formulation : str
    folder : Path
        For its files.
    verdict : bool
        Whether it states its error.

    Raises
    ------
    TimeoutError
        After `LONGEST`.
    """
    path = case.scene
    if not isinstance(path, Path):
        for name, tables in case.links.items():
            scenes.write_toml(folder / f"{name}.toml", tables)
        path = scenes.write_toml(folder / "scene.toml", dict(path))
    settings = [*FORMULATIONS[formulation], *case.changes, *case.also.get(formulation, ())]
    ends = time.monotonic() + LONGEST

    def limited(at: float, duration: float) -> None:
        if time.monotonic() > ends:
            raise TimeoutError(f"{LONGEST:g} s, and only at {at:.4g} s of {duration:.4g} s")

    return erls.simulate(load_chain(path, settings), progress=limited, verdict=verdict)


def judged(case: Case, formulation: str) -> dict[str, Any]:
    """A row: what came of a case in a formulation, stated and actual error, and what is wrong with it.

    Returns
    -------
    dict
        ``subject``, ``case``, ``formulation``, ``outcome``, ``stated``, ``off``, ``doubt``, ``by``, ``measures``,
        ``problem`` (empty: the row passes) and ``wall_s``: plain numbers and texts.

    Raises
    ------
    KeyboardInterrupt
    """
    row: dict[str, Any] = {"subject": case.subject, "case": case.name, "formulation": formulation}
    row |= dict.fromkeys(("stated", "off", "doubt")) | {"by": "", "measures": [], "problem": ""}
    if formulation in case.not_here:
        return {**row, "outcome": "not applicable", "by": case.not_here[formulation], "wall_s": 0.0}
    begun, wanted = time.perf_counter(), case.end(formulation)
    try:
        with tempfile.TemporaryDirectory() as name, warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)  # of numbers that overflow where a motion runs away
            run = simulated(case, formulation, Path(name))
            row |= {"outcome": "" if run.trust is None else run.trust.verdict}
            said = " ".join([*run.warnings, *(run.trust.reasons if run.trust else ())])
            if wanted is not None:
                row["problem"] = f"ran, and should end: {wanted}"
            elif case.told and not re.search(case.told, said):
                row["problem"] = f"does not say {case.told!r}"
            elif run.trust is not None and run.trust.verdict == BROKEN and not case.told:
                row["problem"] = "; ".join(run.trust.reasons)
            elif case.truth is not None:
                row |= _held(case, formulation, run, Path(name))
    except ReportedError as problem:
        if problem.cause == Cause.INTERRUPTED:  # nothing that could be judged
            raise KeyboardInterrupt from None
        kind = "refused" if problem.exit_code == 2 else "ends"
        row |= {"outcome": f"{kind}: {problem.cause}"}
        if problem.cause != wanted:
            row["problem"] = str(problem).splitlines()[0]
        elif case.told and not re.search(case.told, str(problem)):
            row["problem"] = f"does not say {case.told!r}"
    except Exception as problem:  # what users must never see
        row |= {"outcome": f"BUG: {type(problem).__name__}", "problem": traceback.format_exc(limit=-3)[-1500:]}
    return {**row, "wall_s": round(time.perf_counter() - begun, 2)}


def _held(case: Case, formulation: str, run: ChainRun, folder: Path) -> dict[str, Any]:
    """Whether the stated error of a run holds, up to its horizon where it is not known beyond."""
    assert case.truth is not None
    assert run.accuracy is not None
    off, stated = case.truth(Made(case, formulation, run, folder, run.end)), run.accuracy.total
    places = Made(case, formulation, run, folder, run.end).places()
    floor = ROUNDING * max(run.formulation.mechanism.reach, float(np.ptp(places, axis=0).max(initial=0.0)))
    tolerance, horizon, ends = run.scene.record.simulation.tolerance, run.accuracy.horizon, ""
    if not _covered(off, stated, floor) and horizon is not None:
        off, stated = case.truth(Made(case, formulation, run, folder, horizon)), tolerance
        ends = f", up to {horizon:.3g} s"
    found = {"stated": stated, "off": off.metres, "doubt": off.doubt, "by": off.by + ends}
    found["measures"] = [list(measure) for measure in off.others]
    wrong = [f"{name} {value:.3g} > {most:.3g}" for name, value, most in off.others if not value <= most]
    if off.metres is not None and stated is None:
        wrong.append("states nothing: " + "; ".join(run.trust.reasons if run.trust else ()))
    elif not _covered(off, stated, floor):
        wrong.append("stated too low")
    elif off.metres is not None and stated is not None and off.doubt > max(_DOUBTFUL * stated, floor):
        wrong.append("what judges it is in doubt")
    return {**found, "problem": "; ".join(wrong)}


def _covered(off: Off, stated: float | None, floor: float) -> bool:
    if off.metres is None:
        return True
    return stated is not None and math.isfinite(off.metres) and off.metres <= stated + off.doubt + floor


def apart(one: Array, other: Array) -> float:
    """Largest distance of points (..., 3) [m]."""
    return float(np.linalg.norm(one - other, axis=-1).max())


def closed(
    places: Callable[[Array], Array], by: str, doubt: float = 0.0, *measures: Callable[[Made], Measure]
) -> Truth:
    """Judged by places (k, points, 3) at times (k,): a closed form, or an independent integration."""

    known: dict[float, Array] = {}  # by the time up to which they are: the same for all formulations

    def truth(made: Made) -> Off:
        if made.until not in known:
            known[made.until] = places(made.times)
        off = apart(made.places(), known[made.until])
        return Off(off, doubt, by, tuple(measure(made) for measure in measures))

    return truth


def measured(by: str, *measures: Callable[[Made], Measure]) -> Truth:
    """Judged by other measures alone."""
    return lambda made: Off(None, 0.0, by, tuple(measure(made) for measure in measures))


def fine(by: str, good: Callable[[Case], Case], best: Callable[[Case], Case]) -> Truth:
    """Judged by the better of two better runs; how far they are apart is the doubt.

    Parameters
    ----------
    by : str
    good, best : callable
        The case as these have it; what formulation it is must stand in its changes.
    """

    known: dict[float, tuple[Array, float]] = {}  # by the time up to which they are: the same for all formulations

    def truth(made: Made) -> Off:
        if made.until not in known:
            one, two = (
                made.places(made.other(better(dataclasses.replace(made.case, also={})))) for better in (good, best)
            )
            known[made.until] = two, apart(one, two)
        exact, doubt = known[made.until]
        return Off(apart(made.places(), exact), doubt, by)

    return truth


def at(time: float, point: str, place: Sequence[float], doubt: float, by: str) -> Truth:
    """Judged by a published place of one point at one time."""

    def truth(made: Made) -> Off:
        return Off(apart(made.run.position(point, time), np.array(place)), doubt, by)

    return truth


def same_as(
    twin: Callable[[Case], Case],
    back: Callable[[Array], Array] = lambda places: places,
    later: float = 0.0,
    by: str = "",
    most: float | None = None,
) -> Truth:
    """Judged by the same motion described differently.

    It may be off by ``most`` of the size where steps are fixed (1e-9 unless given) and by a tenth of the tolerance
    where they adapt.

    Parameters
    ----------
    twin : callable
        The other description.
    back : callable
        Places (k, points, 3) of the twin as the case has them.
    later : float
        How much later the same happens in the twin [s].
    by : str
    most : float, optional
        Of the mechanism's reach.
    """

    def truth(made: Made) -> Off:
        run = made.other(twin(made.case))
        off = apart(made.places(), back(made.places(run, made.times + later)))
        settings = made.run.scene.record.simulation
        reach = made.run.formulation.mechanism.reach
        fixed = settings.integrator == "generalized_alpha" or settings.step is not None
        limit = (most or 1e-9) * reach if fixed else settings.tolerance / 10
        return Off(off, 0.0, by, (Measure("twins apart / m", off, limit),))

    return truth


def energy_kept(most: float) -> Callable[[Made], Measure]:
    """Drift of the energy, of what is exchanged between its parts over the run."""

    def measure(made: Made) -> Measure:
        found = made.run.energy(np.linspace(made.run.start, made.until, 2001))
        exchanged = float(np.ptp(found.kinetic))
        drift = float(np.abs(found.total - found.total[0]).max())
        return Measure("energy drift / exchanged", drift / max(exchanged, 1e-300), most)

    return measure
