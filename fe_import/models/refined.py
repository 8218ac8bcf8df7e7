"""A frame on a finer mesh, and what fields of the coarse one are on it.

Displacements of a beam element are exact for loads at its nodes, so that a field of the coarse mesh is the one of the
fine mesh that inner nodes take which bear no load; with consistent masses the coarse matrices are those of the fine
mesh over these fields.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fe_import.description.link import LinkFile
from fe_import.elements.frame import FrameElement, assemble_frame, thermal_load
from fe_import.model import Array, FEModel
from fe_import.models.frame import frame_mesh, frame_model
from fe_import.models.model import add_masses, to_si
from fe_import.solver.sparse import factorize


def refined_frame(link: LinkFile, parts: int) -> FEModel:
    """Model of a link made of beams, each element divided; nodes of the coarse mesh come first and keep their numbers.

    Parameters
    ----------
    link : LinkFile
        With a table ``frame``.
    parts : int
        Elements in place of each one.

    Raises
    ------
    FEImportError
        As `fe_import.models.model.build_model`.
    """
    description, where = link.description, str(link.path)
    frame = description.frame
    assert frame is not None
    mesh = frame_mesh(description, frame, where)
    nodes, elements = _divided(mesh.nodes, mesh.elements, parts)
    mass, stiffness, _ = assemble_frame(
        len(nodes),
        elements,
        shear=frame.theory == "timoshenko",
        mass=frame.mass,
        rotary_inertia=frame.rotary_inertia,
    )
    dofs, change = np.arange(6 * len(nodes), dtype=np.int64), description.temperature_change
    model = replace(
        frame_model(description, frame, where),
        nodes=nodes,
        dof_map=dofs.reshape(-1, 6),
        mass=mass,
        stiffness=stiffness,
        independent=dofs,
        lines=np.array([e.nodes for e in elements], dtype=np.int64),
        stiffness_parts={},
        stress=None,
        beams=None,
        thermal=None if change is None else thermal_load(len(nodes), elements, change),
    )
    return to_si(add_masses(model, description.masses, where), description, where)


def _divided(nodes: Array, elements: Sequence[FrameElement], parts: int) -> tuple[Array, list[FrameElement]]:
    """Nodes (n, 3), new ones last, and elements of equal length in place of each one."""
    added: list[Array] = []
    found: list[FrameElement] = []
    for element in elements:
        first, last = element.nodes
        inner = [len(nodes) + len(added) + k for k in range(parts - 1)]
        added += [nodes[first] + (nodes[last] - nodes[first]) * (k / parts) for k in range(1, parts)]
        chain = [first, *inner, last]
        found += [
            replace(element, nodes=(chain[k], chain[k + 1]), length=element.length / parts) for k in range(parts)
        ]
    return np.vstack([nodes, *added]), found


def on_refined(model: FEModel, fields: Array) -> Array:
    """(d, k) fields on a refined frame, from those (c, k) at the nodes of the coarse mesh."""
    count, size = len(fields), model.stiffness.shape[0]
    if count == size:
        return fields
    inner = np.arange(count, size)
    rows = model.stiffness[inner]
    solve = factorize(rows[:, inner].tocsc(), "stiffness of the nodes within elements", model.dof_positions()[inner])
    return np.vstack([fields, -solve(rows[:, :count] @ fields)])
