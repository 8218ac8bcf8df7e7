"""What the run of a chain looks like: deformed links, joints, the ground."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from erls.equations.formulation import State
from erls.maths.se3 import inverse, pose
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.joint_types import single
from erls.mechanism.links import Link
from erls.mechanism.loops import LoopEnd
from erls.mechanism.sensors.base import Node
from erls.run.chain.places import node_positions, rigid_frames, rigid_positions, surface_positions
from erls.run.chain.run import ChainRun
from erls.view.figure import DEFLECTION, Figure, Part, PartMesh, Pose, Shade
from erls.view.marks import Acting, arrows, loads_of, sensor_places
from erls.view.shapes import Arrow, JointPlace, drawn_link, ground_surface, joints_surface, link_outline, plane_surface
from erls.view.stress import chain_values
from fe_import.model import IntArray

_PLANE = 0.12  # half of the width that is drawn of a plane, of the size of the largest link


@dataclass(frozen=True)
class ChainFigure(Figure):
    """A run of a chain."""

    run: ChainRun
    shade: Shade = DEFLECTION
    part = "link"

    @property
    def gravity(self) -> Array:
        """(3,) [m/s²]"""
        return self.run.formulation.mechanism.gravity

    @property
    def size(self) -> float:
        """Of the largest link [m]."""
        links = self.run.formulation.mechanism.links
        return max(link.size for link in links)

    def fixed(self) -> Array:
        """(n, 3) joints on the ground, and corners of what is drawn of planes there."""
        joints = np.array([frame[:3, 3] for frame in self._standing]).reshape(-1, 3)
        return np.concatenate([joints, *self._planes])

    def ground(self, towards: Array, unit: float) -> list[Any]:
        """A plate behind each joint on it, a piece of each plane that points may touch."""
        plates = [ground_surface(frame, towards, unit) for frame in self._standing]
        return [*plates, *(plane_surface(corners) for corners in self._planes)]

    @property
    def _standing(self) -> list[Array]:
        """(4, 4) frames on the ground of joints and closing joints."""
        mechanism = self.run.formulation.mechanism
        ends = [end for loop in mechanism.loops if loop.holds_frames for end in (loop.inner, loop.outer)]
        frames = [joint.before for joint in mechanism.joints if joint.parent < 0]
        return frames + [end.frame for end in ends if end.link is None]

    @cached_property
    def _planes(self) -> list[Array]:
        """(4, 3) corners of a piece of each plane on the ground, below where its point begins."""
        mechanism, (start,) = self.run.formulation.mechanism, self.run.states([self.run.start])
        found = []
        for contact in mechanism.contacts:
            if contact.base is None:
                place = node_positions(mechanism, start, contact.link, [contact.node])[0]
                normal, *along = contact.axes.reshape(3, 3)
                below = place - ((place - contact.position) @ normal) * normal
                sides = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) @ (_PLANE * self.size * np.array(along))
                found.append(below + sides)
        return found

    def poses(self, times: Sequence[float] | Array) -> list[ChainPose]:
        """The chain at each time."""
        mechanism, states = self.run.formulation.mechanism, self.run.states(list(times))
        marks = zip(states, loads_of(self.run, times), strict=True)
        plain = [ChainPose(at.time, mechanism, at, tuple(acting), self._sensors) for at, acting in marks]
        if self.shade is DEFLECTION:
            return plain
        found = chain_values(self.run, times, self.shade)
        each = [[None if own is None else own[k] for own in found] for k in range(len(states))]
        return [replace(pose, shade=self.shade, held=own) for pose, own in zip(plain, each, strict=True)]

    @cached_property
    def _sensors(self) -> dict[str, Node | str]:
        return sensor_places(self.run)

    def paths(self, times: Array, magnification: float) -> list[Array]:
        """All times at once."""
        mechanism, states = self.run.formulation.mechanism, self.run.series(times)
        places = [node_positions(mechanism, states, p.link, [p.node], magnification) for p in mechanism.points]
        return [place[:, 0] for place in places]


@dataclass(frozen=True)
class ChainPose(Pose):
    """A chain in a state, with what acts on it, where sensors are, and what colours say at the nodes of its links, None
    of those without.
    """

    time: float
    mechanism: Mechanism
    state: State
    acting: tuple[Acting, ...] = ()
    watching: Mapping[str, Node | str] = field(default_factory=dict)
    shade: Shade = DEFLECTION
    held: list[Array | None] | None = None

    def points(self, magnification: float) -> list[Array]:
        """(3,) places of the named points."""
        return [self._nodes(p.link, magnification, [p.node])[0] for p in self.mechanism.points]

    def nodes(self, magnification: float) -> list[Array]:
        """(n, 3) nodes of each link, then the corners of its surface."""
        return [self._drawn(k, magnification) for k in self.mechanism.bodies]

    def deflections(self) -> list[Array]:
        """(n,) of each link against the equivalent rigid one [m]."""
        return [np.linalg.norm(self._displacement(k), axis=1) for k in self.mechanism.bodies]

    def values(self) -> list[Array]:
        """(n,) of each link's nodes."""
        if self.held is None:
            return super().values()
        every = [(self.held[k], len(_corners(self.mechanism.links[k]))) for k in self.mechanism.bodies]
        return [np.full(count, np.nan) if own is None else own for own, count in every]

    @property
    def _links(self) -> list[Link]:
        return [self.mechanism.links[k] for k in self.mechanism.bodies]

    def anchor(self) -> Array:
        """(3,) the last link."""
        return np.asarray(self.state.poses[-1][:3, 3])

    def parts(self, magnification: float, unit: float) -> list[Part]:
        """Deformed links."""
        found = []
        for link, places, values in zip(self._links, self.nodes(magnification), self.values(), strict=True):
            cells = _cells(link)
            surface = drawn_link(link.model, link.inboard.node, cells, places, values, unit)
            found.append(Part(surface, bool(len(cells[0]))))
        return found

    def joints(self, magnification: float, unit: float, moving: bool) -> Any:
        """Joints on their links."""
        places = joint_places(self.mechanism, self.state, magnification)
        places += closing_places(self.mechanism, self.state, magnification)
        if moving:  # hinges on the ground stay where they are
            places = [place for place in places if place.inner_node is not None or place.type != "revolute"]
        return joints_surface(places, unit) if places else None

    def loads(self, magnification: float) -> list[Arrow]:
        """On nodes, and on centres of mass."""
        return arrows(self.mechanism, self.state, self.acting, magnification)

    def sensors(self, magnification: float) -> dict[str, Array]:
        """On nodes and joints."""
        names = [joint.name for joint in self.mechanism.joints]
        names += [loop.name for loop in self.mechanism.loops if loop.holds_frames]
        joints: dict[str, Array] = {}
        if any(isinstance(at, str) for at in self.watching.values()):
            seen = joint_places(self.mechanism, self.state, magnification)
            seen += closing_places(self.mechanism, self.state, magnification)
            joints = {name: place.inner[:3, 3] for name, place in zip(names, seen, strict=True)}
        places = {
            name: joints.get(at) if isinstance(at, str) else self._nodes(at.link, magnification, [at.node])[0]
            for name, at in self.watching.items()
        }
        return {name: place for name, place in places.items() if place is not None}

    def outline(self) -> list[Any]:
        """The links without displacement: the Equivalent Rigid Link System."""
        outlines = zip(self._links, self.nodes(0.0), strict=True)
        return [line for link, places in outlines for line in link_outline(link.model, _cells(link), places)]

    def meshes(self, magnification: float) -> list[PartMesh]:
        """Links, in the order of their nodes, then of the corners of their surfaces."""
        found = []
        for k, places in zip(self.mechanism.bodies, self.nodes(magnification), strict=True):
            link = self.mechanism.links[k]
            held = None if self.held is None else self.held[k]
            more = {} if held is None else {self.shade.array: held}
            triangles, lines = _cells(link)
            cells = [(kind, c) for kind, c in (("line", lines), ("triangle", triangles)) if len(c)]
            cells = cells or [("vertex", np.arange(len(places))[:, None])]
            rigid = link.model.surface is not None
            found.append(PartMesh(link.name, places, cells, self._displacement(k), more, rigid))
        return found

    def _nodes(self, link: int, magnification: float, nodes: Any = slice(None)) -> Array:
        return node_positions(self.mechanism, self.state, link, nodes, magnification)

    def _drawn(self, link: int, magnification: float) -> Array:
        """(n, 3) nodes, then corners."""
        surface, nodes = self.mechanism.links[link].model.surface, self._nodes(link, magnification)
        if surface is None:
            return nodes
        corners = surface_positions(self.mechanism, self.state, link, surface.points, magnification)
        return np.concatenate([nodes, corners])

    def _displacement(self, link: int) -> Array:
        """(n, 3) of nodes and corners against the equivalent rigid link, world axes [m]."""
        if self.mechanism.links[link].model.surface is not None:
            return self._drawn(link, 1.0) - self._drawn(link, 0.0)
        return self._nodes(link, 1.0) - rigid_positions(self.mechanism, self.state, link)


def _corners(link: Link) -> Array:
    """(n, 3) nodes, then corners of the surface, mesh frame."""
    model = link.model
    return model.nodes if model.surface is None else np.concatenate([model.nodes, model.surface.points])


def _cells(link: Link) -> tuple[IntArray, IntArray]:
    """Triangles and lines that are drawn, over nodes and corners; a surface stands in place of both of the nodes."""
    model = link.model
    if model.surface is None:
        return model.triangles, model.lines
    return model.surface.triangles + len(model.nodes), model.lines[:0]


def joint_places(mechanism: Mechanism, state: State, magnification: float) -> list[JointPlace]:
    """Every joint in its displaced place."""
    result = []
    for k, joint in enumerate(mechanism.joints):
        inner, inner_node = joint.before, None
        if joint.seat is not None:
            below = joint.parent
            inner = _displaced(mechanism, joint.seat, joint.before, state, below, magnification)
            inner_node = node_positions(mechanism, state, below, [joint.seat.node], magnification)[0]
        after = mechanism.links[k]
        outer = _displaced(mechanism, after.inboard, inverse(joint.after), state, k, magnification)
        outer_node = node_positions(mechanism, state, k, [after.inboard.node], magnification)[0]
        kind = "fixed" if joint.fixed else single(joint.freedom).name
        along = pose(np.roll(np.eye(3), joint.freedom.axis - 2, axis=0))  # z along the axis of the motion
        result.append(JointPlace(kind, inner @ along, outer @ along, inner_node, outer_node))
    return result


def closing_places(mechanism: Mechanism, state: State, magnification: float) -> list[JointPlace]:
    """Every closing joint and bushing, likewise."""
    result = []
    for loop in mechanism.loops:
        if not loop.holds_frames:
            continue
        kind, along = "spherical", np.eye(4)
        if loop.freedom is not None:
            kind = single(loop.freedom.freedom).name
            along = pose(np.roll(np.eye(3), loop.freedom.freedom.axis - 2, axis=0))
        inner, inner_node = _end(mechanism, state, loop.inner, magnification)
        outer, outer_node = _end(mechanism, state, loop.outer, magnification)
        on_links = outer[:3, 3] if outer_node is None else outer_node
        result.append(JointPlace(kind, inner @ along, outer @ along, inner_node, on_links))
    return result


def _end(mechanism: Mechanism, state: State, end: LoopEnd, magnification: float) -> tuple[Array, Array | None]:
    """(4, 4) world pose of a frame of a closing joint, turned as its link, and (3,) the node that carries it."""
    if end.link is None:
        return end.frame, None
    (node,) = node_positions(mechanism, state, end.link, [end.node], magnification)
    turned = state.poses[end.link][:3, :3]
    return pose(turned @ end.frame[:3, :3], node + turned @ end.frame[:3, 3]), node


def _displaced(mechanism: Mechanism, interface: Any, frame: Array, state: State, number: int, factor: float) -> Array:
    """(4, 4) world pose of a frame that rides on an interface of a deformed link, its displacement against the rigid
    chain magnified.
    """
    link, q = mechanism.links[number], state.modal[number]
    u = link.interface_shape(interface, frame) @ q
    if "foreshortening" in mechanism.effects and link.second_order is not None:
        u = u + link.second_order.interface(interface, frame) @ q @ q / 2
    true = state.poses[number] @ frame @ pose(Rotation.from_rotvec(u[3:]).as_matrix(), u[:3])
    if factor == 1.0:
        return np.asarray(true)
    rigid = rigid_frames(mechanism, state)[number] @ frame
    turned = factor * Rotation.from_matrix(rigid[:3, :3].T @ true[:3, :3]).as_rotvec()
    place = rigid[:3, 3] + factor * (true[:3, 3] - rigid[:3, 3])
    return pose(rigid[:3, :3] @ Rotation.from_rotvec(turned).as_matrix(), place)
