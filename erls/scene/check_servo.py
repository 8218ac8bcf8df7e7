"""The conditions on the tables ``servo``, ``inverse`` and ``plan`` that the types of their records cannot state."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from erls.errors import SceneError
from erls.scene.build_joints import joint_coordinates
from erls.scene.chain import SceneRecord
from erls.scene.checks import bad, directed, positive
from erls.scene.joints import Joint
from erls.scene.servo import Servo
from fe_import.files.toml import choose

AXES = ("x", "y", "z")
_ALONG = 1e-6  # sine of an angle within which two directions are one


def check_servo(scene: SceneRecord, file: str) -> None:
    """Refuse demands that cannot be meant.

    Raises
    ------
    SceneError
        BAD_FIELD, BAD_REFERENCE: naming file, field, value and remedy.
    """
    joints = [name for joint in scene.joints for name in joint_coordinates(joint)]
    points = [point.name for point in scene.points]
    for k, servo in enumerate(scene.servo):
        _check_one(servo, points, joints, f"{file}: servo[{k}]")
    positive(f"{file}: inverse.bandwidth", scene.inverse.bandwidth)
    positive(f"{file}: inverse.step", scene.inverse.step)
    for k, name in enumerate(scene.inverse.drives):
        place = f"{file}: inverse.drives[{k}]"
        choose(name, joints, place, SceneError)
        if name in scene.inverse.drives[:k]:
            raise bad(place, "named twice", name, "name it once")


def check_plan(scene: SceneRecord, file: str) -> None:
    """The same of the table ``plan``, whose joints have one coordinate; their numbers are checked as it is read."""
    plan, joints = scene.plan, [joint.name for joint in scene.joints if "" in _parts(joint)]
    for name in plan.joints:
        choose(name, joints, f"{file}: plan.joints", SceneError)
    positive(f"{file}: plan.swing", plan.swing)
    if not 0.0 <= plan.uncertainty < 0.5:
        raise bad(f"{file}: plan.uncertainty", "not a share of a frequency", plan.uncertainty, "give 0 to 0.5")


def _parts(joint: Joint) -> list[str]:
    return [freedom.name for freedom in joint_coordinates(joint).values()]


def _check_one(servo: Servo, points: Sequence[str], joints: Sequence[str], place: str) -> None:
    if bool(servo.point) == bool(servo.joints):
        raise bad(place, "give exactly one of 'point' and 'joints'", servo.point or None, "name what shall move")
    if (servo.motion is None) == (servo.path is None):
        raise bad(place, "give exactly one of 'motion' and 'path'", None, "say how it shall move")
    for name, factor in servo.joints.items():
        choose(name, joints, f"{place}.joints", SceneError)
        if not factor:
            raise bad(f"{place}.joints.{name}", "counts nothing", factor, "give a factor, or leave it out")
    for field in ("coordinates", "about", "path"):
        if servo.joints and getattr(servo, field):
            raise bad(f"{place}.{field}", "belongs to a point", None, "remove it, or name a point")
    if not servo.point:
        return
    choose(servo.point, points, f"{place}.point", SceneError)
    if bool(servo.coordinates) == (servo.about is not None):
        remedy = f"give some of {', '.join(AXES)}, or the line about which its angle is demanded"
        raise bad(place, "give exactly one of 'coordinates' and 'about'", servo.point, remedy)
    for k, axis in enumerate(servo.coordinates):
        choose(axis, AXES, f"{place}.coordinates[{k}]", SceneError)
        if axis in servo.coordinates[:k]:
            raise bad(f"{place}.coordinates[{k}]", "named twice", axis, "name it once")
    if servo.motion is not None and len(servo.coordinates) > 1:
        message, remedy = "one motion for several coordinates", "give a path, or a [[servo]] for each of them"
        raise bad(f"{place}.motion", message, len(servo.coordinates), remedy)
    if servo.about is not None:
        if servo.path is not None:
            raise bad(f"{place}.path", "a path has no angle about a line", None, "give its motion, or coordinates")
        directed(f"{place}.about.axis", servo.about.axis)
        line, zero = (np.array(x, dtype=float) for x in (servo.about.axis, servo.about.zero))
        if np.linalg.norm(np.cross(line, zero)) <= _ALONG * np.linalg.norm(line) * np.linalg.norm(zero):
            raise bad(f"{place}.about.zero", "lies along the axis", servo.about.zero, "give a direction across it")
