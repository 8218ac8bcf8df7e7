"""A run: what every kind of scene gives, and what files, reports, tables and pictures ask of it.

Rules for a further kind of run:

1. It derives from `Run`, is a frozen dataclass, and is known over an `Axis`: time, or what grows in its place.
2. Answers are arrays with the shape of the asked values in front; values outside are refused by `Run.within`.
3. ``summary`` is the JSON of ``erls simulate``: ``scene``, ``formulation``, ``wall_s``, ``samples``, ``warnings`` and
   what the kind adds; a sample holds ``t``, ``joints`` and ``points``. A run that was written and read gives the same.
4. A pair of functions in `erls.run.file` writes and reads what is its own, and one class in `erls.view` draws it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from html import escape
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from erls.errors import Cause, SceneError, SimulationError
from erls.maths.so3 import Array
from erls.run.accuracy import Accuracy, Trust
from erls.run.animation import animate
from erls.run.tables import data_frame, dataset, plot
from erls.scene.records import SceneFile


class Axis(NamedTuple):
    """What a run goes along: its name, symbol and unit."""

    name: str
    symbol: str
    unit: str

    def text(self, value: str) -> str:
        """A value with its unit."""
        return f"{value} {self.unit}".rstrip()


class Curve(NamedTuple):
    """(k, ...) values for `erls.run.file`, their unit, and what they are."""

    values: Array
    unit: str
    text: str


class Run(ABC):
    """What all runs have in common.

    Attributes
    ----------
    scene : SceneFile
    wall_s : float
        Time that it took.
    warnings : tuple of str
        What the user should know before trusting it.
    accuracy, trust : Accuracy, Trust or None
        What it states of its error; None where that was not asked for.
    """

    axis: ClassVar[Axis] = Axis("time", "t", "s")
    scene: SceneFile
    wall_s: float
    warnings: tuple[str, ...]
    accuracy: Accuracy | None
    trust: Trust | None

    @property
    @abstractmethod
    def failure(self) -> SimulationError | None:
        """Why it ended early; None for a complete one."""

    @property
    @abstractmethod
    def times(self) -> Array:
        """(k,) rising values of the axis at which it was computed."""

    @property
    @abstractmethod
    def point_names(self) -> tuple[str, ...]:
        """Points whose places are reported."""

    @abstractmethod
    def position(self, point: str, t: ArrayLike) -> Array:
        """(..., 3) place of a point in the world [m]."""

    @abstractmethod
    def samples(self, times: Sequence[float]) -> list[dict[str, Any]]:
        """Joints and points at given times, as in the JSON of ``erls simulate``."""

    @abstractmethod
    def summary(self, times: Sequence[float] = ()) -> dict[str, Any]:
        """The JSON of ``erls simulate``."""

    @abstractmethod
    def columns(self, times: Array) -> dict[str, Array]:
        """(k,) values by name with unit: the table (CSV) of ``erls view``."""

    @abstractmethod
    def curves(self, times: Array) -> dict[str, Curve]:
        """What its file shows to other programs, by path."""

    @property
    def start(self) -> float:
        """First value of the axis."""
        return float(self.times[0]) if len(self.times) else 0.0

    @property
    def end(self) -> float:
        """Last one that was computed."""
        return float(self.times[-1]) if len(self.times) else 0.0

    def stated(self) -> dict[str, Any]:
        """What is stated of its error, as in the JSON of ``erls simulate``."""
        if self.accuracy is None or self.trust is None:
            return {}
        return {"accuracy": self.accuracy.summary(), "trust": self.trust.summary()}

    @property
    def title(self) -> str:
        """Above its pictures."""
        return self.scene.name

    def to_pandas(self, times: ArrayLike | None = None) -> Any:
        """Its table as a ``pandas.DataFrame`` over the axis; columns are those of `columns`, units in their names.

        Parameters
        ----------
        times : array_like, optional
            Values of the axis; up to 1001 even ones unless given.

        Raises
        ------
        SceneError
            TIME_OUT_OF_RANGE; BAD_FIELD: pandas is not installed.
        """
        return data_frame(self, times)

    def to_xarray(self, times: ArrayLike | None = None) -> Any:
        """Its table as an ``xarray.Dataset``: vectors over the axis and ``axis`` (x, y, z), units as attributes.

        Parameters and errors are those of `to_pandas`.
        """
        return dataset(self, times)

    def plot(self, *names: str, times: ArrayLike | None = None, axes: Any = None) -> Any:
        """Draw columns of its table with matplotlib.

        Parameters
        ----------
        *names : str
            Without units, patterns such as ``elbow.*`` too; a vector is drawn with its three parts. The places of its
            points unless given.
        times : array_like, optional
            Values of the axis; up to 1001 even ones unless given.
        axes : matplotlib.axes.Axes, optional
            To draw into.

        Returns
        -------
        matplotlib.axes.Axes

        Raises
        ------
        SceneError
            TIME_OUT_OF_RANGE; BAD_REFERENCE: a name that the table does not have.
        """
        return plot(self, names, times, axes)

    def animate(self, *points: str, times: ArrayLike | None = None, speed: float = 1.0) -> Any:
        """Its points moving in space, by matplotlib; `erls.write_view` makes films with links in their shapes.

        In notebooks ``HTML(run.animate().to_jshtml())`` plays it, elsewhere ``.save("run.gif")`` keeps it.

        Parameters
        ----------
        *points : str
            Names, patterns such as ``end*`` too; all unless given.
        times : array_like, optional
            Values of the axis, a picture each; up to 101 even ones unless given.
        speed : float
            How many times faster than it was.

        Returns
        -------
        matplotlib.animation.FuncAnimation

        Raises
        ------
        SceneError
            TIME_OUT_OF_RANGE; BAD_REFERENCE: a point that is not there; BAD_FIELD.
        """
        return animate(self, points, times, speed)

    def __reduce__(self) -> tuple[Any, ...]:
        """Copies and pickles hold the bytes of a run file."""
        from erls.run.file import run_content, run_of  # here: files know all kinds of runs

        return run_of, (run_content(self),)

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.title!r}: {', '.join(self._said().values())}>"

    def _repr_html_(self) -> str:
        rows = {"run": self.title, **self._said(), **{f"warning {k}": text for k, text in enumerate(self.warnings, 1)}}
        cells = (f"<tr><th>{escape(name)}</th><td>{escape(text)}</td></tr>" for name, text in rows.items())
        return f"<table>{''.join(cells)}</table>"

    def _said(self) -> dict[str, str]:
        """In a few words, by subject."""
        reached = self.axis.text(f"{self.start:.6g} to {self.end:.6g}")
        said = {self.axis.name: reached, "steps": f"{len(self.times)} knots"}
        if self.trust is not None:
            said["verdict"] = self.trust.verdict
        if self.accuracy is not None:
            total = self.accuracy.total
            said["error"] = "error not known" if total is None else f"error at most {total:.1e} m"
        if self.failure is not None:
            said["failure"] = str(self.failure.cause)
        return said

    @property
    def worth_a_file(self) -> bool:
        """Whether it holds more than its start."""
        return len(self.times) > 1

    def nearest(self, times: ArrayLike) -> Array:
        """(k,) the values nearest to these at which it can be looked at: any of a motion."""
        return np.asarray(times, dtype=float)

    def spread(self, count: int) -> Array:
        """(k,) up to ``count`` even values, ends included, to look at."""
        return np.unique(self.nearest(np.linspace(self.start, self.end, count)))

    def looks(self, count: int) -> Array:
        """(k,) values for the curves of its file."""
        return self.spread(count)

    def within(self, t: ArrayLike) -> Array:
        """(k,) flat values.

        Raises
        ------
        SceneError
            TIME_OUT_OF_RANGE.
        """
        flat = np.asarray(t, dtype=float).ravel()
        hair = 1e-9 * max(self.end, 1e-300)
        bad = ~((flat >= self.start - hair) & (flat <= self.end + hair))
        if bad.any():
            raise SceneError(
                Cause.TIME_OUT_OF_RANGE,
                f"the run does not cover this {self.axis.name}",
                where="t",
                value=float(flat[bad][0]),
                limit=self.axis.text(f"{self.start:.6g} to {self.end:.6g}"),
                remedy="ask within the run, or simulate longer",
            )
        return flat


def vector(columns: dict[str, Array], name: str, unit: str, values: Any) -> None:
    """Add the three columns of vectors (k, 3)."""
    for axis, part in zip("xyz", np.array(values).reshape(-1, 3).T, strict=True):
        columns[f"{name}.{axis} [{unit}]"] = part


def plain(name: str) -> str:
    """A name in one piece, for the head of a column."""
    return " ".join(name.split())
