"""Fixed-interface modes ranked by their part in the motion that a drive causes where it is observed.

The driven interfaces are held and accelerated, white noise in each driving component; the other interfaces are free.
With all candidates the link then has modes φ_j, ω_j. From drive d to observation o, relative to the static motion,

    H_od(s) = Σ_j c_oj b_jd / (s² + 2 ζ ω_j s + ω_j²),     ‖H_od‖² ≈ Σ_j (c_oj b_jd)² / (4 ζ ω_j³)

for light damping ζ, equal in all modes, which then drops out of every share. Each mode's share of that energy is
divided among the fixed-interface modes by their strain energy ω_k² q_k² in it. Energy as the measure for interior modes
is that of Palomba, Richiedei & Trevisani (Shock and Vibration, 2015), for periodic excitation; what a mode does to the
interface is its effective interface mass (Kammer & Triller, J. Vibration and Acoustics 118, 1996).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import scipy.linalg as la

from fe_import.description.reduction import COMPONENTS, Ranking
from fe_import.errors import Cause, FEImportError
from fe_import.files.toml import choose
from fe_import.model import Array, FEModel, IntArray
from fe_import.reduction.base import expanded
from fe_import.reduction.fixed_interface import Partition
from fe_import.solver.sparse import dense_modes

CANDIDATES_PER_MODE = 4
FEWEST_CANDIDATES = 40
_EQUAL = 1e-6  # relative difference of frequencies that count as one: a pair of a symmetric section has 1e-9
_SILENT = 1e-20  # of a squared transfer per the product of its factors; rounding leaves 1e-26


def best_ranked(
    model: FEModel,
    parts: Partition,
    constraint: Array,
    lowest: Callable[[int], tuple[Array, Array]],
    ranking: Ranking,
    where: str,
) -> tuple[Array, Array, dict[str, Any]]:
    """The ``ranking.count`` best of the lowest candidates (4 for each mode to keep, at least 40), in rising frequency.

    Raises
    ------
    FEImportError
        Fewer modes than asked for (MODE_COUNT), an unknown node (BAD_REFERENCE), or nothing of what is driven arrives
        where it is observed (BAD_FIELD).
    """
    omega, modes = _whole_groups(lowest, max(FEWEST_CANDIDATES, CANDIDATES_PER_MODE * ranking.count), len(parts.inner))
    if len(omega) < ranking.count:
        raise FEImportError(
            Cause.MODE_COUNT,
            "the model has fewer fixed-interface modes",
            where=f"{where}: reduction.ranking.count",
            value=ranking.count,
            limit=len(omega),
            remedy="ask for fewer, or refine the mesh",
        )
    observed = _observed_rows(model, ranking.observed, f"{where}: reduction.ranking.observed")
    fields = np.hstack([constraint, parts.clamped_field(modes)])
    energies = _interior_energies(
        fields.T @ (parts.mass @ fields),
        constraint.T @ (parts.stiffness @ constraint),
        omega,
        expanded(model, fields)[observed],
        _driven(model, ranking.driving),
        f"{where}: reduction.ranking",
    )
    turn = _within_groups(energies, omega)
    modes = modes @ turn
    score = np.einsum("kl,km,ml->l", turn, energies, turn)
    score /= max(score.sum(), np.finfo(float).tiny)
    kept = np.sort(np.argsort(-score, kind="stable")[: ranking.count])
    note = {
        "rule": "ranking",
        "candidates": len(omega),
        "kept": [int(k) + 1 for k in kept],
        "shares": [float(f"{s:.4g}") for s in score[kept]],
        "reached": float(f"{score[kept].sum():.6g}"),
    }
    return omega[kept], modes[:, kept], note


def _driven(model: FEModel, driving: Sequence[str]) -> list[tuple[int, int]]:
    """Interface number and component of each driving entry."""
    names = [i.name for i in model.interface_nodes]
    split = (entry.rpartition(".") for entry in driving)
    return [(names.index(name), COMPONENTS.index(component)) for name, _, component in split]


def _observed_rows(model: FEModel, observed: Sequence[str], where: str) -> IntArray:
    nodes = {**model.node_names, **{i.name: i.node for i in model.interface_nodes}}
    rows = []
    for entry in observed:
        name, _, component = entry.rpartition(".")
        choose(name, nodes, where)
        row = int(model.dof_map[nodes[name], COMPONENTS.index(component)])
        if row < 0:
            raise FEImportError(
                Cause.BAD_FIELD,
                "this node of a solid has no rotations",
                where=where,
                value=entry,
                remedy="observe ux, uy or uz, or an interface",
            )
        rows.append(row)
    return np.array(rows, dtype=np.int64)


def _interior_energies(
    mass: Array, condensed: Array, omega: Array, observed: Array, driven: list[tuple[int, int]], where: str
) -> Array:
    """(k, k) strain energy shares of the fixed-interface modes, weighted by the transfers; the diagonal is the score.

    Parameters
    ----------
    mass : (b + k, b + k) array
        Craig-Bampton, interface displacements first.
    condensed : (b, b) array
        Stiffness of the interface displacements.
    omega : (k,) array
        Circular frequencies of the fixed-interface modes.
    observed : (o, b + k) array
    driven : list of (interface, component)
    where : str
    """
    size, count = len(mass), len(condensed)
    stiffness = la.block_diag(condensed, np.diag(omega**2))
    held = np.unique(np.concatenate([6 * i + np.arange(6) for i, _ in driven]))
    free = np.setdiff1d(np.arange(size), held)
    drive = np.array([6 * i + c for i, c in driven])
    inner = np.ix_(free, free)
    frequencies, modes = dense_modes(stiffness[inner], mass[inner], None, "link with its driven interfaces held")
    follow = -modes @ ((modes.T @ stiffness[np.ix_(free, drive)]) / frequencies[:, None] ** 2)
    drives = -modes.T @ (mass[np.ix_(free, drive)] + mass[inner] @ follow)
    observes = observed[:, free] @ modes

    total = np.zeros((len(omega), len(omega)))
    loud = 0
    groups = _groups(frequencies)
    for d in range(drives.shape[1]):
        for o in range(len(observes)):
            factors = np.linalg.norm(observes[o]) * np.linalg.norm(drives[:, d])
            transfers = np.array([observes[o, g] @ drives[g, d] for g in groups])
            if (transfers**2 <= _SILENT * factors**2).all():
                continue
            loud += 1
            energy = transfers**2 / np.array([frequencies[g].mean() ** 3 for g in groups])
            for weight, g in zip(energy / energy.sum(), groups, strict=True):
                if weight > 0:
                    field = modes[:, g] @ drives[g, d]  # what the drive excites of equal modes
                    strain = omega * field[free >= count] / np.sqrt(field @ stiffness[inner] @ field)
                    total += weight * np.outer(strain, strain)
    if not loud:
        raise FEImportError(
            Cause.BAD_FIELD,
            "nothing of what is driven arrives where it is observed",
            where=where,
            remedy="observe another interface or node than the driven one, in a direction that the drive can reach",
        )
    return total / loud


def _groups(frequencies: Array) -> list[IntArray]:
    """Positions of equal ones together."""
    apart = np.diff(frequencies) > _EQUAL * frequencies[1:]
    return np.split(np.arange(len(frequencies)), np.flatnonzero(apart) + 1)


def _whole_groups(lowest: Callable[[int], tuple[Array, Array]], wanted: int, available: int) -> tuple[Array, Array]:
    """The lowest modes without half a pair at the end, which would make a symmetric link asymmetric."""
    omega, modes = lowest(min(wanted + 1, available))
    count = len(omega) if len(omega) <= wanted else int(_groups(omega)[-1][0])
    return omega[:count], modes[:, :count]


def _within_groups(energies: Array, omega: Array) -> Array:
    """Rotation of fixed-interface modes of equal frequency that gathers the energy in as few as can be."""
    turn = np.eye(len(omega))
    for g in _groups(omega):
        if len(g) > 1:
            turn[np.ix_(g, g)] = la.eigh(energies[np.ix_(g, g)])[1][:, ::-1]
    return turn
