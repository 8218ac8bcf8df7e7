"""Energy that the numerical damping of generalized-α takes from vibrations that its steps do not resolve."""

from __future__ import annotations

import numpy as np
import scipy.linalg as la

from erls.accuracy.looked_at import LookedAt
from erls.accuracy.power import in_angles
from erls.integrate.alpha_spectrum import step_errors
from erls.scene.integrators import FIXED_STEP

_PARTS = 8  # of a run, over each of which the modes are those at its middle
_FACTOR = 3.0  # modes of a moving mechanism are not those of any one configuration


def numerical_loss(look: LookedAt) -> float:
    """What it may come to over a run, at most [J]; 0 of methods that damp nothing.

    A mode of frequency ω keeps the share |factor|² of its energy in a step of h (`erls.integrate.alpha_spectrum`). Its
    energy is (η̇² + η̈²/ω²)/2 at unit modal mass: what it holds beyond its static deflection.
    """
    settings, tree = look.run.scene.record.simulation, in_angles(look.formulation)
    if settings.integrator != FIXED_STEP or tree is None or not tree.size:
        return 0.0
    s, total = look.solution, 0.0
    for part in np.array_split(np.arange(len(s.t) - 1), _PARTS):
        if not len(part):
            continue
        middle = part[len(part) // 2]
        stiffness, _ = tree.stiffness_and_damping(float(s.t[middle]), s.y[middle], s.v[middle])
        mass = tree.mass_matrix(float(s.t[middle]), s.y[middle])
        squares, modes = la.eigh((stiffness + stiffness.T) / 2, mass)
        modes, omega = modes[:, squares > 0], np.sqrt(squares[squares > 0])
        speeds, pulls = (x[part] @ mass @ modes for x in (s.v, s.a))
        held = (speeds**2 + (pulls / omega) ** 2) / 2
        steps = np.diff(s.t)[part]
        step = float(np.median(steps[steps > 0], axis=0)) if (steps > 0).any() else 0.0
        kept = np.exp(2 * step_errors(settings.spectral_radius, omega * step).real)
        total += float(held.sum(axis=0) @ np.maximum(1 - kept, 0.0))
    return _FACTOR * total
