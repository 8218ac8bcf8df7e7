"""A frame link as its parts in SI units: elements and point masses, for programs with elements of their own."""

from __future__ import annotations

from dataclasses import dataclass, replace

import msgspec

from fe_import.description.records import Frame, LinkDescription
from fe_import.elements.frame import FrameElement
from fe_import.elements.sections import SectionConstants
from fe_import.model import Array
from fe_import.models.frame import FrameMesh, frame_mesh, node_number
from fe_import.models.inertia import inertia_matrix
from fe_import.models.model import unit_factors


@dataclass(frozen=True)
class NodeMass:
    """Mass [kg] and inertia about the node (3, 3) [kg m²]."""

    node: int
    mass: float
    inertia: Array


@dataclass(frozen=True)
class FrameParts:
    """Mesh and point masses of a frame link; its table ``frame`` says how elements stretch, shear and weigh."""

    frame: Frame
    mesh: FrameMesh
    masses: tuple[NodeMass, ...]


def frame_parts(
    link: LinkDescription, frame: Frame, where: str, elements: int | None = None, times: int = 1
) -> FrameParts:
    """Parts of a frame link.

    Parameters
    ----------
    link : LinkDescription
    frame : Frame
        Its table ``frame``.
    where : str
        Name of the file, for messages.
    elements : int, optional
        Of each member, instead of its own number.
    times : int
        So many elements in place of each.

    Raises
    ------
    FEImportError
        A faulty member, section, node, mass or unit.
    """
    members = [msgspec.structs.replace(m, elements=times * (elements or m.elements)) for m in frame.members]
    frame = msgspec.structs.replace(frame, members=members)
    length, mass, time = unit_factors(link, where)
    mesh = frame_mesh(link, frame, where)
    names = {**{i.name: mesh.names[i.node] for i in link.interfaces if i.node in mesh.names}, **mesh.names}
    masses = []
    for k, point in enumerate(link.masses):
        place = f"{where}: masses[{k}]"
        inertia = inertia_matrix(point.inertia, f"{place}.inertia") * mass * length**2
        masses.append(NodeMass(node_number(names, point.node, f"{place}.node"), point.mass * mass, inertia))
    converted = [_converted(e, length, mass, time) for e in mesh.elements]
    return FrameParts(frame, replace(mesh, nodes=mesh.nodes * length, elements=converted), tuple(masses))


def _converted(e: FrameElement, length: float, mass: float, time: float) -> FrameElement:
    """The element in SI units."""
    s, stress = e.section, mass / (length * time**2)
    section = SectionConstants(
        s.area * length**2, s.inertia_y * length**4, s.inertia_z * length**4, s.torsion_constant * length**4,
        s.shear_factor_y, s.shear_factor_z,
    )  # fmt: skip
    return replace(
        e,
        length=e.length * length,
        section=section,
        youngs_modulus=e.youngs_modulus * stress,
        shear_modulus=e.shear_modulus * stress,
        density=e.density * mass / length**3,
    )
