"""The window that can be turned, with a slider for time."""

from __future__ import annotations

import numpy as np

from erls.maths.so3 import Array
from erls.view.stage import POINTS, Stage


class Window(Stage):
    """A stage on the screen."""

    off_screen = None  # unless pyvista is told otherwise for the whole process

    def _directions(self) -> None:
        """Axes triad in the corner; gravity as an arrow at the walls, where it turns with the scene."""
        self.plotter.add_axes()
        gravity = self.figure.gravity
        if gravity.any():
            box = self.motion.box
            length = 0.15 * float((box.high - box.low)[self.camera.vertical])
            down = gravity / np.linalg.norm(gravity)
            start = np.where(self.camera.towards > 0, box.low, box.high)
            upper = box.high if down[self.camera.vertical] < 0 else box.low
            start[self.camera.vertical] = upper[self.camera.vertical]
            self._arrow(start, down, length / self.camera.pixel, "#222222")
            self._texts(np.array([start + 0.5 * length * down]), ["  g"], "black")

    def _texts(self, places: Array, texts: list[str], colour: str, name: str | None = None) -> None:
        self.plotter.add_point_labels(
            places, texts, name=name, text_color=colour, font_size=15, shape=None, show_points=False,
            always_visible=True, reset_camera=False, render=False,
        )  # fmt: skip

    def show_time(self, time: float) -> None:
        """Put the mechanism at a time."""
        start, end = float(self.motion.times[0]), float(self.motion.times[-1])
        (pose,) = self.figure.poses(self.figure.run.nearest([min(max(time, start), end)]))
        self.pose(pose)
        self.paths(pose.time)
        for k, (name, place) in enumerate(
            zip(self.figure.run.point_names, pose.points(self.magnification), strict=True)
        ):
            self._texts(np.array([place]), [f"  {name}"], POINTS[k % len(POINTS)], name=f"point {k}")

    @property
    def hidden(self) -> bool:
        """Whether it is not on the screen: the display could not be opened."""
        return self.plotter.render_window.GetClassName() in ("vtkEGLRenderWindow", "vtkOSOpenGLRenderWindow")

    def interact(self, caption: str) -> None:
        """Open the window; returns when it is closed."""
        start, end = float(self.motion.times[0]), float(self.motion.times[-1])
        ticks = self.walls.ticks()
        self._texts(np.array([t.place for t in ticks]), [t.text for t in ticks], "#6b727c")
        self.plotter.add_text(caption, font_size=11, color="black")
        self.show_time(start)
        if self.motion.elastic:
            title = f"{self.figure.shade.name} [{self.figure.shade.unit}]"
            bar = {"title": title, "vertical": True, "position_x": 0.9, "position_y": 0.3, "height": 0.4}
            self.plotter.add_scalar_bar(mapper=self._actors["pose"][0].mapper, color="black", n_labels=6, **bar)
        axis = self.figure.run.axis
        title = f"{axis.symbol} [{axis.unit}]" if axis.unit else axis.name
        if end > start:
            self.plotter.add_slider_widget(
                self.show_time, (start, end), value=start, title=title, color="black", fmt="%.3f",
                pointa=(0.2, 0.05), pointb=(0.8, 0.05),
                slider_width=0.015, tube_width=0.006, title_height=0.018,
            )  # fmt: skip
        self.plotter.show(title="erls")
