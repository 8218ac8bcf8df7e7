"""What acts in the joints of random scenes: drives of every kind, springs, dampers, friction, rotors."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from random_draws import Draws, rounded


@dataclass(frozen=True)
class Scale:
    """What is much and what is little for a coordinate.

    Attributes
    ----------
    turns : bool
        Whether it is an angle.
    size : float
        How far it usually goes: 1 rad, or a share of the mechanism [m].
    time : float
        In which it goes that far [s].
    load : float
        Torque [N m] or force [N] of the weight that it carries.
    inertia : float
        That it moves [kg m²] or [kg].
    """

    turns: bool
    size: float
    time: float
    load: float
    inertia: float

    def within(self, share: float) -> Scale:
        """The same for a coordinate that has less room."""
        return Scale(self.turns, share * self.size, self.time, self.load, self.inertia)


def random_motion(draws: Draws, scale: Scale, start: float, duration: float) -> dict[str, Any]:
    """A motion of any shape that is at ``start`` (rad or m) at time 0, within a run of that ``duration`` [s]."""
    kinds = {"polynomial": 0.4, "waypoints": 0.15, "sine": 0.15, "spin_up": 0.15 * scale.turns, "table": 0.15}
    shape = draws.pick(kinds)
    far, ramp = draws.signed(0.2, 1.5) * scale.size, rounded(scale.time * draws.uniform(1.0, 3.0))
    late = rounded(0.2 * duration * draws.uniform(0.0, 1.0)) if draws.chance(0.3) else 0.0
    if shape == "polynomial":
        ends = {"from": rounded(start), "to": rounded(start + far)}
        return {"shape": shape, **ends, "start": late, "duration": ramp, "degree": draws.pick({3: 0.2, 5: 0.3, 7: 0.5})}
    if shape == "waypoints":
        stops = [late, *(rounded(late + ramp * k) for k in range(1, draws.whole(2, 4)))]
        values = [rounded(start), *(rounded(start + draws.signed(0.2, 1.0) * scale.size) for _ in stops[1:])]
        return {"shape": shape, "times": stops, "values": values, "degree": draws.pick({3: 0.2, 5: 0.3, 7: 0.5})}
    if shape == "sine":
        quiet = draws.chance(0.7)  # phase -90: it starts at rest at its lowest point
        swing = rounded(abs(far) / 2 if quiet else abs(far) / 8)
        frequency = rounded(1.0 / (2 * ramp))
        offset = rounded(start + swing, 12) if quiet else rounded(start)
        phase = -90.0 if quiet else 0.0
        return {"shape": shape, "amplitude": swing, "offset": offset, "frequency_hz": frequency, "phase_deg": phase}
    if shape == "spin_up":
        rate = rounded(draws.signed(0.3, 2.0) * scale.size / scale.time)
        how = {"ramp": "sine"} if draws.chance(0.3) else {"ramp": "polynomial", "degree": draws.one_of((3, 5, 7))}
        return {"shape": shape, "rate": rate, "from": rounded(start), "duration": ramp, **how}
    count = draws.whole(4, 7)
    times = [rounded(ramp * k * 0.7) for k in range(count)]
    values = [rounded(start), *(rounded(start + draws.signed(0.05, 0.5) * scale.size) for _ in times[1:])]
    return {"shape": shape, "times": times, "values": values}


def random_load(draws: Draws, scale: Scale, duration: float) -> list[dict[str, Any]]:
    """One to three profiles that add up."""
    return [_profile(draws, scale, duration) for _ in range(draws.pick({1: 0.7, 2: 0.2, 3: 0.1}))]


def _profile(draws: Draws, scale: Scale, duration: float) -> dict[str, Any]:
    most = max(scale.load * 0.7, scale.inertia * scale.size / scale.time**2 * 0.2)
    value, start = rounded(draws.signed(0.1, 1.0) * most), rounded(draws.uniform(0.0, 0.4) * duration)
    shape = draws.pick({"constant": 0.15, "step": 0.25, "trapezoid": 0.25, "sine_burst": 0.2, "table": 0.15})
    if shape == "constant":
        return {"shape": shape, "value": rounded(0.5 * value)}
    if shape == "step":
        end = {"end": rounded(start + draws.uniform(0.1, 0.5) * duration)} if draws.chance(0.5) else {}
        return {"shape": shape, "start": start, "value": value, **end}
    if shape == "trapezoid":
        rise, hold, fall = (rounded(draws.uniform(0.01, 0.3) * duration) for _ in range(3))
        if draws.chance(0.15):
            rise = 0.0
        return {"shape": shape, "start": start, "rise": rise, "hold": hold, "fall": fall, "value": value}
    if shape == "sine_burst":
        frequency, cycles = rounded(draws.log_uniform(0.3, 5.0) / scale.time), draws.uniform(0.5, 6.0)
        return {"shape": shape, "start": start, "amplitude": value, "frequency_hz": frequency, "cycles": cycles}
    times = [rounded(duration * k / 5) for k in range(6)]
    kind = draws.pick({"linear": 0.5, "cubic": 0.4, "hold": 0.1})
    values = [rounded(draws.uniform(-1.0, 1.0) * value) for _ in times]
    return {"shape": shape, "times": times, "values": values, "interpolation": kind}


def random_acting(
    draws: Draws, scale: Scale, start: float, duration: float, drive: str, feed_forward: bool, held: bool = False
) -> dict[str, Any]:
    """Fields of a joint or coordinate that starts at ``start``: its drive and the forces in it.

    Parameters
    ----------
    draws : Draws
    scale : Scale
    start : float
        [rad or m]
    duration : float
        Of the run [s].
    drive : str
        ``free``, ``torque``, ``motion``, ``pd``, or ``limited``: a pd whose motor often gives less than it should.
    feed_forward : bool
        Whether a pd may have it.
    held : bool
        Whether something must hold it: a slide would fall without end.
    """
    found: dict[str, Any] = {}
    if drive == "motion":
        found["drive"] = {"type": "motion", "motion": random_motion(draws, scale, start, duration)}
    else:
        found["initial"] = {"position": rounded(start)}
        if draws.chance(0.25):
            found["initial"]["rate"] = rounded(draws.signed(0.1, 1.0) * scale.size / scale.time)
    if drive == "torque":
        found["drive"] = {"type": "torque", "profiles": random_load(draws, scale, duration)}
    if drive in ("pd", "limited"):
        found["drive"] = _controller(draws, scale, start, duration, drive == "limited", feed_forward)
    stiff = rounded(draws.log_uniform(0.5, 20.0) * scale.load / scale.size)
    if (held and drive in ("free", "torque")) or draws.chance(0.15):
        found["stiffness"] = stiff
        found["rest"] = rounded(start + draws.uniform(-0.3, 0.3) * scale.size)
    if draws.chance(0.4):
        found["damping"] = rounded(draws.log_uniform(0.003, 0.3) * scale.inertia / scale.time)
    if draws.chance(0.15):
        slow = rounded(draws.log_uniform(0.005, 0.1) * scale.size / scale.time)
        found["friction"] = {"force": rounded(draws.log_uniform(0.01, 0.3) * scale.load), "transition_rate": slow}
    if draws.chance(0.2):
        gear = draws.pick({1.0: 0.3, 50.0: 0.4, 100.0: 0.3})
        found["motor"] = {"rotor_inertia": rounded(draws.log_uniform(0.01, 1.0) * scale.inertia / gear**2)}
        found["motor"]["gear_ratio"] = gear
    return found


def _controller(
    draws: Draws, scale: Scale, start: float, duration: float, limited: bool, feed_forward: bool
) -> dict[str, Any]:
    bandwidth = draws.uniform(3.0, 12.0) / scale.time  # rad/s
    ratio = draws.uniform(0.3, 1.0)
    needed = scale.load + scale.inertia * scale.size / scale.time**2
    found: dict[str, Any] = {
        "type": "pd",
        "motion": random_motion(draws, scale, start, duration),
        "proportional_gain": rounded(scale.inertia * bandwidth**2),
        "derivative_gain": rounded(2 * ratio * scale.inertia * bandwidth),
        "feed_forward": feed_forward and draws.chance(0.4),
    }
    if limited or draws.chance(0.3):
        found["torque_limit"] = rounded(needed * (draws.uniform(0.2, 0.8) if limited else draws.uniform(1.0, 3.0)))
    return found


def seconds(size: float) -> float:
    """Time in which a mechanism of that size falls through itself [s]."""
    return math.sqrt(size / 9.81)
