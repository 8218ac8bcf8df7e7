"""Audits of a finished run: what must hold whatever the scene, so that a breach says that something is wrong.

Rules for a further audit:

1. One function `LookedAt` -> `Audit`, or None where it says nothing of a run, and one line in `AUDITS`; what it
   measures stands in a file of its own.
2. Value and limit are in the same unit. The limit follows from the error that the run states, so that a run which is
   as far off as it says keeps it; the docstring of the function has the formula.
3. It takes a few evaluations of what a run evaluates thousands of times: all audits together below 2 % of a run.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from erls.accuracy.constraint_drift import constraint_drift
from erls.accuracy.energy_balance import effort_error, energy_balance, limit_of
from erls.accuracy.free_momentum import free_momentum
from erls.accuracy.looked_at import SLACK, LookedAt
from erls.equations.loops.closed_chain import DECAY, ClosedChain
from erls.errors import SimulationError
from erls.run.chain.run import ChainRun

_EFFORTS, _EFFORTS_OF_LOOPS = 1e-9, 1e-2


@dataclass(frozen=True)
class Audit:
    """What one audit found.

    Attributes
    ----------
    name : str
        Of `AUDITS`.
    value, limit : float
        In the same unit, which ``unit`` names.
    unit : str
    ok : bool
        Whether the value keeps to the limit.
    text : str
        What was found, in one line.
    """

    name: str
    value: float
    limit: float
    unit: str
    ok: bool
    text: str


def audits(run: ChainRun, integration: float | None = None, *, reported: bool = False) -> tuple[Audit, ...]:
    """Audits of a run, those that say something of it.

    Parameters
    ----------
    run : ChainRun
    integration : float, optional
        Stated error of its integration [m]; the tolerance of the scene, or what truncation adds up to, unless given.
    reported : bool
        Also hold the efforts that the run reports against those that its motion takes: the first reactions that a run
        is asked for take some milliseconds.
    """
    look = LookedAt(run, integration)
    if not len(look.panels.first):
        return ()
    own = [audit for name, audit in AUDITS.items() if reported or name != "efforts"]
    with np.errstate(all="ignore"):  # a run that failed may hold anything: what is not a number is a breach
        return tuple(found for audit in own if (found := audit(look)) is not None)


def _audit(name: str, value: float, limit: float, unit: str, text: str) -> Audit:
    return Audit(name, value, limit, unit, bool(value <= limit), text)


def _energy(look: LookedAt) -> Audit | None:
    """|E(t) - E(0) - W(t)| over what is exchanged; the limit is that of `erls.accuracy.energy_balance.limit_of`:

    SLACK F ε + error of the integrals + 1e-11 of the exchanged energy, and, of energy that is lost, what the method
    damps (`erls.accuracy.numerical_loss`).
    """
    try:
        found = energy_balance(look)
    except (SimulationError, np.linalg.LinAlgError) as problem:
        return Audit("energy", np.inf, 0.0, "of what is exchanged", False, f"energy is not known: {problem}")
    if found is None:
        return None
    size = max(found.exchanged, 1e-300)
    limit = limit_of(look, found)
    where = "over the run" if found.whole else "in some steps, taken for all,"
    way = "lost" if found.off < 0 else "gained"
    text = (
        f"{abs(found.off):.2g} J {way} {where} of {found.exchanged:.2g} J exchanged, beside the work of drives and "
        f"dissipation; {limit:.2g} J would go with the stated error"
    )
    return _audit("energy", abs(found.off) / size, limit / size, "of what is exchanged", text)


def _rates(look: LookedAt) -> Audit | None:
    """Largest distance of positions from the integral of their rates, over the run and all coordinates [m].

    Limit: SLACK ε + error of the integral. Nothing is said of runs that keep but some of their knots, between which
    the integral is not resolved (`erls.run.watches.stored_output` looks at these).
    """
    if look.run.scene.record.simulation.output_step is not None or not len(look.metres):
        return None
    drift = np.abs(look.drift).max(axis=0, initial=0.0)
    worst = int(drift.argmax())
    value = float(drift[worst])
    rule = look.panels.rule_errors(look.rates[:, worst][look.panels.nodes]).sum() * look.metres[worst]
    text = f"positions move {value:.2g} m beyond the integral of the velocities over the run"
    return _audit("rates", value, SLACK * look.error + float(rule), "m", text)


def _constraints(look: LookedAt) -> Audit | None:
    """Largest opening of a condition [m]; the limit is SLACK ε.

    A rate φ of a condition counts as φ/DECAY, the opening that decays at that rate.
    """
    found = constraint_drift(look)
    if found is None:
        return None
    value = max(found.opening, found.speed / DECAY)
    text = f"{found.worst}: open by up to {found.opening:.2g} m, at up to {found.speed:.2g} m/s"
    return _audit("constraints", value, SLACK * look.error, "m", text)


def _momentum(look: LookedAt) -> Audit | None:
    """Change of the momentum along a first joint that moves freely, over the most that the kinetic energy could hold.

    Limit: SLACK ε over the way that the run's largest speed makes in its time, or the mechanism's size, if that is
    less, and rounding.
    """
    found = free_momentum(look)
    if found is None or not found.size:
        return None
    way = min(look.mechanism.reach, float(look.speed.max()) * look.run.end)
    text = f"joint {found.joint!r}: momentum along it changes by {found.change / found.size:.2g} of what it could be"
    limit = SLACK * look.error / max(way, 1e-300) + 1e-9
    return _audit("momentum", found.change / found.size, limit, "of what it could be", text)


def _efforts(look: LookedAt) -> Audit | None:
    """Largest difference of the power of reported efforts from that which the motion takes, over the largest of that.

    Limit: rounding; with loops a hundredth, as efforts are reported of the nearest state that closes them, and stiff
    links make forces of what they were open by.
    """
    value = effort_error(look)
    if value is None:
        return None
    limit = _EFFORTS_OF_LOOPS if isinstance(look.formulation, ClosedChain) else _EFFORTS
    text = f"the power of the reported efforts differs by {value:.2g} of it from that which the motion takes"
    return _audit("efforts", value, limit, "of the largest power", text)


AUDITS: dict[str, Callable[[LookedAt], Audit | None]] = {
    "energy": _energy,
    "rates": _rates,
    "constraints": _constraints,
    "momentum": _momentum,
    "efforts": _efforts,
}
"""One line each."""
