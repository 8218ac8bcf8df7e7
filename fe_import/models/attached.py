"""Masses, springs and constraints that a mesh file attaches to a solid, in its matrices and its independent dofs.

Constraints are eliminated exactly, in this order: rigid bodies, equations, averages. What cannot be (a component that
follows twice, a circle) is refused; an equation that follows from others changes nothing.
"""

from __future__ import annotations

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
    needs_rotations,
)
from fe_import.elements.solid_mesh import SolidMesh
from fe_import.errors import Cause, FEImportError
from fe_import.interfaces.averaged import Items, average
from fe_import.interfaces.dependence import Dependence, arm
from fe_import.model import Array, IntArray
from fe_import.models.attached_beams import beam_matrices

_NONE = 1e-10  # of an equation's coefficients: what is left of one that follows from others
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
    turning = sorted({node for item in mesh.attachments for node in needs_rotations(item)})
    dof_map[turning, 3:] = 3 * len(nodes) + np.arange(3 * len(turning)).reshape(-1, 3)
    return AttachedNodes(nodes, dof_map, 3 * (len(nodes) + len(turning)))


def attached_matrices(mesh: SolidMesh, where: AttachedNodes) -> tuple[sp.csc_array, sp.csc_array]:
    """(rows, rows) mass and stiffness of point masses, springs and beams."""
    mass, stiffness = _Entries(), _Entries()
    for item in mesh.attachments:
        if isinstance(item, AttachedMass):
            dofs = where.dof_map[item.node]
            block, x = np.zeros((6, 6)), arm(item.offset[None])[0]
            block += item.mass * x.T @ x
            block[3:, 3:] += item.inertia
            present = dofs >= 0
            mass.add(dofs[present], block[np.ix_(present, present)])
        elif isinstance(item, AttachedSpring):
            rows, coefficients = _form(item.terms, where)
            stiffness.add(rows, item.stiffness * np.outer(coefficients, coefficients))
        elif isinstance(item, AttachedBeam):
            dofs = where.dof_map[list(item.element.nodes)].ravel()
            present = np.ix_(dofs >= 0, dofs >= 0)  # a node of a solid does not turn where the beam's end is pinned
            for entries, block in zip((mass, stiffness), beam_matrices(item), strict=True):
                entries.add(dofs[dofs >= 0], block[present])
    return mass.matrix(where.rows), stiffness.matrix(where.rows)


class _Entries:
    def __init__(self) -> None:
        self.rows: list[IntArray] = []
        self.blocks: list[Array] = []

    def add(self, rows: IntArray, block: Array) -> None:
        self.rows.append(rows)
        self.blocks.append(block)

    def matrix(self, size: int) -> sp.csc_array:
        none = np.zeros(0, dtype=np.int64)
        i = np.concatenate([none, *(np.repeat(r, len(r)) for r in self.rows)])
        j = np.concatenate([none, *(np.tile(r, len(r)) for r in self.rows)])
        values = np.concatenate([np.zeros(0), *(b.ravel() for b in self.blocks)])
        return sp.coo_array((values, (i, j)), shape=(size, size)).tocsc()


def _form(terms: Terms, where: AttachedNodes) -> tuple[IntArray, Array]:
    rows = np.array([where.row(node, component) for node, component, _ in terms], dtype=np.int64)
    return rows, np.array([coefficient for _, _, coefficient in terms])


def attached_constraints(mesh: SolidMesh, where: AttachedNodes) -> Dependence:
    """All nodal components from the independent ones.

    Raises
    ------
    FEImportError
        ``MESH``: constraints that contradict each other, or that resist rigid-body motion.
    """
    state = Dependence.free(where.rows)
    for kind in (RigidBody, LinearEquation, AverageNode):
        for item in mesh.attachments:
            if isinstance(item, kind):
                state = _followed(state, item, where, mesh.source)
    rigid = _rigid_motions(where)
    off = np.abs(state.matrix @ rigid[state.independent] - rigid).max(initial=0.0)
    if off > _RIGID * np.abs(rigid).max(initial=1.0):
        raise _fault(mesh.source, "the equations between nodes resist rigid-body motion", float(off))
    return state


def _followed(state: Dependence, item: Attachment, where: AttachedNodes, source: str) -> Dependence:
    if isinstance(item, LinearEquation):
        return _with_equation(state, item, where)
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
        members = Items.of_nodes(where.dof_map[item.nodes, :3], where.nodes[item.nodes], item.weights)
        mean = average(members, where.nodes[item.reference])
        followers, leaders = where.dof_map[item.reference], members.rows.ravel()
        values = np.linalg.solve(mean.motion, mean.components)
    else:
        raise TypeError(type(item))
    columns = state.columns(followers)
    places = np.tile(leaders, (len(followers), 1)), np.repeat(np.arange(len(followers)), len(leaders))
    shape = (len(followers), where.rows)
    expression = sp.csr_array((values.ravel(), (places[1], places[0].ravel())), shape=shape) @ state.matrix
    if (columns < 0).any() or abs(expression[:, columns]).max() > 0:
        raise _fault(source, f"{item.keyword}: a node of it follows other nodes already, or itself", None)
    return state.following(columns, sp.csr_array(expression))


def _with_equation(state: Dependence, item: LinearEquation, where: AttachedNodes) -> Dependence:
    rows, coefficients = _form(item.terms, where)
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
