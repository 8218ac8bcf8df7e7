"""Coulomb friction as a set-valued law: which joints slide, which stick, and what friction gives there.

Along coordinate k friction gives λ_k to M a = f + Σ λ_k e_k. With the force F_k of a joint that slides, and the largest
S_k ≥ F_k that holds one at rest,

    v_k ≠ 0:  λ_k = -F_k sign v_k
    v_k = 0:  a_k = 0 and |λ_k| ≤ S_k,  or  λ_k = -F_k sign a_k

Of joints at rest a = b + W λ, where b are their accelerations without friction in them and W = Eᵀ M⁻¹ E, which is
symmetric and positive definite. With S_k = F_k that is a linear complementarity problem between bounds, which then has
one solution whatever the number of joints (R. W. Cottle, J.-S. Pang, R. E. Stone, The Linear Complementarity Problem,
1992, theorem 3.3.7). It is found by exchanging one joint at a time, the first that contradicts the law (K. G. Murty's
least index, which ends). With S_k > F_k the law has more than one solution where one joint that breaks away may carry
others along; here whoever S_k cannot hold slides, feels F_k from then on, and the rest is asked again.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from fe_import.model import IntArray

_ROUNDING = 1e-11  # of the forces that hold, and of what they accelerate by


class DryFriction(NamedTuple):
    """Friction that sticks, of m joints.

    Attributes
    ----------
    places : (m,) int array
        Of their coordinates.
    sliding, static : (m,) arrays
        F and S [N m or N].
    names : tuple of str
    """

    places: IntArray
    sliding: Array
    static: Array
    names: tuple[str, ...]

    def given(self, v: Array, along: Array) -> Array:
        """(k, m) friction at k rates (k, n), where it balances forces ``along`` (k, m) if a joint sticks."""
        rates = v[:, self.places]
        return np.asarray(np.where(rates == 0.0, along, -self.sliding * np.sign(rates)))

    def power(self, v: Array) -> Array:
        """(k,) its power at rates (k, n) [W]."""
        return np.asarray(-np.abs(v[:, self.places]) @ self.sliding)


def dry_friction(mechanism: Mechanism, free_joints: IntArray) -> DryFriction | None:
    """Of the joints of a tree whose coordinates, of the free ones, come first; None where none sticks."""
    joints = [mechanism.joints[k] for k in free_joints]
    places = [place for place, joint in enumerate(joints) if joint.forces.sticks]
    if not places:
        return None
    forces = [joints[place].forces for place in places]
    return DryFriction(
        places=np.array(places),
        sliding=np.array([own.friction for own in forces]),
        static=np.array([own.static for own in forces]),
        names=tuple(joints[place].name for place in places),
    )


class Settled(NamedTuple):
    """What the law says at a state: -1, 0, 1 of each joint, for one that slides back, sticks, slides on (m,);
    accelerations (n,).
    """

    modes: Array
    accelerations: Array


def settled(solve: Callable[[Array], Array], force: Array, v: Array, dry: DryFriction, released: Array) -> Settled:
    """Apply the law.

    Parameters
    ----------
    solve : callable
        M⁻¹ of (n,) or (n, k) forces.
    force : (n,) array
        f, without this friction.
    v : (n,) array
        Rates; exactly zero of a joint at rest.
    dry : DryFriction
    released : (m,) array
        -1 or 1 of a joint at rest that has broken away, and so slides in that direction.
    """
    rates = v[dry.places]
    modes = np.where(rates == 0.0, released, np.sign(rates))
    pushed = np.array(force)
    pushed[dry.places] -= modes * dry.sliding
    rest = np.flatnonzero(modes == 0.0)
    if not len(rest):
        return Settled(modes, solve(pushed))
    at = dry.places[rest]
    unit = np.zeros((len(force), len(rest)))
    unit[at, np.arange(len(rest))] = 1.0
    both = solve(np.column_stack([pushed, unit]))
    free, answers = both[:, 0], both[:, 1:]
    modes[rest], given = at_rest(answers[at], free[at], dry.sliding[rest], dry.static[rest])
    accelerations = free + answers @ given
    accelerations[dry.places[modes == 0.0]] = 0.0
    return Settled(modes, accelerations)


def at_rest(compliance: Array, free: Array, sliding: Array, static: Array) -> tuple[Array, Array]:
    """Modes of joints at rest, as of `Settled`, and what friction gives to each (m,).

    Parameters
    ----------
    compliance : (m, m) array
        W.
    free : (m,) array
        b.
    sliding, static : (m,) arrays
    """
    modes = np.zeros(len(free))
    while True:
        given = np.where(modes == 0.0, 0.0, -modes * sliding)
        held = np.flatnonzero(modes == 0.0)
        given[held] = _between(compliance[np.ix_(held, held)], (free + compliance @ given)[held], static[held])
        gone = held[np.abs(given[held]) >= static[held]]
        if not len(gone):
            return modes, given
        modes[gone] = -np.sign(given[gone])


def _between(compliance: Array, free: Array, most: Array) -> Array:
    """(m,) forces λ: b + W λ is zero where -S < λ < S, and of the other sign than λ where |λ| = S.

    One that S just holds, to rounding, is told to be a little below.
    """
    side = np.zeros(len(free))  # 0 between the bounds
    slack = _ROUNDING * (compliance.diagonal() * most + np.abs(free))
    while True:
        given = side * most
        inner = np.flatnonzero(side == 0.0)
        rest = (free + compliance @ given)[inner]
        given[inner] = -np.linalg.solve(compliance[np.ix_(inner, inner)], rest)
        accelerations = free + compliance @ given
        excess = np.abs(given) > most * (1 + _ROUNDING)
        wrong = np.where(side == 0.0, excess, accelerations * side > slack)
        if not wrong.any():
            just = (side == 0.0) & (np.abs(given) >= most)
            return np.asarray(np.where(just, given * (1 - 2 * _ROUNDING), given))
        first = int(np.argmax(wrong))
        side[first] = np.sign(given[first]) if side[first] == 0.0 else 0.0
