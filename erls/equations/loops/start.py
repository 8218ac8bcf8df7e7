"""Where a chain with loops begins: the undeformed links put together, and rates that keep them so.

Joints next to the ground keep their coordinates and rates, as far as that leaves the others free to follow; driven
joints keep them before all others.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from erls.equations.loops.rows import Closure
from erls.equations.loops.tied import Tied
from erls.errors import Cause, SimulationError
from erls.maths.so3 import Array
from fe_import.model import IntArray

_CLOSED = 1e-11  # of the size of the mechanism: rounding
ASSEMBLED = 1e-8  # of it: what rigid links may leave open. Axes off by so much still count as parallel (`DEPENDENT`)
_DEPENDENT = 1e-6  # share of a joint's motion that others cannot make up for: below, it does not decide anything
_NUDGES = (0.0, 0.1, -0.1)  # rad or reaches, to leave singular guesses (links in line)
_ALTERNATE = 0.6180339887498949  # no two joints are nudged alike


@dataclass(frozen=True)
class Start:
    """A closed configuration.

    Attributes
    ----------
    y : (n,) array
        Links undeformed.
    held, following : int arrays
        Free joints, by their place in y, that keep their initial coordinates, and those that close the loops.
    gap : float
        What undeformed links leave open [m]: dimensions that do not fit, in a direction in which no joint moves.
    where : str
        Its loop and direction; empty where that is rounding.
    """

    y: Array
    held: IntArray
    following: IntArray
    gap: float = 0.0
    where: str = ""


def find_start(chain: Tied) -> Start:
    """Close the loops on the undeformed chain, to rounding or else as well as may be: within the assembly tolerance, or
    as far as flexible links may be bent.

    Raises
    ------
    SimulationError
        LOOP_OPEN: the links do not reach; names the loop and says how far it is from closing.
    """
    count = len(chain.bare.free_joints)
    given = np.zeros(chain.size)
    given[:count] = [chain.mechanism.joints[k].position for k in chain.bare.free_joints]
    every = np.arange(count)
    if not chain.rows.names:  # elastic couplings tie nothing
        return Start(given, every, np.zeros(0, dtype=np.int64))
    best = Start(given, every, every, np.inf)
    for some in (True, False):
        for nudge in _NUDGES:
            guess = given.copy()
            guess[:count] += _nudges(chain, nudge)
            moving = _following(chain, _joint_rows(chain, guess + _spread(chain))) if some else every
            if some:
                guess[np.setdiff1d(every, moving)] = given[np.setdiff1d(every, moving)]
            y = _closed(chain, guess, moving)
            found = chain.closure(0.0, y, np.zeros(chain.size))
            gap, where = _gap(chain, found)
            if gap <= _CLOSED * chain.reach:
                return _start(chain, y)
            if gap < best.gap:
                best = Start(y, every, every, gap, where)
    bent = chain.mechanism.elastic_assembly and chain.size > count
    if best.gap <= ASSEMBLED * chain.reach or (bent and best.gap < chain.reach):
        return _start(chain, best.y, best.gap, best.where)
    raise stays_open(chain, f"the links do not reach: {best.where} stays open", best.gap)


def stays_open(chain: Tied, message: str, gap: float) -> SimulationError:
    """Links do not close a loop."""
    remedy = (
        "check lengths, position and axis of the loop, and start nearer to a closed position: joints.initial.position"
    )
    if chain.mechanism.elastic_assembly:
        remedy += "; initial.assemble = 'elastic' needs flexible links whose modes give way in this direction"
    return SimulationError(
        Cause.LOOP_OPEN,
        message,
        where="loops",
        value=f"{gap:.3g} m",
        limit=f"{ASSEMBLED * chain.reach:.3g} m",
        remedy=remedy,
    )


def _start(chain: Tied, y: Array, gap: float = 0.0, where: str = "") -> Start:
    following = _following(chain, _joint_rows(chain, y))
    return Start(y, np.setdiff1d(np.arange(len(chain.bare.free_joints)), following), following, gap, where)


def start_velocity(chain: Tied, y: Array, following: IntArray) -> Array:
    """(n,) given rates, joints that follow adapted to them; links do not change their shapes."""
    v = np.zeros(chain.size)
    joints = chain.bare.free_joints
    v[: len(joints)] = [chain.mechanism.joints[k].rate for k in joints]
    if not len(following):
        return v
    found = chain.closure(0.0, y, v)
    rows = _joint_rows(chain, y)[:, following]
    v[following] -= np.linalg.lstsq(rows, chain.row_metres * found.rate, rcond=_DEPENDENT)[0] / chain.metres[following]
    return v


def _nudges(chain: Tied, size: float) -> Array:
    joints = [chain.mechanism.joints[k] for k in chain.bare.free_joints]
    unit = np.array([1.0 if joint.freedom.turns else chain.reach for joint in joints])
    return np.asarray(size * unit * np.cos(2 * np.pi * _ALTERNATE * np.arange(len(unit))))


def _spread(chain: Tied) -> Array:
    """(n,) a displacement to a general position, where joints depend on each other only if they always do."""
    result = np.zeros(chain.size)
    result[: len(chain.bare.free_joints)] = _nudges(chain, 0.05)
    return result


def _joint_rows(chain: Tied, y: Array) -> Array:
    """(m, joints) conditions over the free joints, in metres per metre."""
    found = chain.closure(0.0, y, np.zeros(chain.size))
    rows = chain.scaled_rows(found, np.arange(len(chain.row_metres)))
    return np.asarray(rows[:, : len(chain.bare.free_joints)])


def _following(chain: Tied, rows: Array) -> IntArray:
    """Joints whose motion decides that of the loops: from the outer end inward, free ones first."""
    joints = [chain.mechanism.joints[k] for k in chain.bare.free_joints]
    order = sorted(range(len(joints)), key=lambda k: (joints[k].drive.kind != "free", -k))
    basis = np.zeros((len(rows), 0))
    result: list[int] = []
    for k in order:
        rest = rows[:, k]
        for _ in range(2):  # once more against rounding
            rest = rest - basis @ (basis.T @ rest)
        size = float(np.linalg.norm(rest))
        if size > _DEPENDENT:
            basis = np.column_stack([basis, rest / size])
            result.append(k)
    return np.array(sorted(result), dtype=np.int64)


def _gap(chain: Tied, found: Closure) -> tuple[float, str]:
    """Largest opening [m] and its name; a joint that is back to front is open by the size of the mechanism."""
    wrong = chain.rows.upside_down(found)
    if wrong:
        return chain.reach, f"loop {wrong[0]!r} (back to front)"
    gaps = np.abs(chain.openings(found))
    return float(gaps.max()), chain.rows.names[int(gaps.argmax())]


def _closed(chain: Tied, guess: Array, moving: IntArray) -> Array:
    """(n,) the joints ``moving`` turned until the loops are closed as well as may be."""
    from scipy.optimize import least_squares  # here: slow to import

    if not len(moving):
        return guess
    y, still = guess.copy(), np.zeros(chain.size)
    unit = chain.metres[moving]

    def gaps(x: Array) -> Array:
        y[moving] = x / unit
        return chain.openings(chain.closure(0.0, y, still))

    def slope(x: Array) -> Array:
        y[moving] = x / unit
        return _joint_rows(chain, y)[:, moving]

    tolerances = {"xtol": 1e-15, "ftol": 1e-15, "gtol": 1e-15}
    x = least_squares(gaps, guess[moving] * unit, slope, max_nfev=100, **tolerances).x
    for _ in range(3):  # to rounding
        x = x - np.linalg.lstsq(slope(x), gaps(x), rcond=1e-9)[0]
    y[moving] = x / unit
    return y
