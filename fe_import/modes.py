"""From a reduction basis to six rigid-body and some elastic modes, mass-orthonormal, in rising frequency."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from fe_import.errors import Cause, FEImportError
from fe_import.inertia import mass_properties
from fe_import.link import Damping, Reduction
from fe_import.model import Array, FEModel, IntArray
from fe_import.reduction import Basis
from fe_import.sparse import dense_modes, polishing

_MASSLESS = 1e-12  # of the largest; the thinnest wire has 1e-8, rounding 1e-15


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
    # columns of like size: without, rounding in the large ones drowns the lowest modes of a slender link
    inertia, resistance = np.diag(mass), np.diag(stiffness).clip(min=0)
    massive = inertia > _MASSLESS * inertia.max()
    squared = resistance[massive] / inertia[massive]  # of the frequencies of the columns alone; 0 for rigid motions
    typical = np.median(squared[squared > 0]) if squared.any() else 1.0
    scale = 1 / np.sqrt(inertia + resistance / typical)
    mass, stiffness = mass * np.outer(scale, scale), stiffness * np.outer(scale, scale)
    rigid, rigid_coordinates = _rigid_modes(mass, basis.rigid / scale[:, None], where)

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
    coordinates = scale[:, None] * np.hstack([rigid, complement @ elastic[:, :wanted]])
    motions = np.zeros((6 + wanted, 6))
    motions[:6] = rigid_coordinates
    return OrthonormalModes(coordinates, np.concatenate([np.zeros(6), omega[:wanted]]), motions)


def mode_shapes(model: FEModel, basis: Basis, modes: OrthonormalModes) -> tuple[Array, OrthonormalModes]:
    """Displacement fields (d, m) of the modes, and the modes polished with them.

    The reduced matrices carry the rounding of the large basis vectors that a high mode is the small difference of;
    the fields do not, so orthonormality is restored there. Signs: the largest component is positive.
    """
    shapes = basis.vectors @ modes.coordinates
    count = shapes.shape[1]
    change = np.eye(count)
    change[:6, 6:] = -shapes[:, :6].T @ (model.mass @ shapes[:, 6:])
    omega, polish = polishing(model.stiffness, model.mass, modes.omega[6:], shapes @ change[:, 6:])
    change[:, 6:] = change[:, 6:] @ polish
    shapes = shapes @ change
    size = np.abs(shapes)
    first = (size > 0.99 * size.max(axis=0)).argmax(axis=0)  # the first of several equal ones, whatever the rounding
    signs = np.sign(shapes[first, np.arange(count)])
    signs[:6] = 1.0
    omega = np.concatenate([np.zeros(6), omega])
    return shapes * signs, OrthonormalModes(modes.coordinates @ change * signs, omega, modes.rigid)


def _rigid_modes(mass: Array, motions: Array, where: str) -> tuple[Array, Array]:
    """Mass-orthonormal rigid-body modes (k, 6), and (6, 6) coordinates of the unit ``motions`` in them."""
    centre = mass_properties(motions.T @ mass @ motions).centre_of_mass
    shift = np.eye(6)  # to rotations about the centre of mass, so that a distant origin costs no digits
    shift[:3, 3:] = -np.stack([np.cross(axis, centre) for axis in np.eye(3)], axis=1)
    central = motions @ shift
    rigid_mass = central.T @ mass @ central
    size = np.sqrt(np.diag(rigid_mass))
    inertia = np.linalg.eigvalsh(rigid_mass[3:, 3:])
    if not size[:3].all() or inertia[0] <= _MASSLESS * inertia[-1]:
        raise FEImportError(
            Cause.NOT_DEFINITE,
            "the link has no mass or no inertia about some axis",
            where=where,
            remedy="give it density, rotary inertia or point masses off one line",
        )
    factor = la.cholesky(rigid_mass, lower=True)
    back = 2 * np.eye(6) - shift  # its inverse
    return la.solve_triangular(factor, central.T, lower=True).T, factor.T @ back


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
