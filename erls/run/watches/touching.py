"""Contacts and stops: those that press when a run starts, and those that its steps passed over."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from erls.equations.formulation import Formulation
from erls.equations.serial.state_series import state_series
from erls.equations.substructures import solved
from erls.integrate.base import Solution
from erls.maths.so3 import Array
from erls.run.watches.base import Begun, Ended, Finding, Plan, Watch

_MOST = 1000  # stretches between knots


class Gap(NamedTuple):
    """Room before something touches, at the times of a motion: (k,) arrays of it and of its rate [m or rad, per s]."""

    name: str
    unit: str
    room: Array
    rate: Array


class Touching(Watch):
    """Looks at the gaps of contacts, and at what joints are from their stops."""

    @staticmethod
    def concerns(plan: Plan) -> bool:
        """Mechanisms with contacts or stops."""
        return plan.mechanism.touches

    def begins(self, begun: Begun) -> Finding:
        """What presses before anything has moved."""
        y, v = begun.formulation.initial_state()
        found = _gaps(begun.formulation, np.zeros(1), y[None], v[None])
        return Finding(
            [
                f"{gap.name} is pressed in by {-gap.room[0]:.3g} {gap.unit} at the start, and pushes back (start "
                "outside, or where the force bears what lies on it)"
                for gap in found
                if gap.room[0] < 0
            ]
        )

    def after(self, ended: Ended) -> Finding:
        """What the motion between two knots went through."""
        return Finding(passed_over(ended.run.formulation, ended.run.solution))


def passed_over(formulation: Formulation, s: Solution) -> list[str]:
    """Of gaps that are open at two knots, and would close between them by the cubic through both; in the longest
    stretches between knots.
    """
    result, h = [], np.diff(s.t)
    longest = np.sort(np.argsort(-h, kind="stable")[:_MOST])
    knots = np.concatenate([longest, longest + 1])
    with np.errstate(all="ignore"):
        for gap in _gaps(formulation, s.t[knots], s.y[knots], s.v[knots]) if len(longest) else ():
            least = np.nan_to_num(_least(h[longest], gap.room, gap.rate), nan=0.0)
            deepest = int(np.argmin(least))
            if least[deepest] < 0:
                by = f"{-least[deepest]:.3g} {gap.unit} (use a smaller simulation.tolerance, or a smaller step)"
                result.append(f"{gap.name}: a step passed over it at t = {s.t[longest[deepest]]:.6g} s, by {by}")
    return result


def _least(h: Array, room: Array, rate: Array) -> Array:
    """(k,) least value between knots of the cubic through values and rates (2 k,), of the first ones before those of
    the second, that are positive there, where it falls and then rises; infinite elsewhere.
    """
    (start, end), (falling, rising) = np.split(room, 2), h * np.split(rate, 2)
    # start + falling s + b s² + c s³
    c = 2 * (start - end) + falling + rising
    b = end - start - falling - c
    root = np.sqrt(np.maximum(b * b - 3 * c * falling, 0.0))
    at = np.clip(-falling / np.where(b + root == 0, 1.0, b + root), 0.0, 1.0)  # of the minimum
    least = start + at * (falling + at * (b + at * c))
    return np.asarray(np.where((start > 0) & (end > 0) & (falling < 0) & (rising > 0), least, np.inf))


def _gaps(formulation: Formulation, t: Array, y: Array, v: Array) -> Iterator[Gap]:
    """Of every contact, and of every joint with stops."""
    mechanism = formulation.mechanism
    if mechanism.contacts:
        found = formulation.contact_series(t, y, v)
        for k, contact in enumerate(mechanism.contacts):
            yield Gap(f"contact {contact.name!r}", "m", found.gap[:, k], found.rate[:, k])
    stopped = [k for k, joint in enumerate(mechanism.joints) if joint.forces.stops]
    if stopped:
        series = state_series(solved(formulation), t, y, v)
        for k in stopped:
            joint, angle, rate = mechanism.joints[k], series.angles[:, k], series.rates[:, k]
            stops = joint.forces.stops
            assert stops is not None
            for name, room, way in (("lower", angle - stops.lower, rate), ("upper", stops.upper - angle, -rate)):
                yield Gap(f"joint {joint.name!r}: the {name} stop", joint.freedom.units[0], room, way)
