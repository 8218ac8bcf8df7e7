"""Audits of motions of bodies and beams: energy where nothing drives or damps, and openings of their connections."""

from __future__ import annotations

import numpy as np

from erls.accuracy.audits import Audit
from erls.accuracy.looked_at import SLACK, truncation
from erls.run.bodies.motion import BodyMotion
from fe_import.model import IntArray

_LOOKS = 25
_ROUNDING = 1e-11
_LEAST = 1e-10


def body_audits(run: BodyMotion, integration: float | None = None) -> tuple[Audit, ...]:
    """Audits of a motion, those that say something of it.

    Parameters
    ----------
    run : BodyMotion
    integration : float, optional
        Stated error of its integration [m]; what the truncation of its steps adds up to, unless given.
    """
    s = run.solution
    if len(s.t) < 2:
        return ()
    system = run.assembly.system
    places = (12 * np.arange(system.count)[:, None] + np.arange(3)).ravel()
    y, a = s.y[:, places], s.a[:, places]
    way = float(np.abs(y - y[0]).max(initial=0.0))
    rho = run.scene.record.simulation.spectral_radius  # type: ignore[union-attr]  # a motion's
    error = truncation(s.t, a, rho) if integration is None else integration
    error = max(error, _LEAST * max(float(np.ptp(y.reshape(-1, 3), axis=0).max()), 1e-300))
    knots = np.unique(np.linspace(0, len(s.t) - 1, _LOOKS).round().astype(np.int64))
    with np.errstate(all="ignore"):  # a run that failed may hold anything
        found = [_connections(run, knots[:: _LOOKS // 5], error)]
        if run.conservative:
            found.insert(0, _energy(run, knots, error, way))
    return tuple(audit for audit in found if audit is not None)


def _energy(run: BodyMotion, knots: IntArray, error: float, way: float) -> Audit:
    """Largest change of energy over what is exchanged; limit: SLACK ε over the way of the nodes, and rounding."""
    kinds = run.energies_at(knots)
    totals = kinds.sum(axis=1)
    exchanged = max(float(np.ptp(kinds, axis=0).max()), 1e-300)
    held = float(np.abs(kinds).max())
    value = float(np.abs(totals - totals[0]).max()) / exchanged
    limit = SLACK * error / max(way, 1e-300) + _ROUNDING * (1 + held / exchanged)
    text = f"energy changes by {value:.2g} of what is exchanged, {exchanged:.2g} J, where nothing drives or damps"
    return Audit("energy", value, limit, "of what is exchanged", bool(value <= limit), text)


def _connections(run: BodyMotion, knots: IntArray, error: float) -> Audit | None:
    """Largest opening of a connection [m], angles by the distance of nodes; limit: SLACK ε."""
    system, s = run.assembly.system, run.solution
    if not system.constraints:
        return None
    places = s.y[0, : 12 * system.count].reshape(-1, 12)[:, :3]
    metres = np.where(system.rows.c.any(axis=1), 1.0, max(float(np.ptp(places, axis=0).max()), 1e-3))
    value, worst = 0.0, ""
    for t, q in zip(s.t[knots].tolist(), run.configurations_at(knots)[0], strict=True):
        gaps = np.abs(system.constraint(t, q)) * metres
        if not gaps.max() <= value or not worst:
            value, worst = float(gaps.max()), system.constraint_names[int(gaps.argmax())]
    limit = SLACK * error
    return Audit("constraints", value, limit, "m", bool(value <= limit), f"{worst}: open by up to {value:.2g} m")
