"""The finite-element model of one link, before reduction: data only.

Degrees of freedom ("dofs") are numbered over *all* nodal components first (``mass`` and ``stiffness`` live there);
``coupling`` maps the independent dofs to them where nodes follow an interface node (rigid coupling).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:  # a run on links that were reduced before has no use for it
    import scipy.sparse as sp

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]


@dataclass(frozen=True)
class InterfaceNode:
    """A node where a joint sits: it carries three displacements and three rotations.

    Attributes
    ----------
    name : str
    node : int
        Index of the node in ``FEModel.nodes``.
    position : (3,) array
        Position in the mesh frame [m].
    coupled_nodes : (n,) int array
        Nodes that the interface node moves or averages; only itself when it sits on a frame node.
    weights : (n,) array
        Weights of the coupled nodes, sum 1.
    coupling : str
        ``"node"`` (a frame node), ``"rigid"`` (RBE2) or ``"averaged"`` (RBE3).
    """

    name: str
    node: int
    position: Array
    coupled_nodes: IntArray
    weights: Array
    coupling: str


class StressSource(Protocol):
    """What knows the elements of a model: stresses or section forces at its sites, linear in the displacements.

    ``quantity`` is ``"stress"`` or ``"section forces"``; ``site_nodes`` (s,) the node of each site; ``sets`` the
    sites of each named set.
    """

    @property
    def quantity(self) -> str: ...

    @property
    def site_nodes(self) -> IntArray: ...

    @property
    def sets(self) -> Mapping[str, IntArray]: ...

    def site_elements(self, sites: IntArray) -> IntArray:
        """(p,) element of each site, -1 where it belongs to none."""

    def site_axes(self, sites: IntArray) -> Array:
        """(p, 3, 3) axes (rows) in which the six components are counted, in the mesh frame."""

    def evaluate(self, fields: Array, dof_map: IntArray, sites: IntArray) -> Array:
        """(p, 6, m) components at the sites of displacement fields (d, m)."""

    def converted(self, length: float, stress: float) -> StressSource:
        """The same in SI, from units of ``length`` metres and ``stress`` pascals."""


@dataclass(frozen=True)
class BeamLines:
    """Elements of a frame as lines with mass, for its second-order kinematics.

    Attributes
    ----------
    nodes : (e, 2) int array
    axes : (e, 3, 3) array
        Rows are the local axes in the mesh frame.
    lengths : (e,) array
        [m]
    shear : (e, 2) array
        Φ_y and Φ_z of `fe_import.elements.frame.shear_flexibility`.
    mass : (e,) array
        Per length [kg/m].
    rotary : (e, 3) array
        Rotary inertia per length about the local axes [kg m].
    lumped : bool
        Half of each element at either of its nodes.
    """

    nodes: IntArray
    axes: Array
    lengths: Array
    shear: Array
    mass: Array
    rotary: Array
    lumped: bool

    @property
    def is_tree(self) -> bool:
        """Whether there is one way from each node to each other (the lines are connected)."""
        return len(self.nodes) < len(np.unique(self.nodes))

    def converted(self, length: float, mass: float) -> BeamLines:
        """In SI, from units of ``length`` metres and ``mass`` kilograms."""
        return replace(
            self,
            lengths=self.lengths * length,
            mass=self.mass * (mass / length),
            rotary=self.rotary * (mass * length),
        )


@dataclass(frozen=True)
class ThermalLoad:
    """A uniform change of temperature, and what it does per kelvin.

    Attributes
    ----------
    change : float
        From the temperature of the stated shape without stress [K].
    force : (d,) array
        Nodal forces and moments that expand the free link, ∫ Bᵀ E A α dx; in balance [N/K, N m/K].
    restrained : (s, 6) array
        Components of ``FEModel.stress`` at its sites while the link is held in its shape, N = -E A α.
    """

    change: float
    force: Array
    restrained: Array


MOST_TRIANGLES = 20_000  # that a rigid link may be drawn with: run files and pictures hold them all


@dataclass(frozen=True)
class Surface:
    """What a rigid link is drawn as; without mass, and no node of the link.

    Attributes
    ----------
    points : (n, 3) array
        Corners in the mesh frame [m].
    triangles : (t, 3) int array
    """

    points: Array
    triangles: IntArray


@dataclass(frozen=True)
class FEModel:
    """Mass and stiffness matrices of a free link with what is needed to interpret their rows.

    Attributes
    ----------
    name : str
    nodes : (n, 3) array
        Undeformed positions in the mesh frame [m].
    dof_map : (n, 6) int array
        Row of each nodal component (ux, uy, uz, rx, ry, rz), -1 where the node lacks it. A node has all three
        displacements, and all three rotations or none.
    mass, stiffness : (d, d) sparse CSC
        Over all nodal components [kg, kg m, kg m²; N/m, N, N m], symmetric.
    interface_nodes : tuple of InterfaceNode
    coupling : (d, f) sparse CSC or None
        All nodal components = ``coupling`` @ independent dofs; None when all are independent.
    independent : (f,) int array
        Rows of the nodal components that are the independent dofs.
    node_names : dict
        Nodes that the user named.
    lines : (m, 2) int array
        Line segments for pictures (frames).
    triangles : (m, 3) int array
        Surface triangles for pictures (solids).
    stiffness_parts : dict of sparse CSC
        The stiffness split by kind of strain energy (frames), to name the modes; may be empty.
    kind : str
        ``"frame"``, ``"solid"`` (also with shells beside), ``"shell"`` or ``"matrices"``.
    source : str
        File that the model came from.
    stress : StressSource or None
        None for bare matrices, which have no elements.
    notes : dict of str
        What the provenance should say about the source.
    beams : BeamLines or None
        Elements of a frame, for its second-order kinematics.
    added_mass : (d, d) sparse CSC or None
        What ``mass`` holds of point masses.
    thermal : ThermalLoad or None
        Where a temperature change is given.
    left_out : dict of int
        What stands in the mesh file and is not part of the link, and how often.
    second_order_lack : str
        Why the elements of a solid do not tell its second-order displacements, where they do not.
    materials : dict
        Those that the mesh file brings, where they are used, in its units: Young's modulus, Poisson's ratio, density.
    """

    name: str
    nodes: Array
    dof_map: IntArray
    mass: sp.csc_array
    stiffness: sp.csc_array
    interface_nodes: tuple[InterfaceNode, ...]
    independent: IntArray
    coupling: sp.csc_array | None = None
    node_names: dict[str, int] = field(default_factory=dict)
    lines: IntArray = field(default_factory=lambda: np.zeros((0, 2), dtype=np.int64))
    triangles: IntArray = field(default_factory=lambda: np.zeros((0, 3), dtype=np.int64))
    stiffness_parts: dict[str, sp.csc_array] = field(default_factory=dict)
    kind: str = "frame"
    source: str = ""
    stress: StressSource | None = None
    notes: dict[str, str] = field(default_factory=dict)
    beams: BeamLines | None = None
    added_mass: sp.csc_array | None = None
    thermal: ThermalLoad | None = None
    left_out: dict[str, int] = field(default_factory=dict)
    second_order_lack: str = ""
    materials: dict[str, tuple[float, float, float]] = field(default_factory=dict)

    @property
    def interface_dofs(self) -> IntArray:
        """(6 n_interfaces,) rows of the interface displacements and rotations, among all nodal components."""
        return np.concatenate([self.dof_map[i.node] for i in self.interface_nodes]).astype(np.int64)

    def rigid_body_modes(self) -> Array:
        """(d, 6) displacement fields of unit translations and of unit rotations about the mesh origin.

        A rotation ω moves a node at x by ω × x and turns it by ω.
        """
        modes = np.zeros((self.mass.shape[0], 6))
        x, y, z = self.nodes.T
        zero = np.zeros_like(x)
        for axis in range(3):
            modes[self.dof_map[:, axis], axis] = 1.0
            turning = self.dof_map[:, 3 + axis]
            modes[turning[turning >= 0], 3 + axis] = 1.0
        for component, fields in enumerate(((zero, z, -y), (-z, zero, x), (y, -x, zero))):
            for axis in range(3):
                modes[self.dof_map[:, component], 3 + axis] = fields[axis]
        return modes

    def dof_positions(self) -> Array:
        """(f, 3) where each independent dof sits; the centre of the nodes for those of no node [m]."""
        positions = np.tile(self.nodes.mean(axis=0), (self.mass.shape[0], 1))
        for rows in self.dof_map.T:
            positions[rows[rows >= 0]] = self.nodes[rows >= 0]
        return positions[self.independent]

    def reduced_matrices(self) -> tuple[sp.csc_array, sp.csc_array]:
        """Mass and stiffness over the independent dofs, the coupling eliminated."""
        if self.coupling is None:
            return self.mass, self.stiffness
        return eliminated(self.mass, self.coupling), eliminated(self.stiffness, self.coupling)


def eliminated(matrix: sp.csc_array, coupling: sp.csc_array) -> sp.csc_array:
    """Cᵀ A C for symmetric A.

    Most columns of C are unit vectors of rows that no other column moves: entries between those are taken over as they
    are, only the others are products.
    """
    import scipy.sparse as sp

    columns = np.flatnonzero(np.diff(coupling.indptr) == 1)
    at = coupling.indptr[columns]
    rows = coupling.indices[at]
    alone = (coupling.data[at] == 1.0) & (np.bincount(coupling.indices)[rows] == 1)
    columns, rows = columns[alone], rows[alone]
    others = np.setdiff1d(np.arange(coupling.shape[1]), columns)
    if 4 * len(others) > len(columns) or (np.diff(rows) <= 0).any():
        return (coupling.T @ matrix @ coupling).tocsc()
    kind = matrix.indices.dtype
    place = np.full(matrix.shape[0], -1, dtype=kind)
    place[rows] = columns
    to = place[matrix.indices]
    kept = to >= 0
    for row in np.flatnonzero(place < 0):
        kept[matrix.indptr[row] : matrix.indptr[row + 1]] = False
    ends = np.zeros(len(kept) + 1, dtype=kind)
    np.cumsum(kept, out=ends[1:])
    starts = np.zeros(coupling.shape[1] + 1, dtype=kind)
    starts[1 + columns] = ends[matrix.indptr[rows + 1]] - ends[matrix.indptr[rows]]
    shape = (coupling.shape[1],) * 2
    same = sp.csc_array((matrix.data[kept], to[kept], np.cumsum(starts, dtype=kind)), shape=shape)
    if not len(others):
        return same
    products = sp.coo_array(coupling.T @ (matrix @ coupling[:, others]))
    row, column = products.coords[0].astype(kind), others[products.coords[1]].astype(kind)
    mirrored = ~np.isin(row, others)
    ends_of = np.concatenate([row, column[mirrored]]), np.concatenate([column, row[mirrored]])
    values = np.concatenate([products.data, products.data[mirrored]])
    return same + sp.csc_array((values, ends_of), shape=shape)


def magnitudes(matrix: sp.csc_array) -> sp.csc_array:
    """|A| entry by entry, which shares its pattern with A."""
    import scipy.sparse as sp

    return sp.csc_array((np.abs(matrix.data), matrix.indices, matrix.indptr), shape=matrix.shape)
