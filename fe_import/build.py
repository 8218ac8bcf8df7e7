"""From a link description to its finite-element model (SI, free, with interface nodes)."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from fe_import.errors import Cause, FEImportError, ReportedError
from fe_import.frame import FrameElement, assemble_frame, local_axes
from fe_import.link import Frame, Inertia, Interface, LinkDescription, LinkFile, Material, Member, PointMass
from fe_import.model import Array, FEModel, IntArray, InterfaceNode
from fe_import.sections import section_constants
from fe_import.toml_file import choose

MOST_ELEMENTS = 100_000  # per member; a larger number is a slip

_LENGTH = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254, "ft": 0.3048}
_POUND = 0.45359237
_POUND_FORCE = _POUND * 9.80665
_MASS = {
    "kg": 1.0,
    "g": 1e-3,
    "t": 1e3,
    "lb": _POUND,
    "slug": _POUND_FORCE / 0.3048,
    "lbf*s2/in": _POUND_FORCE / 0.0254,
}
_TIME = {"s": 1.0, "ms": 1e-3}


def build_model(link: LinkFile) -> FEModel:
    """Assemble the model that a description states, in SI units.

    Raises
    ------
    FEImportError
        A faulty section, node, set, interface or mesh.
    """
    description, where = link.description, str(link.path)
    if description.frame is not None:
        model = _frame_model(description, description.frame, where)
    else:
        from fe_import.build_solid import solid_model  # scikit-fem and meshio are heavy

        model = solid_model(link)
    model = add_masses(model, description.masses, where)
    return to_si(model, description, where)


def _node(names: dict[str, int], name: str, where: str) -> int:
    choose(name, names, where)
    return names[name]


def _frame_model(link: LinkDescription, frame: Frame, where: str) -> FEModel:
    names = {name: k for k, name in enumerate(frame.nodes)}
    positions = [np.asarray(p, dtype=float) for p in frame.nodes.values()]
    elements: list[FrameElement] = []
    lines: list[tuple[int, int]] = []
    if not frame.members:
        raise FEImportError(
            Cause.BAD_FIELD, "a frame needs at least one member", where=f"{where}: frame.members", remedy="add one"
        )
    for k, member in enumerate(frame.members):
        place = f"{where}: frame.members[{k}]"
        chain = _subdivide(member, names, positions, place)
        for a, b in pairwise(chain):
            elements.append(_element(link, frame, member, (a, b), positions, where, place))
            lines.append((a, b))
    nodes = np.stack(positions)
    _check_connected(np.asarray(lines), names, where)
    mass, stiffness, parts = assemble_frame(
        len(nodes),
        elements,
        shear=frame.theory == "timoshenko",
        mass=frame.mass,
        rotary_inertia=frame.rotary_inertia,
    )
    dof_map = np.arange(6 * len(nodes), dtype=np.int64).reshape(-1, 6)
    return FEModel(
        name=link.name,
        nodes=nodes,
        dof_map=dof_map,
        mass=mass,
        stiffness=stiffness,
        interface_nodes=_frame_interfaces(link.interfaces, names, nodes, where),
        independent=np.arange(6 * len(nodes), dtype=np.int64),
        node_names=names,
        lines=np.asarray(lines, dtype=np.int64),
        stiffness_parts=parts,
        kind="frame",
        source=where,
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
    first, last = (_node(names, n, f"{place}.{f}") for n, f in ((member.start, "from"), (member.end, "to")))
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


def _element(
    link: LinkDescription,
    frame: Frame,
    member: Member,
    nodes: tuple[int, int],
    positions: list[Array],
    where: str,
    place: str,
) -> FrameElement:
    choose(member.material, link.materials, f"{place}.material")
    choose(member.section, link.sections, f"{place}.section")
    material: Material = link.materials[member.material]
    start, end = positions[nodes[0]], positions[nodes[1]]
    along = (end - start) / np.linalg.norm(end - start)
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
    return FrameElement(
        nodes=nodes,
        axes=local_axes(start, end, reference),
        length=float(np.linalg.norm(end - start)),
        section=section_constants(
            link.sections[member.section],
            material.poissons_ratio,
            frame.torsion,
            f"{where}: sections.{member.section}",
        ),
        youngs_modulus=material.youngs_modulus,
        shear_modulus=material.youngs_modulus / (2 * (1 + material.poissons_ratio)),
        density=material.density,
    )


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
        node = _node(names, interface.node, f"{place}.node")
        if any(node == other.node for other in result):
            raise FEImportError(
                Cause.INTERFACE,
                "two interfaces on one node",
                where=f"{place}.node",
                value=interface.node,
                remedy="give each interface its own node",
            )
        result.append(
            InterfaceNode(
                interface.name, node, nodes[node], np.array([node], dtype=np.int64), np.ones(1), "node"
            )
        )
    return tuple(result)


def add_masses(model: FEModel, masses: list[PointMass], where: str) -> FEModel:
    """Point masses and inertias on nodes or interfaces.

    Raises
    ------
    FEImportError
        An unknown node, an inertia on a node without rotations, or an inertia that is not positive semidefinite.
    """
    if not masses:
        return model
    names = {**{i.name: i.node for i in model.interface_nodes}, **model.node_names}
    rows: list[IntArray] = []
    blocks: list[Array] = []
    for k, point in enumerate(masses):
        place = f"{where}: masses[{k}]"
        node = _node(names, point.node, f"{place}.node")
        interface = next((i for i in model.interface_nodes if i.name == point.node), None)
        if interface is not None and interface.node != node:
            raise FEImportError(
                Cause.BAD_REFERENCE,
                "both a node and an interface elsewhere have this name",
                where=f"{place}.node",
                value=point.node,
                remedy="rename one of the two",
            )
        inertia = inertia_matrix(point.inertia, f"{place}.inertia")
        dofs = model.dof_map[node]
        if inertia.any() and (dofs < 0).any():
            raise FEImportError(
                Cause.BAD_FIELD,
                "this node has no rotations, so it cannot carry an inertia",
                where=f"{place}.inertia",
                value=point.inertia,
                remedy="put the inertia on an interface",
            )
        block = np.zeros((6, 6))
        block[:3, :3] = point.mass * np.eye(3)
        block[3:, 3:] = inertia
        keep = dofs >= 0
        rows.append(dofs[keep])
        blocks.append(block[np.ix_(keep, keep)])
    i = np.concatenate([np.repeat(r, len(r)) for r in rows])
    j = np.concatenate([np.tile(r, len(r)) for r in rows])
    added = sp.coo_array((np.concatenate([b.ravel() for b in blocks]), (i, j)), shape=model.mass.shape)
    return replace(model, mass=(model.mass + added).tocsc())


def inertia_matrix(given: Inertia, where: str, error: type[ReportedError] = FEImportError) -> Array:
    """(3, 3) inertia from ``[Ixx, Iyy, Izz]`` or three rows.

    Raises
    ------
    ReportedError
        Of class ``error``: not finite, not symmetric, or not positive semidefinite.
    """
    inertia = np.zeros((3, 3))
    for k, row in enumerate(given):
        if isinstance(row, tuple):
            inertia[k] = row
        else:
            inertia[k, k] = row
    scale = np.abs(inertia).max(initial=0.0)
    ok = np.isfinite(inertia).all() and np.abs(inertia - inertia.T).max() <= 1e-9 * scale
    if not ok or np.linalg.eigvalsh(inertia).min() < -1e-9 * scale:
        raise error(
            Cause.BAD_FIELD,
            "an inertia must be finite, symmetric and not negative",
            where=where,
            value=inertia.tolist(),
            remedy="give [Ixx, Iyy, Izz] or a symmetric 3x3 matrix about the node",
        )
    return inertia


def to_si(model: FEModel, link: LinkDescription, where: str) -> FEModel:
    """Convert a model from the units of its description.

    Displacements scale with the length unit, rotations do not; forces with mass · length / time².
    """
    u = link.units
    for name, value, table in (("length", u.length, _LENGTH), ("mass", u.mass, _MASS), ("time", u.time, _TIME)):
        choose(value, table, f"{where}: units.{name}")
    length, mass, time = _LENGTH[u.length], _MASS[u.mass], _TIME[u.time]
    if length == mass == time == 1:
        return model
    scale = np.ones(model.mass.shape[0])
    turning = model.dof_map[:, 3:]
    scale[turning[turning >= 0]] = length
    d = sp.diags_array(scale).tocsc()
    inverse = sp.diags_array(1 / scale).tocsc()

    def convert(matrix: sp.csc_array, factor: float) -> sp.csc_array:
        return (d @ matrix @ d * factor).tocsc()

    # coupling: displacement per rotation is a length
    coupling = model.coupling
    if coupling is not None:
        coupling = (inverse @ coupling @ sp.diags_array(scale[model.independent])).tocsc()
    return replace(
        model,
        nodes=model.nodes * length,
        mass=convert(model.mass, mass),
        stiffness=convert(model.stiffness, mass / time**2),
        stiffness_parts={k: convert(p, mass / time**2) for k, p in model.stiffness_parts.items()},
        interface_nodes=tuple(replace(i, position=i.position * length) for i in model.interface_nodes),
        coupling=coupling,
    )
