"""The stage of pictures and films: a mechanism before measured walls, seen by one camera, drawn off screen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from erls.maths.so3 import Array
from erls.view.camera import Box, Camera, Pixels, Size, Walls, text_unit
from erls.view.figure import Figure, Pose
from erls.view.shapes import SHARP, load_surface, polylines, sensor_surface, with_normals

COLOURS = "turbo"  # its dark ends are cut
UNKNOWN = "#b4bac2"
GHOST = (0.42, 0.50, 0.60)
PARTS = ("#3d6b99", "#c26a2d", "#4f8a5b", "#8a5a96", "#a04848", "#4a8f95")
POINTS = ("#b3123f", "#1d4e89", "#2f7d32", "#7b3fa0", "#a65a00", "#00707a")
LOADS, SENSORS = "#d4a017", "#0b7285"
_PATH_SAMPLES = 1001
_BOX_SAMPLES = 201


@dataclass(frozen=True)
class Motion:
    """What a view needs to know of the whole run, at one magnification.

    Attributes
    ----------
    times : (k,) array
        Of the paths [s].
    paths : list of (k, 3) arrays
        Of the named points [m].
    box : Box
    largest : float
        Largest of what colours say.
    elastic : bool
        Whether that is worth a colour.
    unit : float
        Radius of a tube [m].
    """

    times: Array
    paths: list[Array]
    box: Box
    largest: float
    elastic: bool
    unit: float

    @classmethod
    def of(cls, figure: Figure, magnification: float, shown: Sequence[Pose] | None = None) -> Motion | None:
        """Survey a run; if ``shown`` poses are given, the box is theirs and the deflection that of the last.

        None where the mechanism has no finite size.
        """
        times = figure.run.spread(_PATH_SAMPLES)
        paths = figure.paths(times, magnification)
        every = max(len(times) // _BOX_SAMPLES, 1)
        seen = figure.poses(times[::every]) if shown is None else shown
        unit = 0.01 * figure.size
        extent, largest = list(figure.fixed()), 0.0
        for p in seen:
            for positions in p.nodes(magnification):
                extent += [positions.min(axis=0), positions.max(axis=0)]
            extent += [end for load in p.loads(magnification) for end in (load.place, load.place + load.along)]
            if shown is None or p is shown[-1]:
                largest = max(largest, *(float(np.fmax.reduce(x, initial=0.0)) for x in p.values()))
        points = np.concatenate([np.array(extent), *paths])
        if not (np.abs(points) < 1e15).all():
            return None
        unit = max(unit, 0.0065 * float(np.ptp(points, axis=0).max()), 1e-6)
        points = np.concatenate([points - unit, points + unit])
        shown_at_all = largest > 0.0 if figure.shade.always else largest > 1e-4 * unit
        return cls(times, paths, Box.around(points), largest, shown_at_all, unit)


class Stage:
    """An off-screen window with a mechanism; close it after use, or use it in a ``with`` statement.

    Parameters
    ----------
    run : Run
    motion : Motion
        Its survey.
    magnification : float
    size : (width, height)
        Of the pictures [pixel].
    finer : int
        Draw that many times finer, and take the mean.
    """

    off_screen: bool | None = True

    def __init__(self, figure: Figure, motion: Motion, magnification: float, size: Size, finer: int = 1) -> None:
        import pyvista as pv

        self.figure, self.motion, self.magnification, self.finer = figure, motion, magnification, finer
        self.camera = Camera.fitting(motion.box, figure.gravity, size)
        self.walls = Walls(motion.box, self.camera)
        self.line = finer * text_unit(size) / 14.5  # a thin line [pixel]
        window = [finer * size[0], finer * size[1]]
        self.plotter = pv.Plotter(off_screen=self.off_screen, window_size=window, lighting="light kit")
        self.plotter.set_background("white")
        self.plotter.enable_anti_aliasing("msaa", multi_samples=4)
        self._actors: dict[str, list[Any]] = {}
        self.corner = (0.0, 0.0)
        self.gravity: Array | None = None
        self._furniture()
        self._directions()
        self._aim()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def close(self) -> None:
        """Free the window."""
        self.plotter.close()

    def _add(self, mesh: Any, **look: Any) -> Any:
        shiny = {"ambient": 0.3, "diffuse": 0.8, "specular": 0.2, "specular_power": 20}
        if not mesh.GetNumberOfPolys():
            shiny = {"lighting": False}
        actor = self.plotter.add_mesh(mesh, **{**shiny, **look}, reset_camera=False, render=False)
        actor.prop.interpolation = "Phong"
        return actor

    def _lines(self, segments: Array, colour: Any, width: float) -> Any:
        import pyvista as pv

        flat = np.asarray(segments).reshape(-1, 3)
        mesh = pv.PolyData(flat, lines=np.insert(np.arange(len(flat)).reshape(-1, 2), 0, 2, axis=1).ravel())
        return self._add(mesh, color=colour, line_width=width * self.line)

    def _furniture(self) -> None:
        """What does not move: walls, ground, paths."""
        self._lines(self.walls.lines(), "#dfe3e8", 1.0)
        for ground in self.figure.ground(self.camera.towards, self.motion.unit):
            self._add(ground, color="#a3aab3")
        self.paths(self.motion.times[-1])

    def _directions(self) -> None:
        """Axes triad and gravity arrow in the corner of the picture."""
        gravity, em = self.figure.gravity, text_unit(self.camera.size)
        self.corner = (4.2 * em, self.camera.size[1] - 4.2 * em)
        origin = self.camera.lift(*self.corner)
        for axis, colour in enumerate(("#c62828", "#2e7d32", "#1565c0")):
            self._arrow(origin, np.eye(3)[axis], 3.0 * em, colour)
        if gravity.any():
            self.gravity = self.camera.lift(self.corner[0] + 6.0 * em, self.corner[1] - 1.5 * em)
            self._arrow(self.gravity, gravity / np.linalg.norm(gravity), 3.2 * em, "#222222")

    def _arrow(self, start: Array, direction: Array, pixels: float, colour: str) -> None:
        import pyvista as pv

        shape = pv.Arrow(
            start=start, direction=direction, scale=pixels * self.camera.pixel, tip_length=0.3, tip_radius=0.085,
            shaft_radius=0.03, tip_resolution=24, shaft_resolution=16,
        )  # fmt: skip
        self._add(with_normals(shape), color=colour)

    def _aim(self) -> None:
        camera, view = self.plotter.camera, self.camera
        reach = 3 * float(np.linalg.norm(self.motion.box.high - self.motion.box.low)) + 100 * self.motion.unit
        camera.enable_parallel_projection()
        camera.focal_point, camera.position = view.focal, view.focal + reach * view.towards
        camera.up = view.up
        camera.parallel_scale = view.pixel * view.size[1] / 2
        camera.clipping_range = (reach * 0.02, 2 * reach)

    def paths(self, until: float) -> None:
        """Draw the paths of the named points: strong up to a time, pale beyond."""
        self._remove("paths")
        motion, actors = self.motion, []
        count = int(np.searchsorted(motion.times, until, side="right"))
        behind = -3 * motion.unit * self.camera.towards  # unseen in a parallel view; pale never covers strong
        for k, path in enumerate(motion.paths):
            for part, strong in ((path[:count], True), (path[max(count - 1, 0) :] + behind, False)):
                if len(part) > 1 and np.ptp(part, axis=0).max() > 1e-3 * motion.unit:  # what stays has no path
                    colour = POINTS[k % len(POINTS)] if strong else "#c9ced6"
                    # a fine tube: lines of short pieces look ragged
                    width = (1.6 if strong else 1.2) * self.line / self.finer * self.camera.pixel
                    curve = polylines(part, [list(range(len(part)))]).tube(radius=width / 2, n_sides=6)
                    actors.append(self._add(curve, color=colour, lighting=False))
        self._actors["paths"] = actors

    def pose(self, pose: Pose, ghost: bool = False) -> None:
        """Draw the mechanism in a pose, instead of any earlier one; a ghost is drawn in one pale colour."""
        self._remove("pose")
        motion, actors = self.motion, []
        for k, part in enumerate(pose.parts(self.magnification, motion.unit)):
            if ghost:
                actors.append(self._add(part.surface, color=GHOST, scalars=None))
            elif motion.elastic:
                limits = [0.0, motion.largest]
                look = {"scalars": "value", "cmap": colour_map(), "clim": limits, "show_scalar_bar": False}
                actors.append(self._add(part.surface, nan_color=UNKNOWN, **look))
            else:
                actors.append(self._add(part.surface, color=PARTS[k % len(PARTS)], scalars=None))
            if part.sharp and not ghost:
                edges = part.surface.extract_feature_edges(SHARP, boundary_edges=False, non_manifold_edges=False)
                if edges.n_points:
                    actors.append(self._add(edges, color="#333333", line_width=0.8 * self.line))
        joints = pose.joints(self.magnification, motion.unit, moving=ghost)
        if joints is not None:
            actors.append(self._add(joints, color=GHOST if ghost else "#596069"))
        if not ghost:
            actors += self._dots(pose)
            actors += [self._add(load_surface(load), color=LOADS) for load in pose.loads(self.magnification)]
            places = pose.sensors(self.magnification).values()
            actors += [self._add(sensor_surface(place, motion.unit), color=SENSORS) for place in places]
            if self.magnification != 1.0:
                actors += [self._add(m, color="#777777", line_width=1.0 * self.line) for m in pose.outline()]
        self._actors["pose"] = actors

    def _dots(self, pose: Pose) -> list[Any]:
        import pyvista as pv

        balls = [pv.Sphere(radius=1.5 * self.motion.unit, center=p) for p in pose.points(self.magnification)]
        return [self._add(b, color=POINTS[k % len(POINTS)]) for k, b in enumerate(balls)]

    def _remove(self, name: str) -> None:
        for actor in self._actors.pop(name, []):
            self.plotter.remove_actor(actor, reset_camera=False, render=False)

    def image(self) -> Pixels:
        """(height, width, 3) picture."""
        self.plotter.render()
        taken: Pixels = np.asarray(self.plotter.screenshot(None, return_img=True))
        n = self.finer
        if n == 1:
            return taken
        total = sum(taken[i::n, j::n].astype(np.uint16) for i in range(n) for j in range(n))
        return np.asarray(total // n**2, dtype=np.uint8)


def colour_map() -> Any:
    """Colours of deflection and stress."""
    import matplotlib
    from matplotlib.colors import ListedColormap

    return ListedColormap(matplotlib.colormaps[COLOURS](np.linspace(0.1, 0.93, 256)))
