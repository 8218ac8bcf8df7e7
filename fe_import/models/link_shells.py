"""From the description of a link that is nothing but shells to these as data."""

from __future__ import annotations

import numpy as np

from fe_import.description.link import LinkFile
from fe_import.elements.attachments import AttachedMass
from fe_import.elements.link_shells import LinkShells, four_cornered
from fe_import.errors import Cause, FEImportError
from fe_import.models.meshed import mesh_of
from fe_import.models.shell import shell_parts


def link_shells(link: LinkFile) -> LinkShells:
    """Shells of a link, over the nodes of its model.

    Raises
    ------
    FEImportError
        As of `fe_import.models.meshed.meshed_model`; ``BAD_FIELD``: a link with solid elements, or without shells.
    """
    description, where = link.description, str(link.path)
    shell = description.shell
    if shell is None or description.solid is not None:
        message, remedy = "this link is not one of shells alone", "give [shell], and neither [solid] nor [frame]"
        raise FEImportError(Cause.BAD_FIELD, message, where=where, remedy=remedy)
    mesh = mesh_of(link)
    parts = shell_parts(description, shell, mesh, where)
    cells, make = np.zeros((mesh.shell_count, 4), dtype=np.int64), np.zeros(mesh.shell_count, dtype=np.int64)
    stiffness, moments, directions, surfaces = [], [], [], []
    for k, part in enumerate(parts):
        cells[part.numbers], make[part.numbers] = four_cornered(part.block.nodes), k
        stiffness.append(part.block.stiffness[0])
        moments.append(part.block.moments[0])
        surfaces.append(part.laminate.surfaces())
        directions.append(np.zeros(3) if part.block.reference is None else part.block.reference[0])
    masses = [item for item in mesh.attachments if isinstance(item, AttachedMass)]
    others = {item.keyword: None for item in mesh.attachments if not isinstance(item, AttachedMass)}
    return LinkShells(
        cells,
        make,
        np.array(stiffness),
        np.array(moments),
        np.array(directions),
        shell.drilling,
        np.array([[m.mass, *m.offset, *np.ravel(m.inertia)] for m in masses]).reshape(-1, 13),
        np.array([m.node for m in masses], dtype=np.int64),
        np.array(surfaces),
        tuple(others),
    )
