"""Where the joints of random closed linkages are, and what closes them: they close as they stand."""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from random_draws import Draws, rounded


@dataclass(frozen=True)
class Linkage:
    """Where the joints of a planar linkage are.

    Attributes
    ----------
    kind : str
    places : list of complex
        Joints in turn, the first and, of a chain, the last on the ground [m].
    drive : str
        Of the first joint.
    room : float
        How far it may turn from there [rad].
    closing : str
        Kind of the joint that closes it.
    welded : int
        Of two arms: the number of links in the first one; 0 of a chain from ground to ground.
    """

    kind: str
    places: list[complex]
    drive: str
    room: float
    closing: str = "revolute"
    welded: int = 0

    @property
    def lengths(self) -> list[float]:
        """Of the links [m], as they are written."""
        return [rounded(abs(b - a), 9) for a, b in pairwise(self.places)]

    @property
    def directions(self) -> list[float]:
        """Of the links [rad]."""
        return [cmath.phase(b - a) for a, b in pairwise(self.places)]


def random_linkage(draws: Draws, size: float) -> Linkage:
    """A planar linkage of about that size [m]."""
    kind = draws.pick({"four-bar": 0.35, "slider-crank": 0.25, "five-bar": 0.15, "hanging": 0.25})
    return {"four-bar": _four_bar, "slider-crank": _slider_crank, "five-bar": _five_bar, "hanging": _hanging}[kind](
        draws, size
    )


def _drive(draws: Draws) -> str:
    return draws.pick({"motion": 0.5, "pd": 0.15, "torque": 0.15, "free": 0.2})


def _meeting(first: complex, one: float, last: complex, other: float) -> complex:
    """Where two circles meet, on the left of the way from the first centre to the last."""
    way = last - first
    distance = abs(way)
    along = (distance**2 + one**2 - other**2) / (2 * distance)
    return first + way / distance * complex(along, math.sqrt(max(one**2 - along**2, 0.0)))


def _four_bar(draws: Draws, size: float) -> Linkage:
    """Its crank may turn round and round (Grashof), and the angles of transmission stay good."""
    ground, crank = 0.5 * size, draws.uniform(0.15, 0.3) * 0.5 * size
    coupler = draws.uniform(0.9, 1.2) * ground
    rocker = draws.uniform(0.8, 1.0) * coupler
    pin = crank * cmath.exp(1j * math.radians(draws.uniform(20.0, 160.0)))
    places = [0j, pin, _meeting(pin, coupler, ground + 0j, rocker), ground + 0j]
    return Linkage("four-bar", places, _drive(draws), 6.0, draws.pick({"revolute": 0.75, "spherical": 0.25}))


def _slider_crank(draws: Draws, size: float) -> Linkage:
    """The third link, of no length, slides along the x-axis; ``line`` guides the rod without it."""
    crank = draws.uniform(0.15, 0.3) * size
    rod = draws.uniform(1.5, 2.5) * crank
    pin = crank * cmath.exp(1j * math.radians(draws.uniform(20.0, 160.0)))
    slider = pin.real + math.sqrt(rod**2 - pin.imag**2)
    guide = draws.pick({"prismatic": 0.5, "cylindrical": 0.2, "line": 0.3})
    return Linkage("slider-crank", [0j, pin, complex(slider, 0.0)], _drive(draws), 6.0, guide)


def _five_bar(draws: Draws, size: float) -> Linkage:
    """Two arms with motors on the ground hold a hand between them."""
    ground = draws.uniform(0.1, 0.3) * size
    hand = complex(draws.uniform(0.2, 0.8) * ground, draws.uniform(0.35, 0.45) * size)
    inner, outer = 0.3 * size, draws.uniform(0.3, 0.36) * size
    left = _meeting(0j, inner, hand, outer)
    right = _meeting(hand, outer, ground + 0j, inner)
    return Linkage("five-bar", [0j, left, hand, right, ground + 0j], _drive(draws), 0.4)


def _hanging(draws: Draws, size: float) -> Linkage:
    """A chain that hangs between two places, or two arms whose ends are joined or welded."""
    count = draws.whole(3, 5)
    half = 0.5 * size / count * draws.uniform(1.6, 2.4)
    opening = draws.uniform(1.2, 2.6)
    steps = [-math.pi / 2 + opening * (k / count - 0.5) for k in range(count + 1)]
    arc = [half * cmath.exp(1j * angle) * complex(1.0, draws.uniform(-0.05, 0.05)) for angle in steps]
    places = [place - arc[0] for place in arc]
    arms = draws.whole(1, count - 1) if draws.chance(0.5) else 0
    closing = draws.pick({"revolute": 0.6, "spherical": 0.2, "fixed": 0.2 * (arms > 0 and count > 3)})
    drive = draws.pick({"free": 0.6, "torque": 0.2, "pd": 0.2})
    return Linkage("two arms" if arms else "hanging chain", places, drive, 0.2, closing, arms)


def closing_fields(draws: Draws, linkage: Linkage, turn: list[list[float]], rate: float) -> dict[str, Any]:
    """What the table of the closing joint of a chain from ground to ground says beside its name, link and node.

    Parameters
    ----------
    draws : Draws
    linkage : Linkage
    turn : (3, 3) list
        Rotation from the plane of the linkage to the world.
    rate : float
        Damping that is much there [N m s/rad].
    """
    end = linkage.places[-1]
    found: dict[str, Any] = {"type": linkage.closing, "position": in_world(turn, end.real, end.imag)}
    if linkage.kind == "slider-crank":
        found |= {"axis": in_world(turn, 1.0, 0.0), "position": [0.0, 0.0, 0.0]}
    elif linkage.closing == "revolute" and draws.chance(0.3):
        found["damping"] = rounded(draws.log_uniform(0.01, 1.0) * rate)
    return found


def in_world(turn: list[list[float]], x: float, y: float) -> list[float]:
    """A direction or place of the plane in the world."""
    return [rounded(row[0] * x + row[1] * y, 12) for row in turn]


def rotation(degrees: list[float]) -> list[list[float]]:
    """(3, 3) about fixed x, then y, then z."""
    (cx, sx), (cy, sy), (cz, sz) = ((math.cos(math.radians(a)), math.sin(math.radians(a))) for a in degrees)
    return [
        [cz * cy, cz * sy * sx - sz * cx, cz * sy * cx + sz * sx],
        [sz * cy, sz * sy * sx + cz * cx, sz * sy * cx - cz * sx],
        [-sy, cy * sx, cy * cx],
    ]
