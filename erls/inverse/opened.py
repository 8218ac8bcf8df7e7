"""Scenes without the controllers whose feed-forward is to be found: what an inversion works on."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from msgspec.structs import replace

from erls.mechanism.drives import FreeDrive, PDDrive
from erls.mechanism.place import Place
from erls.scene.build_joints import led_by_inversion, with_coordinates
from erls.scene.chain import Scene, SceneRecord
from erls.scene.joints import Acting


def with_controllers(record: SceneRecord, change: Callable[[str, PDDrive], PDDrive | FreeDrive]) -> SceneRecord:
    """With other drives in place of the controllers that an inversion leads."""

    def changed(name: str, acting: Acting) -> Acting:
        drive = acting.drive
        return replace(acting, drive=change(name, drive)) if isinstance(drive, PDDrive) and drive.elastic else acting

    return replace(record, joints=[with_coordinates(joint, changed) for joint in record.joints])


def opened(scene: Scene) -> Scene:
    """Without them; they are the unknown drives.

    Raises
    ------
    SceneError
        BAD_FIELD: a motion is given besides, or other drives are named as unknown.
    """
    names, given = led_by_inversion(scene.record), scene.record.inverse.drives
    if not names:
        return scene
    if given and set(given) != set(names):
        place, message = Place(Path(), str(scene.path)), "not the joints with feed_forward = 'elastic'"
        raise place.error("inverse.drives", message, ", ".join(given), remedy=f"name {', '.join(names)}, or none")

    def open_(name: str, drive: PDDrive) -> FreeDrive:
        for field in ("motion", "profiles"):
            if getattr(drive, field):
                place, message = Place(Path(), f"{scene.path}: {name}.drive"), "feed_forward = 'elastic' finds it"
                raise place.error(field, message, remedy="remove it, and say by [[servo]] what shall move how")
        return FreeDrive()

    record = with_controllers(scene.record, open_)
    return Scene(scene.path, replace(record, inverse=replace(record.inverse, drives=names)))


def in_modes(scene: Scene) -> Scene:
    """In a formulation whose coordinates are independent."""
    settings = scene.record.simulation
    if settings.formulation != "nodal":
        return scene
    return Scene(scene.path, replace(scene.record, simulation=replace(settings, formulation="erls")))
