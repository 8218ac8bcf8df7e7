"""The contract of nodal elements.

Rules for adding an element:

1. One file with one class that holds all elements of its kind as arrays; `erls.nodal.assembly` adds them up.
2. Forces, velocities and increments are twists and wrenches in the axes of each node, in the order of ``nodes``.
3. Forces depend on relative poses of nodes only, gravity aside: rigid motions leave them at rounding level.
4. ``derivatives`` are exact; a row in the table of ``tests/erls/test_nodal_elements.py`` holds them against
   differences.
"""

from __future__ import annotations

from typing import Protocol

from erls.lie.so3 import Array
from erls.nodal.scatter import IntArray


class Elements(Protocol):
    """Elements of one kind: e of them, with k nodes each."""

    @property
    def nodes(self) -> IntArray:
        """(e, k) node numbers."""

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Times at which forces jump."""

    def mass(self, poses: Array) -> Array:
        """(e, 6k, 6k) at node poses (e, k, 4, 4)."""

    def forces(self, t: float, poses: Array, v: Array, a: Array) -> Array:
        """(e, 6k) inertia and internal forces less loads, at velocities and accelerations (e, 6k)."""

    def derivatives(self, t: float, poses: Array, v: Array, a: Array) -> tuple[Array, Array]:
        """(e, 6k, 6k) twice: derivatives of `forces` by increments of the poses and by velocities."""

    def energy(self, t: float, poses: Array, v: Array) -> tuple[float, float]:
        """Kinetic and potential energy [J]; loads that have no potential count nothing."""
