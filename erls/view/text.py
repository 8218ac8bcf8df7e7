"""What a picture says: title, caption, names of points and times of poses."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from erls.run.bodies.mode import BodyMode
from erls.run.link_mode import LinkMode
from erls.run.record import Run
from erls.view.camera import Pixels, text_unit
from erls.view.figure import Pose
from erls.view.labels import Label, Sheet
from erls.view.stage import POINTS, SENSORS, Stage, colour_map


def written(stage: Stage, pixels: Pixels, caption: str) -> Sheet:
    """A rendered picture with title, caption, axes and colour bar; names and times can still be placed on it."""
    sheet = Sheet(pixels)
    sheet.heading(stage.figure.run.title, caption)
    sheet.axes(stage.walls)
    sheet.triad(stage.camera, stage.corner, stage.gravity)
    if stage.motion.elastic:
        shade = stage.figure.shade
        sheet.colour_bar(colour_map(), stage.motion.largest, shade.name, shade.unit)
    return sheet


def displacement(run: Run, magnification: float) -> str:
    """How displacement is shown."""
    if isinstance(run, BodyMode | LinkMode):
        return "amplitude without scale"
    return "true displacement" if magnification == 1.0 else f"displacement × {magnification:g}"


def caption(run: Run, poses: Sequence[Pose], magnification: float, speed: float = 1.0) -> str:
    """Times, scale of the displacement, speed of a film, and whether the run ended early."""
    times, axis = [p.time for p in poses], run.axis
    if len(times) == 1:  # as many digits in every frame of a film
        digits = max(3 - math.floor(math.log10(max(run.end, 1e-9))), 0)
        text = f"{times[0]:.{digits}f}"
    else:
        text = f"{min(times):.4g} to {max(times):.4g}"
    parts = [f"{axis.symbol} = {axis.text(text)}", displacement(run, magnification)]
    if speed != 1.0:
        parts.append(f"speed × {speed:g}")
    if run.failure is not None:
        parts.append(f"run ended early: {run.failure.cause}")
    return "  ·  ".join(parts)


def point_labels(stage: Stage, pose: Pose) -> list[Label]:
    """Names of the points and of the sensors, beside them."""
    names, result = stage.figure.run.point_names, []
    for k, (name, place) in enumerate(zip(names, pose.points(stage.magnification), strict=True)):
        x, y = stage.camera.project(place)
        result.append(Label(name, name, (float(x), float(y)), POINTS[k % len(POINTS)], bold=True))
    for name, place in pose.sensors(stage.magnification).items():
        x, y = stage.camera.project(place)
        result.append(Label(f"sensor {name}", name, (float(x), float(y)), SENSORS, scale=0.9))
    return result


def time_labels(stage: Stage, poses: Sequence[Pose]) -> list[Label]:
    """Times beside the last named point of each pose, in one text where poses meet; the last pose comes first.

    Without named points they stand beside the last joint.
    """
    places = [stage.camera.project((p.points(stage.magnification) or [p.anchor()])[-1]) for p in poses]
    near, axis = 1.5 * text_unit(stage.camera.size), stage.figure.run.axis
    groups: list[list[int]] = []
    for k in reversed(range(len(poses))):
        same = [g for g in groups if np.linalg.norm(places[g[0]] - places[k]) < near]
        if same:
            same[0].append(k)
        else:
            groups.append([k])
    result = []
    for group in groups:
        members = sorted(group)
        text = ", ".join(f"{t:.4g}" for t in sorted({poses[k].time for k in members})[:3])
        if len(members) > 3:
            in_a_row = members[-1] - members[0] == len(members) - 1
            text = f"{poses[members[0]].time:.4g} to {poses[members[-1]].time:.4g}" if in_a_row else text + ", …"
        text = axis.text(text) if axis.unit else f"{axis.symbol} {text}"
        x, y = places[group[0]]
        last = len(poses) - 1 in group
        result.append(Label(text, text, (float(x), float(y)), "#20242a" if last else "#5a626d", scale=0.9))
    return result
