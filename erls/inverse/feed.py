"""Feed-forward by inversion: the torques and motions that drives need, as tables of their controllers.

A controller with ``feed_forward = "elastic"`` gets what `erls.inverse.invert` finds for the tables ``servo``:

    τ = τ*(t) + k (q*(t) - q) + c (q̇*(t) - q̇)

with τ* the effort of the mechanism as its links bend and q* the coordinate of the joint meanwhile. It has nothing to
correct on a mechanism that is the one of the inversion.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from msgspec.structs import replace

from erls.inverse.inversion import Inversion
from erls.inverse.invert import invert
from erls.inverse.opened import in_modes, with_controllers
from erls.maths.so3 import Array
from erls.mechanism.drives import PDDrive
from erls.mechanism.motions import MotionTable
from erls.mechanism.profiles import LoadTable
from erls.scene.build import Message
from erls.scene.build_joints import led_by_inversion
from erls.scene.chain import Scene

_APART = 1e-6  # rad or m between where a joint begins and where it is wanted


class Fed(NamedTuple):
    """A scene whose controllers have tables, and what the user should know of them."""

    scene: Scene
    warnings: tuple[str, ...]


def load_table(t: Array, values: Array) -> LoadTable:
    """Torques at knots, cubic between them."""
    return LoadTable(times=tuple(t.tolist()), values=tuple(values.tolist()), interpolation="cubic")


def fed(scene: Scene, tell: Message = lambda text: None) -> Fed:
    """Find what the controllers of a scene feed forward; a scene without any is given back.

    Raises
    ------
    SceneError, FEImportError, SimulationError
        As `erls.inverse.invert.invert`.
    """
    names = led_by_inversion(scene.record)
    if not names:
        return Fed(scene, ())
    tell(f"finding what the mechanism needs along {', '.join(names)}")
    found = invert(in_modes(scene), tell=tell)

    def tables(name: str, drive: PDDrive) -> PDDrive:
        motion = MotionTable(times=tuple(found.t.tolist()), values=tuple(found.angles[name].tolist()))
        profiles = (load_table(found.t, found.efforts[name]),)
        return replace(drive, feed_forward=False, motion=motion, profiles=profiles)

    record = with_controllers(scene.record, tables)
    return Fed(Scene(scene.path, record), (*found.warnings, *_apart(found, names)))


def _apart(found: Inversion, names: tuple[str, ...]) -> tuple[str, ...]:
    """Joints that do not begin where they are wanted."""
    begin = {joint.name: joint.position for joint in found.problem.mechanism.joints}
    return tuple(
        f"{name} starts at {begin[name]:.6g}, and is wanted at {found.start[name]:.6g}: its controller pulls it there"
        for name in names
        if np.abs(begin[name] - found.start[name]) > _APART
    )
