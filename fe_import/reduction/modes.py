"""From a reduction basis to six rigid-body and some elastic modes, mass-orthonormal, in rising frequency."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg as la

from fe_import.description.reduction import Reduction
from fe_import.errors import Cause, FEImportError
from fe_import.modal.equal_frequencies import LONGEST, kept_whole, whole_count
from fe_import.model import Array, FEModel
from fe_import.reduction import Basis
from fe_import.reduction.rigid_modes import MASSLESS, rigid_modes
from fe_import.reduction.static_span import completed, static_span
from fe_import.solver.sparse import dense_modes, polishing


@dataclass(frozen=True)
class OrthonormalModes:
    """Coordinates of the modes in the basis (k, m), circular frequencies (m,) [rad/s], rigid motions (m, 6).

    ``flexibility`` (b, b), where fewer modes are kept than the basis has, or static correction is asked for: of the
    whole basis between the interfaces, inertia-relieved. ``told``: how many are kept where that is not as asked.
    """

    coordinates: Array
    omega: Array
    rigid: Array
    flexibility: Array | None = None
    told: str = ""


def reduced_matrices(model: FEModel, basis: Basis) -> tuple[Array, Array]:
    """(k, k) mass and stiffness over the basis, symmetric to the last digit."""
    mass = basis.vectors.T @ (model.mass @ basis.vectors)
    stiffness = basis.vectors.T @ (model.stiffness @ basis.vectors)
    return (mass + mass.T) / 2, (stiffness + stiffness.T) / 2


def column_scale(mass: Array, stiffness: Array) -> Array:
    """(k,) factors that bring the columns of a basis to like size.

    Without, rounding in the large ones drowns the lowest modes of a slender link.
    """
    inertia, resistance = np.diag(mass), np.diag(stiffness).clip(min=0)
    massive = inertia > MASSLESS * inertia.max()
    squared = resistance[massive] / inertia[massive]  # of the frequencies of the columns alone; 0 for rigid motions
    typical = np.median(squared[squared > 0]) if squared.any() else 1.0
    return np.asarray(1 / np.sqrt(inertia + resistance / typical))


def orthonormal_modes(
    mass: Array,
    stiffness: Array,
    basis: Basis,
    options: Reduction,
    interfaces: Array | None,
    where: str,
    inboard: int = 0,
) -> OrthonormalModes:
    """Rigid-body modes from geometry, elastic ones from the eigenproblem on their mass-orthogonal complement.

    Splitting off the rigid-body motions first keeps their frequency at zero exactly and lets the elastic problem
    be positive definite.

    Parameters
    ----------
    mass, stiffness : (k, k) arrays
    basis : Basis
    options : Reduction
    interfaces : (6 n_interfaces, k) array or None
        Interface displacements and rotations per unit coordinate; for static correction and clamped truncation.
    where : str
    inboard : int
        Number of the interface that ``options.truncation = "clamped"`` clamps.

    Raises
    ------
    FEImportError
        The rigid-body mass matrix is singular, or more elastic modes are asked for than there are.
    """
    scale = column_scale(mass, stiffness)
    mass, stiffness = mass * np.outer(scale, scale), stiffness * np.outer(scale, scale)
    interfaces = np.zeros((0, len(scale))) if interfaces is None else interfaces * scale
    rigid, rigid_coordinates = rigid_modes(mass, basis.rigid / scale[:, None], where)

    complement = whole = la.qr(mass @ rigid)[0][:, 6:]
    thermal = np.zeros((0, len(scale))) if basis.thermal is None else (basis.thermal * scale)[None]
    kept_loads = np.vstack([interfaces[: len(interfaces) * options.static_correction], thermal])
    scaled = _Scaled(mass, stiffness, rigid, interfaces, kept_loads)
    if options.elastic_modes is not None and (len(kept_loads) or options.truncation == "clamped"):
        complement = _kept_span(scaled, complement, inboard, options, where)
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
            remedy="ask for fewer, keep more modes in the basis (fixed_interface_modes, free_modes), or give the mass "
            "matrix rotary inertia",
        )
    kept, told = wanted, ""
    if options.elastic_modes is not None:
        kept = len(omega) if complement is not whole else whole_count(omega, wanted)
        told = _kept_whole(omega, wanted, kept) if kept != wanted else ""
    wanted = kept
    lost = len(interfaces) > 0 and wanted < whole.shape[1]
    flexibility = _flexibility(scaled, whole) if lost or options.static_correction else None
    coordinates = scale[:, None] * np.hstack([rigid, complement @ elastic[:, :wanted]])
    motions = np.zeros((6 + wanted, 6))
    motions[:6] = rigid_coordinates
    return OrthonormalModes(coordinates, np.concatenate([np.zeros(6), omega[:wanted]]), motions, flexibility, told)


def _kept_whole(omega: Array, wanted: int, kept: int) -> str:
    return kept_whole(omega / (2 * np.pi), wanted, kept, "reduction.elastic_modes")


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
    return shapes * signs, replace(modes, coordinates=modes.coordinates @ change * signs, omega=omega)


@dataclass(frozen=True)
class _Scaled:
    """Mass and stiffness (k, k), rigid-body modes (k, 6) and interface displacements (b, k) of scaled columns.

    ``kept_loads`` (l, k): generalized loads that the modes kept answer exactly, at the interfaces or of temperature.
    """

    mass: Array
    stiffness: Array
    rigid: Array
    interfaces: Array
    kept_loads: Array


def _flexibility(link: _Scaled, complement: Array) -> Array:
    """(b, b) displacements of the interfaces under unit loads there, balanced by inertia."""
    moved = link.interfaces @ complement
    return np.asarray(moved @ la.cho_solve(la.cho_factor(complement.T @ link.stiffness @ complement), moved.T))


def _kept_span(link: _Scaled, complement: Array, inboard: int, options: Reduction, where: str) -> Array:
    """What the elastic modes to keep are made of: columns within the complement of the rigid-body motions."""
    count = options.elastic_modes or 0
    k, m = complement.T @ link.stiffness @ complement, complement.T @ link.mass @ complement
    if options.truncation == "clamped":
        frequencies, clamped = _clamped_modes(link, slice(6 * inboard, 6 * inboard + 6), count + LONGEST + 1)
        lowest = complement.T @ clamped
    else:
        frequencies, lowest = dense_modes(k, m, count + LONGEST + 1, "free link")
    if not len(link.kept_loads):
        count = whole_count(frequencies, min(count, len(frequencies)))
        return np.asarray(complement @ la.qr(lowest[:, :count], mode="economic")[0])
    static = static_span(k, link.kept_loads @ complement, link.kept_loads @ link.rigid)
    if static.shape[1] > count:
        what, remedy = "thermal expansion", "or remove temperature_change"
        if options.static_correction:
            what, remedy = "static correction", "six per interface, or remove static_correction"
        raise FEImportError(
            Cause.MODE_COUNT,
            f"{what} takes more elastic modes",
            where=f"{where}: reduction.elastic_modes",
            value=count,
            limit=static.shape[1],
            remedy=f"ask for at least as many, {remedy}",
        )
    # beside the static fields: as many of the lowest modes as part none of equal frequency
    used, found = 0, static
    while found.shape[1] < count and used < len(frequencies):
        used = whole_count(frequencies, used + 1)
        found = completed(static, lowest[:, :used], k, len(k))
    return np.asarray(complement @ found)


def _clamped_modes(link: _Scaled, rows: slice, count: int) -> tuple[Array, Array]:
    """Circular frequencies and lowest modes with some interface displacements held, less their rigid-body motion."""
    mass, stiffness, held = link.mass, link.stiffness, link.interfaces[rows]
    moving = held.any(axis=0)
    if moving.sum() == len(held):  # columns of the basis: leave them out
        free = np.eye(len(mass))[:, ~moving]
    else:
        free = la.qr((held / np.abs(held).max(axis=1, keepdims=True)).T)[0][:, len(held) :]
    omega, modes = dense_modes(
        free.T @ stiffness @ free, free.T @ mass @ free, count, "link with its inboard interface clamped"
    )
    span = free @ modes
    return omega, np.asarray(span - link.rigid @ (link.rigid.T @ mass @ span))


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
