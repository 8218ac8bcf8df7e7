"""Coulomb friction as a set-valued law: which joints slide, which stick, and what friction gives there.

Along coordinate k friction gives λ_k to M a = f + Σ λ_k g_k. With the force F_k of a joint that slides, and the largest
S_k ≥ F_k that holds one at rest,

    v_k ≠ 0:  λ_k = -F_k sign v_k
    v_k = 0:  a_k = 0 and |λ_k| ≤ S_k,  or  λ_k = -F_k sign a_k

Of joints at rest a = b + W λ, where b are their accelerations without friction in them and W = Gᵀ M⁻¹ G, M⁻¹ under the
conditions of loops. It is symmetric and positive definite in a tree. With S_k = F_k that is a linear complementarity
problem between bounds, which then has one solution whatever the number of joints (R. W. Cottle, J.-S. Pang, R. E.
Stone, The Linear Complementarity Problem, 1992, theorem 3.3.7). It is found by exchanging one joint at a time, the
first that contradicts the law (K. G. Murty's least index, which ends). With S_k > F_k the law has more than one
solution where one joint that breaks away may carry others along; here whoever S_k cannot hold slides, feels F_k from
then on, and the rest is asked again.

In a loop one joint may rest because others do. Then W is singular: accelerations are still one, the forces of friction
that hold are not. `erls.equations.switches.shares` says which are taken.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from erls.equations.switches.shares import independent, shared
from erls.maths.so3 import Array
from fe_import.model import IntArray

if TYPE_CHECKING:
    from erls.mechanism.chain import Mechanism

_ROUNDING = 1e-11  # of the forces that hold, and of what they accelerate by
_MADE_DEFINITE = 1e-10  # of a compliance that is singular, added to its diagonal
_MOVES = 1e-6  # of what friction accelerates by: less is what that addition makes


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
    """Of the joints of a tree whose coordinates, of the free ones, come first; None where none sticks, or where they
    have other modes, since joints that close loops stick as well.
    """
    joints = [mechanism.joints[k] for k in free_joints]
    places = [place for place, joint in enumerate(joints) if joint.forces.sticks]
    if not places or mechanism.gripped:
        return None
    forces = [joints[place].forces for place in places]
    return DryFriction(
        places=np.array(places),
        sliding=np.array([own.friction for own in forces]),
        static=np.array([own.static for own in forces]),
        names=tuple(joints[place].name for place in places),
    )


class Freely(NamedTuple):
    """A state without the friction of m joints.

    Attributes
    ----------
    accelerations : (n,) array
    answers : (n, m) array
        Accelerations by a unit of friction in each joint.
    along : (m,) array
        Accelerations of the joints.
    compliance : (m, m) array
        W: those by a unit of friction in each.
    alone : (m,) array
        How each joint gives way to a unit of force, were there no loops: of W the diagonal then.
    """

    accelerations: Array
    answers: Array
    along: Array
    compliance: Array
    alone: Array


class Settled(NamedTuple):
    """What the law says at a state.

    Attributes
    ----------
    modes : (m,) array
        -1, 0, 1 of each joint, for one that slides back, sticks, slides on.
    accelerations : (n,) array
    given : (m,) array
        Friction.
    held : int array
        Of the joints that stick those whose rest is no consequence of others'.
    """

    modes: Array
    accelerations: Array
    given: Array
    held: IntArray


class Rubbing(Protocol):
    """Equations of motion that leave out friction that sticks, and know it."""

    @property
    def dry(self) -> DryFriction | None:
        """Friction that sticks."""

    def freely(self, t: float, y: Array, v: Array) -> Freely:
        """A state without it."""


def settled(system: Rubbing, t: float, y: Array, v: Array, released: Array | None = None) -> Settled:
    """Apply the law to joints whose rates are coordinates' (n,), exactly zero at rest; see `settle`."""
    dry = system.dry
    assert dry is not None
    found = settle(system.freely(t, y, v), v[dry.places], dry, released)
    found.accelerations[dry.places[found.modes == 0.0]] = 0.0
    return found


def settle(free: Freely, rates: Array, dry: DryFriction, released: Array | None = None) -> Settled:
    """Apply the law.

    Parameters
    ----------
    free : Freely
    rates : (m,) array
        Of the joints, exactly zero at rest.
    dry : DryFriction
    released : (m,) array, optional
        -1 or 1 of a joint at rest that has broken away, and so slides in that direction.
    """
    modes = np.where(rates == 0.0, 0.0 if released is None else released, np.sign(rates))
    given = -modes * dry.sliding
    rest = np.flatnonzero(modes == 0.0)
    held = rest
    if len(rest):
        along = (free.along + free.compliance @ given)[rest]
        own = free.compliance[np.ix_(rest, rest)]
        modes[rest], given[rest] = at_rest(own, along, dry.sliding[rest], dry.static[rest], free.alone[rest])
        rest = np.flatnonzero(modes == 0.0)
        held = rest[independent(free.compliance[np.ix_(rest, rest)], free.alone[rest])]
    return Settled(modes, free.accelerations + free.answers @ given, given, held)


def at_rest(
    compliance: Array, free: Array, sliding: Array, static: Array, alone: Array | None = None
) -> tuple[Array, Array]:
    """Modes of joints at rest, as of `Settled`, and what friction gives to each (m,).

    Parameters
    ----------
    compliance : (m, m) array
        W.
    free : (m,) array
        b.
    sliding, static : (m,) arrays
    alone : (m,) array, optional
        See `Freely`; the diagonal of W unless given.
    """
    modes, alone = np.zeros(len(free)), compliance.diagonal() if alone is None else alone
    while True:
        given = np.where(modes == 0.0, 0.0, -modes * sliding)
        held = np.flatnonzero(modes == 0.0)
        own, along = compliance[np.ix_(held, held)], (free + compliance @ given)[held]
        if len(independent(own, alone[held])) == len(held):
            given[held] = _between(own, along, static[held])
            gone = held[np.abs(given[held]) >= static[held]]
        else:
            given[held], moves = _among_dependent(own, along, static[held], alone[held])
            gone = held[moves]
        if not len(gone):
            return modes, given
        modes[gone] = -np.sign(given[gone])


def _among_dependent(
    compliance: Array, free: Array, static: Array, alone: Array
) -> tuple[Array, NDArray[np.bool_]]:
    """(m,) forces, and which joints they cannot hold, where W is singular."""
    more = _MADE_DEFINITE * np.maximum(compliance.diagonal(), 1e-4 * alone)
    given = _between(compliance + np.diag(more), free, static)
    accelerations = free + compliance @ given
    sizes = np.abs(compliance) @ static + np.abs(free)
    moves = (np.abs(given) >= static) & (-accelerations * np.sign(given) > _MOVES * sizes)
    if not moves.any():
        given = shared(compliance, free, static, alone).forces
    return given, moves


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
