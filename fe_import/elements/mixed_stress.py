"""Stress of a link of several kinds of elements: the sites of one, then those of the next."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fe_import.elements.shell_stress import ShellStress
from fe_import.elements.solid_stress import SolidStress
from fe_import.model import Array, IntArray


@dataclass(frozen=True)
class MixedStress:
    """A `fe_import.model.StressSource` of solids and shells."""

    parts: tuple[SolidStress, ShellStress]
    quantity: str = "stress"

    @property
    def site_nodes(self) -> IntArray:
        """(s,) the node of each site."""
        return np.concatenate([part.site_nodes for part in self.parts])

    @cached_property
    def sets(self) -> Mapping[str, IntArray]:
        """Sites by name, of both."""
        found: dict[str, IntArray] = {}
        solid, shell = self.parts
        for sets, start in ((solid.sets, 0), (shell.sets, len(solid.site_nodes))):
            for name, own in sets.items():
                found[name] = np.concatenate([found.get(name, np.zeros(0, dtype=np.int64)), start + own])
        return found

    def site_elements(self, sites: IntArray) -> IntArray:
        """(p,) -1: a nodal stress belongs to no element."""
        return np.full(len(sites), -1, dtype=np.int64)

    def site_axes(self, sites: IntArray) -> Array:
        """(p, 3, 3) axes of the mesh frame."""
        return np.tile(np.eye(3), (len(sites), 1, 1))

    def evaluate(self, fields: Array, dof_map: IntArray, sites: IntArray) -> Array:
        """(p, 6, m) components at the sites of displacement fields (d, m)."""
        start = len(self.parts[0].site_nodes)
        result = np.empty((len(sites), 6, fields.shape[1]))
        (solid, shell), inside = self.parts, sites < start
        result[inside] = solid.evaluate(fields, dof_map, sites[inside])
        result[~inside] = shell.evaluate(fields, dof_map, sites[~inside] - start)
        return result

    def converted(self, length: float, stress: float) -> MixedStress:
        """In other units; see `fe_import.model.StressSource`."""
        solid, shell = self.parts
        return MixedStress((solid.converted(length, stress), shell.converted(length, stress)))
