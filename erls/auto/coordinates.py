"""Where the coordinates of a mechanism without some modes stand among those of the whole one."""

from __future__ import annotations

import numpy as np

from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.effects import FIRST, SECOND
from fe_import.model import IntArray


def kept_places(whole: Mechanism, less: Mechanism, size: int) -> IntArray:
    """Places of the coordinates that both have: joints first, then the elastic modes link by link.

    Parameters
    ----------
    whole, less : Mechanism
        ``less`` with some links rigid, or with all following statically.
    size : int
        Number of coordinates of ``whole``.
    """
    counts = [link.elastic_modes for link in whole.links]
    at = size - sum(counts)
    if less.bandwidth != whole.bandwidth:
        return np.arange(at)
    if counts == [link.elastic_modes for link in less.links]:
        return np.arange(size)
    kept = [np.arange(at)]
    for count, link in zip(counts, less.links, strict=True):
        if link.elastic_modes:
            kept.append(np.arange(at, at + count))
        at += count
    return np.concatenate(kept)


def same_start(whole: Mechanism, less: Mechanism) -> bool:
    """Whether both start from the same state: inertia does not act at rest."""
    modes = [[link.elastic_modes for link in mechanism.links] for mechanism in (whole, less)]
    same = modes[0] == modes[1] and whole.bandwidth == less.bandwidth
    return same and whole.effects - less.effects <= FIRST | SECOND


def embedded(values: Array, places: IntArray, size: int) -> Array:
    """(..., size) values at their places, zeros elsewhere."""
    result = np.zeros((*values.shape[:-1], size))
    result[..., places] = values
    return result
