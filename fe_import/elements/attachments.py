"""What a mesh file attaches to a solid: point masses, springs, rigid bodies, averages, linear equations. Data only.

Components are 0 ... 5: displacements, then rotations, along the axes of the mesh. ``keyword`` is that of the file.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fe_import.model import Array, IntArray

Terms = tuple[tuple[int, int, float], ...]  # node, component, coefficient


@dataclass(frozen=True)
class AttachedMass:
    """A mass at ``offset`` (3,) from a node, with inertia (3, 3) about itself."""

    keyword: str
    node: int
    mass: float
    inertia: Array
    offset: Array


@dataclass(frozen=True)
class AttachedSpring:
    """Energy ½ ``stiffness`` (Σ coefficient · component)²."""

    keyword: str
    stiffness: float
    terms: Terms


@dataclass(frozen=True)
class LinearEquation:
    """Σ coefficient · component = 0; the first term follows from the others where it can."""

    keyword: str
    terms: Terms


@dataclass(frozen=True)
class RigidBody:
    """Nodes that follow a reference node, which has rotations."""

    keyword: str
    reference: int
    nodes: IntArray


@dataclass(frozen=True)
class AverageNode:
    """A reference node that moves as nodes do on average, with their weights."""

    keyword: str
    reference: int
    nodes: IntArray
    weights: Array


Attachment = AttachedMass | AttachedSpring | LinearEquation | RigidBody | AverageNode


def nodes_of(item: Attachment) -> list[int]:
    """All nodes that an attachment names."""
    if isinstance(item, AttachedMass):
        return [item.node]
    if isinstance(item, (RigidBody, AverageNode)):
        return [item.reference, *item.nodes.tolist()]
    return [node for node, _, _ in item.terms]


def renumbered(item: Attachment, new: Callable[[int], int]) -> Attachment:
    """The same with other numbers of nodes."""
    if isinstance(item, AttachedMass):
        return replace(item, node=new(item.node))
    if isinstance(item, (RigidBody, AverageNode)):
        nodes = np.array([new(n) for n in item.nodes.tolist()], dtype=np.int64)
        return replace(item, reference=new(item.reference), nodes=nodes)
    return replace(item, terms=tuple((new(n), component, c) for n, component, c in item.terms))


def needs_rotations(item: Attachment) -> list[int]:
    """Nodes that turn: they lead or average others, carry inertia or an arm, or their rotation is named."""
    if isinstance(item, AttachedMass):
        return [item.node] if item.inertia.any() or item.offset.any() else []
    if isinstance(item, (RigidBody, AverageNode)):
        return [item.reference]
    return [node for node, component, _ in item.terms if component > 2]
