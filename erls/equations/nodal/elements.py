"""The contract of nodal elements.

Rules for adding an element:

1. One file with one class that holds all elements of its kind as arrays; `erls.equations.nodal.assembly` adds them up.
2. Forces, velocities and increments are twists and wrenches in the axes of each node, in the order of ``nodes``.
3. Forces depend on relative poses of nodes only, gravity aside: rigid motions leave them at rounding level.
4. ``derivatives`` are exact for internal forces and loads, and for gyroscopic forces of rigid bodies; a row in the
   table of ``tests/erls/test_nodal_elements.py`` holds them against differences. Inertia that changes with deformation
   may be left out of them: that costs iterations, not accuracy.
5. What an element must know beside the poses, such as how many times it was wound up, lies in its memory: part of the
   configuration, made anew by ``remember`` and never changed in place.
"""

from __future__ import annotations

from typing import Any, Protocol

from erls.equations.nodal.scatter import IntArray
from erls.maths.so3 import Array


class Elements(Protocol):
    """Elements of one kind: e of them, with k nodes each."""

    @property
    def nodes(self) -> IntArray:
        """(e, k) node numbers."""

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Times at which forces jump."""

    def remember(self, poses: Array, before: Any) -> Any:
        """Memory at node poses (e, k, 4, 4), next to those of ``before`` (None at the start)."""

    def mass(self, poses: Array, memory: Any) -> Array:
        """(e, 6k, 6k) at node poses (e, k, 4, 4)."""

    def forces(self, t: float, poses: Array, memory: Any, v: Array, a: Array) -> Array:
        """(e, 6k) inertia and internal forces less loads, at velocities and accelerations (e, 6k)."""

    def derivatives(
        self, t: float, poses: Array, memory: Any, v: Array, a: Array, material: bool = False
    ) -> tuple[Array, Array]:
        """(e, 6k, 6k) twice: derivatives of `forces` by increments of the poses and by velocities.

        With ``material``, internal forces count as if they did not turn with deformation.
        """

    def energy(self, t: float, poses: Array, memory: Any, v: Array) -> tuple[float, float]:
        """Kinetic and potential energy [J]; loads that have no potential count nothing."""
