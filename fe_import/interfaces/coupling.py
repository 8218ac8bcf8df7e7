"""Interface nodes added to a model's nodes: any set of nodes, of a mesh or of exported matrices, gets a joint's node.

``couple_interfaces(nodes, faces, source, dof_map, rows) -> Coupling`` takes positions (n, 3) and, unless the nodes
are a solid's with rows 3 * node + component, the (n, 6) dof map and the number of rows of the matrices.

Rules for adding a coupling: one file with a function that makes dofs of a `Dependence` follow, a branch in
`couple_interfaces`, and its name in `fe_import.description.check` and `fe_import.modal.check`. Interface dofs stay
independent; rigid-body motion passes exactly.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from fe_import.errors import Cause, FEImportError
from fe_import.interfaces.averaged import Items, Patch, divided, follow_average
from fe_import.interfaces.dependence import Dependence
from fe_import.interfaces.faces import InterfaceFace, checked_faces
from fe_import.interfaces.rigid import follow_rigidly
from fe_import.model import Array, IntArray, InterfaceNode


@dataclass(frozen=True)
class Coupling:
    """A model's nodes and dofs extended by its interface nodes.

    Attributes
    ----------
    nodes : (n + i + a, 3) array
        The model's nodes, then one per interface that is none of them, then auxiliary nodes of large averaged faces
        [m].
    dof_map : (n + i + a, 6) int array
        Row of each nodal component, -1 where a node lacks it.
    coupling : (d, f) sparse CSC
        All nodal components = ``coupling`` @ independent dofs.
    independent : (f,) int array
        Rows that are the independent dofs, six of every interface among them.
    interface_nodes : tuple of InterfaceNode
    """

    nodes: Array
    dof_map: IntArray
    coupling: sp.csc_array
    independent: IntArray
    interface_nodes: tuple[InterfaceNode, ...]

    def extended(self, matrix: sp.csc_array) -> sp.csc_array:
        """A matrix of the model over all d nodal components; interface nodes add nothing."""
        d, given = self.coupling.shape[0], sp.csc_array(matrix)
        ends = np.pad(given.indptr, (0, d - given.shape[0]), mode="edge")
        return sp.csc_array((given.data, given.indices, ends), shape=(d, d))


def couple_interfaces(
    nodes: Array,
    faces: Sequence[InterfaceFace],
    source: str = "",
    dof_map: IntArray | None = None,
    rows: int | None = None,
    state: Dependence | None = None,
) -> Coupling:
    """Add an interface node to each face and couple the face to it.

    Parameters
    ----------
    nodes : (n, 3) array
    faces : sequence of InterfaceFace
    source : str
        File to name in messages.
    dof_map : (n, 6) int array or None
        Row of each nodal component; None for a solid's nodes, row 3 * node + component.
    rows : int or None
        Rows of the matrices; those of ``dof_map`` unless there are others (modal coordinates).
    state : Dependence or None
        Constraints between the rows that hold already.

    Raises
    ------
    FEImportError
        ``INTERFACE``: nodes that do not exist, too few, collinear or too close ones, a position far from the face,
        rigid faces that share a node, averaged ones with none left of their own, a node that does not turn or that
        follows, too many nodes to average, faulty weights, or two interfaces of one name.
    """
    faces = checked_faces(nodes, faces, source)
    n = len(nodes)
    if dof_map is None:
        dof_map = np.full((n, 6), -1, dtype=np.int64)
        dof_map[:, :3] = np.arange(3 * n).reshape(n, 3)
    start = int(dof_map.max(initial=-1)) + 1 if rows is None else rows
    patches = [_patches(face, faces, nodes, source) for face in faces]
    auxiliary = [[patch.position for level in levels for patch in level] for levels in patches]
    new = [k for k, face in enumerate(faces) if face.coupling != "node"]
    i = len(new)
    added = start + np.arange(6 * (i + sum(map(len, auxiliary)))).reshape(-1, 6)
    places = [n + new.index(k) if k in new else int(f.nodes[0]) for k, f in enumerate(faces)]
    own_nodes = np.array(places, dtype=np.int64)
    interface_rows = np.vstack([dof_map, added[:i]])[own_nodes]
    patch_rows = np.split(added[i:], np.cumsum([len(a) for a in auxiliary])[:-1])

    state = Dependence.free(start + added.size) if state is None else state.extended(added.size)
    order = sorted(range(len(faces)), key=lambda k: faces[k].coupling != "rigid")
    for k in order:  # what is rigid follows its own node only
        face, points = faces[k], nodes[faces[k].nodes]
        if face.coupling == "node":
            _check_node(face, interface_rows[k], state, source)
        elif face.coupling == "rigid":
            offsets = points - face.position
            followers = dof_map[face.nodes]
            if (state.columns(followers[followers >= 0]) < 0).any():
                raise FEImportError(
                    Cause.INTERFACE,
                    f"nodes of interface {face.name!r} follow others already, by constraints of the mesh file",
                    where=source,
                    remedy='leave these constraints out (ignore in [solid]), or use coupling = "averaged"',
                )
            state = follow_rigidly(state, dof_map[face.nodes], offsets, interface_rows[k])
        else:
            members = Items.of_nodes(dof_map[face.nodes, :3], points, face.shares)
            averaged = follow_average(state, members, face.position, interface_rows[k], patches[k], patch_rows[k])
            if averaged is None:
                raise FEImportError(
                    Cause.INTERFACE,
                    f"the nodes of interface {face.name!r} already move with other interfaces",
                    where=source,
                    remedy="let each interface have nodes of its own",
                )
            state = averaged
    return Coupling(
        nodes=np.vstack([nodes, *(faces[k].position for k in new), *(a for some in auxiliary for a in some)]),
        dof_map=np.vstack([dof_map, added]),
        coupling=state.matrix.tocsc(),
        independent=state.independent,
        interface_nodes=tuple(
            InterfaceNode(f.name, int(own), f.position, f.nodes, f.shares, f.coupling)
            for f, own in zip(faces, own_nodes, strict=True)
        ),
    )


def _check_node(face: InterfaceFace, rows: IntArray, state: Dependence, source: str) -> None:
    """An interface that is a node must turn, and follow no others."""
    if (rows < 0).any():
        message, remedy = "is a node of a solid, which does not turn", "put it on a face, or on a node of a beam"
    elif (state.columns(rows) < 0).any():
        message, remedy = "is a node that follows others, by constraints of the mesh file", "put it on their reference"
    else:
        return
    raise FEImportError(Cause.INTERFACE, f"interface {face.name!r} {message}", where=source, remedy=remedy)


def _patches(face: InterfaceFace, faces: Sequence[InterfaceFace], nodes: Array, source: str) -> list[list[Patch]]:
    """Patches of an averaged face that shares no node with another interface."""
    if face.coupling != "averaged":
        return []
    shared = any(np.intersect1d(face.nodes, other.nodes).size for other in faces if other is not face)
    return divided(nodes[face.nodes], face.shares, shared, face.name, source)
