"""The contract of nodal elements.

Rules for adding a kind of element:

1. A file with its record and one class that holds all elements of the kind as arrays: ``nodes`` (e, 1) or (e, 2), −1
   for the ground, and ``breakpoints``. Fields for the arrays in `erls.equations.nodal.contract.Model`; lines that fill
   them in `erls.equations.nodal.model`.
2. A file of functions on those records, kernels that add forces, derivatives and energy of all elements of the kind:
   `erls.equations.nodal.sums`, `blocks` and `outputs` call them by address (`erls.equations.nodal.contract.Layout`), so
   that nothing of them is compiled for a system without such elements. They serve real and complex numbers alike.
3. Forces, velocities and increments are twists and wrenches in the axes of each node.
4. Forces depend on relative poses of nodes only, gravity aside: rigid motions leave them at rounding level.
5. Derivatives are exact for internal forces and loads, and for gyroscopic forces of rigid bodies; a row in the tables
   of ``tests/erls/test_nodal_elements.py`` holds them against differences and complex steps. Inertia that changes with
   deformation may be left out of them: that costs iterations, not accuracy.
6. What an element must know beside the poses, such as how many times it was wound up, is part of `State`, made anew by
   ``remember`` and never changed in place.
"""

from __future__ import annotations

from typing import Protocol

from erls.equations.nodal.scatter import IntArray


class Elements(Protocol):
    """Elements of one kind: e of them."""

    @property
    def nodes(self) -> IntArray:
        """(e, 1) or (e, 2) node numbers, −1 for the ground."""

    @property
    def breakpoints(self) -> tuple[float, ...]:
        """Times at which forces jump."""
