"""The table ``plan`` of a chain: two poses, and what holds on the way from one to the other."""

from __future__ import annotations

from erls.scene.records import Record


class PlannedJoint(Record, frozen=True):
    """A joint that goes from where the scene starts it to another coordinate.

    Attributes
    ----------
    to, to_deg : float
        Where it goes [rad or m], or in degrees; give one.
    effort : float, optional
        Largest torque or force of its motor either way [N m or N]; none unless given.
    rate, rate_deg : float, optional
        Largest rate either way [rad/s or m/s], or in degrees per second; none unless given.
    """

    to: float | None = None
    to_deg: float | None = None
    effort: float | None = None
    rate: float | None = None
    rate_deg: float | None = None


class Plan(Record, frozen=True):
    """A motion from rest to rest that `erls plan` finds; runs pay no attention to it.

    Attributes
    ----------
    joints : dict of PlannedJoint
        Those that go together, by name.
    start : float
        Time at which they start [s].
    swing : float
        Largest vibration of a named point once they have arrived [m].
    uncertainty : float
        Share by which frequencies may differ from those of the model, and the bound on vibration still holds.
    """

    joints: dict[str, PlannedJoint] = {}
    start: float = 0.0
    swing: float = 1e-4
    uncertainty: float = 0.02
