"""Mean forces of vibrations on joints, which a mechanism with finer links vibrates otherwise at the start than it did.

A start at which loads come suddenly sets the modes of K ψ = ω² M ψ vibrating about their equilibrium, by A = ψᵀR/ω²
with the forces R out of balance there. Forces that are not linear in displacements and rates, as those of inertia,
friction and contacts, then have a mean over a period that drives slow joints,

    F = 1/2π ∮ R_θ(y + A ψ cos φ, v - ω A ψ sin φ, -ω² A ψ cos φ) dφ - R_θ(y, v, 0),

which dies out with the energy of the vibration, as exp(-2 ζ ω t), and is otherwise taken to stay as at the start. Modes
of unlike frequency have nothing to do with each other, so that their forces add up; those that stay in step to the end
of the run swing as one, Σ A ψ, or what they are taken to be would follow from rounding. What a run is off by is F of
the finer links less F of those that it had. What is left out is damped as the least damped mode of the link that was
kept. Links that are nothing but a modal file lack the modes that count as left out of them.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy.linalg as la

from erls.accuracy.compared_links import Compared, Motion
from erls.equations.formulation import TreeFormulation
from erls.equations.serial.equilibrium import elastic_on_diagonal
from erls.maths.so3 import Array
from fe_import.model import IntArray

_PHASES, _PHASES_SUDDEN = 8, 32  # of a period: exact for squares of vibrations; where friction and limits jump
_SMALL = 1e-3  # of the largest energy of a vibration: forces are about proportional to it
_IN_STEP = 1.0  # rad over the run, by which frequencies of one vibration may lie apart
_ELASTIC = 0.5  # of the energy of a mode, in links: the rest are joints on their springs, which drift tells

Forces = Callable[[Array, Array, Array, Array], Array]


def mean_vibration_forces(compared: Compared, start: Motion, t: Array, sudden: bool, borne: Array) -> Array:
    """(k, f) what free joints lack of them at the times t (k,) of a run [N m or N]; of trees.

    Parameters
    ----------
    compared : Compared
    start : Motion
        The first instant, without accelerations.
    t : (k,) array
        Middles of stretches of time, two or more, over which means are taken [s]; impulses count from the start on.
    sudden : bool
        Whether friction, contacts or limits of motors act.
    borne : (N,) array
        By which what is left out is deformed before the start.
    """
    y, v = start.whole[0][0], start.whole[1][0]
    at, run, every = float(start.t[0]), compared.run, np.arange(compared.whole.size)
    edges = np.concatenate([[0.0], (t[1:] + t[:-1]) / 2 - at, t[-1:] - at])
    phases = _PHASES_SUDDEN if sudden else _PHASES
    more, none = _damping_left_out(compared), np.zeros(compared.lesser.size)
    whole = mean_forces(compared.whole, compared.forces, at, y + borne, v, every, more, edges, phases)
    lesser = mean_forces(
        compared.lesser, compared.lesser_forces, at, y[run], v[run], compared.own, none, edges, phases
    )
    found = whole - lesser
    found[0] *= edges[1] / ((t[1] - t[0]) / 2)  # the impulse since the start: drift is followed from t[0] on
    return found


def mean_forces(
    equations: TreeFormulation,
    forces: Forces,
    t: float,
    y: Array,
    v: Array,
    moving: IntArray,
    more: Array,
    edges: Array,
    phases: int = _PHASES,
) -> Array:
    """Mean forces of the vibrations that a start sets off.

    Parameters
    ----------
    equations : TreeFormulation
        Of n coordinates, f of free joints before those of links.
    forces : callable
        (k, n) forces out of balance at k times and states.
    t : float
        Time of the start [s].
    y, v : (n,) arrays
        Its state.
    moving : (m,) int array
        Coordinates that vibrate; the rest stay where they are.
    more : (n,) array
        Damping of coordinates beside that of the equations [1/s].
    edges : (k + 1,) array
        Of k stretches of time, from the start [s].
    phases : int
        Of a period, at which forces are evaluated.

    Returns
    -------
    (k, f) array
        Means over each stretch.
    """
    free = len(equations.free_joints)
    block = np.ix_(moving, moving)
    stiffness, damping = equations.stiffness_and_damping(t, y, v)
    mass = equations.mass_matrix(t, y)[block]
    squares, parts = la.eigh((stiffness + stiffness.T)[block] / 2, mass, check_finite=False)
    modes = np.zeros((len(y), len(squares)))
    modes[moving] = parts
    elastic = (squares > 0) & (elastic_on_diagonal(equations)[0] @ modes**2 > _ELASTIC * squares)
    squares, modes = squares[elastic], modes[:, elastic]
    decay = np.einsum("ij,ik,kj->j", modes, damping + np.diag(more), modes).clip(min=0.0)
    still = forces(np.array([t]), y[None], v[None], 0 * y[None])[0]
    omega, amplitude = np.sqrt(squares), still @ modes / squares
    number = np.cumsum(np.diff(omega, prepend=omega[:1]) * edges[-1] > _IN_STEP)
    together = (number == np.arange(len(omega))[:, None]).astype(float)  # (vibrations, modes)
    energies = together * (omega * amplitude) ** 2
    energy = energies.sum(axis=1)
    most = energy > _SMALL * energy.max(initial=0.0)
    together, decay = together[most], energies[most] @ decay / energy[most]
    swing, rate, acceleration = (together @ (amplitude * omega**order * modes).T for order in range(3))

    angles = 2 * np.pi * (np.arange(phases) + 0.5) / phases
    cosine, sine = np.cos(angles)[:, None, None], np.sin(angles)[:, None, None]
    states = y + cosine * swing, v - sine * rate, -cosine * acceleration
    found = forces(np.full(phases * len(swing), t), *(part.reshape(-1, len(y)) for part in states))
    mean = found.reshape(phases, len(swing), len(y)).mean(axis=0) - still
    return np.asarray(_mean_decay(np.outer(edges, decay)) @ mean[:, :free])


def _mean_decay(x: Array) -> Array:
    """(k, j) means of exp(-x) between one row of x (k + 1, j) and the next."""
    span = np.diff(x, axis=0)
    return np.asarray(np.exp(-x[:-1]) * np.where(span > 0, -np.expm1(-span) / np.where(span > 0, span, 1.0), 1.0))


def _damping_left_out(compared: Compared) -> Array:
    """(N,) of the coordinates that are left out."""
    result = [np.zeros(compared.free)]
    for own, finer in zip(compared.lesser.mechanism.links, compared.whole.mechanism.links, strict=True):
        kept = own.elastic_modes
        ratio = (own.damping / (2 * np.sqrt(own.stiffness))).min(initial=np.inf)
        rest = 2 * ratio * np.sqrt(finer.stiffness[kept:]) if kept else np.zeros(finer.elastic_modes)
        result += [np.zeros(kept), rest]
    return np.concatenate(result)
