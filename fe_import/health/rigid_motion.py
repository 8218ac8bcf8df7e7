"""Rigid-body motions of a reduced link found in three ways: by geometry, by stiffness, as eigenmodes.

They agree when the matrices belong to the nodes, nothing is grounded and nothing hangs loose; which of them departs
tells the fault apart. After the report of pyyeti's ``cbcheck``.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg as la

from fe_import.model import Array, FEModel, magnitudes
from fe_import.reduction import Basis

_STRAINED = 1e-13  # strain energy per that of its terms; rounding leaves 1e-16


def rigid_motion_by_stiffness(model: FEModel, basis: Basis, stiffness: Array) -> float:
    """Departure of the motions that follow one interface without strain from those of geometry.

    The first interface is moved by each of the six unit motions, and the rest takes the shape of least strain
    energy: min ½ zᵀKz with U_b z = R_b.

    Parameters
    ----------
    model : FEModel
    basis : Basis
    stiffness : (k, k) array
        Over the basis.

    Returns
    -------
    float
        Largest departure of any nodal component, per largest component of the motion, rotations counted by what they
        move at the far end of the link; infinite when the interface does not hold the link.
    """
    rows = model.dof_map[model.interface_nodes[0].node]
    geometry = model.rigid_body_modes()
    held = basis.vectors[rows]
    count = len(stiffness)
    scale = _stiffness_scale(model, basis, stiffness, held)
    moved = held * scale
    size = np.abs(moved).max(axis=1)
    if not size.all():
        return float("inf")
    matrix = np.zeros((count + 6, count + 6))
    matrix[:count, :count] = stiffness * np.outer(scale, scale)
    matrix[count:, :count] = moved / size[:, None]
    matrix[:count, count:] = matrix[count:, :count].T
    right = np.zeros((count + 6, 6))
    right[count:] = geometry[rows] / size[:, None]
    try:
        found = la.solve(matrix, right, assume_a="sym")[:count] * scale[:, None]
    except (la.LinAlgError, la.LinAlgWarning):
        return float("inf")
    lengths = _lengths(model)
    departure = np.abs(basis.vectors @ found - geometry).T * lengths
    return float((departure.max(axis=1) / (np.abs(geometry).T * lengths).max(axis=1)).max())


def _lengths(model: FEModel) -> Array:
    """(d,) size of the link for rotations, 1 for displacements, so that both are lengths in any unit."""
    lengths = np.ones(model.mass.shape[0])
    turning = model.dof_map[:, 3:]
    lengths[turning[turning >= 0]] = np.linalg.norm(np.ptp(model.nodes, axis=0))
    return lengths


def _stiffness_scale(model: FEModel, basis: Basis, stiffness: Array, held: Array) -> Array:
    """(k,) scale to unit stiffness; to like displacements of the interface for columns that are rigid-body motions."""
    diagonal, size = np.diag(stiffness), np.abs(basis.vectors)
    strained = diagonal > _STRAINED * np.einsum("dk,dk->k", size, magnitudes(model.stiffness) @ size)
    scale = np.ones(len(stiffness))
    scale[strained] = 1 / np.sqrt(diagonal[strained])
    reach = np.abs(held).max(axis=0)
    scale[~strained] = (reach * scale)[strained].max(initial=0.0) or 1.0
    scale[~strained] /= np.where(reach[~strained] > 0, reach[~strained], 1.0)
    return scale


def rigid_motion_as_eigenmodes(mass: Array, stiffness: Array, rigid: Array, first: float) -> tuple[float, float]:
    """Frequencies and shapes of the six lowest eigenmodes of the free link.

    Parameters
    ----------
    mass, stiffness : (k, k) arrays
        Over the basis.
    rigid : (k, 6) array
        Coordinates of the rigid-body motions in it.
    first : float
        First elastic circular frequency [rad/s].

    Returns
    -------
    frequency : float
        Largest ω² of the six, per that of the first elastic mode.
    departure : float
        Sine of the largest angle between their span and the motions of geometry, in the mass norm.
    """
    diagonal = np.diag(mass) * first**2 + np.diag(stiffness)
    scale = 1 / np.sqrt(np.where(diagonal > 0, diagonal, 1.0))
    inertia = mass * np.outer(scale, scale) * first**2
    shifted = stiffness * np.outer(scale, scale) + inertia
    count = len(mass)
    # M x = μ (K + ω₁² M) x, μ = ω₁² / (ω² + ω₁²): the rigid-body modes are the largest, μ = 1, massless columns 0
    mu, modes = la.eigh(inertia, shifted, subset_by_index=(count - 6, count - 1))
    motions = rigid / scale[:, None]
    motions = motions @ np.linalg.inv(la.cholesky(motions.T @ inertia @ motions))
    modes /= np.sqrt(mu)
    rest = motions - modes @ (modes.T @ inertia @ motions)
    departure = np.sqrt(np.linalg.eigvalsh(rest.T @ inertia @ rest).max().clip(min=0))
    return float(np.abs(1 / mu - 1).max()), float(departure)
