"""Points of a run moving in space, by matplotlib: `Run.animate`."""

from __future__ import annotations

from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from erls.errors import Cause, SceneError
from erls.files.optional import require_package

if TYPE_CHECKING:
    from erls.run.record import Run

_FRAMES = 101
_PAUSE = 50.0  # ms between pictures of a run whose axis is no time


def animate(run: Run, patterns: tuple[str, ...], times: ArrayLike | None, speed: float) -> Any:
    """As `Run.animate` says."""
    asked = patterns or ("*",)
    names = [name for name in run.point_names if any(fnmatchcase(name, pattern) for pattern in asked)]
    for pattern in asked:
        if not any(fnmatchcase(name, pattern) for name in run.point_names):
            message, remedy = "the run has no such point", "name one of these, or a pattern such as end*"
            raise SceneError(
                Cause.BAD_REFERENCE, message, where="animate", value=pattern, limit=run.point_names, remedy=remedy
            )
    if not (np.isfinite(speed) and speed > 0):
        raise SceneError(
            Cause.BAD_FIELD, "speed is positive", where="animate", value=speed, remedy="1 is as fast as it was"
        )
    require_package("matplotlib", "Run.animate")
    along = run.spread(_FRAMES) if times is None else np.atleast_1d(np.asarray(times, dtype=float))
    if not along.size:
        remedy = "give some, or leave them out for all of the run"
        raise SceneError(Cause.BAD_FIELD, "no times", where="animate", value=[], remedy=remedy)
    places = np.stack([np.reshape(run.position(name, along), (len(along), 3)) for name in names])
    import matplotlib.pyplot as plt
    from matplotlib.animation import FuncAnimation

    figure = plt.figure()
    axes: Any = figure.add_subplot(projection="3d")
    middle = (places.min(axis=(0, 1)) + places.max(axis=(0, 1))) / 2
    reach = max(float(np.ptp(places, axis=(0, 1)).max()) / 2, 1e-9)
    axes.set(**{f"{x}lim": (m - reach, m + reach) for x, m in zip("xyz", middle, strict=True)})
    axes.set(xlabel="x [m]", ylabel="y [m]", zlabel="z [m]", box_aspect=(1, 1, 1))
    ways = [axes.plot(*place[:1].T, lw=1)[0] for place in places]
    marks = [
        axes.plot(*place[:1].T, "o", color=way.get_color(), label=name)[0]
        for name, place, way in zip(names, places, ways, strict=True)
    ]
    axes.legend()

    def draw(k: int) -> list[Any]:
        for place, way, mark in zip(places, ways, marks, strict=True):
            way.set_data_3d(*place[: k + 1].T)
            mark.set_data_3d(*place[k : k + 1].T)
        axes.set_title(f"{run.title}: {run.axis.text(f'{along[k]:.4g}')}")
        return [*ways, *marks]

    timed = run.axis.name == "time" and len(along) > 1
    pause = 1e3 * float(along[-1] - along[0]) / (len(along) - 1) / speed if timed else _PAUSE
    plt.close(figure)  # notebooks show what is returned, not its first picture as well
    return FuncAnimation(figure, draw, frames=len(along), interval=max(pause, 1.0))
