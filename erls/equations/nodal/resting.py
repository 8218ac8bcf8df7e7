"""Static starts of nodal scenes: the equilibrium that grows with the loads, what it leaves of the links' stiffness.

With E the forces of beams and shells alone and R those of everything, at rest with the joints held,

    s R(q) + (1 - s) E(q) + Bᵀ λ = 0,    Φ(q) = 0

has the share s of all loads. Where links deflect little, Newton's method at s = 1 finds the only equilibrium there is.
Where they deflect far, or where what it finds does not bear its loads, s grows from none to all, and each step must end
with a positive stiffness (`erls.equations.serial.equilibrium` does the same of modal links).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from erls.equations.linearization import stiffness_left, ways_left
from erls.equations.nodal.assembly import NodalSystem
from erls.equations.nodal.chain import Chain
from erls.equations.nodal.nodes import Nodes
from erls.equations.nodal.statics import LoadSteps, Statics, imbalance, solve_statics
from erls.equations.serial.equilibrium import size_of
from erls.equations.stability import Bearing, unstable
from erls.equations.system import metre_scales
from erls.maths import motion_maps as motions
from erls.maths.saddle import Matrix, dense
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism

_FAR = 0.05  # of a link: deflections from which on there may be several equilibria
_TOLERANCE = 1e-9  # of the size of the mechanism: where links nearly buckle, rounding moves them as far
_ITERATIONS, _DIVERGED = 15, 10.0  # Newton's; how much longer a correction may be than the one before
_FIRST_STEP, _SMALLEST_STEP = 0.125, 1e-3  # of the load; the second of the share that is borne
_STEP_CHANGE = 2.0
_BUCKLED = 0.5  # of the stiffness, left where a path ends: it ends for lack of stiffness, else for another reason
_UNHELD = 1e-12  # of the largest stiffness: given to ways that bend no link


class PartlyLoaded(NodalSystem):
    """A system at rest whose time is the share of all loads that acts.

    Parameters
    ----------
    whole : NodalSystem
        Under all loads; no prescribed motion but the one at time 0.
    bare : NodalSystem
        The same nodes and joints with beams and shells alone, without weight.
    """

    def __init__(self, whole: NodalSystem, bare: NodalSystem) -> None:
        super().__init__(whole.start.poses, whole.elements, whole.rows.joints)
        self._bare = bare

    def residual(self, t: float, q: Nodes, v: Array, a: Array) -> Array:
        """(n,)"""
        return t * super().residual(0.0, q, v, a) + (1 - t) * self._bare.residual(0.0, _of_beams(q, self._bare), v, a)

    def stiffness_and_damping(
        self, t: float, q: Nodes, v: Array, a: Array, multipliers: Array, material: bool = False
    ) -> tuple[Matrix, Matrix]:
        """(n, n) twice; stiffness of the joints' forces in full."""
        whole = super().stiffness_and_damping(0.0, q, v, a, multipliers, material)
        bare = self._bare.stiffness_and_damping(0.0, _of_beams(q, self._bare), v, a, multipliers, material)
        return t * whole[0] + (1 - t) * bare[0], t * whole[1] + (1 - t) * bare[1]

    def constraint(self, t: float, q: Nodes) -> Array:
        """(m,)"""
        return super().constraint(0.0, q)

    def constraint_matrix(self, t: float, q: Nodes) -> Matrix:
        """(m, n)"""
        return super().constraint_matrix(0.0, q)


def _of_beams(q: Nodes, bare: NodalSystem) -> Nodes:
    """The same configuration of a system that has no joints with forces and no springs."""
    return replace(q, turned=bare.start.turned, wound=bare.start.wound)


class Resting(NamedTuple):
    """An equilibrium: configuration, and what loads leave of the stiffness."""

    q: Nodes
    bearing: Bearing


def resting(whole: NodalSystem, chain: Chain, mechanism: Mechanism) -> Resting:
    """At rest under all loads.

    Parameters
    ----------
    whole : NodalSystem
        With joints held.
    chain : Chain
    mechanism : Mechanism

    Raises
    ------
    SimulationError
        UNSTABLE_START: links buckle under their loads, and the mechanism does not allow it; names the link.
        NO_EQUILIBRIUM, where none is found.
    """
    found = _directly(whole)
    if not chain.elastic:
        return Resting(_reached(found), Bearing(1.0, ""))
    bare = NodalSystem(whole.start.poses, chain.elastic, whole.rows.joints)
    stiffness = _Stiffness(whole, bare, chain, mechanism)
    direct = None
    if found.failure is None:
        q, multipliers = found.path[-1].q, found.path[-1].multipliers
        direct = Resting(q, stiffness.left(whole, 1.0, q, multipliers))
        far = np.linalg.norm(q.poses[:, :3, 3] - whole.start.poses[:, :3, 3], axis=1).max()
        if direct.bearing.sound and far <= _FAR * size_of(mechanism):
            return direct
    share, grown = _along_the_load(PartlyLoaded(whole, bare), stiffness)
    if share == 1.0:
        return grown
    buckled = grown.bearing.left < _BUCKLED
    if direct is not None and (mechanism.allow_unstable or (direct.bearing.sound and not buckled)):
        return direct
    if found.failure is not None and not buckled:
        raise found.failure
    raise unstable((direct or grown).bearing.link, share, direct is not None)


def _directly(system: NodalSystem) -> Statics:
    """Newton's method under all loads; the second tangent converges from farther away."""
    found = solve_statics(system, system.start, end=0.0)
    return found if found.failure is None else solve_statics(system, system.start, tangent="material", end=0.0)


def _reached(found: Statics) -> Nodes:
    if found.failure is not None:
        raise found.failure
    return found.path[-1].q


def _along_the_load(system: PartlyLoaded, stiffness: _Stiffness) -> tuple[float, Resting]:
    """The stable branch from no load to all of it, as far as it goes: the share, and the equilibrium there."""
    share, step, multipliers = 0.0, _FIRST_STEP, np.zeros(system.constraints)
    last, newton = Resting(system.start, Bearing(1.0, "")), LoadSteps(system, "full", _TOLERANCE)
    pace = np.zeros(system.size), 0 * multipliers  # of nodes and multipliers, per share
    while share < 1.0 and step > _SMALLEST_STEP * max(share, _SMALLEST_STEP):
        target = min(share + step, 1.0)
        further = target - share
        with np.errstate(over="ignore", invalid="ignore"):  # of a step too far, which is found
            guess = system.compose(last.q, further * pace[0])
            found = _near(newton, target, guess, multipliers + further * pace[1])
        bearing = None if found is None else stiffness.left(system, target, *found)
        if found is not None and bearing is not None and bearing.sound:
            moved = motions.log(motions.inverse(last.q.poses) @ found[0].poses).ravel()
            pace = moved / further, (found[1] - multipliers) / further
            last, multipliers = Resting(found[0], bearing), found[1]
            share, step = target, _STEP_CHANGE * step
        else:
            step = (target - share) / _STEP_CHANGE
    return share, last


def _near(newton: LoadSteps, t: float, q: Nodes, multipliers: Array) -> tuple[Nodes, Array] | None:
    """The equilibrium next to a guess by Newton's own method, or None: what `solve_statics` does from farther away
    ends on any branch.
    """
    before = np.inf
    for _ in range(_ITERATIONS):
        saddle = newton.factor(t, q, multipliers, True)
        if saddle.singular is not None:
            return None
        correction = saddle.solve(saddle.scaled(*imbalance(newton.system, t, q, multipliers)))
        size = float(np.abs(correction[: newton.system.size]).max(initial=0.0))
        if not size < _DIVERGED * before:
            return None
        move, change = saddle.unscaled(correction)
        q, multipliers, before = newton.system.compose(q, -move), multipliers - change, size
        if size <= newton.goal:
            return q, multipliers
    return None


@dataclass(frozen=True)
class _Stiffness:
    """What tells how much of the stiffness of beams and shells loads leave."""

    whole: NodalSystem
    bare: NodalSystem
    chain: Chain
    mechanism: Mechanism

    def left(self, system: NodalSystem, t: float, q: Nodes, multipliers: Array) -> Bearing:
        """At an equilibrium of a system, on the ways that the joints leave."""
        rest = np.zeros(system.size)
        ways = ways_left(dense(system.constraint_matrix(t, q)), 1 / metre_scales(system))
        if not ways.shape[1]:
            return Bearing(1.0, "")
        bent = _of_beams(q, self.bare)
        elastic = dense(self.bare.stiffness_and_damping(0.0, bent, rest, rest, 0 * multipliers, material=True)[0])
        loaded = ways.T @ dense(system.stiffness_and_damping(t, q, rest, rest, multipliers)[0]) @ ways
        unloaded = ways.T @ elastic @ ways
        unloaded = (unloaded + unloaded.T) / 2
        try:
            left, shape = stiffness_left(loaded, unloaded)
        except np.linalg.LinAlgError:  # some ways bend no link
            unloaded[np.diag_indices(len(unloaded))] += _UNHELD * np.diag(unloaded).max()
            left, shape = stiffness_left(loaded, unloaded)
        moved = ways @ shape
        energy = (moved * (elastic @ moved)).reshape(-1, 6).sum(axis=1)
        by_link = [float(energy[nodes].sum()) for nodes in self.chain.nodes]
        return Bearing(left, self.mechanism.links[int(np.argmax(by_link))].name)
