"""Linear elasticity as (6, 6) moduli: stress xx, yy, zz, xy, yz, zx per strain, its shear parts twice the tensor's."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fe_import.model import Array

PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))  # components in their order
_ROUNDING = 1e-12


def isotropic_moduli(lam: float, mu: float) -> Array:
    """(6, 6) of Lamé's parameters."""
    moduli = np.diag([2 * mu] * 3 + [mu] * 3)
    moduli[:3, :3] += lam
    return moduli


def orthotropic_moduli(youngs: Sequence[float], ratios: Sequence[float], shear: Sequence[float]) -> Array:
    """(6, 6) in the axes of the material.

    Parameters
    ----------
    youngs : (3,)
        E1, E2, E3.
    ratios : (3,)
        ν12, ν13, ν23: contraction along the second axis under tension along the first, ν12 / E1 = ν21 / E2.
    shear : (3,)
        G12, G13, G23.

    Raises
    ------
    ValueError
        Constants that no elastic material has.
    """
    e1, e2, e3 = youngs
    n12, n13, n23 = ratios
    g12, g13, g23 = shear
    if not min(*youngs, *shear) > 0:
        raise ValueError("moduli must be positive")
    compliance = np.zeros((6, 6))
    compliance[0, 1:3], compliance[1, 2] = (-n12 / e1, -n13 / e1), -n23 / e2
    compliance += compliance.T + np.diag([1 / e1, 1 / e2, 1 / e3, 1 / g12, 1 / g23, 1 / g13])
    return checked_moduli(np.asarray(np.linalg.inv(checked_moduli(compliance)), dtype=np.float64))


def largest_youngs_modulus(moduli: Array) -> float:
    """Of (6, 6) moduli along their three axes."""
    return float(1 / np.diag(np.linalg.inv(moduli))[:3].min())


def checked_moduli(moduli: Array) -> Array:
    """The same, exactly symmetric.

    Raises
    ------
    ValueError
        Not finite, or not positive definite: some strain would take no energy.
    """
    if not np.isfinite(moduli).all():
        raise ValueError("elastic constants must be finite")
    moduli = (moduli + moduli.T) / 2
    size = np.diag(moduli)
    if not (size > 0).all() or np.linalg.eigvalsh(moduli / np.sqrt(np.outer(size, size)))[0] <= _ROUNDING:
        raise ValueError("elastic constants that are not positive definite")
    return moduli


def turned_moduli(moduli: Array, axes: Array) -> Array:
    """(e, 6, 6) in the axes of the mesh, of a material whose axes are the columns of ``axes`` (e, 3, 3)."""
    turn = np.empty((len(axes), 6, 6))  # strain in the material's axes per strain in the mesh's
    for column, (i, j) in enumerate(PAIRS):
        strain = np.zeros((3, 3))
        strain[i, j] += 0.5
        strain[j, i] += 0.5
        own = axes.swapaxes(1, 2) @ strain @ axes
        for row, (a, b) in enumerate(PAIRS):
            turn[:, row, column] = own[:, a, b] + (own[:, b, a] if a != b else 0.0)
    return np.asarray(turn.swapaxes(1, 2) @ moduli @ turn)


def lame_parameters(moduli: Array) -> tuple[Array, Array] | None:
    """λ and μ of (..., 6, 6) moduli that are all isotropic; None when some are not."""
    lam, mu = moduli[..., 0, 1], moduli[..., 3, 3]
    expected = np.zeros_like(moduli)
    expected[..., :3, :3] = lam[..., None, None]
    expected[..., range(6), range(6)] += np.where(np.arange(6) < 3, 2.0, 1.0) * mu[..., None]
    same = np.abs(moduli - expected).max(axis=(-2, -1)) <= _ROUNDING * np.abs(mu)
    return (lam, mu) if np.all(same) else None


def average_lame_parameters(moduli: Array) -> Array:
    """(..., 2) λ and μ of (..., 6, 6) moduli, averaged over all directions (W. Voigt, 1887): exact where isotropic."""
    along = moduli[..., [0, 1, 2], [0, 1, 2]].sum(axis=-1)
    across = moduli[..., [0, 0, 1], [1, 2, 2]].sum(axis=-1)
    shear = moduli[..., [3, 4, 5], [3, 4, 5]].sum(axis=-1)
    mu = (along - across + 3 * shear) / 15
    return np.stack([(along + 2 * across) / 9 - 2 / 3 * mu, mu], axis=-1)


def stress_of_gradient(gradient: Array, moduli: Array) -> Array:
    """(e, q, 6, m) stress of displacement gradients (e, q, derivative, component, m), moduli (e, 6, 6)."""
    parts = [gradient[:, :, a, a] for a in range(3)]
    parts += [gradient[:, :, a, b] + gradient[:, :, b, a] for a, b in PAIRS[3:]]
    return np.asarray(moduli[:, None] @ np.stack(parts, axis=2))
