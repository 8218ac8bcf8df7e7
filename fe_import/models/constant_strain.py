"""What beam elements of constant strain leave out of bending: the change of the moment along an element.

Between two nodes they bend with one curvature, whereas the moment changes by V h. Their flexibility lacks h² / (12 E I)
for a shear force V, what R. H. MacNeal's residual bending flexibility adds to elements integrated at one point
(Computers & Structures 8 (1978) 175-183): of their strain energy ½ Σ V² h³ / (12 E I).
"""

from __future__ import annotations

import numpy as np

from fe_import.description.records import LinkDescription
from fe_import.elements.frame import element_stiffness
from fe_import.modal.model import ModalModel
from fe_import.model import Array
from fe_import.models.frame_parts import frame_parts


def lacking_energy(link: LinkDescription, modal: ModalModel, where: str, elements: int | None = None) -> Array:
    """(n, n) matrix of twice the energy that is lacking, over the elastic modes of a link made of beams [1/s²].

    Parameters
    ----------
    link : LinkDescription
        With a table ``frame``.
    modal : ModalModel
        Its reduction.
    where : str
        Name of the file, for messages.
    elements : int, optional
        Of each member, instead of its own number.

    Raises
    ------
    FEImportError
        As `fe_import.models.frame_parts.frame_parts`.
    """
    assert link.frame is not None
    parts = frame_parts(link, link.frame, where)
    shear, count = link.frame.theory == "timoshenko", modal.elastic_modes
    shapes = np.zeros((len(modal.nodes), 6, count))
    shapes[:, :3] = modal.translation_shapes[..., 6:]
    shapes[modal.rotation_nodes, 3:] = modal.rotation_shapes[..., 6:]
    result = np.zeros((count, count))
    for own in parts.mesh.members:
        coarser = 1.0 if elements is None else len(own) / elements
        for element in (parts.mesh.elements[k] for k in own):
            stiffness = np.sum(list(element_stiffness(element, shear).values()), axis=0)
            ends = np.kron(np.eye(4), element.axes) @ shapes[list(element.nodes)].reshape(12, count)
            forces = (stiffness @ ends)[1:3]
            inertia = np.array([element.section.inertia_z, element.section.inertia_y])
            share = element.length * (coarser * element.length) ** 2 / (12 * element.youngs_modulus * inertia)
            result += forces.T @ (share[:, None] * forces)
    return result
