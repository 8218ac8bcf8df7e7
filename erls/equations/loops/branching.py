"""What a loop can do where its conditions lose rank: branch, or lock.

With u the direction in which the rows Φ_y say nothing, uᵀΦ_y = 0, and N the ways that they leave, one more than
elsewhere, what is left of uᵀΦ on N is the quadratic form Q = Nᵀ (uᵀΦ_yy) N. Where Q is indefinite, two motions cross (a
change point: a parallelogram in line); where it is definite, none goes on (a dead point of a drive). Time is a
coordinate like the others where drives move joints. (J. M. McCarthy, G. S. Soh, Geometric Design of Linkages, 2011;
A. Müller, J. Mechanisms Robotics 11 (2019) 041011.)
"""

from __future__ import annotations

import enum
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import scipy.linalg as la

from erls.maths.so3 import Array

if TYPE_CHECKING:
    from erls.equations.loops.closed_chain import ClosedChain

AT = 0.01  # of the smallest singular value at the start: what a loop does is that of the singular position beside it
_STEP = 1e-5  # of the size of the mechanism: central differences of rows, half of the digits of which are left
_FLAT = 1e-4  # of the largest curvature: below, none, as differences and the distance from the point itself leave it
_DRIVEN = 0.1  # of the speed that drives ask of the conditions: in a direction in which nothing moves, more locks


class Kind(enum.Enum):
    """What a loop does where it is singular."""

    BRANCHES = "two motions cross"
    LOCKS = "it cannot move on"
    STIFF = "two motions cross, and no mode of its flexible links gives way between them"


class Singular(NamedTuple):
    """A position in which, or near which, a loop is singular.

    Attributes
    ----------
    kind : Kind
    loop : str
        Its name.
    links : tuple of str
        Flexible links within it.
    """

    kind: Kind
    loop: str
    links: tuple[str, ...]


def singular_at(chain: ClosedChain, t: float, y: Array) -> Singular:
    """What a chain does at the singular position near which it is."""
    rows = _rows(chain, t, y)
    left = la.svd(rows[:, :-1])[0]
    weak, drift = left[:, -1], np.linalg.norm(rows[:, -1])
    number = int(chain.rows.owner[chain.kept[np.abs(weak).argmax()]])
    name, flexible = chain.mechanism.loops[number].name, _flexible(chain, rows, number)
    if abs(weak @ rows[:, -1]) > _DRIVEN * drift:
        return Singular(Kind.LOCKS, name, flexible)
    strong = left[:, :-1].T @ rows
    ways = la.svd(np.vstack([strong, np.zeros(len(rows[0]))]))[2][len(strong) :]
    slopes = np.array([_slope(chain, t, y, way) for way in ways])
    form = np.einsum("r,drn,en->de", weak, slopes, ways)
    found = np.linalg.eigvalsh((form + form.T) / 2)
    flat = _FLAT * float(np.abs(found).max(initial=0.0))
    crossing = bool(found.min(initial=0.0) < -flat and found.max(initial=0.0) > flat)
    return Singular(Kind.LOCKS if not crossing else Kind.STIFF if flexible else Kind.BRANCHES, name, flexible)


def _rows(chain: ClosedChain, t: float, y: Array) -> Array:
    """(r, n + 1) conditions in use over coordinates [1] and time [m/s]; signs do not depend on a unit of time."""
    found = chain.closure(t, y, np.zeros(chain.size))
    rates = chain.row_metres * found.rate
    return np.column_stack([chain.scaled_rows(found, chain.kept), rates[chain.kept]])


def _slope(chain: ClosedChain, t: float, y: Array, way: Array) -> Array:
    """(r, n + 1) derivative of the rows along a way."""
    step = _STEP * chain.reach
    change, later = step * way[:-1] / chain.metres, step * float(way[-1])
    ahead, behind = (_rows(chain, t + sign * later, y + sign * change) for sign in (1.0, -1.0))
    return np.asarray((ahead - behind) / (2 * step))


def _flexible(chain: ClosedChain, rows: Array, loop: int) -> tuple[str, ...]:
    """Links whose modes move a loop."""
    own = rows[chain.rows.owner[chain.kept] == loop]
    first, result = len(chain.bare.free_joints), []
    for link in chain.mechanism.links:
        last = first + link.elastic_modes
        if np.abs(own[:, first:last]).max(initial=0.0) > 0.0:
            result.append(link.name)
        first = last
    return tuple(result)
