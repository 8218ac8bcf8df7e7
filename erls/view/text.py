"""What a picture says: title, caption, names of points and times of poses."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from erls.equations.formulation import State
from erls.run.record import Run
from erls.view.camera import Pixels, text_unit
from erls.view.labels import Label, Sheet
from erls.view.stage import POINTS, Stage, colour_map


def written(stage: Stage, pixels: Pixels, caption: str) -> Sheet:
    """A rendered picture with title, caption, axes and colour bar; names and times can still be placed on it."""
    sheet = Sheet(pixels)
    sheet.heading(stage.run.scene.name, caption)
    sheet.axes(stage.walls)
    sheet.triad(stage.camera, stage.corner, stage.gravity)
    if stage.motion.elastic:
        sheet.colour_bar(colour_map(), 1e3 * stage.motion.largest)
    return sheet


def displacement(magnification: float) -> str:
    """How displacement is shown."""
    return "true displacement" if magnification == 1.0 else f"displacement × {magnification:g}"


def caption(run: Run, states: Sequence[State], magnification: float, speed: float = 1.0) -> str:
    """Times, scale of the displacement, speed of a film, and whether the run ended early."""
    times = [s.time for s in states]
    if len(times) == 1:  # as many digits in every frame of a film
        digits = max(3 - math.floor(math.log10(max(run.end, 1e-9))), 0)
        parts = [f"t = {times[0]:.{digits}f} s"]
    else:
        parts = [f"t = {min(times):.4g} to {max(times):.4g} s"]
    parts.append(displacement(magnification))
    if speed != 1.0:
        parts.append(f"speed × {speed:g}")
    if run.failure is not None:
        parts.append(f"run ended early: {run.failure.cause}")
    return "  ·  ".join(parts)


def point_labels(stage: Stage, state: State) -> list[Label]:
    """Names of the points, beside them."""
    points, result = stage.run.formulation.mechanism.points, []
    for k, (point, place) in enumerate(zip(points, stage.point_places(state), strict=True)):
        x, y = stage.camera.project(place)
        result.append(Label(point.name, point.name, (float(x), float(y)), POINTS[k % len(POINTS)], bold=True))
    return result


def time_labels(stage: Stage, states: Sequence[State]) -> list[Label]:
    """Times beside the last named point of each pose, in one text where poses meet; the last pose comes first.

    Without named points they stand beside the last joint.
    """
    places = [stage.camera.project((stage.point_places(s) or [s.poses[-1][:3, 3]])[-1]) for s in states]
    near = 1.5 * text_unit(stage.camera.size)
    groups: list[list[int]] = []
    for k in reversed(range(len(states))):
        same = [g for g in groups if np.linalg.norm(places[g[0]] - places[k]) < near]
        if same:
            same[0].append(k)
        else:
            groups.append([k])
    result = []
    for group in groups:
        members = sorted(group)
        text = ", ".join(f"{t:.4g}" for t in sorted({states[k].time for k in members})[:3])
        if len(members) > 3:
            in_a_row = members[-1] - members[0] == len(members) - 1
            text = f"{states[members[0]].time:.4g} to {states[members[-1]].time:.4g}" if in_a_row else text + ", …"
        text += " s"
        x, y = places[group[0]]
        last = len(states) - 1 in group
        result.append(Label(text, text, (float(x), float(y)), "#20242a" if last else "#5a626d", scale=0.9))
    return result
