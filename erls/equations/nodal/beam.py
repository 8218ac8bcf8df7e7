"""Beam elements: sections between two nodes, straight or curved, and their arrays.

Section frames are fixed to the node frames, so that members may meet at a node under any angle; the twist d₀ from one
end to the other without force follows from the frames as built, and from how far the element expands. Forces are in
`erls.equations.nodal.beam_forces`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from copy import copy
from dataclasses import dataclass

import numpy as np

from erls.equations.nodal.contract import HELICOIDAL, LINEAR
from erls.equations.nodal.rigid_body import RigidBody
from erls.equations.nodal.scatter import IntArray
from erls.equations.nodal.section import BeamSection
from erls.errors import Cause, SceneError
from erls.maths import motion_maps as motions
from erls.maths.so3 import Array


@dataclass(frozen=True)
class Beam:
    """One element.

    Attributes
    ----------
    nodes : (int, int)
    frames : (2, 4, 4) array
        Sections at the ends as built, in the world; x runs along the beam.
    section : BeamSection
    expansion : float
        Axial strain without force, of temperature.
    linear : bool
        Its kinetic energy is that of places and turns that are linear between its ends, `beam_linear`; otherwise that
        of the interpolation of its strains.
    """

    nodes: tuple[int, int]
    frames: Array
    section: BeamSection
    expansion: float = 0.0
    linear: bool = False


def straight(nodes: tuple[int, int], start: Array, end: Array, section: BeamSection, up: Array) -> Beam:
    """Beam between two points [m]; its z axis lies as near ``up`` as possible.

    Raises
    ------
    SceneError
        With cause BAD_FIELD when the points coincide, or ``up`` lies along the beam.
    """
    along = np.asarray(end, dtype=float) - start
    side = np.cross(up, along)
    if np.linalg.norm(side) <= 1e-9 * np.linalg.norm(up) * np.linalg.norm(along):
        raise SceneError(
            Cause.BAD_FIELD,
            "the beam has no length, or its z axis lies along it",
            where=f"beam between nodes {nodes[0]} and {nodes[1]}: up",
            value=list(up),
            remedy="give two points apart, and a direction across the beam",
        )
    x, y = along / np.linalg.norm(along), side / np.linalg.norm(side)
    axes = np.stack([x, y, np.cross(x, y)], axis=1)
    return Beam(nodes, motions.poses(np.array([axes, axes]), np.array([start, end], dtype=float)), section)


class Beams:
    """All beams of a system as arrays, for `erls.equations.nodal.beam_forces`.

    Parameters
    ----------
    beams : sequence of Beam
    poses : (k, 4, 4) array
        All nodes as built.
    gravity : (3,) array
        [m/s²]
    """

    breakpoints: tuple[float, ...] = ()

    def __init__(self, beams: Sequence[Beam], poses: Array, gravity: Array) -> None:
        self.nodes: IntArray = np.array([b.nodes for b in beams], dtype=np.int64).reshape(-1, 2)
        self.frames = motions.inverse(poses[self.nodes]) @ np.array([b.frames for b in beams]).reshape(-1, 2, 4, 4)
        sections = poses[self.nodes] @ self.frames
        built = motions.log(motions.inverse(sections[:, 0]) @ sections[:, 1])
        self.length: Array = np.linalg.norm(built[:, :3], axis=1)
        self.expansion = np.array([b.expansion for b in beams])
        self.built = self.without_force(built)
        self.stiffness = np.array([b.section.stiffness for b in beams]).reshape(-1, 6, 6) / self.length[:, None, None]
        self.inertia = np.array([b.section.inertia for b in beams]).reshape(-1, 6, 6) * self.length[:, None, None]
        ways = np.array([LINEAR if b.linear else HELICOIDAL for b in beams], dtype=np.int64)
        self.moving: IntArray = ways * self.inertia.any(axis=(1, 2))
        self.gravity = np.asarray(gravity, dtype=float)

    def strains(self, bent: Array) -> Array:
        """(e, 6) [γ; κ] of elements with twists d (e, 6), less their expansion."""
        result: Array = (bent - self.built) / self.length[:, None]
        return result

    def without_force(self, built: Array) -> Array:
        """(e, 6) d₀: twists as built, lengthened by the expansion, which changes no angle."""
        result: Array = built.copy()
        result[:, :3] *= 1 + self.expansion[:, None]
        return result

    def without_weight(self) -> Beams:
        """The same beams where nothing pulls them down."""
        found = copy(self)
        found.gravity = np.zeros(3)
        return found

    def sections_at(self, poses: Array, bent: Array, elements: IntArray, fractions: Array) -> Array:
        """(p, 4, 4) sections of elements (p,), at these fractions (p,) of their lengths, at node poses (k, 4, 4)."""
        first = poses[self.nodes[elements, 0]] @ self.frames[elements, 0]
        result: Array = first @ motions.exp(fractions[:, None] * bent[elements])
        return result


def lumped(beams: Sequence[Beam], poses: Array) -> list[RigidBody]:
    """Half of each beam's mass and rotary inertia as rigid bodies at its nodes; give `Beams` sections without then."""
    bodies = []
    for node, local, half in halves(beams, poses):
        turn = local[:3, :3]
        inertia = turn @ half[3:, 3:] @ turn.T
        bodies.append(RigidBody(node, float(half[0, 0]), (inertia + inertia.T) / 2, local[:3, 3]))
    return bodies


def halves(beams: Sequence[Beam], poses: Array) -> Iterator[tuple[int, Array, Array]]:
    """Of both ends of each beam the node, the section's frame (4, 4) in it, and half of the beam's inertia (6, 6) in
    axes of the section.
    """
    for beam in beams:
        d = motions.log(motions.inverse(beam.frames[0]) @ beam.frames[1])
        half = float(np.linalg.norm(d[:3])) / 2
        for node, frame in zip(beam.nodes, beam.frames, strict=True):
            yield node, motions.inverse(poses[node]) @ frame, half * beam.section.inertia

