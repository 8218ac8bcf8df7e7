"""Modes of equal frequency, which are kept together.

Such modes (two of bending of a square or round section) are any pair of directions of one plane: which of them comes
first is decided by rounding, or by the sixth digit of a section, and half of a pair makes a symmetric link asymmetric.
"""

from __future__ import annotations

import numpy as np

from fe_import.model import Array

EQUAL = 1e-4  # relative difference of neighbours that count as equal; legs of one length part theirs by 5e-4
KEPT_WHOLE = "kept whole"  # what the provenance of a modal file calls it
LONGEST = 6  # neighbours looked at; where a spectrum is as dense as that all along, the widest gap among them serves


def whole_count(frequencies: Array, wanted: int) -> int:
    """The number of lowest modes, ``wanted`` or a few more, that parts no modes of equal frequency.

    Parameters
    ----------
    frequencies : (m,) array
        Rising; m >= ``wanted``.
    wanted : int
    """
    gaps = np.diff(frequencies) / np.maximum(frequencies[1:], np.finfo(float).tiny)
    if wanted < 1 or wanted >= len(frequencies) or gaps[wanted - 1] > EQUAL:
        return wanted
    ahead = gaps[wanted : wanted + LONGEST]
    wide = np.flatnonzero(ahead > EQUAL)
    if len(wide):
        return wanted + 1 + int(wide[0])
    if wanted + LONGEST >= len(gaps):
        return len(frequencies)
    return wanted + 1 + int(ahead.argmax())


def kept_whole(frequencies_hz: Array, wanted: int, kept: int, field: str) -> str:
    """What is told where a count is changed."""
    last = frequencies_hz[wanted - 1]
    return f"{field} = {wanted} would part modes of equal frequency ({last:.6g} Hz): {kept} are kept"
