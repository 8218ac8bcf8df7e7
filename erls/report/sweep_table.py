"""A sweep in words, as JSON and as a table."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import IO, Any

import numpy as np

from erls.files.csv_table import write_table
from erls.files.output import replacing
from erls.report.tables import table
from erls.studies.sweep.sweep import Sweep


def sweep_summary(found: Sweep) -> dict[str, Any]:
    """The JSON of ``erls study sweep``."""
    return {
        "scene": str(found.scene),
        "keys": list(found.keys),
        "points": found.points,
        "finished": len(found.rows),
        "failed": len(found.failed),
        "ran": found.ran,
        "interrupted": found.interrupted,
        "quantities": {name: _spread(found, k) for k, name in enumerate(found.quantities)},
        "failures": [
            {"cause": cause, "points": count, "first": next(r.message for r in found.failed if r.cause == cause)}
            for cause, count in Counter(row.cause for row in found.failed).most_common()
        ],
        "bending_looked_at": found.looked_at,
        "warned": sum(bool(row.warnings) for row in found.rows),
        "integration_s": found.integration_s,
        "wall_s": found.wall_s,
    }


def _spread(found: Sweep, k: int) -> dict[str, Any]:
    """Extremes of a quantity, with the points where they are."""
    numbers = found.numbers[:, k]
    told: dict[str, Any] = {"unit": found.units[k]}
    if not np.isfinite(numbers).any():
        return told
    parameters = {row.number: row.parameters for row in found.rows}
    for name, at in (("min", int(np.nanargmin(numbers))), ("max", int(np.nanargmax(numbers)))):
        told[name] = float(numbers[at])
        told[f"{name}_at"] = dict(zip(found.keys, parameters[at], strict=True))
    return {**told, "mean": float(np.nanmean(numbers)), "deviation": float(np.nanstd(numbers))}


def sweep_text(found: Sweep) -> str:
    """What a terminal shows."""
    told = sweep_summary(found)
    lines = [
        f"{told['scene']}: {found.points} points over {', '.join(found.keys)}",
        f"{len(found.rows)} finished, {found.ran} of them now, in {found.wall_s:.3g} s; "
        f"integrations took {found.integration_s:.3g} s",
        "",
    ]
    rows: list[tuple[str, ...]] = []
    for name, spread in told["quantities"].items():
        if "min" not in spread:
            rows.append((f"{name} [{spread['unit']}]", "-", "-", "-", "-", "-"))
            continue
        places = [", ".join(f"{value:.6g}" if isinstance(value, float) else str(value) for value in at.values())
                  for at in (spread["min_at"], spread["max_at"])]  # fmt: skip
        figures = [f"{spread[key]:.6g}" for key in ("min", "mean", "max")]
        rows.append((f"{name} [{spread['unit']}]", *figures, *places))
    lines.append(table(("quantity", "least", "mean", "largest", "least at", "largest at"), rows))
    for failure in told["failures"]:
        lines += ["", f"{failure['points']} failed, {failure['cause']}; the first: {failure['first']}"]
    if told["bending_looked_at"] < len(found.rows):
        looked = f"{told['bending_looked_at']} of {len(found.rows)} points"
        lines += ["", f"how far off links are that bend was looked at in {looked}; --verdict does in all"]
    if told["warned"]:
        text = next(row.warnings[0] for row in found.rows if row.warnings)
        lines += ["", f"{told['warned']} runs warned; the first: {text}"]
    if found.interrupted:
        lines += ["", f"interrupted: {found.points - len(found.rows)} points are left; --resume goes on"]
    return "\n".join(lines)


def write_sweep_table(path: Path, found: Sweep) -> None:
    """Every finished point, a line each: its number, parameters, quantities with units, and why it failed."""
    head = ["point", *found.keys, *_heads(found), "cause", "message"]

    def lines(file: IO[str]) -> None:
        empty = [""] * len(found.quantities)
        write_table(
            file,
            head,
            (
                [
                    row.number,
                    *row.parameters,
                    *(empty if row.numbers is None else (format(x, ".17g") for x in row.numbers)),
                    row.cause,
                    row.message,
                ]
                for row in found.rows
            ),
        )

    with replacing(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        lines(file)


def _heads(found: Sweep) -> list[str]:
    return [f"{name} [{unit}]" for name, unit in zip(found.quantities, found.units, strict=True)]
