"""From a reduction basis to six rigid-body and some elastic modes, mass-orthonormal, in rising frequency."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from fe_import.errors import Cause, FEImportError
from fe_import.link import Damping, Reduction
from fe_import.model import Array, FEModel, IntArray
from fe_import.reduction import Basis
from fe_import.sparse import dense_modes


@dataclass(frozen=True)
class OrthonormalModes:
    """Coordinates of the modes in the basis (k, m), circular frequencies (m,) [rad/s], rigid motions (m, 6)."""

    coordinates: Array
    omega: Array
    rigid: Array


def reduced_matrices(model: FEModel, basis: Basis) -> tuple[Array, Array]:
    """(k, k) mass and stiffness over the basis, symmetric to the last digit."""
    mass = basis.vectors.T @ (model.mass @ basis.vectors)
    stiffness = basis.vectors.T @ (model.stiffness @ basis.vectors)
    return (mass + mass.T) / 2, (stiffness + stiffness.T) / 2


def orthonormal_modes(
    mass: Array, stiffness: Array, basis: Basis, options: Reduction, inboard_columns: IntArray | None, where: str
) -> OrthonormalModes:
    """Rigid-body modes from geometry, elastic ones from the eigenproblem on their mass-orthogonal complement.

    Splitting off the rigid-body motions first keeps their frequency at zero exactly and lets the elastic problem
    be positive definite.

    Parameters
    ----------
    mass, stiffness : (k, k) arrays
    basis : Basis
    options : Reduction
    inboard_columns : (6,) int array or None
        Columns of the inboard interface, clamped to choose the elastic modes; None keeps the lowest free-free ones.
    where : str

    Raises
    ------
    FEImportError
        The rigid-body mass matrix is singular, or more elastic modes are asked for than there are.
    """
    rigid_mass = basis.rigid.T @ mass @ basis.rigid
    try:
        factor = la.cholesky(rigid_mass, lower=True)
    except la.LinAlgError:
        raise FEImportError(
            Cause.NOT_DEFINITE,
            "the link has no mass or no inertia about some axis",
            where=where,
            remedy="give it density, rotary inertia or point masses off one line",
        ) from None
    rigid = la.solve_triangular(factor, basis.rigid.T, lower=True).T  # (k, 6), mass-orthonormal

    complement = la.qr(mass @ rigid)[0][:, 6:]
    if inboard_columns is not None and options.elastic_modes is not None:
        complement = _clamped_span(mass, stiffness, rigid, inboard_columns, options.elastic_modes)
    omega, elastic = dense_modes(
        complement.T @ stiffness @ complement, complement.T @ mass @ complement, None, "free link"
    )
    wanted = len(omega) if options.elastic_modes is None else options.elastic_modes
    if wanted > len(omega):
        raise FEImportError(
            Cause.MODE_COUNT,
            "the reduced model has fewer elastic modes",
            where=f"{where}: reduction.elastic_modes",
            value=wanted,
            limit=len(omega),
            remedy="ask for fewer, or raise fixed_interface_modes",
        )
    coordinates = np.hstack([rigid, complement @ elastic[:, :wanted]])
    signs = np.sign(coordinates[np.abs(coordinates).argmax(axis=0), np.arange(coordinates.shape[1])])
    signs[:6] = 1.0
    rigid_coordinates = np.zeros((6 + wanted, 6))
    rigid_coordinates[:6] = factor.T
    return OrthonormalModes(coordinates * signs, np.concatenate([np.zeros(6), omega[:wanted]]), rigid_coordinates)


def _clamped_span(mass: Array, stiffness: Array, rigid: Array, clamped: IntArray, count: int) -> Array:
    """Mass-orthogonal complement of the rigid motions in the span of them and of the lowest clamped modes."""
    free = np.setdiff1d(np.arange(len(mass)), clamped)
    ix = np.ix_(free, free)
    _, modes = dense_modes(stiffness[ix], mass[ix], count, "link with its inboard interface clamped")
    span = np.zeros((len(mass), modes.shape[1]))
    span[free] = modes
    span -= rigid @ (rigid.T @ mass @ span)
    return np.asarray(la.qr(span, mode="economic")[0])


def mode_kinds(model: FEModel, shapes: Array, basis: Basis, coordinates: Array, stiffness: Array) -> tuple[str, ...]:
    """Name of each mode by its largest share of strain energy.

    Frames: axial, torsion, bending about a section axis. Otherwise ``interface`` (the interface columns of the
    basis hold most of the energy) or ``interior``.
    """
    kinds = ["rigid-body"] * 6
    elastic = shapes[:, 6:]
    if model.stiffness_parts:
        names = list(model.stiffness_parts)
        energy = np.stack([np.einsum("dm,dm->m", elastic, k @ elastic) for k in model.stiffness_parts.values()])
        return (*kinds, *(names[k] for k in energy.argmax(axis=0)))
    if basis.interface_columns == 0:
        return (*kinds, *(["elastic"] * elastic.shape[1]))
    n, z = basis.interface_columns, coordinates[:, 6:]
    interface = np.einsum("km,kl,lm->m", z[:n], stiffness[:n, :n], z[:n])
    interior = np.einsum("km,kl,lm->m", z[n:], stiffness[n:, n:], z[n:])
    return (*kinds, *("interface" if a > b else "interior" for a, b in zip(interface, interior, strict=True)))


def damping_ratios(damping: Damping, omega: Array, where: str) -> Array:
    """(m,) modal damping ratios; 0 for rigid-body modes. Rayleigh: ζ = α / 2ω + β ω / 2.

    Raises
    ------
    FEImportError
        More ratios than elastic modes.
    """
    result = np.zeros(len(omega))
    elastic = omega[6:]
    if damping.ratio is not None:
        result[6:] = damping.ratio
    elif damping.ratios is not None:
        if len(damping.ratios) > len(elastic):
            raise FEImportError(
                Cause.BAD_FIELD,
                "more damping ratios than elastic modes",
                where=f"{where}: damping.ratios",
                value=len(damping.ratios),
                limit=len(elastic),
                remedy="give one per elastic mode, from the lowest on",
            )
        result[6 : 6 + len(damping.ratios)] = damping.ratios
    elif damping.rayleigh is not None:
        result[6:] = damping.rayleigh.alpha / (2 * elastic) + damping.rayleigh.beta * elastic / 2
    return result
