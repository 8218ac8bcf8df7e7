"""Which vibration modes enter a basis: the lowest by count, all below a frequency, or as many as carry the mass.

How many modes a frequency limit or a mass share takes is not known before they are: the number is doubled until they
suffice, up to `MOST_CANDIDATES`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from fe_import.description.reduction import Reduction
from fe_import.errors import Cause, FEImportError
from fe_import.modal.equal_frequencies import LONGEST, kept_whole, whole_count
from fe_import.model import Array

DEFAULT_MODES = 12
DEFAULT_SHARE = 0.9
FIRST_CANDIDATES = 16
MOST_CANDIDATES = 1024

LowestModes = Callable[[int], tuple[Array, Array]]
"""The lowest modes by count: circular frequencies (m,) and shapes (f, m); fewer when there are no more."""


def lowest_by_count(
    lowest: LowestModes, asked: int | None, available: int, field: str
) -> tuple[Array, Array, dict[str, Any]]:
    """As many modes as asked for; `DEFAULT_MODES`, or all there are, when not asked; a few more where that would part
    modes of equal frequency, which what is told of the selection says.

    Raises
    ------
    FEImportError
        MODE_COUNT when there are fewer.
    """
    wanted = DEFAULT_MODES if asked is None else asked
    omega, modes = lowest(min(wanted + 1, available))
    if asked is not None and len(omega) < asked:
        raise FEImportError(
            Cause.MODE_COUNT,
            f"the model has fewer {field.rpartition('.')[2].replace('_', '-').replace('-modes', ' modes')}",
            where=field,
            value=asked,
            limit=len(omega),
            remedy="ask for fewer, refine the mesh, or give the mass matrix rotary inertia",
        )
    if whole_count(omega, wanted) != wanted:
        omega, modes = lowest(min(wanted + LONGEST + 1, available))
    kept = whole_count(omega, min(wanted, len(omega)))
    told = {}
    if asked is not None and kept != asked:
        told = {"whole": kept_whole(omega / (2 * np.pi), asked, kept, field.rpartition(": ")[2])}
    return omega[:kept], modes[:, :kept], told


def below_frequency(
    lowest: LowestModes, options: Reduction, available: int, where: str
) -> tuple[Array, Array, dict[str, Any]]:
    """All modes up to ``options.frequency_limit``.

    Raises
    ------
    FEImportError
        MODE_COUNT when more than `MOST_CANDIDATES` lie below.
    """
    limit = options.frequency_limit or 0.0
    for count in _counts(available):
        omega, modes = lowest(count)
        hertz = omega / (2 * np.pi)
        if len(omega) < count or count == available or hertz[-1] > limit:
            kept = hertz <= limit
            return omega[kept], modes[:, kept], {"rule": "frequency", "limit_hz": limit, "kept": int(kept.sum())}
    raise FEImportError(
        Cause.MODE_COUNT,
        f"more than {count} modes lie below the frequency limit, the last one found at {hertz[-1]:.6g} Hz",
        where=f"{where}: reduction.frequency_limit",
        value=limit,
        limit=count,
        remedy="lower the limit",
    )


def carrying_mass(
    lowest: LowestModes, shares: Callable[[Array], Array], options: Reduction, available: int, where: str
) -> tuple[Array, Array, dict[str, Any]]:
    """The lowest modes that carry ``options.effective_mass`` of the mass in every direction.

    Parameters
    ----------
    lowest : callable
    shares : callable
        Share (m, 6) that each mode carries of what all together do, per rigid-body direction; NaN without mass.
    options : Reduction
    available : int
    where : str

    Raises
    ------
    FEImportError
        MODE_COUNT when `MOST_CANDIDATES` modes carry less, with the share reached.
    """
    goal = DEFAULT_SHARE if options.effective_mass is None else options.effective_mass
    for count in _counts(available):
        omega, modes = lowest(count)
        reached = np.cumsum(shares(modes), axis=0)
        with_mass = ~np.isnan(reached).any(axis=0)
        enough = (reached[:, with_mass] >= goal).all(axis=1)
        complete = len(omega) < count or count == available
        if enough.any() or complete:
            kept = int(enough.argmax()) + 1 if enough.any() else len(omega)
            total = reached[kept - 1] if kept else np.full(6, np.nan)
            note = {
                "rule": "effective-mass",
                "goal": goal,
                "kept": kept,
                "reached": [None if np.isnan(x) else round(float(x), 6) for x in total],
            }
            return omega[:kept], modes[:, :kept], note
    worst = int(np.nanargmin(reached[-1]))
    raise FEImportError(
        Cause.MODE_COUNT,
        f"{count} fixed-interface modes carry {reached[-1, worst]:.4f} of the mass {_DIRECTIONS[worst]}",
        where=f"{where}: reduction.effective_mass",
        value=goal,
        limit=count,
        remedy="ask for a smaller share, or choose modes by count or frequency",
    )


_DIRECTIONS = ("along x", "along y", "along z", "turning about x", "turning about y", "turning about z")


def _counts(available: int) -> list[int]:
    """16, 32 ... up to all there are, or to the maximum."""
    most = min(available, MOST_CANDIDATES)
    counts = [FIRST_CANDIDATES << k for k in range(16) if FIRST_CANDIDATES << k < most]
    return [*counts, most]
