"""The tables ``servo`` and ``inverse`` of a chain: what its drives shall do, and which of them."""

from __future__ import annotations

from erls.mechanism.motions import Motion
from erls.mechanism.paths import Path
from erls.scene.records import Record
from fe_import.description.base import Vector


class About(Record, frozen=True):
    """A line about which the angle of a point is measured.

    Attributes
    ----------
    position : (3,) floats
        A point of the line, in the world [m].
    axis : (3,) floats
        Its direction, in the world.
    zero : (3,) floats
        Direction in the world in which the angle is 0, as far as it lies across the axis.
    """

    position: Vector = (0.0, 0.0, 0.0)
    axis: Vector = (0.0, 0.0, 1.0)
    zero: Vector = (1.0, 0.0, 0.0)


class Servo(Record, frozen=True):
    """A motion that `erls invert` finds the drives for; runs pay no attention to it.

    Attributes
    ----------
    point : str
        A name from ``[[points]]``; give this or ``joints``.
    coordinates : list of str
        ``x``, ``y`` and ``z`` in the world, those that are demanded of the point.
    about : About, optional
        Instead of them the angle of the point about a line is.
    joints : dict of float
        Angles of joints with the factors by which they are added up: ``{ shoulder = 1.0, elbow = 0.5 }``.
    motion : Motion, optional
        Of one coordinate, angle or sum over time.
    path : Path, optional
        Of the point; of its coordinates those that are demanded count.
    """

    point: str = ""
    coordinates: tuple[str, ...] = ()
    about: About | None = None
    joints: dict[str, float] = {}
    motion: Motion | None = None
    path: Path | None = None


class Inverse(Record, frozen=True):
    """What is unknown in an inversion.

    Attributes
    ----------
    drives : list of str
        Joints whose efforts are found, whatever drives them otherwise; all that a drive is given for unless named.
    bandwidth : float, optional
        Internal motions faster than this follow [Hz]; 20 times the frequency of what is demanded, that of a sine with
        its range and its largest acceleration, unless given.
    step : float, optional
        Distance of the knots [s]; ``simulation.step`` unless given, and 1 ms where that is not either.
    """

    drives: tuple[str, ...] = ()
    bandwidth: float | None = None
    step: float | None = None
