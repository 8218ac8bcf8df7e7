"""Shapes of a picture: the deformed links, joints and ground as surfaces. Geometry only, no window."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from erls.equations.formulation import State
from erls.maths.se3 import inverse, pose
from erls.maths.so3 import Array
from erls.mechanism.links import Link
from erls.run.record import Run, node_positions
from fe_import.model import IntArray

_SMOOTH = math.cos(math.radians(20.0))  # a frame that turns more at a node has a corner there
SHARP = 35.0  # [deg]; a surface that turns more has an edge there
_SIDES = 24


@dataclass(frozen=True)
class JointPlace:
    """A joint in the world: its displaced frames on the inner and on the outer side, and the nodes they ride on.

    ``inner`` and ``outer`` are (4, 4) poses; ``inner_node`` is None on the ground.
    """

    revolute: bool
    inner: Array
    outer: Array
    inner_node: Array | None
    outer_node: Array


def deflection(run: Run, state: State, link: int) -> Array:
    """(n, 3) displacement of a link's nodes against the equivalent rigid link, world axes [m]."""
    model, turn = run.formulation.mechanism.links[link].model, state.poses[link][:3, :3]
    return np.asarray((model.translation_shapes @ state.modal[link]) @ turn.T)


def joint_places(run: Run, state: State, magnification: float) -> list[JointPlace]:
    """Every joint in its displaced place."""
    mechanism = run.formulation.mechanism
    result = []
    for k, joint in enumerate(mechanism.joints):
        inner, inner_node = joint.before, None
        if k:
            before, interface = mechanism.links[k - 1], mechanism.links[k - 1].outboard
            if interface is not None:
                inner = _displaced(before, interface, joint.before, state, k - 1, magnification)
                inner_node = node_positions(run, state, k - 1, [interface.node], magnification)[0]
        after = mechanism.links[k]
        outer = _displaced(after, after.inboard, inverse(joint.after), state, k, magnification)
        outer_node = node_positions(run, state, k, [after.inboard.node], magnification)[0]
        result.append(JointPlace(joint.type.revolute, inner, outer, inner_node, outer_node))
    return result


def _displaced(link: Link, interface: Any, frame: Array, state: State, number: int, factor: float) -> Array:
    """(4, 4) world pose of a frame that rides on an interface of a deformed link."""
    u = factor * (link.interface_shape(interface, frame) @ state.modal[number])
    step = pose(Rotation.from_rotvec(u[3:]).as_matrix(), u[:3])
    return np.asarray(state.poses[number] @ frame @ step)


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


def link_surface(link: Link, positions: Array, values: Array, radius: float) -> Any:
    """A deformed link: its surface triangles, and its line elements as tubes with round ends.

    Parameters
    ----------
    link : Link
    positions : (n, 3) array
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
    if len(link.model.triangles):
        solid = pv.PolyData.from_regular_faces(positions, link.model.triangles)
        solid["value"] = values
        parts.append(with_normals(solid))
    runs = chains(link.model.nodes, link.model.lines)
    if runs:
        wire = polylines(positions, runs)
        wire["value"] = values
        parts.append(wire.tube(radius=radius, n_sides=_SIDES, capping=True))
    ends = sorted({n for c in runs for n in (c[0], c[-1])})
    if not parts:  # a rigid link with a single point
        ends = [link.inboard.node]
    if ends:
        dots = pv.PolyData(positions[ends])
        dots["value"] = values[ends]
        ball = pv.Sphere(radius=radius if runs else 2 * radius, theta_resolution=_SIDES, phi_resolution=_SIDES)
        parts.append(dots.glyph(geom=ball, scale=False, orient=False))
    return _joined(parts)


def polylines(points: Array, runs: list[list[int]]) -> Any:
    """Curves through points, as pyvista.PolyData."""
    import pyvista as pv

    return pv.PolyData(points, lines=np.concatenate([[len(c), *c] for c in runs]))


def joints_surface(places: list[JointPlace], unit: float) -> Any:
    """Revolute joints as cylinders along their axis, prismatic ones as boxes on a rail, rigid arms as rods."""
    import pyvista as pv

    parts = []
    for place in places:
        if place.revolute:
            body = pv.Cylinder(direction=(0, 0, 1), radius=2.2 * unit, height=5 * unit, resolution=48)
            pin = pv.Cylinder(direction=(0, 0, 1), radius=0.6 * unit, height=8 * unit, resolution=24)
            parts += [s.transform(place.inner, inplace=False) for s in (body, pin)]
        else:
            half = 2.5 * unit
            box = pv.Box(bounds=(-half, half, -half, half, -1.6 * half, 1.6 * half))
            parts.append(box.transform(place.outer, inplace=False))
            parts += _rod(place.inner[:3, 3], place.outer[:3, 3], 0.8 * unit)
        if place.inner_node is not None:
            parts += _rod(place.inner_node, place.inner[:3, 3], 0.7 * unit)
        parts += _rod(place.outer_node, place.outer[:3, 3], 0.7 * unit)
    return _joined([with_normals(p) for p in parts])


def with_normals(surface: Any) -> Any:
    """A surface with normals for smooth light, and sharp edges kept."""
    return surface.triangulate().compute_normals(split_vertices=True, feature_angle=SHARP)


def _joined(parts: list[Any]) -> Any:
    return parts[0].append_polydata(*parts[1:]) if len(parts) > 1 else parts[0]


def _rod(start: Array, end: Array, radius: float) -> list[Any]:
    import pyvista as pv

    if np.linalg.norm(end - start) < radius:
        return []
    return [pv.Line(pointa=start, pointb=end).tube(radius=radius, n_sides=_SIDES, capping=True)]


def ground_surface(place: Array, towards: Array, unit: float) -> Any:
    """A hatched plate across the first joint's axis.

    Parameters
    ----------
    place : (4, 4) array
        First joint frame.
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
            parts += _rod(start, end, 0.28 * unit)
            parts += _rod(start[[1, 0, 2]], end[[1, 0, 2]], 0.28 * unit)
    return _joined([with_normals(p) for p in parts]).transform(place, inplace=False)


def rigid_outline(run: Run, state: State) -> list[Any]:
    """The links without displacement, as thin lines: the Equivalent Rigid Link System."""
    import pyvista as pv

    result = []
    for k, link in enumerate(run.formulation.mechanism.links):
        positions = node_positions(run, state, k, magnification=0.0)
        if len(link.model.triangles):
            solid = pv.PolyData.from_regular_faces(positions, link.model.triangles)
            result.append(solid.extract_feature_edges(SHARP))
        runs = chains(link.model.nodes, link.model.lines)
        if runs:
            result.append(polylines(positions, runs))
    return result
