"""What reports see of a nodal link: its frame, the nodes of its modal model, and the nearest modal coordinates."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from erls.equations.nodal.beam import Beams
from erls.equations.nodal.parts import SAME, LinkParts, node_at
from erls.maths import rotation_maps as rotations
from erls.maths.se3 import pose
from erls.maths.so3 import Array
from erls.mechanism.links import Link
from fe_import.model import IntArray


@dataclass(frozen=True)
class LinkState:
    """Link frame in the world (..., 4, 4), which goes with the inboard node; places of the model's nodes (..., n, 3) in
    the world [m], and how they have turned there (..., n, 3, 3); the modal coordinates (..., m) that come nearest to
    both.
    """

    frame: Array
    nodes: Array
    turns: Array
    modal: Array


class LinkView:
    """Where to look for a link.

    Parameters
    ----------
    link : Link
    parts : LinkParts
    nodes : slice
        Its nodes in the system.
    first : int
        Its first beam element there.
    """

    def __init__(self, link: Link, parts: LinkParts, nodes: slice, first: int) -> None:
        self._model = model = link.model
        inboard = node_at(parts, link.inboard.node, f"link {link.name!r}")
        self._inboard, self._back = nodes.start + inboard, pose(position=-parts.nodes[inboard])
        self._elements, self._fractions = first + parts.elements, parts.fractions
        self._carriers = nodes.start + parts.carriers
        self._arms = model.nodes - parts.nodes[parts.carriers] if len(parts.carriers) else None
        self._axes = np.array([b.frames[0, :3, :3] for b in parts.beams])[parts.elements] if parts.beams else None
        self._carried = _carried(parts, nodes.start, inboard, model.nodes)
        reach = float(np.linalg.norm(np.ptp(model.nodes, axis=0))) or 1.0
        self._reach = reach
        shapes = np.concatenate([model.translation_shapes, reach * model.rotation_shapes]).reshape(-1, model.modes)
        self._nearest = np.linalg.pinv(shapes)

    def motion_at(self, numbers: Array) -> tuple[Array, IntArray, Array, Array]:
        """Of frames (k, N, 12), or their derivatives: the link frame (k, 4, 4), and which nodes of its model go with a
        node of the system, their places (k, m, 3) and turns (k, m, 3, 3). All are linear in the numbers of frames.
        """
        own, carriers, arms = self._carried
        frames = numbers[:, carriers, 3:].reshape(len(numbers), -1, 3, 3)
        places = numbers[:, carriers, :3] + np.einsum("knij,nj->kni", frames, arms)
        root = np.zeros((len(numbers), 4, 4))
        root[:, :3, :3] = numbers[:, self._inboard, 3:].reshape(-1, 3, 3)
        root[:, :3, 3] = numbers[:, self._inboard, :3] + root[:, :3, :3] @ self._back[:3, 3]
        return root, own, places, frames

    def at(self, poses: Array, beams: Beams | None, bent: Array) -> LinkState:
        """At poses (..., k, 4, 4) of all nodes, with the twists d (..., e, 6) of the beams."""
        frame = poses[..., self._inboard, :, :] @ self._back
        turn, place = frame[..., :3, :3], frame[..., None, :3, 3]
        model = self._model
        found = self._nodes_at(poses, beams, bent)
        if found is None:
            turns = np.repeat(turn[..., None, :, :], len(model.nodes), axis=-3)
            nodes = model.nodes @ np.swapaxes(turn, -2, -1) + place
            return LinkState(frame, nodes, turns, np.zeros((*frame.shape[:-2], model.modes)))
        nodes, turns = found
        moved = (nodes - place) @ turn - model.nodes
        back = np.swapaxes(turn, -2, -1)[..., None, :, :]
        turned = self._reach * rotations.log(back @ turns[..., model.rotation_nodes, :, :])
        shape = np.concatenate([moved, turned], axis=-2).reshape(*frame.shape[:-2], self._nearest.shape[1])
        return LinkState(frame, nodes, turns, shape @ self._nearest.T)

    def _nodes_at(self, poses: Array, beams: Beams | None, bent: Array) -> tuple[Array, Array] | None:
        """Places (..., n, 3) and turns (..., n, 3, 3) of the model's nodes; None of a rigid link."""
        if self._arms is not None:
            carrying = poses[..., self._carriers, :, :]
            turns = carrying[..., :3, :3]
            return carrying[..., :3, 3] + np.einsum("...nij,nj->...ni", turns, self._arms), turns
        if self._axes is None or beams is None:
            return None
        sections = beams.sections_at(poses, bent, self._elements, self._fractions)
        return sections[..., :3, 3], sections[..., :3, :3] @ np.swapaxes(self._axes, 1, 2)


def _carried(parts: LinkParts, first: int, inboard: int, nodes: Array) -> tuple[IntArray, IntArray, Array]:
    """(m,) nodes of a modal model that go with nodes of the system, (m,) these, and (m, 3) arms in their frames."""
    every = np.arange(len(nodes))
    if len(parts.carriers):
        return every, first + parts.carriers, nodes - parts.nodes[parts.carriers]
    if not parts.beams:
        return every, np.full(len(nodes), first + inboard), nodes - parts.nodes[inboard]
    ends = np.round(parts.fractions).astype(np.int64)
    own = np.flatnonzero(np.abs(parts.fractions - ends) <= SAME)
    beams = np.array([beam.nodes for beam in parts.beams])
    return own, first + beams[parts.elements[own], ends[own]], np.zeros((len(own), 3))
