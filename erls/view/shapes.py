"""Shapes of a picture: parts, joints and ground as surfaces. Geometry only, no window."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from erls.maths.so3 import Array
from fe_import.modal.model import ModalModel
from fe_import.model import IntArray

_SMOOTH = math.cos(math.radians(20.0))  # a frame that turns more at a node has a corner there
SHARP = 35.0  # [deg]; a surface that turns more has an edge there
_SIDES = 24


class Arrow(NamedTuple):
    """A load: (3,) place where it acts, (3,) arrow [m], and whether it is a moment."""

    place: Array
    along: Array
    turns: bool


@dataclass(frozen=True)
class JointPlace:
    """A joint in the world: its displaced frames on the inner and on the outer side, and the nodes they ride on.

    ``type`` is that of the joint; ``inner`` and ``outer`` are (4, 4) poses; ``inner_node`` is None on the ground.
    """

    type: str
    inner: Array
    outer: Array
    inner_node: Array | None
    outer_node: Array


def chains(nodes: Array, lines: IntArray) -> list[list[int]]:
    """Line elements joined to smooth chains of nodes; they end at corners, branches and free ends.

    Parameters
    ----------
    nodes : (n, 3) array
    lines : (l, 2) int array
    """
    left = {(min(a, b), max(a, b)) for a, b in lines.tolist() if a != b}
    beside: dict[int, list[int]] = {}
    for a, b in sorted(left):
        beside.setdefault(a, []).append(b)
        beside.setdefault(b, []).append(a)

    def passes(node: int) -> bool:
        if len(beside[node]) != 2:
            return False
        first, second = (nodes[n] - nodes[node] for n in beside[node])
        return float(-first @ second) > _SMOOTH * float(np.linalg.norm(first) * np.linalg.norm(second))

    result = []
    # open chains first, from nodes where they must end; what is left are smooth loops
    for start in [n for n in beside if not passes(n)] + list(beside):
        for following in beside[start]:
            chain, at = [start], following
            while (min(chain[-1], at), max(chain[-1], at)) in left:
                left.remove((min(chain[-1], at), max(chain[-1], at)))
                chain.append(at)
                if not passes(at):
                    break
                at = next(n for n in beside[at] if n != chain[-2])
            if len(chain) > 1:
                result.append(chain)
    return result


def part_surface(
    positions: Array, triangles: Any, runs: list[list[int]], root: int, values: Array, radius: float
) -> Any:
    """A deformed part: its surface triangles, and its lines as tubes with round ends.

    Parameters
    ----------
    positions : (n, 3) array
    triangles : (t, 3) int array
    runs : list of lists of int
        Smooth chains of nodes.
    root : int
        The node of a part without either.
    values : (n,) array
        Carried along as the point data "value".
    radius : float
        Of tubes [m].

    Returns
    -------
    pyvista.PolyData
        With normals.
    """
    import pyvista as pv

    parts = []
    if len(triangles):
        solid = pv.PolyData.from_regular_faces(positions, triangles)
        solid["value"] = values
        parts.append(with_normals(solid))
    if runs:
        wire = polylines(positions, runs)
        wire["value"] = values
        parts.append(wire.tube(radius=radius, n_sides=_SIDES, capping=True))
    ends = sorted({n for c in runs for n in (c[0], c[-1])})
    if not parts:  # a rigid link with a single point
        ends = [root]
    if ends:
        dots = pv.PolyData(positions[ends])
        dots["value"] = values[ends]
        ball = pv.Sphere(radius=radius if runs else 2 * radius, theta_resolution=_SIDES, phi_resolution=_SIDES)
        parts.append(dots.glyph(geom=ball, scale=False, orient=False))
    return joined(parts)


def thick(positions: Array, triangles: IntArray, heights: Array, values: Array) -> tuple[Array, IntArray, Array]:
    """A surface with its thickness: what it was, then the same on top and at the bottom, and its rim.

    Parameters
    ----------
    positions : (n, 3) array
        Nodes.
    triangles : (t, 3) int array
        Seen from above anticlockwise.
    heights : (n, 2) array
        Of bottom and top over each node, along the mean normal there; at folds so far that both sides keep theirs.
    values : (n,) array

    Returns
    -------
    (3 n, 3), (r, 3), (3 n,) arrays
    """
    corners = positions[triangles]
    ahead, back = (np.roll(corners, k, axis=1) - corners for k in (-1, 1))
    normals = np.cross(ahead, back)
    sizes = np.linalg.norm(normals, axis=-1, keepdims=True)
    each = normals[:, 0] / np.maximum(sizes[:, 0], 1e-300)
    angles = np.arctan2(sizes[..., 0], (ahead * back).sum(axis=-1))  # both sides of a fold weigh the same, however cut
    mean = np.zeros_like(positions)
    np.add.at(mean, triangles, angles[..., None] * each[:, None])
    mean /= np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-300)
    slant, met = np.zeros(len(positions)), np.zeros(len(positions))
    np.add.at(slant, triangles, angles * np.einsum("tc,tkc->tk", each, mean[triangles]))
    np.add.at(met, triangles, angles)
    mean /= np.clip(slant / np.maximum(met, 1e-300), 0.3, 1.0)[:, None]
    count = len(positions)
    places = np.concatenate([positions, *(positions + heights[:, k, None] * mean for k in (1, 0))])
    edges = triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    known = {(a, b) for a, b in edges.tolist()}
    rim = np.array([(a, b) for a, b in edges.tolist() if (b, a) not in known], dtype=np.int64).reshape(-1, 2)
    p, q = rim[:, 0], rim[:, 1]
    sides = [
        np.stack([p + 2 * count, q + 2 * count, q + count], axis=1),
        np.stack([p + 2 * count, q + count, p + count], axis=1),
    ]
    whole = np.concatenate([triangles + count, triangles[:, ::-1] + 2 * count, *sides])
    return places, whole, np.tile(values, 3)


Cells: TypeAlias = tuple[IntArray, IntArray]
"""(t, 3) triangles and (l, 2) lines."""


def drawn_link(model: ModalModel, root: int, cells: Cells, places: Array, values: Array, unit: float) -> Any:
    """A link with its nodes at places (n, 3) as a surface, shells with their thickness, coloured by values (n,)."""
    triangles, lines = cells
    if len(model.heights):
        places, triangles, values = thick(places, triangles, model.heights, values)
    return part_surface(places, triangles, chains(model.nodes, lines), root, values, unit)


def link_outline(model: ModalModel, cells: Cells, places: Array) -> list[Any]:
    """The edges of a link with its nodes at places (n, 3), as thin lines."""
    import pyvista as pv

    triangles, lines = cells
    found = []
    if len(triangles):
        found.append(pv.PolyData.from_regular_faces(places, triangles).extract_feature_edges(SHARP))
    runs = chains(model.nodes, lines)
    return [*found, polylines(places, runs)] if runs else found


def polylines(points: Array, runs: list[list[int]]) -> Any:
    """Curves through points, as pyvista.PolyData."""
    import pyvista as pv

    return pv.PolyData(points, lines=np.concatenate([[len(c), *c] for c in runs]))


def joints_surface(places: list[JointPlace], unit: float) -> Any:
    """Joints as what their types look like, rigid arms as rods."""
    parts = []
    for place in places:
        parts += _JOINTS.get(place.type, _ball)(place, unit)
        if place.inner_node is not None:
            parts += rod(place.inner_node, place.inner[:3, 3], 0.7 * unit)
        parts += rod(place.outer_node, place.outer[:3, 3], 0.7 * unit)
    return joined([with_normals(p) for p in parts])


def _pin(unit: float, radius: float, height: float, direction: tuple[int, int, int] = (0, 0, 1)) -> Any:
    import pyvista as pv

    return pv.Cylinder(direction=direction, radius=radius * unit, height=height * unit, resolution=48)


def _box(unit: float, half: float, height: float) -> Any:
    import pyvista as pv

    a, b = half * unit, height * unit
    return pv.Box(bounds=(-a, a, -a, a, -b, b))


def _revolute(place: JointPlace, unit: float) -> list[Any]:
    """A cylinder and a pin along the axis."""
    return [s.transform(place.inner, inplace=False) for s in (_pin(unit, 2.2, 5.0), _pin(unit, 0.6, 8.0))]


def _prismatic(place: JointPlace, unit: float) -> list[Any]:
    """A box on a rail."""
    rail = rod(place.inner[:3, 3], place.outer[:3, 3], 0.8 * unit)
    return [_box(unit, 2.5, 4.0).transform(place.outer, inplace=False), *rail]


def _cylindrical(place: JointPlace, unit: float) -> list[Any]:
    """A sleeve on a rail."""
    rail = rod(place.inner[:3, 3], place.outer[:3, 3], 0.8 * unit)
    return [s.transform(place.outer, inplace=False) for s in (_pin(unit, 2.2, 7.0), _pin(unit, 0.8, 10.0))] + rail


def _universal(place: JointPlace, unit: float) -> list[Any]:
    """A cross of two pins, x of the inner frame and y of the outer one."""
    first, second = _pin(unit, 0.9, 6.0, (1, 0, 0)), _pin(unit, 0.9, 6.0, (0, 1, 0))
    return [first.transform(place.inner, inplace=False), second.transform(place.outer, inplace=False)]


def _fixed(place: JointPlace, unit: float) -> list[Any]:
    """A block."""
    return [_box(unit, 1.8, 1.8).transform(place.outer, inplace=False)]


def _ball(place: JointPlace, unit: float) -> list[Any]:
    """A ball: a spherical joint, and any other."""
    import pyvista as pv

    return [pv.Sphere(radius=2.2 * unit, center=place.outer[:3, 3])]


_JOINTS = {
    "revolute": _revolute,
    "prismatic": _prismatic,
    "cylindrical": _cylindrical,
    "screw": _cylindrical,
    "universal": _universal,
    "fixed": _fixed,
}


def with_normals(surface: Any) -> Any:
    """A surface with normals for smooth light, and sharp edges kept."""
    return surface.triangulate().compute_normals(split_vertices=True, feature_angle=SHARP)


def joined(parts: list[Any]) -> Any:
    """Surfaces as one."""
    return parts[0].append_polydata(*parts[1:]) if len(parts) > 1 else parts[0]


def rod(start: Array, end: Array, radius: float) -> list[Any]:
    """A round rod between two places, none between places that meet."""
    import pyvista as pv

    if np.linalg.norm(end - start) < radius:
        return []
    return [pv.Line(pointa=start, pointb=end).tube(radius=radius, n_sides=_SIDES, capping=True)]


def ground_surface(place: Array, towards: Array, unit: float) -> Any:
    """A hatched plate across a joint's axis.

    Parameters
    ----------
    place : (4, 4) array
        Joint frame.
    towards : (3,) array
        Direction to the viewer; the plate stands behind the joint.
    unit : float
        Radius of a link [m].
    """
    import pyvista as pv

    side = -1.0 if place[:3, 2] @ towards > 0 else 1.0
    half, near, far = 6 * unit, 3.4 * unit, 4.6 * unit
    middle = (0, 0, side * near / 2)
    post = pv.Cylinder(center=middle, direction=(0, 0, 1), radius=1.2 * unit, height=near, resolution=32)
    plate = pv.Box(bounds=(-half, half, -half, half, *sorted((side * near, side * far))))
    parts = [post, plate]
    slant = 2.4 * unit
    for x in np.linspace(-half + slant, half, 5):
        for y in (-half, half):
            start, end = np.array([x, y, side * far]), np.array([x - slant, y, side * (far + slant)])
            parts += rod(start, end, 0.28 * unit)
            parts += rod(start[[1, 0, 2]], end[[1, 0, 2]], 0.28 * unit)
    return joined([with_normals(p) for p in parts]).transform(place, inplace=False)


def load_surface(arrow: Arrow) -> Any:
    """An arrow, of a moment with two heads."""
    import pyvista as pv

    length = float(np.linalg.norm(arrow.along))
    heads = (1.0, 0.8) if arrow.turns else (1.0,)
    parts = [
        pv.Arrow(start=arrow.place, direction=arrow.along, scale=share * length, tip_length=0.18 / share,
                 tip_radius=0.06 / share, shaft_radius=0.02 / share, tip_resolution=24, shaft_resolution=16)
        for share in heads
    ]  # fmt: skip
    return joined([with_normals(part) for part in parts])


def sensor_surface(place: Array, unit: float) -> Any:
    """An octahedron."""
    import pyvista as pv

    return pv.PlatonicSolid("octahedron", radius=2.6 * unit, center=place)


def plane_surface(corners: Array) -> Any:
    """A piece of a plane with corners (4, 3)."""
    import pyvista as pv

    return pv.PolyData.from_regular_faces(corners, np.array([[0, 1, 2, 3]]))
