"""A beam of a scene as nodes and elements: straight or an arc, twisted or not, in elements of equal length."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from erls.errors import Cause, SceneError
from erls.maths import motion_maps as motions
from erls.maths import rotation_maps as rotations
from erls.maths.se3 import pose
from erls.maths.so3 import Array
from erls.scene.bodies.schema import Beam

_FLAT = 1e-9  # sine of the angle below which three points lie on a line


@dataclass(frozen=True)
class Course:
    """Sections as built: at the nodes (k + 1, 4, 4), and at both ends of each element (k, 2, 4, 4); x along it."""

    stations: Array
    elements: Array


def course(beam: Beam, start: Array, end: Array, place: str) -> Course:
    """Where a beam runs between two points (3,).

    Raises
    ------
    SceneError
        BAD_FIELD: points that coincide or lie on a line, or a ``local_z`` along the beam; ``place`` is where.
    """
    if np.linalg.norm(end - start) <= _FLAT * max(np.abs(start).max(), np.abs(end).max()):
        raise _bad(f"{place}.to", "both ends of the beam lie in one place", beam.end, "give nodes apart")
    shares = np.linspace(0, 1, beam.elements + 1)
    if beam.through is None:
        along, places = end - start, start + shares[:, None] * (end - start)
        turns = np.broadcast_to(np.eye(3), (len(shares), 3, 3))
    else:
        along, places, turns = _arc(start, np.array(beam.through), end, shares, place)
    twists = rotations.exp(np.radians(beam.twist_deg) * shares[:, None] * np.array([1.0, 0.0, 0.0]))
    stations = motions.poses(turns @ _axes(beam, along, place) @ twists, places)
    if not beam.chords:
        return Course(stations, np.stack([stations[:-1], stations[1:]], axis=1))
    elements = np.empty((beam.elements, 2, 4, 4))
    for k, (a, b) in enumerate(pairwise(stations)):
        x = b[:3, 3] - a[:3, 3]
        axes = _with_height(x, a[:3, 2] + b[:3, 2])
        elements[k] = pose(axes, a[:3, 3]), pose(axes, b[:3, 3])
    return Course(stations, elements)


def _arc(start: Array, middle: Array, end: Array, shares: Array, place: str) -> tuple[Array, Array, Array]:
    """Direction at the start, places (k, 3), and how far the beam has turned (k, 3, 3)."""
    first, second = middle - start, end - start
    normal = np.cross(first, second)
    area = float(np.linalg.norm(normal))
    if area <= _FLAT * np.linalg.norm(first) * np.linalg.norm(second):
        message = "no arc runs through three points on a line"
        raise _bad(f"{place}.through", message, middle.tolist(), "give a point off the line, or leave it out")
    to_centre = np.cross((first @ first) * second - (second @ second) * first, normal) / (2 * area**2)
    centre, normal = start + to_centre, normal / area
    a, b = start - centre, end - centre
    angle = float(np.arctan2(normal @ np.cross(a, b), a @ b)) % (2 * np.pi)
    turns = rotations.exp(angle * shares[:, None] * normal)
    return np.cross(normal, a), centre + turns @ a, turns


def _axes(beam: Beam, along: Array, place: str) -> Array:
    x = along / np.linalg.norm(along)
    height = np.array(beam.local_z or ((0.0, 1.0, 0.0) if abs(x[2]) > 0.999 else (0.0, 0.0, 1.0)))
    if np.linalg.norm(np.cross(height, x)) < 1e-6 * np.linalg.norm(height):
        message = "the section's height lies along the beam"
        raise _bad(f"{place}.local_z", message, height.tolist(), "give a direction across the beam")
    return _with_height(along, height)


def _with_height(along: Array, height: Array) -> Array:
    x, y = along / np.linalg.norm(along), np.cross(height, along)
    y /= np.linalg.norm(y)
    return np.stack([x, y, np.cross(x, y)], axis=1)


def _bad(where: str, message: str, value: object, remedy: str) -> SceneError:
    return SceneError(Cause.BAD_FIELD, message, where=where, value=value, remedy=remedy)
