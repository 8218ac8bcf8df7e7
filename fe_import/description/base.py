"""What the records of link descriptions are made of."""

from __future__ import annotations

import msgspec

Vector = tuple[float, float, float]
Inertia = tuple[float | Vector, float | Vector, float | Vector]  # [Ixx, Iyy, Izz] or a 3x3 matrix


class Record(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """A table; unknown keys are errors."""
