"""One table of links for every reduction: frames, solids, point masses, equal frequencies, one to three interfaces."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse.linalg as spla
from link_files import SOLID, Array, boundary, frame_link, interface_shapes, solid_link, straight_link

from fe_import.description.link import LinkFile
from fe_import.modal.model import ModalModel
from fe_import.model import FEModel

HUB, HAND = {"name": "hub", "node": "root"}, {"name": "hand", "node": "tip"}
MASSES = [
    {"node": "elbow", "mass": 0.3, "inertia": [1e-4, 2e-4, 3e-4]},
    {"node": "hand", "mass": 0.2, "inertia": [[2e-3, 1e-4, 0.0], [1e-4, 1e-3, 0.0], [0.0, 0.0, 3e-3]]},
]


def _slender(folder: Path, **changes: Any) -> LinkFile:
    return straight_link(folder, 1.0, 10, sections={"s": {"width": 0.005, "height": 0.005}}, **changes)


LINKS: dict[str, Callable[..., LinkFile]] = {
    "frame": frame_link,
    "lumped": lambda folder, **c: frame_link(folder, frame={"mass": "lumped"}, **c),
    "point masses": lambda folder, **c: frame_link(folder, masses=MASSES, **c),
    "slender": _slender,
    "solid": solid_link,
    "averaged": lambda folder, **c: solid_link(
        folder, interfaces=[{**i, "coupling": "averaged"} for i in SOLID["interfaces"]], **c
    ),
    "one interface": lambda folder, **c: frame_link(folder, interfaces=[HUB], **c),
    "one face": lambda folder, **c: solid_link(folder, interfaces=SOLID["interfaces"][:1], **c),
    "three interfaces": lambda folder, **c: frame_link(
        folder, interfaces=[HUB, HAND, {"name": "middle", "node": "elbow"}], **c
    ),
}


def every_mode(method: str, model: FEModel) -> dict[str, Any]:
    """Options that keep every mode of a model."""
    dofs, clamped = len(model.independent), len(model.interface_dofs)
    if method == "craig-bampton":
        return {"method": method, "fixed_interface_modes": dofs - clamped}
    return {"method": method} if method in ("none", "guyan") else {"method": method, "free_modes": dofs - 6}


def held_flexibility(model: FEModel) -> Array:
    """Flexibility of all interfaces but the first, which is held, of the full model; (6 n - 6, 6 n - 6)."""
    _, stiffness = model.reduced_matrices()
    places = boundary(model)
    free = np.setdiff1d(np.arange(stiffness.shape[0]), places[:6])
    at = np.searchsorted(free, places[6:])
    unit = np.zeros((len(free), len(at)))
    unit[at, np.arange(len(at))] = 1.0
    return np.asarray(spla.spsolve(stiffness[free][:, free].tocsc(), unit).reshape(unit.shape)[at])


def modal_flexibility(modal: ModalModel) -> Array:
    """The same of a modal model: displacements of modal coordinates for which the first interface rests."""
    shapes = interface_shapes(modal)
    elastic = shapes[6:] - shapes[6:, :6] @ np.linalg.solve(shapes[:6, :6], shapes[:6])  # rigid motion follows
    compliance = elastic[:, 6:] / (2 * np.pi * modal.frequencies_hz[6:])
    return np.asarray(compliance @ compliance.T)


def relative(found: Array, expected: Array) -> float:
    """Largest departure of a flexibility, per the direct ones of its row and column."""
    size = np.sqrt(np.diag(expected))
    return float(np.abs((found - expected) / np.outer(size, size)).max())


def nodal_fields(model: FEModel, modal: ModalModel) -> Array:
    """(d, m) mode shapes over all nodal components."""
    shapes = np.zeros((model.mass.shape[0], modal.modes))
    shapes[model.dof_map[:, :3].ravel()] = modal.translation_shapes.reshape(-1, modal.modes)
    shapes[model.dof_map[modal.rotation_nodes, 3:].ravel()] = modal.rotation_shapes.reshape(-1, modal.modes)
    return shapes
