"""Springs and dampers along a line; forces are in `erls.equations.nodal.spring_forces`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from erls.equations.nodal.scatter import IntArray
from erls.maths.so3 import Array


@dataclass(frozen=True)
class Spring:
    """A spring with a damper.

    Attributes
    ----------
    nodes : tuple of int
        The second node alone when the first point is fixed to the ground; first and second otherwise.
    first, second : (3,) array
        The points in the frames of their nodes, in the world for the ground [m].
    stiffness, damping : float
        [N/m], [N s/m]
    length : float
        Without force [m].
    """

    nodes: tuple[int, ...]
    first: Array
    second: Array
    stiffness: float
    damping: float
    length: float


class Springs:
    """All springs of a system as arrays, for `erls.equations.nodal.spring_forces`."""

    breakpoints: tuple[float, ...] = ()

    def __init__(self, springs: Sequence[Spring]) -> None:
        self.nodes = with_ground([s.nodes for s in springs])
        laws = [[*s.first, *s.second, s.stiffness, s.damping, s.length] for s in springs]
        self.laws = np.array(laws, dtype=float).reshape(-1, 9)


def with_ground(nodes: Sequence[tuple[int, ...]]) -> IntArray:
    """(e, 2) first and second nodes, the first −1 where there is one node alone."""
    return np.array([(-1, *n)[-2:] for n in nodes], dtype=np.int64).reshape(-1, 2)
