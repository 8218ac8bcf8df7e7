"""The shells of a link as data, for formulations that build elements of their own of them."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from fe_import.model import Array, IntArray


@dataclass(frozen=True)
class LinkShells:
    """Shells between the nodes of a link's model, whose numbers they use.

    Attributes
    ----------
    cells : (e, 4) int array
        Corners; the last one of a triangle stands twice.
    make : (e,) int array
        What each is made of: a row of the next three.
    stiffness : (k, 8, 8) array
        Of the thickness, see `fe_import.elements.laminates.Laminate`, in axes whose first comes nearest to a direction.
    moments : (k, 3) array
        ∫ρ dz, ∫ρ z dz, ∫ρ z² dz [kg/m², kg/m, kg].
    directions : (k, 3) array
        These directions; zeros where turning about the normal changes nothing.
    drilling : float
        Stiffness against drilling, in shares of the membrane's shear stiffness.
    masses : (m, 13) array
        Rigid bodies on nodes: mass, centre of mass from the node (3,), inertia about that (3, 3), in mesh axes.
    mass_nodes : (m,) int array
    surfaces : (k, 3, 5, 8) array
        Stress at bottom, middle and top by the strains of the section, see `Laminate.surfaces`; (0, ...) unknown.
    others : tuple of str
        What else the mesh file attaches, by its keywords.
    """

    cells: IntArray
    make: IntArray
    stiffness: Array
    moments: Array
    directions: Array
    drilling: float
    masses: Array
    mass_nodes: IntArray
    surfaces: Array = field(default_factory=lambda: np.zeros((0, 3, 5, 8)))
    others: tuple[str, ...] = ()

    @property
    def nodes(self) -> IntArray:
        """Those of shells, rising."""
        return np.unique(self.cells)


def four_cornered(cells: IntArray) -> IntArray:
    """(e, 4) of triangles (e, 3) and quadrangles (e, 4)."""
    return cells if cells.shape[1] == 4 else cells[:, [0, 1, 2, 2]]
