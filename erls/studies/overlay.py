"""A measured record beside a run: what both hold, and how far they are apart."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from erls.errors import Cause, SceneError
from erls.maths.so3 import Array
from erls.mechanism.tables import read_titled_csv
from erls.run.record import Run
from fe_import.files.toml import choose

MOST = 20_001  # rows; of longer records every second one, third one ...
_EVEN = 4096  # samples, to look for a lag
_LATEST = 4  # of this part of the record at most


@dataclass(frozen=True)
class Overlaid:
    """One column of a record and of a run, at the times of the record within the run.

    Attributes
    ----------
    name : str
        Head of the column, with its unit.
    times, measured, simulated : (k,) arrays
    largest, rms, peak : float
        Largest and root-mean-square difference, and peak of what was measured.
    correlation : float or None
        Of the two, 1 where they are alike but for size and offset; None where one of them is constant.
    lag : float or None
        By which shifting the run later makes them most alike [s].
    """

    name: str
    times: Array
    measured: Array
    simulated: Array
    largest: float
    rms: float
    peak: float
    correlation: float | None
    lag: float | None


@dataclass(frozen=True)
class Overlay:
    """A record beside a run; ``unknown`` are columns that the run has not, ``outside`` how many rows it does not cover,
    and ``every`` which rows were taken.
    """

    run: Run
    record: Path
    columns: tuple[Overlaid, ...]
    unknown: tuple[str, ...]
    outside: int
    every: int


def overlay(run: Run, record: Path) -> Overlay:
    """Hold a measured record against a run.

    Parameters
    ----------
    run : Run
    record : Path
        CSV: time in its first column, then columns with the heads that those of the run's table have (``erls view -o
        RUN.csv``), with or without the unit.

    Raises
    ------
    SceneError
        The file is missing or faulty; it has no heads, none that the run knows, or no time within the run.
    """
    held = matched(run, record, "--overlay")
    known = run.columns(held.times)
    found = (_overlaid(name, held.times, values, known[name]) for name, values in held.columns.items())
    return Overlay(run, record, tuple(found), held.unknown, held.outside, held.every)


@dataclass(frozen=True)
class Matched:
    """A record as a run sees it: its rows within the run, and its columns by their heads in the table of the run.

    Attributes
    ----------
    times : (k,) array
    columns : dict of (k,) arrays
    unknown : tuple of str
        Heads that the run does not have.
    outside, every : int
        How many rows the run does not cover, and which of the others were taken.
    """

    times: Array
    columns: dict[str, Array]
    unknown: tuple[str, ...]
    outside: int
    every: int


def matched(run: Run, record: Path, where: str) -> Matched:
    """Read a record. Parameters and errors are those of `overlay`; ``where`` is what names it."""
    titles, table = read_titled_csv(record, where)
    if len(titles) != table.shape[1] or len(titles) < 2:
        remedy = "name its columns in the first line as in erls view RUN.h5 -o RUN.csv"
        message = "a record needs time and values, and a head for each column"
        raise SceneError(Cause.TABLE, message, where=str(record), remedy=remedy)
    inside = (table[:, 0] >= run.start) & (table[:, 0] <= run.end)
    every = max(1, -(-int(inside.sum()) // MOST))
    kept = table[inside][::every]
    if len(kept) < 2:
        limit = run.axis.text(f"{run.start:.6g} to {run.end:.6g}")
        remedy = "count its time from the start of the run"
        message = "the record has not two rows within the run"
        raise SceneError(Cause.TABLE, message, where=str(record), value=float(table[0, 0]), limit=limit, remedy=remedy)
    known = run.columns(kept[:1, 0])
    short = {name.rpartition(" [")[0]: name for name in known}
    names = {title: title if title in known else short.get(title) for title in titles[1:]}
    found = {name: kept[:, k] for k, name in enumerate(names.values(), 1) if name is not None}
    unknown = tuple(title for title, name in names.items() if name is None)
    if not found:
        choose(unknown[0], [name for name in short if name != run.axis.symbol], f"{record}: first line", SceneError)
    return Matched(kept[:, 0], found, unknown, int((~inside).sum()), every)


def _overlaid(name: str, times: Array, measured: Array, simulated: Array) -> Overlaid:
    apart = measured - simulated
    correlation, lag = _alike(times, measured, simulated)
    return Overlaid(
        name,
        times,
        measured,
        simulated,
        float(np.abs(apart).max()),
        float(np.sqrt((apart**2).mean())),
        float(np.abs(measured).max()),
        correlation,
        lag,
    )


def _alike(times: Array, measured: Array, simulated: Array) -> tuple[float | None, float | None]:
    """Correlation, and the shift that makes it largest: over even samples, between them by a parabola."""
    count = min(_EVEN, max(len(times), 16))
    even = np.linspace(times[0], times[-1], count)
    a, b = (np.interp(even, times, x) for x in (measured, simulated))
    a, b = a - a.mean(), b - b.mean()
    scale = float(np.linalg.norm(a) * np.linalg.norm(b))
    if not scale > 1e-12 * float((np.abs(measured).max() * np.abs(simulated).max() + 1e-300) * count):
        return None, None
    size = 2 * count
    both = np.fft.irfft(np.fft.rfft(a, size) * np.conj(np.fft.rfft(b, size)), size) / scale
    most = count // _LATEST
    shifts = np.arange(-most, most + 1)
    values = both[shifts]
    at = int(values.argmax())
    shift = float(shifts[at])
    if 0 < at < len(shifts) - 1:
        left, middle, right = values[at - 1 : at + 2].tolist()
        bend = left - 2 * middle + right
        shift += 0.5 * (left - right) / bend if bend < 0 else 0.0
    return float(both[0]), shift * float(even[1] - even[0])


def overlay_summary(found: Overlay) -> dict[str, Any]:
    """The JSON of ``erls view --overlay``."""
    figures = ("largest", "rms", "peak", "correlation", "lag")
    return {
        "record": str(found.record),
        "columns": {c.name: {name: getattr(c, name) for name in figures} for c in found.columns},
        "unknown": list(found.unknown),
        "rows_outside": found.outside,
        "every": found.every,
    }
