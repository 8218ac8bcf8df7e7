"""What links of a URDF file look like, as surfaces in the frames of bodies: meshes beside the file, and primitives.

Nothing here is fatal, since nothing moves by it: what cannot be drawn is told by name.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path, PurePosixPath

import numpy as np

from erls.importers.urdf import UrdfRobot, UrdfShape
from erls.maths.so3 import Array
from fe_import.errors import FEImportError
from fe_import.model import IntArray, Surface

MOST_OF_LINK, MOST_OF_ROBOT = 5_000, 60_000  # triangles; more are thinned
_PACKAGE = "package://"
_LEVELS = 5  # folders above the file in which a package is looked for
_SIDES = 32
_MOST_SHAPES = 200  # of a link
Known = dict[Path, Surface]


class Seen:
    """What the links of one robot look like: meshes are read once, and what is not drawn is told.

    Parameters
    ----------
    robot : UrdfRobot
    source : Path
        The URDF file; meshes lie in its package, or in the folder above its own.
    bodies : int
        That are drawn, among which triangles are shared out.
    """

    def __init__(self, robot: UrdfRobot, source: Path, bodies: int) -> None:
        self.told = list[str]()
        self._robot, self._source = robot, source
        self._most = min(MOST_OF_LINK, MOST_OF_ROBOT // max(bodies, 1))
        self._known: Known = {}

    def leave(self, frames: Mapping[str, Array], why: str) -> None:
        """Tell that links look like something that is left out."""
        if any(self._robot.links[name].visual for name in frames):
            self.told.append(f"what link {next(iter(frames))!r} looks like is left out: {why}")

    def surface(self, frames: Mapping[str, Array], flexible: bool) -> Surface | None:
        """One surface of links that move as one; None where nothing is drawn.

        Parameters
        ----------
        frames : dict of (4, 4) arrays
            Pose of each link in the body's frame, by name.
        flexible : bool
            Whether it is drawn by its own elements instead.
        """
        if flexible:
            self.leave(frames, "flexible links are drawn by their own elements")
            return None
        parts = list[Surface]()
        for name, frame in frames.items():
            link = self._robot.links[name]
            found, faults = _drawn(link.visual, self._source, self._known)
            self.told += [f"link {name!r}: not drawn: {fault}" for fault in dict.fromkeys(faults)]
            if link.visual and not found:
                found, _ = _drawn(link.collision, self._source, self._known)
                self.told += [f"link {name!r} is drawn by its shapes for contact (<collision>)"] if found else []
            parts += [_moved(part, frame) for part in found]
        if not parts:
            return None
        starts = np.cumsum([0, *(len(part.points) for part in parts[:-1])])
        triangles = np.concatenate([part.triangles + start for part, start in zip(parts, starts, strict=True)])
        whole = Surface(np.concatenate([part.points for part in parts]), triangles)
        from fe_import.mesh.surfaces import as_stored, thinned  # here: it imports meshio

        first = next(iter(frames))
        fewer = thinned(whole, self._most)
        if fewer is not whole:
            now = f"{len(triangles)} triangles are thinned to {len(fewer.triangles)} for pictures"
            self.told.append(f"link {first!r}: {now}")
        try:
            return as_stored(fewer, first)
        except FEImportError as problem:
            self.told.append(f"link {first!r}: not drawn: {problem.message}")
            return None


def _drawn(shapes: Sequence[UrdfShape], source: Path, known: Known) -> tuple[list[Surface], list[str]]:
    found, faults = list[Surface](), list[str]()
    if len(shapes) > _MOST_SHAPES:
        faults.append(f"{len(shapes) - _MOST_SHAPES} of its {len(shapes)} shapes are too many")
    for shape in shapes[:_MOST_SHAPES]:
        if shape.kind != "mesh":
            found.append(_moved(_PRIMITIVES[shape.kind](*shape.sizes), shape.pose))
            continue
        try:
            surface = _mesh(shape.file, source, known)
        except FEImportError as problem:
            faults.append(f"{shape.file}: {problem.message}")
        except (ValueError, OSError, RuntimeError) as problem:  # the last two: names and links that no system follows
            faults.append(f"{shape.file}: {problem}")
        else:
            scaled = Surface(surface.points * shape.sizes, surface.triangles)
            if math.prod(shape.sizes) < 0:  # mirrored
                scaled = Surface(scaled.points, scaled.triangles[:, ::-1])
            found.append(_moved(scaled, shape.pose))
    return found, faults


def _mesh(name: str, source: Path, known: Known) -> Surface:
    from fe_import.mesh.surfaces import SUFFIXES, read_surface, thinned  # here: it imports meshio

    suffix = PurePosixPath(name).suffix.lower()
    if suffix not in SUFFIXES:
        raise ValueError(f"{suffix or 'a file without ending'} is not read; give {' or '.join(SUFFIXES)}")
    path = place_of(name, source)
    if path not in known:
        surface = read_surface(path, None)
        known[path] = thinned(surface, 10 * MOST_OF_LINK)  # what is kept meanwhile
    return known[path]


def place_of(name: str, source: Path) -> Path:
    """Where a mesh lies.

    Parameters
    ----------
    name : str
        ``package://NAME/PATH``, with NAME a folder that holds the file or lies in one that does, at most five up; or a
        path from the folder of the file.
    source : Path
        The URDF file.

    Raises
    ------
    ValueError
        It lies elsewhere, or nowhere.
    """
    folder = source.resolve().parent
    text = name.removeprefix("file://")
    if name.startswith(_PACKAGE):
        package, _, rest = name.removeprefix(_PACKAGE).partition("/")
        if package in ("", ".", "..") or "\\" in package:
            raise ValueError("no name of a package")
        above = [folder, *folder.parents][: _LEVELS + 1]
        roots = [at for at in above if at.name == package] + [at / package for at in above if (at / package).is_dir()]
        if not roots:
            raise ValueError(f"no folder {package!r} within {_LEVELS} levels above the file")
        places = [(root.resolve(), root / rest) for root in roots]
    else:
        places = [(folder.parent, folder / text)]
    inside = [place.resolve() for root, place in places if place.resolve().is_relative_to(root)]
    if not inside:
        raise ValueError("it lies outside of the robot's folders")
    return next((place for place in inside if place.exists()), inside[0])


def _moved(surface: Surface, pose: Array) -> Surface:
    return Surface(surface.points @ pose[:3, :3].T + pose[:3, 3], surface.triangles)


def _box(x: float, y: float, z: float) -> Surface:
    corners = np.array([[i, j, k] for i in (-0.5, 0.5) for j in (-0.5, 0.5) for k in (-0.5, 0.5)]) * (x, y, z)
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = [t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))]
    return Surface(corners, np.array(triangles, dtype=np.int64))


def _turned(radii: Array, heights: Array) -> Surface:
    """A body of revolution about z: rings from below to above, closed by a point at either end."""
    angles = 2 * np.pi * np.arange(_SIDES) / _SIDES
    ring = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    rings = [np.column_stack([r * ring, np.full(_SIDES, z)]) for r, z in zip(radii, heights, strict=True)]
    ends = [[0.0, 0.0, heights[0]], [0.0, 0.0, heights[-1]]]
    own, count = np.arange(_SIDES), len(radii)
    after = (own + 1) % _SIDES
    low, high = np.full(_SIDES, count * _SIDES), np.full(_SIDES, count * _SIDES + 1)
    top = (count - 1) * _SIDES
    rows: list[IntArray] = [np.stack([low, after, own], axis=1), np.stack([high, top + own, top + after], axis=1)]
    for k in range(count - 1):
        a, b = k * _SIDES, (k + 1) * _SIDES
        rows += [np.stack([a + own, a + after, b + after], axis=1), np.stack([a + own, b + after, b + own], axis=1)]
    return Surface(np.concatenate([*rings, ends]), np.concatenate(rows))


def _cylinder(radius: float, length: float) -> Surface:
    return _turned(np.full(2, radius), np.array([-0.5, 0.5]) * length)


def _sphere(radius: float) -> Surface:
    angles = np.linspace(-np.pi / 2, np.pi / 2, _SIDES // 2 + 1)[1:-1]
    surface = _turned(radius * np.cos(angles), radius * np.sin(angles))
    points = surface.points.copy()
    points[-2:, 2] = -radius, radius
    return Surface(points, surface.triangles)


_PRIMITIVES: dict[str, Callable[..., Surface]] = {"box": _box, "cylinder": _cylinder, "sphere": _sphere}
