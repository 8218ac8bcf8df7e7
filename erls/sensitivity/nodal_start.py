"""Where the small changes of a nodal run begin: its start, and the accelerations of each leg.

Nodes at the ends of short elements have so little inertia that what solves the equations of motion bends within
fractions of a millimetre. So the equations are differentiated, and solved then.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from erls.equations.consistency import consistent_position
from erls.equations.nodal.assembly import NodalSystem
from erls.equations.nodal.nodes import Nodes
from erls.equations.system import metre_scales
from erls.errors import Cause, SceneError
from erls.maths import motion_maps as motions
from erls.maths.saddle import Matrix, Saddle, Scales, dense
from erls.maths.so3 import Array
from erls.run.chain.run import ChainRun
from erls.sensitivity.outputs import ALONG, MOVED
from erls.sensitivity.variants import Difference, Variant

What = Callable[[Any, Nodes, Array], Array]
"""Of a formulation, a configuration and twists (n,): an array, smooth in all."""


def start_changes(run: ChainRun, differences: Sequence[Difference], q: Nodes, v: Array) -> Array:
    """(p, 2, n) derivatives of places, in the axes of the nodes, and of twists at the start.

    Parameters
    ----------
    run : ChainRun
    differences : sequence of Difference
    q : Nodes
    v : (n,) array
        Twists.
    """
    base: Any = run.formulation
    resting = _Resting(base.held, q) if base.mechanism.static_start else None
    moving = _Moving(base, q, v)
    result = []
    for difference in differences:
        place = resting.moved(difference) if resting else difference.of(lambda variant: _apart(q, variant))
        result.append(np.stack([place, moving.changed(difference, place)]))
    return np.array(result)


def _apart(q: Nodes, variant: Variant) -> Array:
    """(n,) increments from a configuration to that at which a variant starts, undeformed."""
    formulation: Any = variant.formulation
    system = formulation.system
    started, _ = consistent_position(system, 0.0, system.start)
    return motions.log(motions.inverse(q.poses) @ started.poses).ravel()


class LegStart:
    """Accelerations and multipliers where a leg begins: M a + Bᵀ λ = f and B a + b = 0, differentiated as they stand.

    Parameters
    ----------
    base : Nodal
    t : float
        At which forces are asked for [s].
    q : Nodes
    v : (n,) array
        Twists.
    known : (n + m,) array
        Accelerations and multipliers.
    """

    def __init__(self, base: Any, t: float, q: Nodes, v: Array, known: Array) -> None:
        self._base, self._t, self._q, self._v = base, t, q, v
        system: NodalSystem = base.system
        self._a, self._multipliers = np.split(known, [system.size])
        self._tangents = system.exact_stiffness_and_damping(t, q, v, self._a, self._multipliers)
        self._masses = _Masses(system, t, q)

    def changed(self, difference: Difference, place: Array, rate: Array) -> Array:
        """(n + m,) derivatives, from those of places and of twists (n,)."""
        stiffness, damping = self._tangents
        force = difference.of(self._balance) + stiffness @ place + damping @ rate
        gap = total(self._base, difference, self._bias, (self._q, self._v), (place, rate))
        return -self._masses.solved(force, gap)

    def explicit(self, difference: Difference) -> Array:
        """(n + m,) what a parameter changes of forces and of conditions, places and twists held."""
        gap = difference.of(lambda variant: self._bias(variant.formulation, self._q, self._v))
        return np.concatenate([difference.of(self._balance), gap])

    def transposed(self, by: Array) -> tuple[Array, Array, Array]:
        """Of derivatives (n + m, c) by accelerations and multipliers: multipliers (n + m, c) of what `explicit` gives,
        and derivatives by places and twists (n, c).
        """
        stiffness, damping = self._tangents
        n = len(self._v)
        found = -np.stack([self._masses.solved(*np.split(one, [n])) for one in by.T], axis=1)  # symmetric
        of_place, of_rate = self._bias_slopes
        gap = found[n:]
        return found, stiffness.T @ found[:n] + of_place.T @ gap, damping.T @ found[:n] + of_rate.T @ gap

    @cached_property
    def _bias_slopes(self) -> tuple[Array, Array]:
        """(m, n) derivatives of the bias of conditions by places and by twists: those of nodes in joints."""
        system: NodalSystem = self._base.system
        n, nodes = system.size, np.unique(system.model.joint_nodes)
        found = np.zeros((2, system.constraints, n))
        for k in (6 * nodes[nodes >= 0][:, None] + np.arange(6)).ravel() if system.constraints else ():
            unit = np.zeros(n)
            unit[k] = 1.0
            for which, change in enumerate(((unit, 0 * unit), (0 * unit, unit))):
                found[which, :, k] = along(self._base, self._bias, (self._q, self._v), change)
        return found[0], found[1]

    def _balance(self, variant: Variant) -> Array:
        formulation: Any = variant.formulation
        system: NodalSystem = formulation.system
        rows = system.constraint_matrix(self._t, self._q)
        return system.residual(self._t, self._q, self._v, self._a) + rows.T @ self._multipliers

    def _bias(self, formulation: Any, q: Nodes, v: Array) -> Array:
        system: NodalSystem = formulation.system
        return system.constraint_matrix(self._t, q) @ self._a + system.constraint_bias(self._t, q, v)


class _Moving:
    """Twists at the start, those of links that go with their joints made consistent by an impulse μ of the conditions,
    M (v - w) + Bᵀ μ = 0 and B v + Φ_t = 0, differentiated as they stand.
    """

    def __init__(self, base: Any, q: Nodes, v: Array) -> None:
        self._base, self._q, self._v = base, q, v
        self._masses = _Masses(base.system, 0.0, q)
        impulse = self._masses.mass @ (v - base.carried_along(q))
        self._multipliers = -np.linalg.lstsq(dense(self._masses.rows).T, impulse, rcond=None)[0]

    def changed(self, difference: Difference, place: Array) -> Array:
        """(n,) derivative, from that of places."""
        wrong = total(self._base, difference, self._balance, (self._q, self._v), (place, 0 * place))
        force, gap = np.split(wrong, [len(place)])
        return -self._masses.solved(force, gap)[: len(place)]

    def _balance(self, formulation: Any, q: Nodes, _: Array) -> Array:
        system: NodalSystem = formulation.system
        rows = system.constraint_matrix(0.0, q)
        force = system.mass_matrix(0.0, q) @ (self._v - formulation.carried_along(q)) + rows.T @ self._multipliers
        return np.concatenate([force, rows @ self._v + system.constraint_rate(0.0, q)])


class _Masses:
    """[[M, Bᵀ], [B, 0]], factored."""

    def __init__(self, system: NodalSystem, t: float, q: Nodes) -> None:
        self.mass, self.rows = system.mass_matrix(t, q), system.constraint_matrix(t, q)
        self._metres = metre_scales(system)

    @cached_property
    def _saddle(self) -> Saddle:
        return _saddle(self.mass, self.rows, self._metres)

    def solved(self, force: Array, gap: Array) -> Array:
        """(n + m,)"""
        return np.concatenate(self._saddle.unscaled(self._saddle.solve(self._saddle.scaled(force, gap))))


def _saddle(block: Matrix, rows: Matrix, metres: Array) -> Saddle:
    return Saddle(block, rows.T, rows, Scales(metres, abs(block), rows), 1.0)


class _Resting:
    """Equilibrium of a system whose joints are held, R(q) + Bᵀ λ = 0, Φ(q) = 0, differentiated as it stands."""

    def __init__(self, held: NodalSystem, q: Nodes) -> None:
        self._held, self._q, rest = held, q, np.zeros(held.size)
        rows, force = held.constraint_matrix(0.0, q), held.residual(0.0, q, rest, rest)
        self._multipliers: Array = -np.linalg.lstsq(dense(rows).T, force, rcond=None)[0].astype(float)
        stiffness, _ = held.exact_stiffness_and_damping(0.0, q, rest, rest, self._multipliers)
        self._saddle = _saddle(stiffness, rows, metre_scales(held))

    def moved(self, difference: Difference) -> Array:
        """(n,) derivative of the configuration."""
        force, gap = np.split(difference.of(self._balance), [self._held.size])
        return -self._saddle.unscaled(self._saddle.solve(self._saddle.scaled(force, gap)))[0]

    def _balance(self, variant: Variant) -> Array:
        formulation: Any = variant.formulation
        q, rest = self._q, np.zeros(self._held.size)
        if variant.sections:  # conditions and multipliers are those of the run: no joints to be held anew
            force = formulation.system.residual(0.0, q, rest, rest)
            return np.concatenate([force, np.zeros(self._held.constraints)])
        held = formulation.held
        if held.rows.names != self._held.rows.names:
            message = "which conditions of a loop follow from the others at rest depends on a parameter"
            raise SceneError(Cause.BAD_FIELD, message, where="initial.deformation", remedy="start undeformed")
        force = held.residual(0.0, q, rest, rest) + held.constraint_matrix(0.0, q).T @ self._multipliers
        return np.concatenate([force, held.constraint(0.0, q)])


def total(
    base: Any, difference: Difference, what: What, state: tuple[Nodes, Array], change: tuple[Array, Array]
) -> Array:
    """Derivative of what depends on constants, configuration and twists, which change with the parameter.

    Parameters
    ----------
    base : Nodal
    difference : Difference
    what : callable
    state : Nodes and (n,) array
    change : (n,) and (n,) arrays
        Of places and of twists.
    """
    q, v = state
    found = difference.of(lambda variant: what(variant.formulation, q, v))
    return found + along(base, what, state, change) if change[0].any() or change[1].any() else found


def along(base: Any, what: What, state: tuple[Nodes, Array], change: tuple[Array, Array]) -> Array:
    """The same along a change of places and twists alone."""
    (q, v), (place, rate) = state, change
    (step,) = shares_of(base.system, place[None], (v[None], rate[None]))
    moved = [(weight, base.system.compose(q, at * step * place), v + at * step * rate) for at, weight in ALONG]
    return np.asarray(sum(weight / step * what(base, there, rates) for weight, there, rates in moved))


def shares_of(system: NodalSystem, places: Array, *others: tuple[Array, Array]) -> Array:
    """(k,) steps of differences along changes (k, n) of places: a share of the size of the system, or of a radian; and
    along those of other values (k, n), which need not be small, of about their size.
    """
    extent = float(np.ptp(system.start.poses[:, :3, 3], axis=0).max()) or float(metre_scales(system).max())
    scales = np.tile(np.repeat([1 / extent, 1.0], 3), system.count) / MOVED
    fastest = np.abs(places * scales).max(axis=1, initial=0.0)
    for values, changes in others:
        sizes = 1 + np.abs(values).max(axis=1, initial=0.0)
        fastest = np.maximum(fastest, np.abs(changes).max(axis=1, initial=0.0) / sizes)
    return np.asarray(1 / np.where(fastest > 0, fastest, 1.0))
