"""Stress at the nodes of shells, on three surfaces: bottom, middle and top of the thickness.

Strains at the points of the quadrature are extrapolated to the nodes of an element (its corners), turned there into
stress of the outermost layer, or of that in the middle, in mesh axes, and averaged over the elements that meet at a
node. Where shells meet at an angle, or of two makes, the average is over both. Shear across the thickness is that of a
parabola: 3/2 of its mean in the middle, 0 at bottom and top; of layers, their mean.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fe_import.elements.elasticity import PAIRS
from fe_import.elements.laminates import Laminate
from fe_import.elements.shell import ShellBlock, element_matrices
from fe_import.elements.shell_strains import strains
from fe_import.model import Array, IntArray

SURFACES = ("bottom", "middle", "top")


@dataclass(frozen=True)
class ShellPart:
    """Shells of one type and one make.

    Attributes
    ----------
    block : ShellBlock
    numbers : (e,) int array
        Of all shells of the mesh.
    laminate : Laminate
    drilling : float
    """

    block: ShellBlock
    numbers: IntArray
    laminate: Laminate
    drilling: float

    def some(self, rows: IntArray | slice) -> ShellPart:
        """A part of them."""
        block = self.block
        reference = None if block.reference is None else block.reference[rows]
        fewer = ShellBlock(block.element, block.nodes[rows], block.stiffness[rows], block.moments[rows], reference)
        return ShellPart(fewer, self.numbers[rows], self.laminate, self.drilling)


@dataclass(frozen=True)
class ShellStress:
    """The shells of a link, for their stress; a `fe_import.model.StressSource`.

    Sites 3 k, 3 k + 1 and 3 k + 2 are bottom, middle and top of the k-th node of a shell.

    Attributes
    ----------
    positions : (n, 3) array
        Of all nodes.
    parts : tuple of ShellPart
    nodes : (s,) int array
        Those of shells, rising.
    sets : dict
        Sites of the node sets and of the sets of shells.
    scale : float
        Pa per unit of stress.
    length : float
        Metres per unit of length.
    """

    positions: Array
    parts: tuple[ShellPart, ...]
    nodes: IntArray
    sets: Mapping[str, IntArray]
    scale: float = 1.0
    length: float = 1.0
    quantity: str = "stress"

    @property
    def site_nodes(self) -> IntArray:
        """(3 s,) the node of each site."""
        return np.repeat(self.nodes, len(SURFACES))

    def site_elements(self, sites: IntArray) -> IntArray:
        """(p,) -1: a nodal stress belongs to no element."""
        return np.full(len(sites), -1, dtype=np.int64)

    def site_axes(self, sites: IntArray) -> Array:
        """(p, 3, 3) axes of the mesh frame."""
        return np.tile(np.eye(3), (len(sites), 1, 1))

    @property
    def heights(self) -> Array:
        """(n, 2) of bottom and top above each node [m]; the mean of shells of several makes."""
        total, count = np.zeros((len(self.positions), 2)), np.zeros((len(self.positions), 1))
        for part in self.parts:
            own = part.laminate.heights
            np.add.at(total, part.block.nodes, np.array([own[0], own[-1]]))
            np.add.at(count, part.block.nodes, 1.0)
        return np.asarray(self.length * total / np.maximum(count, 1.0))

    def evaluate(self, fields: Array, dof_map: IntArray, sites: IntArray) -> Array:
        """(p, 6, m) stress xx, yy, zz, xy, yz, zx [Pa] of displacement fields (d, m), mesh axes."""
        place = np.full(len(self.positions), -1, dtype=np.int64)
        wanted = np.unique(sites // len(SURFACES))
        place[self.nodes[wanted]] = np.arange(len(wanted))
        total, count = np.zeros((len(wanted), len(SURFACES), 6, fields.shape[1])), np.zeros(len(wanted))
        for part in self.parts:
            touching = np.flatnonzero((place[part.block.nodes] >= 0).any(axis=1))
            for rows in np.array_split(touching, max(1, len(touching) * fields.shape[1] // 200_000)):
                some = part.some(rows)
                at = place[some.block.nodes]
                nodal = self._nodal(some, fields, dof_map)
                np.add.at(total, at[at >= 0], nodal[at >= 0])
                np.add.at(count, at[at >= 0], 1.0)
        mean = total / count[:, None, None, None]
        return np.asarray(mean[np.searchsorted(wanted, sites // len(SURFACES)), sites % len(SURFACES)]) * self.scale

    def _nodal(self, part: ShellPart, fields: Array, dof_map: IntArray) -> Array:
        """(e, k, 3, 6, m) of elements at their corners, in the units of the mesh."""
        block, count = part.block, fields.shape[1]
        corners = self.positions[block.nodes]
        moved = nodal_motion(block, fields, dof_map, self.length)
        _, _, inner = element_matrices(block, corners, part.drilling)
        at = block.points(corners)
        whole = np.concatenate([moved, inner @ moved], axis=1)
        strain = np.einsum("eqin,enm->eqim", strains(at), whole, optimize=True)
        to_corners = extrapolation(block)
        strain = np.einsum("kq,eqim->ekim", to_corners, strain)
        frames = np.einsum("kq,eqic->ekic", to_corners, at.axes)
        frames /= np.linalg.norm(frames, axis=-1, keepdims=True)
        result = np.zeros((*strain.shape[:2], len(SURFACES), 6, count))
        for k, moduli in enumerate(part.laminate.surfaces()):
            plane, shear = moduli[:3] @ strain, moduli[3:] @ strain
            local = np.zeros((*strain.shape[:2], 3, 3, count))
            for row, (i, j) in enumerate(((0, 0), (1, 1), (0, 1))):
                local[:, :, i, j] = local[:, :, j, i] = plane[:, :, row]
            for i in range(2):
                local[:, :, i, 2] = local[:, :, 2, i] = shear[:, :, i]
            turned = np.einsum("ekia,ekijm,ekjb->ekabm", frames, local, frames, optimize=True)
            for row, (a, b) in enumerate(PAIRS):
                result[:, :, k, row] = turned[:, :, a, b]
        return result

    def converted(self, length: float, stress: float) -> ShellStress:
        """The same elements in other units; see `fe_import.model.StressSource`."""
        return replace(self, scale=self.scale * stress, length=self.length * length)


def nodal_motion(block: ShellBlock, fields: Array, dof_map: IntArray, length: float) -> Array:
    """(e, 6 k, m) components of the nodes of elements, from fields in metres, in units of ``length`` metres."""
    moved = fields[dof_map[block.nodes]].reshape(len(block.nodes), block.nodes.shape[1], 6, -1)
    scaled = moved / np.repeat([length, 1.0], 3)[:, None]
    return np.asarray(scaled.reshape(len(block.nodes), 6 * block.nodes.shape[1], -1))


def extrapolation(block: ShellBlock) -> Array:
    """(k, q) from the points of the quadrature to the corners, by the polynomial through them."""
    shapes, _ = block.element.shapes(block.element.points)
    return np.asarray(np.linalg.inv(shapes))


def shell_stress(
    positions: Array, parts: Sequence[ShellPart], node_sets: Mapping[str, IntArray], sets: Mapping[str, IntArray]
) -> ShellStress:
    """Of the nodes of all parts; ``sets`` of shells by their numbers."""
    nodes = np.unique(np.concatenate([part.block.nodes.ravel() for part in parts]))

    def sites(own: IntArray) -> IntArray:
        rows = np.searchsorted(nodes, np.intersect1d(own, nodes))
        return np.asarray((len(SURFACES) * rows[:, None] + np.arange(len(SURFACES))).ravel(), dtype=np.int64)

    named = {name: sites(own) for name, own in node_sets.items()}
    for name, numbers in sets.items():
        used = [part.block.nodes[np.isin(part.numbers, numbers)].ravel() for part in parts]
        named[name] = sites(np.unique(np.concatenate(used)))
    return ShellStress(positions, tuple(parts), nodes, {name: own for name, own in named.items() if len(own)})
