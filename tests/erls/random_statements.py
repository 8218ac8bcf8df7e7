"""Stated errors of random scenes against actual ones: rows of `random_references.judge`, stored references, tables."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

FLOOR = 1e-7  # m; below it errors are none
DOUBTFUL, CHAOTIC = 0.3, 1e-3  # of what a reference judges; of the mechanism's size
PARTS = ("integration", "modes", "effects", "total")
REFERENCE_COLUMNS = ("seed", "outcome", "end", "doubt", *PARTS)

Row = dict[str, Any]


def reference_row(row: Row) -> dict[str, Any]:
    """What tests keep of a row: actual errors, and what they are in doubt by, at the tenths of the run, in one field
    each, separated by blanks.
    """
    actual = row.get("actual", {})
    fields = {part: _joined(actual.get(part) or ()) for part in PARTS}
    doubt = (row.get("doubt") or {}).get("total") or [math.nan]
    end = f"{row['end']:.6g}" if "end" in row else ""
    return {"seed": row["seed"], "outcome": row["outcome"], "end": end, "doubt": _joined(doubt), **fields}


def _joined(values: Iterable[float]) -> str:
    return " ".join(f"{value:.3g}" for value in values)


def row_of(stored: dict[str, str]) -> Row:
    """What `reference_row` keeps, as a row to which a statement can be added; older rows keep one doubt, taken at all
    times.
    """
    actual = {part: [float(value) for value in stored[part].split()] for part in PARTS}
    doubt = [float(value) for value in stored["doubt"].split()]
    if len(doubt) == 1:
        doubt *= len(actual["total"])
    doubts = {"doubt": {"integration": doubt, "total": doubt}} if doubt and not math.isnan(doubt[0]) else {}
    return {"seed": int(stored["seed"]), "outcome": stored["outcome"], "labels": {}, "actual": actual, **doubts}


def worst(row: Row, kind: str, part: str) -> float:
    """Largest value over the run [m]; NaN where there is none."""
    values = (row.get(kind) or {}).get(part)
    return values[-1] if values else math.nan


def chaotic(row: Row) -> bool:
    """Whether references that should agree are apart by a part of the mechanism's size."""
    doubts = [worst(row, "doubt", part) for part in ("integration", "total")]
    return any(doubt > CHAOTIC * row.get("size", math.inf) for doubt in doubts)


def up_to(values: Sequence[float], end: float, horizon: float | None) -> float:
    """Largest error up to the last tenth of the run before a horizon [m]; 0 where that is none."""
    if horizon is None or horizon >= end:
        return values[-1]
    passed = int(len(values) * horizon / end)
    return values[passed - 1] if passed else 0.0


def judged(row: Row, part: str = "total") -> float | None:
    """What is stated of what references judge [m]: of the total all but ``links`` where they share the links' model, as
    they do with runs of all effects that have no gauge or body frame of their own.
    """
    stated, labels = row.get("stated") or {}, row["labels"]
    error: float | None = stated.get(part)
    if error is None or part != "total" or labels["effects"] != "all" or "," in labels["formulation"]:
        return error
    return error - (stated.get("links") or 0.0)


def ratio(row: Row, part: str) -> float | None:
    """Stated over actual error; None where either is missing, the reference is in doubt by too much, or the verdict is
    ``broken``: then there is no bound, whatever the parts add up to.

    Both are counted from `FLOOR` on, so that what is stated below it is enough for what is below it. Up to a stated
    horizon the error is stated to be within the tolerance, and beyond it nothing is relied on: that is what counts
    where the reference is in doubt later on, where the motion is farther off by then, and where it is farther off at
    the end than the total says.
    """
    stated, actual = row.get("stated") or {}, (row.get("actual") or {}).get(part)
    error = judged(row, part)
    if error is None or not actual or row.get("verdict") == "broken":
        return None
    doubts = (row.get("doubt") or {}).get("integration" if part == "integration" else "total")
    horizon = stated["horizon"]

    def over(error: float, until: float | None) -> float | None:
        off = max(up_to(actual, row["end"], until), FLOOR)
        doubt = up_to(doubts, row["end"], until) if doubts else 0.0
        return None if doubt > DOUBTFUL * off else max(error, FLOOR) / off

    whole = over(error, None)
    if horizon is None:
        return whole
    before = over(row["tolerance"], horizon)
    return before if whole is None or (before is not None and min(whole, before) < 1) else whole


def print_table(rows: list[Row], subjects: Sequence[str]) -> int:
    """Print what came of random scenes; 1 where a run ended as none may."""
    ran = [row for row in rows if row["outcome"] == "ran"]
    print(f"{len(rows)} scenes, {len(ran)} ran")
    _print_counts("outcomes", (row["outcome"] for row in rows), len(rows))
    _print_counts("verdicts", (str(row.get("verdict")) for row in ran), len(ran))
    wild = [row for row in ran if chaotic(row)]
    seeds = [row["seed"] for row in wild]
    print(f"references in doubt by {CHAOTIC:g} of the size (chaotic): {len(wild)}, seeds {seeds}")
    steps = [row["steps"] for row in ran]
    if steps:
        low, middle, high = np.percentile(steps, (10, 50, 90))
        print(f"steps: {low:.0f} (10th percentile), {middle:.0f} (median), {high:.0f} (90th)")
    costs = [row["cost"] for row in ran if "cost" in row]
    if costs:
        middle, high = np.percentile(costs, (50, 90))
        print(f"cost of the statement over the run: median {middle:.0%}, 90th percentile {high:.0%}")
    print("\nstated over actual error")
    for part in PARTS:
        _print_ratios(part, [ratio(row, part) for row in ran])
    for subject in subjects:
        print(f"\ntotal, by {subject}")
        for value, members in _by_class(ran, subject):
            _print_ratios(value, [ratio(row, "total") for row in members])
    print("\nactual error of integration over the tolerance, by integrator")
    for value, members in _by_class(ran, "integrator"):
        _print_integration(value, members)
    print("\nlinks: actual distance from exact beams, and its doubt [m]")
    for row in ran:
        if "actual" in (row.get("links") or {}):
            print(f"  seed {row['seed']}: {row['links']['actual'][-1]:.1e} {row['links']['doubt']:.1e}")
    bugs = [row for row in rows if row["outcome"].startswith("BUG")]
    for row in bugs:
        print(f"\nseed {row['seed']}: {row['outcome']}\n{row.get('message', '')}")
    return 1 if bugs else 0


def _by_class(rows: list[Row], subject: str) -> list[tuple[str, list[Row]]]:
    found: defaultdict[str, list[Row]] = defaultdict(list)
    for row in rows:
        found[row["labels"][subject]].append(row)
    return sorted(found.items())


def _print_counts(what: str, values: Iterable[str], whole: int) -> None:
    print(f"{what}:")
    for value, count in Counter(values).most_common():
        print(f"  {count:5d} {count / max(whole, 1):6.1%}  {value}")


def _print_ratios(name: str, ratios: Sequence[float | None]) -> None:
    known = np.array([value for value in ratios if value is not None])
    text = f"  {name:28s} {len(known):5d} of {len(ratios):5d} judged"
    if len(known):
        middle, high = np.percentile(known, (50, 90))
        text += f", covered {np.mean(known >= 1):6.1%}, median {middle:8.2g}, 90th percentile {high:8.2g}"
    print(text)


def _print_integration(name: str, rows: list[Row]) -> None:
    known = []
    for row in rows:
        off, doubt = worst(row, "actual", "integration"), worst(row, "doubt", "integration")
        if doubt <= DOUBTFUL * max(off, FLOOR):
            known.append(max(off, FLOOR) / row["tolerance"])
    text = f"  {name:28s} {len(known):5d} of {len(rows):5d} judged"
    if known:
        low, middle, high, most = np.percentile(known, (10, 50, 90, 100))
        text += f": {low:.2g} (10th percentile), {middle:.2g} (median), {high:.2g} (90th), {most:.2g} (most)"
        text += f"; within the tolerance {np.mean(np.array(known) <= 1):.0%}"
    print(text)
