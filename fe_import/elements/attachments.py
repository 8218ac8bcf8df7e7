"""What a mesh file attaches to a solid: masses, springs, beams, rigid bodies, averages, linear equations. Data only.

Components are 0 ... 5: displacements, then rotations, along the axes of the mesh. ``keyword`` is that of the file.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fe_import.elements.frame import FrameElement
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
    """Energy ½ Σ stiffness (Σ coefficient · component)², the outer sum over its ``forms``."""

    keyword: str
    forms: tuple[tuple[float, Terms], ...]


@dataclass(frozen=True)
class AttachedBeam:
    """A straight beam between points at ``offsets`` (2, 3) from two nodes, which turn with it.

    Attributes
    ----------
    keyword : str
    material : str
        Its name in the file.
    element : FrameElement
        With the numbers of the nodes; its length is that between the points.
    offsets : (2, 3) array
    released : tuple of int
        Local components that its ends do not pass on: 0 ... 5 of the first, 6 ... 11 of the second.
    line_mass : float
        Nonstructural mass per length, without rotary inertia.
    """

    keyword: str
    material: str
    element: FrameElement
    offsets: Array
    released: tuple[int, ...] = ()
    line_mass: float = 0.0


@dataclass(frozen=True)
class LinearEquation:
    """Σ coefficient · component = 0; the first term follows from the others where it can."""

    keyword: str
    terms: Terms


@dataclass(frozen=True)
class RigidBody:
    """Nodes that follow a reference node, which has rotations, in some of their components (a node may lack these)."""

    keyword: str
    reference: int
    nodes: IntArray
    components: tuple[int, ...] = (0, 1, 2, 3, 4, 5)


@dataclass(frozen=True)
class AverageNode:
    """A reference node that moves as nodes do on average, with their weights; None: by their shares of the area."""

    keyword: str
    reference: int
    nodes: IntArray
    weights: Array | None


@dataclass(frozen=True)
class TiedNodes:
    """Nodes that go with the faces on which they lie.

    Attributes
    ----------
    keyword : str
    nodes : (k,) int array
    triangles, quadrilaterals : (t, 3), (q, 4) int arrays
        Corners of the faces.
    tolerance : float
        Nodes farther away stay free; a share of the size of the face when 0.
    """

    keyword: str
    nodes: IntArray
    triangles: IntArray
    quadrilaterals: IntArray
    tolerance: float = 0.0


Attachment = AttachedMass | AttachedSpring | AttachedBeam | LinearEquation | RigidBody | AverageNode | TiedNodes


def nodes_of(item: Attachment) -> list[int]:
    """All nodes that an attachment names."""
    if isinstance(item, AttachedMass):
        return [item.node]
    if isinstance(item, AttachedBeam):
        return list(item.element.nodes)
    if isinstance(item, (RigidBody, AverageNode)):
        return [item.reference, *item.nodes.tolist()]
    if isinstance(item, TiedNodes):
        return [n for part in (item.nodes, item.triangles, item.quadrilaterals) for n in part.ravel().tolist()]
    return [node for node, _, _ in _terms(item)]


def _terms(item: AttachedSpring | LinearEquation) -> list[tuple[int, int, float]]:
    if isinstance(item, LinearEquation):
        return [*item.terms]
    return [term for _, terms in item.forms for term in terms]


def renumbered(item: Attachment, new: Callable[[int], int]) -> Attachment:
    """The same with other numbers of nodes."""
    if isinstance(item, AttachedMass):
        return replace(item, node=new(item.node))
    if isinstance(item, AttachedBeam):
        first, second = item.element.nodes
        return replace(item, element=replace(item.element, nodes=(new(first), new(second))))
    if isinstance(item, (RigidBody, AverageNode)):
        return replace(item, reference=new(item.reference), nodes=_all(item.nodes, new))
    if isinstance(item, TiedNodes):
        faces = _all(item.triangles, new), _all(item.quadrilaterals, new)
        return replace(item, nodes=_all(item.nodes, new), triangles=faces[0], quadrilaterals=faces[1])
    if isinstance(item, AttachedSpring):
        return replace(item, forms=tuple((stiffness, _moved(terms, new)) for stiffness, terms in item.forms))
    return replace(item, terms=_moved(item.terms, new))


def _moved(terms: Terms, new: Callable[[int], int]) -> Terms:
    return tuple((new(node), component, c) for node, component, c in terms)


def _all(nodes: IntArray, new: Callable[[int], int]) -> IntArray:
    return np.array([new(n) for n in nodes.ravel().tolist()], dtype=np.int64).reshape(nodes.shape)


def needs_rotations(item: Attachment) -> list[int]:
    """Nodes that turn: they lead or average others, carry inertia, an arm or a beam, or are named."""
    if isinstance(item, AttachedMass):
        return [item.node] if item.inertia.any() or item.offset.any() else []
    if isinstance(item, AttachedBeam):
        held = [not set(item.released) >= {k + 3, k + 4, k + 5} for k in (0, 6)]
        ends = zip(item.element.nodes, held, item.offsets, strict=True)
        return [node for node, passes, offset in ends if passes or offset.any()]
    if isinstance(item, (RigidBody, AverageNode)):
        return [item.reference]
    if isinstance(item, TiedNodes):
        return []
    return [node for node, component, _ in _terms(item) if component > 2]
