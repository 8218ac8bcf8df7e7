"""Drives of a joint: the records of a scene file, and what the formulations ask of them.

Rules for a new kind of drive:

1. One record here with ``build``, one line in `DriveRecord`, one row in ``tests/erls/test_drives.py``.
2. ``torque`` depends on time and on the joint's own coordinate and rate only, is smooth between
   ``breakpoints`` and is not limited; what needs the whole chain (feed-forward) is added by the formulation.
3. Whoever applies a torque passes the total through ``limited``.
4. ``gains`` are the constant stiff parts, minus the derivatives of the torque, for implicit integrators.

Coordinates in rad and torques in N m, at a prismatic joint m and N.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import msgspec

from erls.mechanism.curves import Curve, merged
from erls.mechanism.motions import Motion
from erls.mechanism.place import Place
from erls.mechanism.profiles import Load, build_loads

ELASTIC = "elastic"
"""Feed-forward by an inversion of the scene."""


@dataclass(frozen=True)
class Drive:
    """What moves a joint; as it stands by default, nothing does.

    Parameters
    ----------
    kind : str
        ``type`` of the record.
    load : Curve, optional
        Torque over time; a controller adds its own.
    motion : Curve, optional
        Prescribed or wanted coordinate over time.
    gains : (k, c)
        Of the controller: -∂torque/∂angle and -∂torque/∂rate, N m/rad and N m s/rad; (0, 0) without one.
        Where ``limited`` saturates the true derivatives are zero.
    feed_forward : bool
        The formulation adds the torque that the rigid chain needs for the wanted motions.
    torque_limit : float
        Largest torque, either way.
    """

    kind: str = "free"
    load: Curve | None = None
    motion: Curve | None = None
    gains: tuple[float, float] = (0.0, 0.0)
    feed_forward: bool = False
    torque_limit: float = math.inf

    @property
    def prescribed(self) -> bool:
        """Whether the coordinate follows ``reference`` exactly, and the torque is a reaction."""
        return self.kind == "motion"

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Rising times at which an integrator must stop, s."""
        return merged(t for curve in (self.load, self.motion) if curve is not None for t in curve.breakpoints)

    def torque(self, t: float, angle: float, rate: float, left: bool = False) -> float:
        """Torque, without feed-forward and not limited; 0 where it is a reaction.

        Parameters
        ----------
        t : float
            Time, s.
        angle, rate : float
            Physical relative coordinate of the joint's two frames, and its rate.
        left : bool
            Take the limit from the left at a breakpoint.
        """
        load = 0.0 if self.load is None else self.load.value(t, left)
        if self.motion is None or self.prescribed:
            return load
        wanted, wanted_rate, _ = self.motion.derivatives(t, left)
        return load + self.gains[0] * (wanted - angle) + self.gains[1] * (wanted_rate - rate)

    def reference(self, t: float, left: bool = False) -> tuple[float, float, float] | None:
        """Prescribed or wanted coordinate, rate and acceleration; None where there is none."""
        return None if self.motion is None else self.motion.derivatives(t, left)

    def limited(self, torque: float) -> float:
        """The torque that the motor can give."""
        return max(-self.torque_limit, min(self.torque_limit, torque))

    def gains_at(self, torque: float) -> tuple[float, float]:
        """`gains`, or none where the motor gives less than the wanted ``torque``."""
        return self.gains if abs(torque) <= self.torque_limit else (0.0, 0.0)


class _Record(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="type"):
    """Base of all drives."""


class FreeDrive(_Record, frozen=True, tag="free"):
    """No drive; the joint moves freely."""

    def build(self, place: Place) -> Drive:
        """Check and build."""
        return Drive()


class TorqueDrive(_Record, frozen=True, tag="torque"):
    """A torque (force, at a prismatic joint) over time.

    Attributes
    ----------
    profiles : list of Load
        One or more shapes, which add up.
    """

    profiles: tuple[Load, ...]

    def build(self, place: Place) -> Drive:
        """Check and build."""
        if not self.profiles:
            raise place.error("profiles", "empty", remedy='give a profile, or type = "free"')
        return Drive("torque", load=build_loads(self.profiles, place, "profiles"))


class VoltageDrive(_Record, frozen=True, tag="voltage"):
    """A voltage over time on the circuit of the joint's motor, which needs ``resistance`` and ``torque_constant``.

    Attributes
    ----------
    profiles : list of Load
        One or more shapes, which add up [V].
    """

    profiles: tuple[Load, ...]

    def build(self, place: Place) -> Drive:
        """Check and build."""
        if not self.profiles:
            raise place.error("profiles", "empty", remedy='give a profile, or type = "free"')
        return Drive("voltage", load=build_loads(self.profiles, place, "profiles"))


class MotionDrive(_Record, frozen=True, tag="motion"):
    """A prescribed motion; the run reports the torque that it takes.

    Attributes
    ----------
    motion : Motion
        Shape of the joint's coordinate.
    """

    motion: Motion

    def build(self, place: Place) -> Drive:
        """Check and build."""
        return Drive("motion", motion=self.motion.build(place.at("motion")))


class PDDrive(_Record, frozen=True, tag="pd"):
    """A proportional-derivative controller that follows a motion.

    Attributes
    ----------
    motion : Motion, optional
        Shape of the wanted coordinate; required unless ``feed_forward`` is ``elastic``, which finds it.
    proportional_gain : float
        Torque per deviation [N m/rad or N/m].
    derivative_gain : float
        Torque per deviation of the rate [N m s/rad or N s/m].
    feed_forward : bool or str
        true: add the torque that the rigid chain would need for the motion. ``elastic``: add the torque that the
        mechanism with its links as they bend needs for what ``[[servo]]`` demands, and want the coordinate that it
        has meanwhile; `erls simulate` finds both before it runs.
    profiles : list of Load
        Torques over time that are added; they add up.
    torque_limit : float, optional
        Largest total torque either way [N m or N]; none unless given.
    """

    proportional_gain: float
    derivative_gain: float
    motion: Motion | None = None
    feed_forward: bool | str = False
    profiles: tuple[Load, ...] = ()
    torque_limit: float | None = None

    @property
    def elastic(self) -> bool:
        """Whether torque and motion are to be found by an inversion of the scene."""
        return self.feed_forward == ELASTIC

    def build(self, place: Place) -> Drive:
        """Check and build."""
        if isinstance(self.feed_forward, str):
            place.choice("feed_forward", self.feed_forward, (True, False, ELASTIC))
            message, remedy = "is found only for joints of a chain that is simulated", "use erls simulate, or true"
            raise place.error("feed_forward", message, self.feed_forward, remedy=remedy)
        if self.motion is None:
            raise place.error("motion", "missing", remedy="say how the joint shall move")
        limit = math.inf if self.torque_limit is None else place.positive("torque_limit", self.torque_limit)
        return Drive(
            "pd",
            motion=self.motion.build(place.at("motion")),
            gains=(
                place.not_negative("proportional_gain", self.proportional_gain),
                place.not_negative("derivative_gain", self.derivative_gain),
            ),
            load=build_loads(self.profiles, place, "profiles") if self.profiles else None,
            feed_forward=self.feed_forward,
            torque_limit=limit,
        )


DriveRecord = FreeDrive | TorqueDrive | VoltageDrive | MotionDrive | PDDrive
"""Drives of a scene file, told apart by ``type``."""


def build_drive(record: DriveRecord, folder: Path, where: str, revolute: bool) -> Drive:
    """Check a drive's numbers, read its tables and build it.

    Parameters
    ----------
    record : DriveRecord
        From the scene file.
    folder : Path
        Folder of the scene file.
    where : str
        ``<scene file>: <field path>`` of the record, for messages.
    revolute : bool
        Whether the joint turns; fields in degrees are refused where it slides.

    Raises
    ------
    SceneError
        A bad number or a faulty table.
    """
    return record.build(Place(folder, where, revolute))
