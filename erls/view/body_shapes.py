"""Shapes of bodies and springs: an ellipsoid of mass and inertia with rods to what it hangs on, a zigzag."""

from __future__ import annotations

from typing import Any

import numpy as np

from erls.maths.se3 import pose
from erls.maths.so3 import Array
from erls.view.shapes import polylines, rod, with_normals


def ellipsoid(mass: float, inertia: Array, largest: float) -> tuple[Array, Array]:
    """Radii (3,) [m] and axes (3, 3) of the ellipsoid with the mass and inertia of a body, in its frame.

    Parameters
    ----------
    mass : float
        [kg]
    inertia : (3, 3) array
        About the centre of mass [kg m²].
    largest : float
        What no radius passes [m].
    """
    moments, axes = np.linalg.eigh(inertia)
    squares = 2.5 * (moments.sum() - 2 * moments) / mass if mass > 0 else np.zeros(3)  # I = m (b² + c²) / 5
    return np.minimum(np.sqrt(np.maximum(squares, 0.0)), largest), axes * np.sign(np.linalg.det(axes))


def body_surface(radii: Array, place: Array, ends: Array, thinnest: float) -> Any:
    """An ellipsoid in a frame (4, 4) along its axes, with rods to ``ends`` (k, 3)."""
    import pyvista as pv

    ball = pv.Sphere(radius=1.0, theta_resolution=48, phi_resolution=48)
    shape = ball.scale(np.maximum(radii, thinnest), inplace=False).transform(place, inplace=False)
    rods = [r for end in ends for r in rod(place[:3, 3], end, 0.6 * thinnest)]
    return with_normals(shape.append_polydata(*rods) if rods else shape)


def spring_surface(start: Array, end: Array, unit: float) -> Any:
    """A spring between two places."""
    along = end - start
    across = facing(start, along)[:3, 0] if along.any() else np.zeros(3)
    shares = np.array([0.0, 0.15, *np.linspace(0.2, 0.8, 12), 0.85, 1.0])
    sides = 2 * unit * np.array([0.0, 0.0, *[1.0, -1.0] * 6, 0.0, 0.0])
    line = start + shares[:, None] * along + sides[:, None] * across
    return polylines(line, [list(range(len(line)))]).tube(radius=0.35 * unit, n_sides=12, capping=True)


def facing(place: Array, direction: Array) -> Array:
    """(4, 4) a frame at a place with z along a direction."""
    z = direction / np.linalg.norm(direction)
    x = np.cross(z, np.eye(3)[int(np.abs(z).argmin())])
    x /= np.linalg.norm(x)
    return pose(np.stack([x, np.cross(z, x), z], axis=1), place)
