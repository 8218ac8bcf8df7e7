"""What an estimate says of the integration of a run: of points over time, and of forces."""

from __future__ import annotations

from dataclasses import dataclass

from erls.maths.so3 import Array


@dataclass(frozen=True)
class ErrorOverTime:
    """Of points and forces.

    Attributes
    ----------
    times : (k,) array
        [s]
    error : (k,) array
        Largest error of a point up to each time [m].
    effort, reaction : (joints,) arrays
        Relative to the peak of each over the run; NaN where they are not known.
    """

    times: Array
    error: Array
    effort: Array
    reaction: Array

    @property
    def total(self) -> float:
        """Over the run [m]."""
        return float(self.error[-1])
