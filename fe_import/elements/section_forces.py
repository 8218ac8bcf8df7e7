"""Section forces of frame elements as a linear map of the nodal displacements.

At both ends of an element: normal force N, shear forces V_y, V_z, torsion T, bending moments M_y, M_z in the
element's local axes. They are what the part at larger local x does to the part at smaller x: N > 0 is tension, and
at a cantilever's root an end force P along y gives V_y = P, M_z = P L.

They follow from the element's stiffness, as the finite-element programs report them. Between its nodes an element
carries its own inertia and weight, which the stiffness leaves out: the forces jump by that from one element to the
next, and by half of it at the last nodes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fe_import.elements.frame import FrameElement, element_stiffness, stacked
from fe_import.model import Array, IntArray


@dataclass(frozen=True)
class FrameSections:
    """The elements of a frame, for their section forces; a `fe_import.model.StressSource`.

    Site 2 e is the first end of element e, site 2 e + 1 its second.

    Attributes
    ----------
    site_nodes : (2 e,) int array
    sets : dict
        Sites of each member, named ``FROM-TO``.
    axes : (e, 3, 3) array
        Rows are the local axes in the mesh frame.
    stiffness : (e, 12, 12) array
        In local axes.
    """

    site_nodes: IntArray
    sets: Mapping[str, IntArray]
    axes: Array
    stiffness: Array
    quantity: str = "section forces"

    def site_elements(self, sites: IntArray) -> IntArray:
        """(p,) element of each site."""
        return np.asarray(sites // 2)

    def site_axes(self, sites: IntArray) -> Array:
        """(p, 3, 3) local axes of the sections, rows."""
        return np.asarray(self.axes[sites // 2])

    def evaluate(self, fields: Array, dof_map: IntArray, sites: IntArray) -> Array:
        """(p, 6, m) N, V_y, V_z [N], T, M_y, M_z [N m] of displacement fields (d, m)."""
        element, second, count = sites // 2, sites % 2 == 1, fields.shape[1]
        ends = self.site_nodes.reshape(-1, 2)[element]
        moved = fields[dof_map[ends]].reshape(len(sites), 4, 3, count)  # u₁, φ₁, u₂, φ₂
        local = np.einsum("pij,pkjm->pkim", self.axes[element], moved).reshape(len(sites), 12, count)
        rows = np.where(second[:, None, None], self.stiffness[element, 6:], -self.stiffness[element, :6])
        return np.asarray(rows @ local)

    def converted(self, length: float, stress: float) -> FrameSections:
        """The same elements in other units; see `fe_import.model.StressSource`."""
        d = np.tile(np.repeat([1.0, length], 3), 2)
        return replace(self, stiffness=self.stiffness * np.outer(d, d) * stress * length)


def frame_sections(
    elements: Sequence[FrameElement], members: Sequence[tuple[str, range]], shear: bool
) -> FrameSections:
    """Section forces of elements.

    Parameters
    ----------
    elements : sequence of FrameElement
    members : sequence of (str, range)
        Name and elements of each member; members of one name make one set.
    shear : bool
        Timoshenko (True) or Euler-Bernoulli.
    """
    sets: dict[str, list[int]] = {}
    for name, inside in members:
        sets.setdefault(name, []).extend(range(2 * inside.start, 2 * inside.stop))
    return FrameSections(
        site_nodes=np.array([e.nodes for e in elements], dtype=np.int64).ravel(),
        sets={name: np.array(sites, dtype=np.int64) for name, sites in sets.items()},
        axes=np.stack([e.axes for e in elements]),
        stiffness=np.asarray(sum(element_stiffness(stacked(elements), shear).values())),
    )
