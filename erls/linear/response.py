"""Responses of a linear model: over frequency, and in time after a step."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.linalg as la
from numpy.typing import ArrayLike

from erls.errors import Cause, SceneError
from erls.linear.model import LinearModel
from erls.maths.so3 import Array

_BEFORE, _BEHIND = 10.0, 2.0  # frequencies that are looked at: from the slowest mode to the fastest, and beyond
_PER_MODE = 12  # frequencies around each mode
_STEPS = 600  # of a step response
_PERIODS, _MOST = 12.0, 1e4  # of the slowest mode; and of the fastest one


def frequency_response(
    model: LinearModel,
    frequencies_hz: ArrayLike,
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
) -> Array:
    """(k, p, r) complex amplitudes of outputs per amplitude of inputs that are sines.

        H(s) = Y₀ Z + s Y₁ Z + s² Y₂ Z + U,    (s² M + s D + K) Z = F,    s = 2πi f

    with F and U the forces and what outputs take of inputs by themselves, of motions by place, rate and acceleration.
    It is not built on A: mass matrices need no inverse.

    Parameters
    ----------
    model : LinearModel
    frequencies_hz : (k,) array
        Positive.
    inputs, outputs : sequence of str, optional
        All unless given.

    Raises
    ------
    SceneError
        BAD_FIELD: a frequency that is not positive; BAD_REFERENCE: there is no such input or output.
    """
    f = np.asarray(frequencies_hz, dtype=float).ravel()
    if not (np.isfinite(f).all() and (f > 0).all()):
        message, remedy = "frequencies must be positive", "give frequencies above 0 Hz"
        raise SceneError(Cause.BAD_FIELD, message, where="frequencies_hz", value=f.tolist(), remedy=remedy)
    own, seen = model.part(inputs, outputs)
    s = 2j * np.pi * f[:, None, None]
    weights = np.where(model.moved[own], np.array([s**-2, s**-1, s**0]), np.array([0 * s, 0 * s, s**0]))
    force, through = (
        np.einsum("okxr,ofr->kfr", weights, part)
        for part in (model.forces[:, :, own], model.through[:, seen][:, :, own])
    )
    moved = np.linalg.solve(s**2 * model.mass + s * model.damping + model.stiffness, force)
    rows = model.seen[0][seen] + s * model.seen[1][seen] + s**2 * model.seen[2][seen]
    return np.asarray(rows @ moved + through)


def telling_frequencies(model: LinearModel) -> Array:
    """(k,) rising frequencies [Hz] that show a response: even on a logarithmic scale, and more about each mode."""
    modes = np.array([mode.frequency_hz for mode in model.modes if mode.frequency_hz > 0])
    modes = modes[modes > 1e-6 * modes.max(initial=0.0)]  # others are at rest, but for rounding
    if not len(modes):
        modes = np.ones(1)
    last = _BEHIND * float(modes.max())
    first = float(modes.min()) / _BEFORE
    even = np.geomspace(first, last, 400)
    damped = {mode.frequency_hz: max(abs(mode.damping_ratio), 1e-4) for mode in model.modes}
    near = [f * (1 + damped[f] * np.linspace(-4, 4, _PER_MODE + 1)) for f in modes.tolist()]
    found = np.unique(np.concatenate([even, *near]))
    return np.asarray(found[(found >= first) & (found <= last)])


def step_response(
    model: LinearModel,
    times: ArrayLike,
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
) -> Array:
    """(k, p, r) outputs after a step of one unit of each input by itself, from the state at rest.

    Parameters
    ----------
    model : LinearModel
    times : (k,) array
        [s] even ones from 0 on.
    inputs, outputs : sequence of str, optional
        All unless given.

    Raises
    ------
    SceneError
        BAD_FIELD: times that are not even; BAD_REFERENCE: there is no such input or output.
    """
    t = np.asarray(times, dtype=float).ravel()
    own, seen = model.part(inputs, outputs)
    h = float(t[1] - t[0]) if len(t) > 1 else 1.0
    if not len(t) or t[0] != 0 or h <= 0 or np.abs(np.diff(t) - h).max(initial=0.0) > 1e-9 * t[-1]:
        message, remedy = "not even times from 0 on", "for example numpy.linspace(0, 1, 1001)"
        raise SceneError(Cause.BAD_FIELD, message, where="times", value=t[:3].tolist(), remedy=remedy)
    a, b = model.A, model.B[:, own]
    n, r = b.shape
    block = np.zeros((n + r, n + r))
    block[:n, :n], block[:n, n:] = a * h, b * h
    found = la.expm(block)
    x, result = np.zeros((n, r)), np.empty((len(t), len(seen), r))
    for k in range(len(t)):
        result[k] = model.C[seen] @ x + model.D[np.ix_(seen, own)]
        x = found[:n, :n] @ x + found[:n, n:]
    return result


def telling_times(model: LinearModel) -> Array:
    """(k,) even times that show a step response: some periods of the slowest mode."""
    rates = np.array([abs(mode.pole) for mode in model.modes])
    rates = rates[rates > 1e-6 * rates.max(initial=0.0)]
    if not len(rates):
        return np.linspace(0.0, 1.0, _STEPS + 1)
    growth = max((mode.pole.real for mode in model.modes), default=0.0)
    end = _PERIODS / float(rates.min()) * 2
    end = min(end, 8 / growth) if growth > 0 else end
    return np.linspace(0.0, min(end, _MOST / float(rates.max()) * 2 * np.pi), _STEPS + 1)
