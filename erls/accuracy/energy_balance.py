"""The balance of energy: what a run holds against what drives, loads, dampers and friction gave and took.

    E(t) - E(0) = ∫ (power of drives and loads - dissipation) dt

Where all powers follow from angles and rates it is looked at over the whole run, at the ends of some panels, with
powers at every knot. Motors that prescribe motions give what the equations of motion say, which costs as much as a
step, so that the balance is then looked at over some panels, and what an even sample of them is off by is taken for
all.
"""

from __future__ import annotations

from typing import NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from erls.accuracy.looked_at import SLACK, LookedAt
from erls.accuracy.numerical_loss import numerical_loss
from erls.accuracy.panels import Panels, within_legs
from erls.accuracy.power import in_angles, known_power, motor_power, moved, reported_power, tied_power
from erls.equations.formulation import Formulation
from erls.equations.loops.closed_chain import ClosedChain
from erls.equations.quasi_static.formulation import QuasiStatic
from erls.equations.serial.state_series import energy_series
from erls.maths.so3 import Array
from fe_import.model import IntArray

_ROUNDING = 1e-11  # of the energies themselves
_CORNERS = 20.0  # times what rules are off by where powers of contacts bend within panels: up to 12 on bouncing balls


class EnergyBalance(NamedTuple):
    """What a run's energy is off by [J].

    Attributes
    ----------
    off : float
        Farthest that energy comes from the work done, with its sign.
    exchanged : float
        The largest change of a kind of energy, or the largest kinetic one.
    error : float
        Of the integrals.
    force : float
        Energy per metre by which positions are off [N].
    whole : bool
        Whether the whole run was looked at.
    """

    off: float
    exchanged: float
    error: float
    force: float
    whole: bool
    left_out: float = 0.0


def energy_balance(look: LookedAt) -> EnergyBalance | None:
    """Of a run; None where stored states lie too far apart for integrals between them, or there is but one."""
    panels = look.panels
    if not len(panels.first):
        return None
    tree = in_angles(look.formulation)
    loops = [loop for loop in look.mechanism.loops if loop.freedom is not None or loop.bushing is not None]
    idle = not any(loop.prescribed or loop.bushing or (loop.freedom and loop.freedom.active) for loop in loops)
    if look.run.conservative:
        return _over_all(look, np.zeros(panels.nodes.shape))
    if look.run.scene.record.simulation.output_step is not None:
        return None
    if tree is not None and idle and not moved(look.mechanism):
        s = look.solution
        return _over_all(look, known_power(tree, within_legs(s.t), s.y, s.v)[panels.nodes])
    return _over_some(look, panels.picked(look.picked))


def limit_of(look: LookedAt, found: EnergyBalance) -> float:
    """What the energy of a run may be off by [J].

    An error ε of positions is one of F ε in the energy, F being the energy that is exchanged per metre of motion, or
    the force that ties loops. Energy that is lost may be as much more as the method damps.
    """
    granted = SLACK * look.error * found.force + found.error + found.left_out + _ROUNDING * found.exchanged
    if found.off < -granted:
        granted += numerical_loss(look)
    return granted


def _over_all(look: LookedAt, power: Array) -> EnergyBalance:
    """At both ends of the panels that were picked, and at that of the run, with the powers (p, 4) of all panels."""
    panels, s = look.panels, look.solution
    picked = np.union1d(look.picked, [len(panels.first) - 1])
    chosen, each = panels.picked(picked), (panels.weights * power).sum(axis=1)
    spent = np.cumsum(each)
    ends = np.concatenate([chosen.first, chosen.last, panels.first[:1]])
    work = np.concatenate([(spent - each)[picked], spent[picked], [0.0]])
    t = within_legs(s.t)
    energies = energy_series(look.formulation, t[ends], s.y[ends], s.v[ends])
    off = energies.sum(axis=1) - energies[-1].sum() - work
    ties = np.zeros(1)
    if isinstance(look.formulation, ClosedChain) and in_angles(look.formulation) is not None:
        evenly = panels.first[look.even]
        ties = tied_power(look.formulation, t[evenly], s.y[evenly], s.v[evenly])[1]
    left_out = _following(look.formulation, _states(look, ends).y) if look.dear else 0.0
    error = float(_rule_errors(look, panels, power).sum()) if power.any() else 0.0
    force = max(_force(look, chosen, energies, np.isin(picked, look.even)), float(np.median(ties)))
    return EnergyBalance(float(off[np.abs(off).argmax()]), _exchanged(energies), error, force, True, left_out)


def _over_some(look: LookedAt, chosen: Panels) -> EnergyBalance:
    """Over single panels."""
    nodes, (count, width) = chosen.nodes.ravel(), chosen.nodes.shape
    states = _states(look, nodes)
    stored, t, y, v = energy_of(states.formulation), states.t, states.y, states.v
    power, ties = power_taken(states)
    power = power.reshape(count, width)
    begins = np.arange(count) * width + np.argmax(chosen.nodes == chosen.first[:, None], axis=1)
    ends = np.concatenate([begins, np.arange(count) * width + width - 1])
    first = _states(look, look.panels.first[:1])  # the sample may lie where all is at rest again
    whence = energy_series(stored, first.t, first.y, first.v)
    energies = np.concatenate([energy_series(stored, t[ends], y[ends], v[ends]), whence])
    totals = energies.sum(axis=1)
    off = totals[count : 2 * count] - totals[:count] - (chosen.weights * power).sum(axis=1)
    even = np.isin(look.picked, look.even)
    whole = float(look.panels.lengths.sum() / chosen.lengths[even].sum())
    worst, summed = float(off[np.abs(off).argmax()]), _of_all(off[even], whole)
    rules = _rule_errors(look, chosen, power)
    error = float(rules[even].sum() * whole + rules[~even].sum())
    force = max(_force(look, chosen, energies, even), float(np.median(ties.reshape(count, width)[even])))
    largest = max(worst, summed, key=abs)
    return EnergyBalance(largest, _exchanged(energies), error, force, False, _following(states.formulation, y))


def _rule_errors(look: LookedAt, panels: Panels, power: Array) -> Array:
    """(p,) what integrals of powers (p, 4) may be off by."""
    return panels.rule_errors(power) * (_CORNERS if look.mechanism.touches else 1.0)


class States(NamedTuple):
    """Equations with all coordinates, and times, coordinates, rates and accelerations at some knots."""

    formulation: Formulation
    t: Array
    y: Array
    v: Array
    a: Array


def _states(look: LookedAt, knots: IntArray) -> States:
    s, t, own = look.solution, within_legs(look.solution.t)[knots], look.formulation
    if isinstance(own, QuasiStatic):
        return States(own.inner, t, *own.all_modes_at(t, s.y[knots], s.v[knots]))
    return States(own, t, s.y[knots], s.v[knots], s.a[knots])


def energy_of(formulation: Formulation) -> Formulation:
    """Whose energy changes by what `power_taken` finds: where loops are tied, that of the tree."""
    tied = isinstance(formulation, ClosedChain) and in_angles(formulation) is not None
    return cast(ClosedChain, formulation).bare if tied else formulation


def power_taken(states: States) -> tuple[Array, Array]:
    """(k,) power of all drives, loads and dissipation at some states [W], and (k,) largest force of a condition [N]."""
    formulation, *at = states
    tree = in_angles(formulation)
    if tree is None:
        return reported_power(formulation, *at), np.zeros(len(states.t))
    known = known_power(tree, *at[:3])
    if isinstance(formulation, ClosedChain):
        power, ties = tied_power(formulation, *at[:3])
        return power + known, ties
    return motor_power(tree, *at) + known, np.zeros(len(states.t))


def effort_error(look: LookedAt) -> float | None:
    """Largest difference of the power of the efforts that a run reports from that which its motion takes, over the
    largest of the latter; at the picked panel with the largest. None where the balance itself takes reported ones.
    """
    nodes = look.panels.nodes[look.picked]
    states = _states(look, nodes.ravel())
    if in_angles(states.formulation) is None:
        return None
    taken = power_taken(states)[0]
    size = np.abs(taken).max(initial=0.0)
    if not size > 0.0:
        return None
    row = np.unique(nodes[np.abs(taken).argmax() // nodes.shape[1]])
    states = _states(look, row)
    reported = reported_power(*states)
    return float(np.abs(reported - power_taken(states)[0]).max() / size)


def _of_all(off: Array, whole: float) -> float:
    """What a run is off by in all that is ``whole`` times as long as a sample (q,): the mean, as far as its scatter
    leaves it certain, adds up; the rest is as often one way as the other.
    """
    count, mean = len(off), float(off.mean())
    certain = np.sign(mean) * max(abs(mean) - float(off.std()) / np.sqrt(count), 0.0)
    by_chance = float(np.sqrt((off**2).mean() * count * whole))
    return float(count * whole * certain + np.copysign(by_chance, mean))


def _following(formulation: Formulation, y: Array) -> float:
    """Largest strain energy of modes that follow statically, at coordinates (k, n) of all modes: what their vibrations,
    which the equations leave out, may exchange.
    """
    if not isinstance(formulation, QuasiStatic):
        return 0.0
    modes, inner = formulation.modes, formulation.inner
    stiffness = np.concatenate([link.stiffness for link in formulation.mechanism.links])
    elastic = slice(inner.size - len(stiffness), None)
    force = (y[:, elastic] * stiffness) @ modes.static[elastic]  # κ η, as Hᵀ K W = 0
    return float((force**2 / modes.stiffness).sum(axis=1).max(initial=0.0) / 2)


def _exchanged(energies: Array) -> float:
    """Largest change of a kind of energy, or, as bodies exchange it among each other, the largest kinetic energy."""
    return float(max(np.ptp(energies, axis=0).max(), energies[:, 0].max()))


def _force(look: LookedAt, chosen: Panels, energies: Array, even: NDArray[np.bool_]) -> float:
    """Mean rate at which energies change, over the mean speed [N], of the even ones of panels; or, as bodies exchange
    energy among each other, the largest kinetic energy over the size of the mechanism. Energies at the beginnings of
    panels, then at their ends.
    """
    count = len(chosen.first)
    rates = np.abs(energies[count : 2 * count] - energies[:count]).sum(axis=1) / chosen.lengths
    speeds = look.speed[chosen.nodes].max(axis=1)
    exchange = rates[even].sum() / max(speeds[even].sum(), 1e-300)
    return float(max(exchange, energies[:, 0].max() / look.mechanism.reach))
