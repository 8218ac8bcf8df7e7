"""What a run states about its own error, and whether it can be relied on.

The computation stands in `erls.accuracy`; these are the records that runs hold, files keep and reports show.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

PARTS = ("integration", "modes", "effects", "links", "output")
"""What the total is the sum of, in the order of the JSON."""

GOOD, LIMITED, BROKEN = "good", "limited", "broken"
"""Verdicts: the total is known and within the tolerance; known and larger, or good up to a horizon; neither."""


@dataclass(frozen=True)
class Accuracy:
    """Stated error of a run, the largest over the judged points and the whole run (or up to the horizon).

    Attributes
    ----------
    integration : float or None
        Of the integration in time, phase and drift over the whole run included [m].
    modes : float or None
        Of modes left out, against all modes of the links' meshes, and of the meshes of frames [m].
    effects : float or None
        Of physical effects left out [m].
    links : float or None
        Of what the model of links leaves out: higher orders in their deflection [m].
    output : float or None
        Of interpolation between stored states [m].
    efforts, reactions : mapping of str to float or None
        By joint, relative to the peak over the run: what the integration alone makes of them, without other parts.
    horizon : float or None
        Time up to which all this holds, where disturbances grow beyond the tolerance after it [s].
    judged_at : tuple of str
        Points.
    unjudged : mapping of str to str
        Why a part is None.
    """

    integration: float | None = None
    modes: float | None = None
    effects: float | None = None
    links: float | None = None
    output: float | None = None
    efforts: Mapping[str, float | None] = field(default_factory=dict)
    reactions: Mapping[str, float | None] = field(default_factory=dict)
    horizon: float | None = None
    judged_at: tuple[str, ...] = ()
    unjudged: Mapping[str, str] = field(default_factory=dict)

    @property
    def total(self) -> float | None:
        """Sum of the parts [m]; None where one is not known."""
        parts = [getattr(self, name) for name in PARTS]
        return None if any(part is None for part in parts) else float(sum(parts))

    def summary(self) -> dict[str, Any]:
        """The key ``accuracy`` of the JSON of ``erls simulate``."""
        return {
            "total": self.total,
            **{name: getattr(self, name) for name in PARTS},
            "efforts": dict(self.efforts),
            "reactions": dict(self.reactions),
            "horizon": self.horizon,
            "judged_at": list(self.judged_at),
        }


@dataclass(frozen=True)
class Trust:
    """Whether a run can be relied on.

    Attributes
    ----------
    verdict : str
        `GOOD`, `LIMITED` or `BROKEN`.
    reasons : tuple of str
        Why it is no better, each with what to change.
    """

    verdict: str
    reasons: tuple[str, ...] = ()

    def summary(self) -> dict[str, Any]:
        """The key ``trust`` of the JSON of ``erls simulate``."""
        return {"verdict": self.verdict, "reasons": list(self.reasons)}
