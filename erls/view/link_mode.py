"""What a mode of a link looks like: the link beside where it rests."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from erls.maths.so3 import Array
from erls.run.link_mode import LinkMode
from erls.view.figure import DEFLECTION, Figure, Part, PartMesh, Pose, Shade
from erls.view.shapes import drawn_link, link_outline
from fe_import.modal.model import ModalModel


@dataclass(frozen=True)
class LinkModeFigure(Figure):
    """A mode."""

    run: LinkMode
    shade: Shade = DEFLECTION
    part = "link"

    @property
    def gravity(self) -> Array:
        """(3,) none."""
        return np.zeros(3)

    @property
    def size(self) -> float:
        """Of the link [m]."""
        return float(np.ptp(self.run.model.nodes, axis=0).max())

    def fixed(self) -> Array:
        """(0, 3) the link is free."""
        return np.zeros((0, 3))

    def ground(self, towards: Array, unit: float) -> list[Any]:
        """It stands on nothing."""
        return []

    def poses(self, times: Sequence[float] | Array) -> list[LinkModePose]:
        """The link at each phase."""
        phases = np.asarray(times, dtype=float)
        moved = self.run.displacements(phases)
        return [LinkModePose(t, self.run.model, u) for t, u in zip(phases.tolist(), moved, strict=True)]


@dataclass(frozen=True)
class LinkModePose(Pose):
    """The link at a phase, displaced by (n, 3)."""

    time: float
    model: ModalModel
    moved: Array

    def points(self, magnification: float) -> list[Array]:
        """(3,) places of the interfaces."""
        (places,) = self.nodes(magnification)
        return [places[interface.node] for interface in self.model.interface_nodes]

    def nodes(self, magnification: float) -> list[Array]:
        """(n, 3) of the link."""
        return [self.model.nodes + magnification * self.moved]

    def deflections(self) -> list[Array]:
        """(n,) [m]"""
        return [np.linalg.norm(self.moved, axis=1)]

    def anchor(self) -> Array:
        """(3,) its first node."""
        return np.asarray(self.nodes(1.0)[0][0])

    def parts(self, magnification: float, unit: float) -> list[Part]:
        """The displaced link."""
        model, (places,) = self.model, self.nodes(magnification)
        root, cells = model.interface_nodes[0].node, (model.triangles, model.lines)
        surface = drawn_link(model, root, cells, places, self.values()[0], unit)
        return [Part(surface, bool(len(model.triangles)))]

    def joints(self, magnification: float, unit: float, moving: bool) -> Any:
        """It has none."""
        return None

    def outline(self) -> list[Any]:
        """The link at rest."""
        return link_outline(self.model, (self.model.triangles, self.model.lines), self.model.nodes)

    def meshes(self, magnification: float) -> list[PartMesh]:
        """The link, in the order of its nodes."""
        cells = [("line", self.model.lines), ("triangle", self.model.triangles)]
        shown = [(kind, found) for kind, found in cells if len(found)]
        shown = shown or [("vertex", np.arange(len(self.moved))[:, None])]
        return [PartMesh(self.model.name, self.nodes(magnification)[0], shown, self.moved)]
