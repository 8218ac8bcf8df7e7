"""Nodes and interfaces of a link of matrices: what its description names, found among the exported nodes."""

from __future__ import annotations

import numpy as np

from fe_import.description.records import Interface, LinkDescription, Matrices
from fe_import.errors import Cause, FEImportError
from fe_import.exports import Export
from fe_import.files.toml import as_spelt, choose
from fe_import.interfaces.faces import InterfaceFace
from fe_import.model import Array, IntArray, InterfaceNode

_NEAR = 0.05  # distance of a named position from its node, in sizes of the link


def named_nodes(matrices: Matrices, export: Export, where: str) -> dict[str, int]:
    """Nodes of the export that the description names, by number or nearest position."""
    result = {}
    usable = np.flatnonzero(export.dof_map[:, 0] >= 0)
    limit = _NEAR * float(np.linalg.norm(np.ptp(export.nodes[usable], axis=0)))
    for name, given in matrices.nodes.items():
        place = f"{where}: matrices.nodes.{name}"
        if isinstance(given, int):
            result[name] = _by_label(given, export, place)
            continue
        distance = np.linalg.norm(export.nodes[usable] - np.asarray(given), axis=1)
        nearest = int(distance.argmin())
        if not distance[nearest] <= limit:
            raise FEImportError(
                Cause.BAD_REFERENCE,
                "no node with rows near this position",
                where=place,
                value=tuple(given),
                limit=f"{limit:.4g}, nearest {distance[nearest]:.4g}",
                remedy="positions are in the mesh's frame and units",
            )
        result[name] = int(usable[nearest])
    return result


def _by_label(label: int, export: Export, place: str) -> int:
    found = np.flatnonzero(export.labels == label)
    if not len(found) or export.dof_map[found[0], 0] < 0:
        known = export.labels[export.dof_map[:, 0] >= 0]
        raise FEImportError(
            Cause.BAD_REFERENCE,
            "this node has no rows in the matrices" if len(found) else "no node of this number",
            where=place,
            value=label,
            limit=f"{len(known)} nodes with rows, numbers {known.min()} ... {known.max()}",
            remedy="numbers are those of the program that wrote the files",
        )
    return int(found[0])


def matrices_interfaces(
    link: LinkDescription, export: Export, names: dict[str, int], dense: IntArray, where: str
) -> tuple[list[InterfaceFace], dict[str, InterfaceNode]]:
    """Faces that get an interface node, and interfaces on nodes of the model, by name."""
    faces: list[InterfaceFace] = []
    seats: dict[str, InterfaceNode] = {}
    for k, interface in enumerate(link.interfaces):
        place = f"{where}: interfaces[{k}]"
        if bool(interface.node) == bool(interface.face):
            raise FEImportError(
                Cause.INTERFACE,
                "give exactly one of 'node' and 'face'",
                where=place,
                remedy="node = NUMBER or NAME for a node with rotations, face = SET for nodes of solids",
            )
        if interface.face:
            faces.append(_face(interface, export, dense, place))
            continue
        node = int(dense[_seat(interface, export, names, place)])
        if any(node == other.node for other in seats.values()):
            raise FEImportError(
                Cause.INTERFACE,
                "two interfaces on one node",
                where=f"{place}.node",
                value=interface.node,
                remedy="give each interface its own node",
            )
        position = export.nodes[dense == node][0]
        seats[interface.name] = InterfaceNode(
            interface.name, node, position, np.array([node], dtype=np.int64), np.ones(1), "node"
        )
    return faces, seats


def _seat(interface: Interface, export: Export, names: dict[str, int], place: str) -> int:
    """The node with rotations that an interface names."""
    if interface.position is not None or interface.coupling != "rigid":
        raise FEImportError(
            Cause.INTERFACE,
            "an interface on a node has no position or coupling of its own",
            where=place,
            remedy="remove the field, or give face = SET",
        )
    text = interface.node
    if text in names:
        node = names[text]
    elif text.isascii() and text.isdigit() and len(text) < 19:
        node = _by_label(int(text), export, f"{place}.node")
    else:
        choose(text, names, f"{place}.node")
    if (export.dof_map[node] < 0).any():
        raise FEImportError(
            Cause.INTERFACE,
            "this node has no rotations, so no joint can sit on it",
            where=f"{place}.node",
            value=text,
            remedy="give face = SET: a set of at least 3 nodes not on one line",
        )
    return node


def _face(interface: Interface, export: Export, dense: IntArray, place: str) -> InterfaceFace:
    name = as_spelt(interface.face, export.node_sets)
    choose(name, export.node_sets, f"{place}.face")
    members = export.node_sets[name]
    if not len(members):
        raise FEImportError(
            Cause.INTERFACE,
            "this set has no nodes",
            where=f"{place}.face",
            value=interface.face,
            remedy="name a set of 3 nodes or more, not on one line",
        )
    orphans = members[dense[members] < 0]
    if len(orphans):
        raise FEImportError(
            Cause.INTERFACE,
            f"{len(orphans)} nodes of this set have no rows in the matrices",
            where=f"{place}.face",
            value=f"node {export.labels[orphans[0]]}",
            remedy="take nodes that belong to elements, without reference nodes",
        )
    weights = None
    if interface.coupling == "averaged" and interface.weights != "uniform":
        weights = _areas(export, members)
        if not (weights > 0).all():
            if interface.weights == "area":
                raise FEImportError(
                    Cause.INTERFACE,
                    "a node of this set belongs to no surface triangle within the set",
                    where=f"{place}.face",
                    value=f"node {export.labels[members[weights.argmin()]]}",
                    remedy='use weights = "uniform"',
                )
            weights = None
    position = _centre(export, members) if interface.position is None else np.asarray(interface.position, dtype=float)
    return InterfaceFace(interface.name, dense[members], position, interface.coupling, weights)


def _within(export: Export, members: IntArray) -> tuple[IntArray, Array]:
    """Triangles whose nodes are all in a set, and their areas."""
    triangles = export.triangles[np.isin(export.triangles, members).all(axis=1)]
    a, b, c = (export.nodes[triangles[:, k]] for k in range(3))
    return triangles, np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2


def _areas(export: Export, members: IntArray) -> Array:
    """Each node's third of the triangles around it within the set."""
    triangles, areas = _within(export, members)
    shares = np.bincount(triangles.ravel(), np.repeat(areas / 3, 3), minlength=len(export.nodes))
    return np.asarray(shares[members])


def _centre(export: Export, members: IntArray) -> Array:
    """Centroid of the triangles within the set, or the mean of its nodes when there are none."""
    triangles, areas = _within(export, members)
    if areas.sum() == 0:
        return np.asarray(export.nodes[members].mean(axis=0))
    return np.asarray(areas @ export.nodes[triangles].mean(axis=1) / areas.sum())
