"""What a run of bodies and beams looks like: beams as tubes along their interpolation, bodies as ellipsoids of their
inertia, connections, springs, the ground.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from erls.equations.nodal.joints import GROUND, Joint
from erls.equations.nodal.shell_stress import SurfaceStress
from erls.maths import motion_maps as motions
from erls.maths.se3 import pose
from erls.maths.so3 import Array
from erls.run.bodies.connections import joint_frames
from erls.run.bodies.rest import BodyRest
from erls.run.bodies.run import BodyRun
from erls.scene.bodies.schema import GROUND as GROUND_NAME
from erls.scene.bodies.schema import Body, LineSpring
from erls.view.body_shapes import body_surface, ellipsoid, facing, spring_surface
from erls.view.figure import DEFLECTION, STRESS, Figure, Part, PartMesh, Pose, Shade
from erls.view.shapes import JointPlace, ground_surface, joints_surface, part_surface, polylines, thick
from erls.view.stress import largest, surface_stress
from fe_import.model import IntArray
from fe_import.models.inertia import inertia_matrix

_SMOOTH = 160  # points along all beams; at least two for each element


@dataclass(frozen=True)
class BodyFigure(Figure):
    """A run of bodies and beams."""

    run: BodyRun
    shade: Shade = DEFLECTION
    part = "part"

    @cached_property
    def stress(self) -> list[SurfaceStress]:
        """Where to look for that of each shell."""
        return surface_stress(self.run)

    @property
    def gravity(self) -> Array:
        """(3,) [m/s²]"""
        return np.array(self.run.scene.record.gravity)

    @cached_property
    def size(self) -> float:
        """Of all that is built [m]."""
        return float(np.linalg.norm(np.ptp(np.concatenate([self.built[:, :3, 3], self.fixed()]), axis=0)))

    @property
    def built(self) -> Array:
        """(n, 4, 4) nodes as built."""
        return self.run.assembly.system.start.poses

    @property
    def joints(self) -> tuple[Joint, ...]:
        """All connections."""
        return tuple(self.run.assembly.full.rows.joints)

    def fixed(self) -> Array:
        """(k, 3) connections with the ground."""
        return np.array([j.inner_frame[:3, 3] for j in self.joints if j.inner == GROUND]).reshape(-1, 3)

    def ground(self, towards: Array, unit: float) -> list[Any]:
        """A plate behind every connection with the ground; behind the end of a beam where that is clamped."""
        found = []
        for joint in self.joints:
            if joint.inner != GROUND:
                continue
            frame, seen = joint.inner_frame, towards
            along = self._into_beam(joint.outer) if joint.type == "fixed" else None
            if along is not None:
                frame, seen = facing(frame[:3, 3], -along), along
            found.append(ground_surface(frame, seen, unit))
        return found

    def _into_beam(self, node: int) -> Array | None:
        """(3,) direction of the first beam that ends at a node, away from it."""
        for own in self.run.assembly.beams.values():
            for end, element in ((0, own[0]), (1, own[-1])):
                if element.nodes[end] == node:
                    return np.asarray((1 - 2 * end) * element.frames[end, :3, 0])
        return None

    def poses(self, times: Sequence[float] | Array) -> list[BodyPose]:
        """Bodies and beams at each time."""
        flat = self.run.within(np.asarray(times, dtype=float))
        found = zip(flat.tolist(), self.run.configurations(flat), strict=True)
        return [BodyPose(self, at, nodes.poses, nodes.bent) for at, nodes in found]

    @cached_property
    def elements(self) -> tuple[IntArray, Array]:
        """Nodes (e, 2) of all elements, and their sections in the frames of these (e, 2, 4, 4)."""
        every = [e for own in self.run.assembly.beams.values() for e in own]
        nodes = np.array([e.nodes for e in every], dtype=np.int64).reshape(-1, 2)
        frames = np.array([e.frames for e in every]).reshape(-1, 2, 4, 4)
        return nodes, motions.inverse(self.built[nodes]) @ frames

    def lines(self, nodes: Array, bent: Array) -> list[Array]:
        """(p, 3) course of each beam: H(x) = H_A exp(x d), as its elements interpolate."""
        ends, sections = self.elements
        pieces = int(np.clip(_SMOOTH // max(len(ends), 1), 2, 32))
        shares = np.linspace(0, 1, pieces + 1)[None, :, None]
        places = ((nodes[ends[:, 0]] @ sections[:, 0])[:, None] @ motions.exp(shares * bent[:, None]))[..., :3, 3]
        found, first = [], 0
        for own in self.run.assembly.beams.values():
            mine = places[first : first + len(own)]
            first += len(own)
            found.append(np.concatenate([mine[:, :-1].reshape(-1, 3), mine[-1:, -1]]))
        return found

    @cached_property
    def origin(self) -> Array:
        """(n, 4, 4) nodes where displacements count from."""
        return self.run.origin.poses

    @cached_property
    def origin_lines(self) -> list[Array]:
        """Beams there."""
        return self.lines(self.origin, self.run.origin.bent)

    @cached_property
    def ellipsoids(self) -> list[tuple[Array, Array]]:
        """Radii (3,) and axes (3, 3) of each body, in its frame; a point for one that is as good as massless."""
        bodies, found = self.run.scene.record.bodies, []
        heaviest = max((b.mass for b in bodies), default=0.0)
        for body in bodies:
            largest = 0.3 * self.size if body.mass > 1e-3 * heaviest else 0.0
            found.append(ellipsoid(body.mass, inertia_matrix(body.inertia, body.name), largest))
        return found

    @cached_property
    def arms(self) -> list[list[Array]]:
        """(3,) places on each body, in its frame, that rods from its centre of mass lead to: its node, connections."""
        numbers, found = self.run.assembly.numbers, []
        for body in self.run.scene.record.bodies:
            node, places = numbers[body.name], [np.zeros(3)]
            for joint in self.joints:
                sides = (joint.inner, joint.inner_frame), (joint.outer, joint.outer_frame)
                places += [frame[:3, 3] for number, frame in sides if number == node]
            found.append(places)
        return found


@dataclass(frozen=True)
class BodyPose(Pose):
    """Bodies and beams at one time: poses (n, 4, 4) of the nodes, twists (e, 6) of the elements from end to end."""

    figure: BodyFigure
    time: float
    poses: Array
    bent: Array

    def points(self, magnification: float) -> list[Array]:
        """(3,) places of the reported nodes."""
        numbers = self.figure.run.assembly.numbers
        places = self._magnified(self.poses[:, :3, 3], self.figure.origin[:, :3, 3], magnification)
        return [places[numbers[name]] for name in self.figure.run.point_names]

    def nodes(self, magnification: float) -> list[Array]:
        """(p, 3) of each beam, then of each shell, then of each body."""
        shells = self._surfaces(magnification)
        bodies = [self._body_places(k, magnification) for k in range(len(self.figure.arms))]
        return self._lines(magnification) + shells + bodies

    def deflections(self) -> list[Array]:
        """(p,) against where they are built, at rest; zeros of motions, and of modes, whose amplitude means nothing."""
        here = self.nodes(1.0)
        if not isinstance(self.figure.run, BodyRest):
            return [np.zeros(len(places)) for places in here]
        built = BodyPose(self.figure, 0.0, self.figure.built, self.bent).nodes(0.0)
        return [np.linalg.norm(a - b, axis=1) for a, b in zip(here, built, strict=True)]

    def values(self) -> list[Array]:
        """(p,) of each beam, then of each shell, then of each body."""
        if self.figure.shade is DEFLECTION:
            return super().values()
        beams, places = len(self.figure.run.assembly.beams), self.nodes(1.0)
        stress = [largest(own.at(self.poses)) for own in self.figure.stress]
        found = [np.full(len(each), np.nan) for each in places]
        found[beams : beams + len(stress)] = stress
        return found

    def anchor(self) -> Array:
        """(3,) the last node."""
        return np.asarray(self.poses[-1, :3, 3])

    def parts(self, magnification: float, unit: float) -> list[Part]:
        """Beams, then shells, bodies and springs."""
        record, found, none = self.figure.run.scene.record, [], np.zeros((0, 3), dtype=np.int64)
        moved = self.values()
        for line, values in zip(self._lines(magnification), moved, strict=False):
            found.append(Part(part_surface(line, none, [list(range(len(line)))], 0, values, unit)))
        surfaces = self.figure.run.assembly.shells.values()
        for surface, places in zip(surfaces, self._surfaces(magnification), strict=True):
            triangles = surface.cells[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3)
            heights = np.tile(surface.heights, (len(places), 1))
            places, triangles, values = thick(places, triangles, heights, moved[len(found)])
            found.append(Part(part_surface(places, triangles, [], 0, values, unit)))
        for k, (body, values) in enumerate(zip(record.bodies, moved[len(found) :], strict=True)):
            found.append(_coloured(self._body(k, body, magnification, unit), float(values[-1])))
        for spring in record.springs:
            if isinstance(spring, LineSpring):
                start, end = self._spring_ends(spring, magnification)
                found.append(_coloured(spring_surface(start, end, unit), 0.0))
        return found

    def joints(self, magnification: float, unit: float, moving: bool) -> Any:
        """Connections, ghosts without those with the ground."""
        places = []
        for joint in self.figure.joints:
            if moving and joint.inner == GROUND:
                continue
            inner = self._node(joint.inner, magnification) if joint.inner != GROUND else np.eye(4)
            outer = self._node(joint.outer, magnification)
            first, second = joint_frames(joint, inner, outer)
            first_node = None if joint.inner == GROUND else inner[:3, 3]
            places.append(JointPlace(joint.type, first, second, first_node, outer[:3, 3]))
        return joints_surface(places, unit) if places else None

    def outline(self) -> list[Any]:
        """Beams where displacements count from."""
        return [polylines(line, [list(range(len(line)))]) for line in self.figure.origin_lines]

    def meshes(self, magnification: float) -> list[PartMesh]:
        """Beams as lines through their nodes, bodies as points at their frames."""
        assembly, found = self.figure.run.assembly, []
        built = self.figure.built[:, :3, 3]
        true, shown = self.poses[:, :3, 3], self._magnified(self.poses[:, :3, 3], built, magnification)
        for name, own in assembly.beams.items():
            nodes = [own[0].nodes[0], *(e.nodes[1] for e in own)]
            cells = [("line", np.stack([np.arange(len(own)), np.arange(1, len(own) + 1)], axis=1))]
            found.append(PartMesh(name, shown[nodes], cells, (true - built)[nodes]))
        stress = [] if self.figure.shade is DEFLECTION else [largest(own.at(self.poses)) for own in self.figure.stress]
        for k, (name, surface) in enumerate(assembly.shells.items()):
            at, more = surface.nodes, {STRESS.array: stress[k]} if stress else {}
            found.append(PartMesh(name, shown[at], [("quad", surface.cells)], (true - built)[at], more))
        for body in self.figure.run.scene.record.bodies:
            node = [assembly.numbers[body.name]]
            found.append(PartMesh(body.name, shown[node], [("vertex", np.array([[0]]))], (true - built)[node]))
        return found

    def _lines(self, magnification: float) -> list[Array]:
        lines = self.figure.lines(self.poses, self.bent)
        return [self._magnified(a, b, magnification) for a, b in zip(lines, self.figure.origin_lines, strict=True)]

    def _surfaces(self, magnification: float) -> list[Array]:
        """(p, 3) nodes of each shell."""
        places = self._magnified(self.poses[:, :3, 3], self.figure.origin[:, :3, 3], magnification)
        return [places[surface.nodes] for surface in self.figure.run.assembly.shells.values()]

    def _magnified(self, places: Array, origin: Array, magnification: float) -> Array:
        return places if magnification == 1.0 else np.asarray(origin + magnification * (places - origin))

    def _node(self, node: int, magnification: float) -> Array:
        """(4, 4) its true turn, at its magnified place."""
        here, origin = self.poses[node], self.figure.origin[node]
        return pose(here[:3, :3], self._magnified(here[:3, 3], origin[:3, 3], magnification))

    def _body_places(self, number: int, magnification: float) -> Array:
        """(k, 3) its node, its connections, the ends of its ellipsoid's axes, its centre of mass."""
        body, (radii, axes) = self.figure.run.scene.record.bodies[number], self.figure.ellipsoids[number]
        frame, centre = self._node(self.figure.run.assembly.numbers[body.name], magnification), body.centre_of_mass
        tips = centre + np.concatenate([axes * radii, -axes * radii], axis=1).T
        places = np.array([*self.figure.arms[number], *tips, centre])
        return np.asarray(places @ frame[:3, :3].T + frame[:3, 3])

    def _body(self, number: int, body: Body, magnification: float, unit: float) -> Any:
        turn = self.poses[self.figure.run.assembly.numbers[body.name], :3, :3]
        radii, axes = self.figure.ellipsoids[number]
        places = self._body_places(number, magnification)
        ends = places[: len(self.figure.arms[number])]
        return body_surface(radii, pose(turn @ axes, places[-1]), ends, 1.5 * unit)

    def _spring_ends(self, spring: LineSpring, magnification: float) -> list[Array]:
        """(3,) places of both ends."""
        numbers, ends = self.figure.run.assembly.numbers, []
        for name, given in ((spring.to, spring.to_position), (spring.node, spring.position)):
            if name == GROUND_NAME:
                ends.append(np.array(given))
                continue
            built, here = self.figure.built[numbers[name]], self._node(numbers[name], magnification)
            at = built[:3, 3] if given is None else np.array(given)
            ends.append(here[:3, :3] @ (built[:3, :3].T @ (at - built[:3, 3])) + here[:3, 3])
        return ends


def _coloured(surface: Any, value: float) -> Part:
    surface["value"] = np.full(surface.n_points, value)
    return Part(surface)
