"""A mode of a reduced link, as something to look at: over the phase of one period, the link free."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from erls.errors import Cause, SceneError
from erls.maths.so3 import Array
from erls.run.record import Axis, Curve, Run, plain, vector
from erls.scene.records import SceneFile, SceneTables
from fe_import.files.hdf5.files import open_for_reading
from fe_import.files.toml import choose
from fe_import.modal.file import SCHEMA, read_modal_file
from fe_import.modal.model import ModalModel

RIGID = 6  # modes before the elastic ones
_LARGEST = 0.1  # displacement, of the size of the link
_PHASES = 49


@dataclass(frozen=True, repr=False)
class LinkMode(Run):
    """An elastic mode; its amplitude, which means nothing, is a tenth of the size.

    Attributes
    ----------
    model : ModalModel
    number : int
        From 1.
    """

    axis: ClassVar[Axis] = Axis("phase", "phase", "")
    scene: SceneFile
    model: ModalModel
    number: int
    wall_s: float = 0.0
    warnings: tuple[str, ...] = ()
    accuracy: None = None
    trust: None = None

    def __reduce__(self) -> tuple[Any, ...]:
        """Of its model: there are no run files of modes."""
        return LinkMode, (self.scene, self.model, self.number)

    @property
    def failure(self) -> None:
        """It has none."""

    @property
    def title(self) -> str:
        """The link, the mode, what moves in it and its frequency."""
        at = RIGID + self.number - 1
        return f"{self.model.name}: mode {self.number}, {self.model.kinds[at]}, {self.model.frequencies_hz[at]:.4g} Hz"

    @property
    def times(self) -> Array:
        """(k,) phases from 0 to 1; the first and the last are farthest out."""
        return np.linspace(0.0, 1.0, _PHASES)

    @property
    def point_names(self) -> tuple[str, ...]:
        """The interfaces."""
        return tuple(interface.name for interface in self.model.interface_nodes)

    @cached_property
    def amplitude(self) -> Array:
        """(n, 3) displacement of all nodes at phase 0, mesh frame [m]."""
        moved = self.model.translation_shapes[:, :, RIGID + self.number - 1]
        size = float(np.linalg.norm(np.ptp(self.model.nodes, axis=0))) or 1.0
        return np.asarray(moved * (_LARGEST * size / max(float(np.linalg.norm(moved, axis=1).max()), 1e-300)))

    def displacements(self, t: ArrayLike) -> Array:
        """(k, n, 3) of all nodes at phases, mesh frame [m]."""
        return np.cos(2 * np.pi * self.within(t))[:, None, None] * self.amplitude

    def position(self, point: str, t: ArrayLike) -> Array:
        """(..., 3) place of an interface in the mesh frame [m]."""
        choose(point, self.point_names, "point", SceneError)
        node = self.model.interface_nodes[self.point_names.index(point)].node
        return np.asarray(self.model.nodes[node] + self.displacements(t)[:, node]).reshape(*np.shape(t), 3)

    def samples(self, times: Sequence[float]) -> list[dict[str, Any]]:
        """Interfaces at phases."""
        places = {name: self.position(name, list(times)) for name in self.point_names}
        return [
            {"t": t, "joints": {}, "points": {name: at[k].tolist() for name, at in places.items()}}
            for k, t in enumerate(times)
        ]

    def summary(self, times: Sequence[float] = ()) -> dict[str, Any]:
        """What mode it is."""
        at = RIGID + self.number - 1
        found = {"link": self.model.name, "mode": self.number, "kind": self.model.kinds[at]}
        return {**found, "frequency_hz": float(self.model.frequencies_hz[at]), "samples": self.samples(times)}

    def columns(self, times: Array) -> dict[str, Array]:
        """Of each interface x, y, z."""
        columns = {"phase [1]": times}
        for name in self.point_names:
            vector(columns, plain(name), "m", self.position(name, times))
        return columns

    def curves(self, times: Array) -> dict[str, Curve]:
        """None: there are no run files of modes."""
        return {}


def is_modal_file(path: Path) -> bool:
    """Whether a file is one, faulty or not.

    Raises
    ------
    SceneError
        FILE_NOT_FOUND, NOT_READABLE.
    """
    with open_for_reading(path, SceneError, Cause.RUN_FILE) as file:
        return "schema" in file.attribute_names() and file.attribute("schema", str) == SCHEMA


def link_mode(path: Path, number: int) -> LinkMode:
    """An elastic mode of a modal file.

    Raises
    ------
    FEImportError
        The file is none.
    SceneError
        BAD_FIELD: the model has not this mode, or its coordinates are no modes.
    """
    model = read_modal_file(path)
    if model.form != "orthonormal":
        message, remedy = "coordinates of the physical form are no modes", "reduce it with form = 'orthonormal'"
        raise SceneError(Cause.BAD_FIELD, message, where=str(path), value=model.form, remedy=remedy)
    most = len(model.frequencies_hz) - RIGID
    if not 1 <= number <= most:
        message, remedy = "the link has no such elastic mode", "give one that it has, or reduce it with more"
        raise SceneError(Cause.BAD_FIELD, message, where="mode", value=number, limit=f"1 to {most}", remedy=remedy)
    return LinkMode(SceneFile(path, SceneTables(name=model.name)), model, number)
