"""What scenes of every kind share: the base of their records, their first fields, settings of motions, the scene read.

A record is one table of the file; unknown keys are errors with a suggestion.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import msgspec

from fe_import.description.base import Vector


class Record(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """Base of all records."""


class Pose(Record, frozen=True):
    """Where a frame stands in another.

    Attributes
    ----------
    position : (3,) floats
        Of its origin [m].
    rotation_deg : (3,) floats
        About fixed x, then y, then z [deg].
    """

    position: Vector = (0.0, 0.0, 0.0)
    rotation_deg: Vector = (0.0, 0.0, 0.0)


class Stepping(Record, frozen=True):
    """Of every motion: how long it is [s], step [s], and numerical damping ρ∞ of generalized-α."""

    duration: float
    step: float | None = None
    spectral_radius: float = 0.8


class SceneTables(Record, frozen=True, kw_only=True):
    """Of every scene."""

    name: str = ""
    gravity: Vector = (0.0, 0.0, -9.81)


@dataclass(frozen=True, repr=False)
class SceneFile:
    """A checked scene and its file; relative paths start at ``folder``."""

    path: Path
    record: SceneTables

    @property
    def name(self) -> str:
        """Its name, or that of its file."""
        return self.record.name or self.path.name.removesuffix(".toml")

    @property
    def folder(self) -> Path:
        """Folder of the file."""
        return self.path.parent

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.name!r} of {self.path}>"
