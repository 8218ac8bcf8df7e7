"""Beams and springs that turn where a solid holds them: nodes of solids pass on forces, but no moments.

A motion of them, everything else at rest, is resisted if it breaks a constraint or takes energy. Beams that share with
a solid one node, or nodes on one line, turn about them unless something else holds them; so do the nodes of a spring
against turning, and a node whose beams are all pinned in one direction. The link would be a mechanism, and is refused
here with the place.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from fe_import.elements.attachments import AttachedBeam, AttachedSpring, Attachment, needs_rotations, nodes_of
from fe_import.elements.solid_mesh import SolidMesh
from fe_import.errors import Cause, FEImportError
from fe_import.interfaces.coupling import Coupling
from fe_import.interfaces.dependence import arm
from fe_import.model import Array, IntArray
from fe_import.models.attached import AttachedNodes

_LOOSE = 1e-12  # of the stiffness on the diagonal, and of the motion: rounding leaves 1e-15
_LINE = 1e-6  # width of the shared nodes over their length


def check_hinges(mesh: SolidMesh, places: AttachedNodes, coupled: Coupling, stiffness: sp.csc_array) -> None:
    """Refuse beams, and nodes of beams, that turn freely.

    Parameters
    ----------
    mesh : SolidMesh
    places : AttachedNodes
    coupled : Coupling
        With all constraints and interfaces.
    stiffness : (d, d) sparse CSC
        Over all nodal components of ``coupled``.

    Raises
    ------
    FEImportError
        ``MESH``.
    """
    count, solid = len(places.nodes), len(mesh.nodes)
    turning = [(item, np.array(nodes_of(item)) % count) for item in mesh.attachments if _passes_moments(item)]
    if not turning:
        return
    pairs = np.array([(nodes[0], node) for _, nodes in turning for node in nodes])
    label = connected_components(sp.coo_array((np.ones(len(pairs)), pairs.T), shape=(count, count)), directed=False)[1]
    for own in np.unique(label[pairs[:, 0]]):
        nodes = np.flatnonzero(label == own)
        shared = nodes[nodes < solid]
        if _on_a_line(places.nodes[shared]) and not _resisted(_rigid_motions(places, nodes), coupled, stiffness):
            names = sorted({item.keyword for item, at in turning if label[at[0]] == own})
            shown = places.nodes[(shared if len(shared) else nodes)[:2]]
            at = f"the {len(shared)} nodes that they share with the solid, which pass on no moments"
            raise FEImportError(
                Cause.MESH,
                f"{', '.join(names)}: they turn freely about {at if len(shared) else 'nothing'}",
                where=mesh.source,
                value=", ".join("({:.6g}, {:.6g}, {:.6g})".format(*p) for p in shown),
                limit="three nodes, not on one line",
                remedy="join them to a face by a rigid body or a coupling, or let them share more nodes",
            )
    beams = [item for item in mesh.attachments if isinstance(item, AttachedBeam)]
    ends = np.array([item.element.nodes for item in beams], dtype=np.int64).reshape(-1, 2) % count
    pinned = {int(end) for item, own in zip(beams, ends, strict=True) if item.released for end in own}
    for node in sorted(pinned):
        rows = places.dof_map[node, 3:]
        if rows[0] >= 0 and not _resisted((rows, np.eye(3)), coupled, stiffness):
            raise FEImportError(
                Cause.MESH,
                "nothing resists a turn of this node: all beams there are pinned",
                where=mesh.source,
                value="({:.6g}, {:.6g}, {:.6g})".format(*places.nodes[node]),
                remedy="let one of the beams pass on the moment (pin flags)",
            )


def _passes_moments(item: Attachment) -> bool:
    if isinstance(item, AttachedSpring):
        return bool(needs_rotations(item))
    return isinstance(item, AttachedBeam)


def _on_a_line(points: Array) -> bool:
    if len(points) < 3:
        return True
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(spread[1] <= _LINE * spread[0])


def _rigid_motions(places: AttachedNodes, nodes: IntArray) -> tuple[IntArray, Array]:
    """Rows and (rows, 6) motions of nodes as one body; rotations about their centre, of about unit displacement."""
    offsets = places.nodes[nodes] - places.nodes[nodes].mean(axis=0)
    full = np.zeros((len(nodes), 6, 6))
    full[:, :3] = arm(offsets)
    full[:, 3:, 3:] = np.eye(3)
    full[:, :, 3:] /= np.linalg.norm(offsets, axis=1).max() or 1.0
    rows = places.dof_map[nodes].ravel()
    return rows[rows >= 0], full.reshape(-1, 6)[rows >= 0]


def _resisted(motions: tuple[IntArray, Array], coupled: Coupling, stiffness: sp.csc_array) -> bool:
    """Whether every combination of motions (rows, k), all other rows at rest, breaks a constraint or takes energy."""
    rows, values = motions
    column = np.searchsorted(coupled.independent, rows).clip(max=len(coupled.independent) - 1)
    free = coupled.independent[column] == rows
    broken = np.asarray(coupled.coupling[:, column[free]] @ values[free])
    broken[rows] -= values
    block = stiffness[rows][:, rows]
    weight = stiffness.diagonal()[rows]
    scale = float(np.einsum("rk,r,rk->", values, weight, values))
    energy = values.T @ (block @ values) / (scale if scale > 0 else 1.0)
    share = broken.T @ broken / np.einsum("rk,rk->", values, values)
    return bool(np.linalg.eigvalsh(energy + share)[0] > _LOOSE)

