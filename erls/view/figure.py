"""What a run looks like: the contract between runs of every kind and the stage, exports and texts.

To draw a further kind of run: a `Figure` and its `Pose`, one file, and a line in `erls.view.figures`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from erls.maths.so3 import Array
from erls.run.record import Run
from erls.view.shapes import Arrow


@dataclass(frozen=True)
class Shade:
    """What colours say.

    Attributes
    ----------
    name, unit : str
    array : str
        Point data of exports that hold it.
    always : bool
        Whether any of it is worth a colour.
    """

    name: str
    unit: str
    array: str = ""
    always: bool = False


DEFLECTION, STRESS = Shade("deflection", "mm"), Shade("stress", "MPa", "von_mises_MPa", True)
FORCE, MOMENT = (
    Shade("section force", "N", "section_force_N", True),
    Shade("section moment", "N m", "section_moment_Nm", True),
)
SHADES = {"deflection": DEFLECTION, "stress": STRESS, "section-force": FORCE, "section-moment": MOMENT}
"""By the names that ``--color`` takes."""


@dataclass(frozen=True)
class Part:
    """A link, beam or body as drawn.

    Attributes
    ----------
    surface : pyvista.PolyData
        With what colours say as the point data "value", not a number where it is not known.
    sharp : bool
        Whether its sharp edges are drawn as lines.
    """

    surface: Any
    sharp: bool = False


@dataclass(frozen=True)
class PartMesh:
    """A link, beam or body for ParaView: (n, 3) points, cells by kind, true displacements (n, 3) [m], and what else is
    known at its points; ``rigid``: all points move as one body.
    """

    name: str
    points: Array
    cells: list[tuple[str, Any]]
    displacement: Array
    more: dict[str, Array] = field(default_factory=dict)
    rigid: bool = False


class Pose(ABC):
    """The mechanism at one time; ``magnification`` is that of displacements, 1 is true."""

    time: float

    @abstractmethod
    def points(self, magnification: float) -> list[Array]:
        """(3,) places of the named points."""

    @abstractmethod
    def nodes(self, magnification: float) -> list[Array]:
        """(n, 3) places of each part."""

    @abstractmethod
    def deflections(self) -> list[Array]:
        """(n,) lengths of the displacements of each part's nodes [m]."""

    def values(self) -> list[Array]:
        """(n,) of each part's nodes, what colours say, in the unit of the figure's shade."""
        return [1e3 * moved for moved in self.deflections()]

    @abstractmethod
    def anchor(self) -> Array:
        """(3,) where its time stands if no point is named."""

    @abstractmethod
    def parts(self, magnification: float, unit: float) -> list[Part]:
        """Parts as surfaces; ``unit`` is the radius of a beam."""

    @abstractmethod
    def joints(self, magnification: float, unit: float, moving: bool) -> Any:
        """Joints as one surface, None without; ``moving``: without those that stay where they are."""

    def loads(self, magnification: float) -> list[Arrow]:
        """What acts on it."""
        return []

    def sensors(self, magnification: float) -> dict[str, Array]:
        """(3,) places of what watches it, by name."""
        return {}

    @abstractmethod
    def outline(self) -> list[Any]:
        """What displacements count from, as thin lines."""

    @abstractmethod
    def meshes(self, magnification: float) -> list[PartMesh]:
        """Parts for ParaView."""


class Figure(ABC):
    """What is drawn of a run.

    Attributes
    ----------
    run : Run
    part : str
        What its parts are called in ParaView.
    shade : Shade
    """

    run: Run
    part: str
    shade: Shade

    @property
    @abstractmethod
    def gravity(self) -> Array:
        """(3,) [m/s²]"""

    @property
    @abstractmethod
    def size(self) -> float:
        """Of the largest part [m]."""

    @abstractmethod
    def fixed(self) -> Array:
        """(k, 3) places that belong into every picture."""

    @abstractmethod
    def ground(self, towards: Array, unit: float) -> list[Any]:
        """Where it stands, as surfaces; ``towards`` the viewer."""

    @abstractmethod
    def poses(self, times: Sequence[float] | Array) -> Sequence[Pose]:
        """The mechanism at each time."""

    def paths(self, times: Array, magnification: float) -> list[Array]:
        """(k, 3) places of each named point at times (k,)."""
        points = [pose.points(magnification) for pose in self.poses(times)]
        return [np.array(path) for path in zip(*points, strict=True)]
