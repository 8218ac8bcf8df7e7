"""Shells, and masses, springs and constraints that a mesh file attaches, in the matrices and the independent dofs.

Constraints are eliminated exactly, in this order: rigid bodies, ties, equations, averages. What cannot be (a component
that follows twice, a circle) is refused; a tie or an equation that follows from others changes nothing.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from fe_import.elements.attachments import (
    AttachedBeam,
    AttachedMass,
    AttachedSpring,
    Attachment,
    AverageNode,
    LinearEquation,
    RigidBody,
    Terms,
    TiedNodes,
    needs_rotations,
)
from fe_import.elements.solid_mesh import SolidMesh, element_faces
from fe_import.errors import Cause, FEImportError
from fe_import.interfaces.averaged import Items, average
from fe_import.interfaces.dependence import Dependence, arm
from fe_import.interfaces.ties import feet_on_faces
from fe_import.interfaces.weights import area_weights
from fe_import.model import Array, IntArray
from fe_import.models.attached_beams import beam_matrices

_NONE = 1e-10  # of an equation's coefficients: what is left of one that follows from others
_NEAR = 0.05  # of the size of a face: nodes that far from it are tied, as Abaqus does
_RIGID = 1e-9  # of the size of a motion: an equation that resists it


@dataclass(frozen=True)
class AttachedNodes:
    """Nodes of a mesh and of what is attached to it.

    Attributes
    ----------
    nodes : (n + k, 3) array
        Those of the mesh first.
    dof_map : (n + k, 6) int array
        Rows, -1 where a node does not turn.
    rows : int
    """

    nodes: Array
    dof_map: IntArray
    rows: int

    def row(self, node: int, component: int) -> int:
        """Of a nodal component."""
        return int(self.dof_map[node, component])


def attached_nodes(mesh: SolidMesh) -> AttachedNodes:
    """Rows 3 * node + component, then the rotations of the nodes that turn."""
    nodes = np.vstack([mesh.nodes, mesh.further_nodes])
    dof_map = np.full((len(nodes), 6), -1, dtype=np.int64)
    dof_map[:, :3] = np.arange(3 * len(nodes)).reshape(-1, 3)
    asked = {node % len(nodes) for item in mesh.attachments for node in needs_rotations(item)}
    turning = sorted(asked | set(mesh.shell_nodes.tolist()))
    dof_map[turning, 3:] = 3 * len(nodes) + np.arange(3 * len(turning)).reshape(-1, 3)
    return AttachedNodes(nodes, dof_map, 3 * (len(nodes) + len(turning)))


def add_attached(mesh: SolidMesh, where: AttachedNodes, mass: Entries, stiffness: Entries) -> None:
    """Matrices of point masses, springs and beams."""
    for item in mesh.attachments:
        if isinstance(item, AttachedMass):
            dofs = where.dof_map[item.node]
            block, x = np.zeros((6, 6)), arm(item.offset[None])[0]
            block += item.mass * x.T @ x
            block[3:, 3:] += item.inertia
            present = dofs >= 0
            mass.add(dofs[present], block[np.ix_(present, present)])
        elif isinstance(item, AttachedSpring):
            for value, terms in item.forms:
                rows, coefficients = _form(terms, where)
                stiffness.add(rows, value * np.outer(coefficients, coefficients))
        elif isinstance(item, AttachedBeam):
            dofs = where.dof_map[list(item.element.nodes)].ravel()
            present = np.ix_(dofs >= 0, dofs >= 0)  # a node of a solid does not turn where the beam's end is pinned
            for entries, block in zip((mass, stiffness), beam_matrices(item), strict=True):
                entries.add(dofs[dofs >= 0], block[present])


class Entries:
    """Element matrices that become a sparse one."""

    def __init__(self) -> None:
        self._rows: list[IntArray] = []
        self._blocks: list[Array] = []

    def add(self, rows: IntArray, block: Array) -> None:
        """One (k, k) of rows (k,)."""
        self.add_all(rows[None], block[None])

    def add_all(self, rows: IntArray, blocks: Array) -> None:
        """Some (e, k, k) of rows (e, k)."""
        self._rows.append(rows)
        self._blocks.append(blocks)

    def matrix(self, size: int) -> sp.csc_array:
        """(size, size), their sum."""
        none = np.zeros(0, dtype=np.int64)
        i = np.concatenate([none, *(np.repeat(r, r.shape[1], axis=1).ravel() for r in self._rows)])
        j = np.concatenate([none, *(np.tile(r, (1, r.shape[1])).ravel() for r in self._rows)])
        values = np.concatenate([np.zeros(0), *(b.ravel() for b in self._blocks)])
        return sp.coo_array((values, (i, j)), shape=(size, size)).tocsc()


def _form(terms: Terms, where: AttachedNodes) -> tuple[IntArray, Array]:
    rows = np.array([where.row(node, component) for node, component, _ in terms], dtype=np.int64)
    return rows, np.array([coefficient for _, _, coefficient in terms])


def attached_constraints(mesh: SolidMesh, where: AttachedNodes) -> tuple[Dependence, dict[str, int]]:
    """All nodal components from the independent ones, and how many nodes ties leave free, by their keyword.

    Raises
    ------
    FEImportError
        ``MESH``: constraints that contradict each other, or that resist rigid-body motion, ties of no node.
    """
    state = Dependence.free(where.rows)
    free: Counter[str] = Counter()
    for kind in (RigidBody, TiedNodes, LinearEquation, AverageNode):
        for item in mesh.attachments:
            if isinstance(item, kind):
                if isinstance(item, TiedNodes):
                    state, left = _with_tie(state, item, mesh, where)
                    free[item.keyword] += left
                else:
                    state = _followed(state, item, mesh, where)
    rigid = _rigid_motions(where)
    off = np.abs(state.matrix @ rigid[state.independent] - rigid).max(initial=0.0)
    if off > _RIGID * np.abs(rigid).max(initial=1.0):
        raise _fault(mesh.source, "the equations between nodes resist rigid-body motion", float(off))
    return state, {keyword: count for keyword, count in free.items() if count}


def _followed(state: Dependence, item: Attachment, mesh: SolidMesh, where: AttachedNodes) -> Dependence:
    if isinstance(item, LinearEquation):
        return _with_equation(state, *_form(item.terms, where))
    if isinstance(item, RigidBody):
        others = item.nodes[item.nodes != item.reference]
        motion = np.zeros((len(others), 6, 6))
        motion[:, :3] = arm(where.nodes[others] - where.nodes[item.reference])
        motion[:, 3:, 3:] = np.eye(3)
        chosen = list(item.components)
        rows = where.dof_map[others][:, chosen].ravel()
        leaders, values = where.dof_map[item.reference], motion[:, chosen].reshape(-1, 6)[rows >= 0]
        followers = rows[rows >= 0]
    elif isinstance(item, AverageNode):
        weights = area_weights(mesh, item.nodes, item.keyword) if item.weights is None else item.weights
        members = Items.of_nodes(where.dof_map[item.nodes, :3], where.nodes[item.nodes], weights)
        mean = average(members, where.nodes[item.reference])
        followers, leaders = where.dof_map[item.reference], members.rows.ravel()
        values = np.linalg.solve(mean.motion, mean.components)
    else:
        raise TypeError(type(item))
    terms = _terms(np.tile(leaders, (len(followers), 1)), values, where.rows)
    following = _following(state, followers, terms)
    if following is None:
        raise _fault(mesh.source, f"{item.keyword}: a node of it follows other nodes already, or itself", None)
    return following


def _terms(columns: IntArray, values: Array, width: int) -> sp.csr_array:
    """(k, width) sparse matrix with ``values`` (k, c) in ``columns`` (k, c)."""
    rows = np.repeat(np.arange(len(columns)), columns.shape[1])
    return sp.csr_array((values.ravel(), (rows, columns.ravel())), shape=(len(columns), width))


def _following(state: Dependence, followers: IntArray, terms: sp.csr_array) -> Dependence | None:
    """Rows that follow from now on, as ``terms`` of all rows; None where they do already, or would from themselves."""
    columns = state.columns(followers)
    expression = sp.csr_array(terms @ state.matrix)
    if (columns < 0).any() or abs(expression[:, columns]).max() > 0:
        return None
    return state.following(columns, expression)


def _with_tie(state: Dependence, item: TiedNodes, mesh: SolidMesh, where: AttachedNodes) -> tuple[Dependence, int]:
    """Ties of nodes to faces, and how many nodes are too far away; what follows already does so by equations."""
    faces = _faces(item, mesh)
    own = np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *(f.ravel() for f in faces)]))
    nodes = np.setdiff1d(item.nodes, own)
    feet = feet_on_faces(where.nodes[nodes], where.nodes, faces) if faces and len(nodes) else None
    near = np.zeros(0, dtype=bool) if feet is None else feet.gaps <= (item.tolerance or _NEAR * feet.sizes)
    if feet is None or not near.any():
        nearest = None if feet is None else float(f"{feet.gaps.min():.4g}")
        raise _fault(mesh.source, f"{item.keyword}: none of its nodes lies on one of its faces, nearest", nearest)
    at, leaders, motions = nodes[near], feet.nodes[near], feet.motions[near]
    values = motions.swapaxes(1, 2).reshape(3 * len(at), -1)  # row: node, component; column: leader, component
    present = np.repeat(leaders >= 0, 3, axis=1)
    columns = np.where(present, where.dof_map[leaders, :3].reshape(len(at), -1), 0).repeat(3, axis=0)
    terms = _terms(columns, np.where(present.repeat(3, axis=0), values, 0.0), where.rows)
    terms.eliminate_zeros()
    followers = where.dof_map[at, :3].ravel()
    found = _following(state, followers, terms)
    if found is None:
        free = state.columns(followers) >= 0
        free &= abs(sp.csr_array(terms @ state.matrix)[:, state.columns(followers[free])]).sum(axis=1) == 0
        found = _following(state, followers[free], sp.csr_array(terms[free])) if free.any() else state
        assert found is not None
        for row in np.flatnonzero(~free):
            one = terms[[row]]
            found = _with_equation(found, np.array([followers[row], *one.indices]), np.array([-1.0, *one.data]))
    return found, int((~near).sum())


def _faces(item: TiedNodes, mesh: SolidMesh) -> list[IntArray]:
    """All nodes of the faces of a tie, by their number."""
    wanted = {tuple(sorted(face)) for part in (item.triangles, item.quadrilaterals) for face in part.tolist()}
    faces = element_faces(mesh)
    corners = np.where(np.isin(faces.sizes, (3, 6)), 3, 4)
    own = np.array(sorted({node for face in wanted for node in face}), dtype=np.int64)
    ends = faces.nodes[:, :4]
    chosen = np.asarray((np.isin(ends, own) | (np.arange(ends.shape[1]) >= corners[:, None])).all(axis=1))
    for k in np.flatnonzero(chosen):
        chosen[k] = tuple(sorted(faces.nodes[k, : corners[k]].tolist())) in wanted
    return [faces.nodes[chosen & (faces.sizes == k), :k] for k in np.unique(faces.sizes[chosen])]


def _with_equation(state: Dependence, rows: IntArray, coefficients: Array) -> Dependence:
    """Σ coefficient · component of the rows = 0; the first follows from the others where it can."""
    left = np.asarray((sp.csr_array(coefficients[None]) @ state.matrix[rows]).toarray()).ravel()
    size = np.abs(left).max(initial=0.0)
    if size <= _NONE * np.abs(coefficients).max():
        return state  # follows from others
    first = int(state.columns(rows[:1])[0])
    pivot = first if first >= 0 and abs(left[first]) > 1e-3 * size else int(np.abs(left).argmax())
    used = np.flatnonzero(np.abs(left) > _NONE * size)
    used = used[used != pivot]
    values = -left[used] / left[pivot]
    expression = sp.csr_array((values, (np.zeros(len(used), dtype=np.int64), used)), shape=(1, len(left)))
    return state.following(np.array([pivot]), expression)


def _rigid_motions(where: AttachedNodes) -> Array:
    """(rows, 6) of the nodes, about the origin."""
    result = np.zeros((where.rows, 6))
    result[where.dof_map[:, :3]] = arm(where.nodes)
    turning = where.dof_map[:, 3] >= 0
    result[where.dof_map[turning, 3:], 3:] = np.eye(3)
    return result


def _fault(source: str, message: str, value: object) -> FEImportError:
    return FEImportError(
        Cause.MESH, message, where=source, value=value,
        remedy="mend the constraints, or leave them out (ignore in [solid]) and couple faces as interfaces",
    )  # fmt: skip
