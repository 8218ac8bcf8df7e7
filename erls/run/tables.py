"""The table of a run (`Run.columns`) as other packages hold tables, and as lines of a plot."""

from __future__ import annotations

import re
from collections.abc import Iterator
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from erls.errors import Cause, SceneError
from erls.files.optional import optional_package, require_package
from erls.maths.so3 import Array

if TYPE_CHECKING:
    from erls.run.record import Run

HEAD = re.compile(r"(?P<name>.*) \[(?P<unit>.*)\]")
_ROWS = 1001


class Quantity(NamedTuple):
    """Numbers of a run over its axis: (k,), or (k, 3) in world axes."""

    values: Array
    unit: str


def columns(run: Run, times: ArrayLike | None) -> dict[str, Array]:
    """(k,) columns by head, the axis first, at times or at up to 1001 even ones."""
    return run.columns(run.spread(_ROWS) if times is None else np.atleast_1d(np.asarray(times, dtype=float)))


def data_frame(run: Run, times: ArrayLike | None) -> Any:
    """As `Run.to_pandas` says."""
    axis, *rest = columns(run, times).items()
    pandas = optional_package("pandas", "Run.to_pandas")
    return pandas.DataFrame(dict(rest), index=pandas.Index(axis[1], name=axis[0]))


def dataset(run: Run, times: ArrayLike | None) -> Any:
    """As `Run.to_xarray` says."""
    xarray = optional_package("xarray", "Run.to_xarray")
    (name, along), *rest = quantities(columns(run, times))
    variables = {
        found: ((name, "axis")[: part.values.ndim], part.values, {"units": part.unit}) for found, part in rest
    }
    axes = {"axis": list("xyz")} if any(part.values.ndim == 2 for _, part in rest) else {}
    about = {"scene": run.scene.name, "axes": "world"}
    return xarray.Dataset(variables, {name: (name, along.values, {"units": along.unit}), **axes}, about)


def plot(run: Run, patterns: tuple[str, ...], times: ArrayLike | None, axes: Any) -> Any:
    """As `Run.plot` says."""
    (name, along), *rest = quantities(columns(run, times))
    names = [found for found, _ in rest]
    asked = patterns or run.point_names or tuple(names[:1])
    chosen = [found for found in names if any(fnmatchcase(found, pattern) for pattern in asked)]
    for pattern in asked:
        if not any(fnmatchcase(found, pattern) for found in names):
            message, remedy = "the table of the run has no such column", "name one of these, or a pattern such as hip.*"
            raise SceneError(Cause.BAD_REFERENCE, message, where="plot", value=pattern, limit=names, remedy=remedy)
    if axes is None:
        require_package("matplotlib", "Run.plot")
        import matplotlib.pyplot as plt

        _, axes = plt.subplots()
    found = dict(rest)
    for chosen_name in chosen:
        values, unit = found[chosen_name]
        parts = [""] if values.ndim == 1 else [".x", ".y", ".z"]
        for part, line in zip(parts, np.atleast_2d(values.T), strict=True):
            axes.plot(along.values, line, label=f"{chosen_name}{part} [{unit}]")
    units = {found[chosen_name].unit for chosen_name in chosen}
    axes.set_xlabel(f"{name} [{along.unit}]")
    axes.set_ylabel(f"[{units.pop()}]" if len(units) == 1 else "")
    axes.legend()
    return axes


def quantities(table: dict[str, Array]) -> Iterator[tuple[str, Quantity]]:
    """Columns by name, three that are a vector as one."""
    heads = {head: HEAD.fullmatch(head) for head in table}
    named = {match["name"]: Quantity(table[head], match["unit"]) for head, match in heads.items() if match}
    for name, found in named.items():
        base, _, part = name.rpartition(".")
        together = [named.get(f"{base}.{axis}") for axis in "xyz"]
        if part not in ("x", "y", "z") or None in together:
            yield name, found
        elif part == "x":
            yield base, Quantity(np.stack([each.values for each in together if each], axis=1), found.unit)
