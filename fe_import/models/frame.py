"""From the description of a frame link to its finite-element model."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from fe_import.description.records import Frame, Interface, LinkDescription, Material, Member
from fe_import.elements.frame import FrameElement, assemble_frame, beam_lines, local_axes, thermal_load
from fe_import.elements.section_forces import frame_sections
from fe_import.elements.sections import section_constants
from fe_import.errors import Cause, FEImportError
from fe_import.files.toml import choose
from fe_import.model import Array, FEModel, IntArray, InterfaceNode

MOST_ELEMENTS = 100_000  # per member; a larger number is a slip


@dataclass(frozen=True)
class FrameMesh:
    """The nodes and elements that the members of a frame are divided into.

    Attributes
    ----------
    nodes : (n, 3) array
    names : dict of int
        Numbers of the nodes by name; every node has one.
    elements : list of FrameElement
        Member by member.
    members : list of range
        Elements of each member, from its start to its end.
    """

    nodes: Array
    names: dict[str, int]
    elements: list[FrameElement]
    members: list[range]


def frame_mesh(link: LinkDescription, frame: Frame, where: str) -> FrameMesh:
    """Divide the members of a frame.

    Parameters
    ----------
    link : LinkDescription
    frame : Frame
        Its table ``frame``.
    where : str
        Name of the file, for messages.

    Raises
    ------
    FEImportError
        A faulty member, section or node.
    """
    names = {name: k for k, name in enumerate(frame.nodes)}
    positions = [np.asarray(p, dtype=float) for p in frame.nodes.values()]
    elements: list[FrameElement] = []
    members: list[range] = []
    if not frame.members:
        raise FEImportError(
            Cause.BAD_FIELD, "a frame needs at least one member", where=f"{where}: frame.members", remedy="add one"
        )
    for k, member in enumerate(frame.members):
        place = f"{where}: frame.members[{k}]"
        chain = _subdivide(member, names, positions, place)
        members.append(range(len(elements), len(elements) + len(chain) - 1))
        elements += _elements(link, frame, member, chain, positions, where, place)
    _check_connected(np.array([e.nodes for e in elements]), names, where)
    return FrameMesh(np.stack(positions), names, elements, members)


def frame_model(link: LinkDescription, frame: Frame, where: str) -> FEModel:
    """Divide the members, assemble mass and stiffness, and put the interfaces on their nodes.

    Parameters
    ----------
    link : LinkDescription
    frame : Frame
        Its table ``frame``.
    where : str
        Name of the file, for messages.

    Raises
    ------
    FEImportError
        A faulty member, section, node or interface.
    """
    mesh = frame_mesh(link, frame, where)
    shear = frame.theory == "timoshenko"
    mass, stiffness, parts = assemble_frame(
        len(mesh.nodes),
        mesh.elements,
        shear=shear,
        mass=frame.mass,
        rotary_inertia=frame.rotary_inertia,
    )
    dof_map = np.arange(6 * len(mesh.nodes), dtype=np.int64).reshape(-1, 6)
    members = [(f"{m.start}-{m.end}", own) for m, own in zip(frame.members, mesh.members, strict=True)]
    return FEModel(
        name=link.name,
        nodes=mesh.nodes,
        dof_map=dof_map,
        mass=mass,
        stiffness=stiffness,
        interface_nodes=_frame_interfaces(link.interfaces, mesh.names, mesh.nodes, where),
        independent=np.arange(6 * len(mesh.nodes), dtype=np.int64),
        node_names=mesh.names,
        lines=np.array([e.nodes for e in mesh.elements], dtype=np.int64),
        stiffness_parts=parts,
        kind="frame",
        source=where,
        stress=frame_sections(mesh.elements, members, shear),
        beams=beam_lines(mesh.elements, shear, frame.mass, frame.rotary_inertia),
        thermal=None
        if link.temperature_change is None
        else thermal_load(len(mesh.nodes), mesh.elements, link.temperature_change),
    )


def _check_connected(lines: IntArray, names: dict[str, int], where: str) -> None:
    count = len(names)
    unused = np.setdiff1d(np.arange(count), lines)
    if len(unused):
        raise FEImportError(
            Cause.DISCONNECTED,
            "this node belongs to no member",
            where=f"{where}: frame.nodes.{list(names)[unused[0]]}",
            remedy="remove it or add a member",
        )
    graph = sp.coo_array((np.ones(len(lines)), lines.T), shape=(count, count))
    parts, part = connected_components(graph, directed=False)
    if parts > 1:
        apart = list(names)[int(np.argmax(part != part[0]))]
        raise FEImportError(
            Cause.DISCONNECTED,
            f"no members join node {apart!r} to node {next(iter(names))!r}",
            where=f"{where}: frame.members",
            value=f"{parts} parts",
            limit=1,
            remedy="let members share a node (equal positions are not enough), or make each part a link",
        )


def _subdivide(member: Member, names: dict[str, int], positions: list[Array], place: str) -> list[int]:
    """Node indices along a member; inner nodes are added to ``names`` and ``positions``."""
    if member.elements < 1:
        raise FEImportError(
            Cause.BAD_FIELD,
            "a member needs at least one element",
            where=f"{place}.elements",
            value=member.elements,
            remedy="give 1 or more",
        )
    if member.elements > MOST_ELEMENTS:
        raise FEImportError(
            Cause.BAD_FIELD,
            "too many elements",
            where=f"{place}.elements",
            value=member.elements,
            limit=MOST_ELEMENTS,
            remedy="beam elements are accurate: a few per member do",
        )
    first, last = (node_number(names, n, f"{place}.{f}") for n, f in ((member.start, "from"), (member.end, "to")))
    if np.linalg.norm(positions[last] - positions[first]) == 0:
        raise FEImportError(
            Cause.BAD_FIELD,
            "this member has no length",
            where=place,
            value=f"{member.start} to {member.end}",
            remedy="connect two different positions",
        )
    chain = [first]
    for k in range(1, member.elements):
        s = k / member.elements
        name = f"{member.start}-{member.end}/{k}"
        if name in names:
            raise FEImportError(
                Cause.BAD_FIELD,
                "two nodes of one name: inner nodes of a member are named FROM-TO/1 ... in order",
                where=place,
                value=name,
                remedy="rename the node, or divide members that run side by side by nodes of their own",
            )
        names[name] = len(positions)
        chain.append(len(positions))
        positions.append((1 - s) * positions[first] + s * positions[last])
    return [*chain, last]


def _elements(
    link: LinkDescription,
    frame: Frame,
    member: Member,
    chain: list[int],
    positions: list[Array],
    where: str,
    place: str,
) -> list[FrameElement]:
    choose(member.material, link.materials, f"{place}.material")
    choose(member.section, link.sections, f"{place}.section")
    material: Material = link.materials[member.material]
    places = np.stack([positions[node] for node in chain])
    along = (places[-1] - places[0]) / np.linalg.norm(places[-1] - places[0])
    reference = np.asarray(member.local_z or ((0, 1, 0) if abs(along[2]) > 0.999 else (0, 0, 1)), dtype=float)
    usable = np.isfinite(reference).all() and reference.any()
    if not usable or np.linalg.norm(np.cross(reference, along)) < 1e-6 * np.linalg.norm(reference):
        raise FEImportError(
            Cause.BAD_FIELD,
            "local_z must be finite and not parallel to the member",
            where=f"{place}.local_z",
            value=tuple(reference.tolist()),
            remedy="give a direction across the member",
        )
    section = section_constants(
        link.sections[member.section], material.poissons_ratio, frame.torsion, f"{where}: sections.{member.section}"
    )
    return [
        FrameElement(
            nodes=nodes,
            axes=axes,
            length=length,
            section=section,
            youngs_modulus=material.youngs_modulus,
            shear_modulus=material.youngs_modulus / (2 * (1 + material.poissons_ratio)),
            density=material.density,
            thermal_expansion=material.thermal_expansion or 0.0,
        )
        for nodes, axes, length in zip(
            pairwise(chain),
            local_axes(places[:-1], places[1:], reference),
            np.linalg.norm(np.diff(places, axis=0), axis=1).tolist(),
            strict=True,
        )
    ]


def _frame_interfaces(
    interfaces: list[Interface], names: dict[str, int], nodes: Array, where: str
) -> tuple[InterfaceNode, ...]:
    result: list[InterfaceNode] = []
    for k, interface in enumerate(interfaces):
        place = f"{where}: interfaces[{k}]"
        if interface.face or not interface.node:
            raise FEImportError(
                Cause.INTERFACE,
                "an interface of a frame link sits on a node",
                where=place,
                value=interface.face or None,
                remedy="give node = NAME",
            )
        if interface.position is not None:
            raise FEImportError(
                Cause.INTERFACE,
                "an interface of a frame link is where its node is",
                where=f"{place}.position",
                value=interface.position,
                remedy="remove the field, or put the interface on another node",
            )
        if interface.coupling != "rigid":
            raise FEImportError(
                Cause.INTERFACE,
                "an interface on a node of a frame couples no other nodes",
                where=f"{place}.coupling",
                value=interface.coupling,
                remedy="remove the field",
            )
        node = node_number(names, interface.node, f"{place}.node")
        if any(node == other.node for other in result):
            raise FEImportError(
                Cause.INTERFACE,
                "two interfaces on one node",
                where=f"{place}.node",
                value=interface.node,
                remedy="give each interface its own node",
            )
        result.append(
            InterfaceNode(interface.name, node, nodes[node], np.array([node], dtype=np.int64), np.ones(1), "node")
        )
    return tuple(result)


def node_number(names: dict[str, int], name: str, where: str) -> int:
    """Number of a node by its name; an unknown one is refused with a suggestion."""
    choose(name, names, where)
    return names[name]
