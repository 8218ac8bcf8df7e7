"""Mechanisms of scenes that start elsewhere than one that was built, or bear other loads: the rest serves again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import msgspec
import numpy as np

from erls.mechanism.chain import Mechanism
from erls.mechanism.joints import Joint
from erls.mechanism.place import Place
from erls.scene.build import Built
from erls.scene.build_joints import initial_motion
from erls.scene.build_loads import build_loads
from erls.scene.chain import Scene, SceneRecord
from erls.scene.check_circuits import circuits
from erls.scene.joints import Joint as JointRecord

_MAY_DIFFER = {"joints", "loads", "simulation"}


def rebuilt(scene: Scene, before: SceneRecord, mechanism: Mechanism) -> Built | None:
    """What `erls.scene.build.build_mechanism` would make of a scene, where that is known from another one.

    Parameters
    ----------
    scene : Scene
    before : SceneRecord
        The other one.
    mechanism : Mechanism
        That of the other one.

    Returns
    -------
    Built or None
        The same objects but for joints that start elsewhere and loads; None where more differs, or where more than
        joints depends on where they start.

    Raises
    ------
    SceneError
        As `erls.scene.build.build_mechanism`.
    """
    now = scene.record
    if len(mechanism.joints) != len(now.joints) or not _alike(now, before):
        return None
    joints = tuple(_started(*both, scene, k) for k, both in enumerate(zip(mechanism.joints, now.joints, strict=True)))
    loads = mechanism.loads
    if now.loads != before.loads:
        numbers: np.ndarray[tuple[int], np.dtype[np.int64]] = np.arange(len(mechanism.links))
        loads = tuple(build_loads(scene, mechanism.links, mechanism.points, numbers))
    return Built(replace(mechanism, joints=joints, loads=loads))


def _alike(now: SceneRecord, before: SceneRecord) -> bool:
    if now.loops or now.bushings or now.couplings or circuits(now) or len(now.joints) != len(before.joints):
        return False
    fields = (field for field in now.__struct_fields__ if field not in _MAY_DIFFER)
    settings = (settings_of_mechanism(record) for record in (now, before))
    return (
        next(settings) == next(settings)
        and all(getattr(now, field) == getattr(before, field) for field in fields)
        and all(_same_joint(*both) for both in zip(now.joints, before.joints, strict=True))
    )


def settings_of_mechanism(record: SceneRecord) -> Sequence[object]:
    """What of the settings goes into a mechanism."""
    return record.simulation.effects, record.simulation.formulation, record.simulation.bandwidth


def _same_joint(now: JointRecord, before: JointRecord) -> bool:
    return now == before or msgspec.structs.replace(now, initial=before.initial) == before


def _started(joint: Joint, record: JointRecord, scene: Scene, k: int) -> Joint:
    """The joint at its start."""
    if joint.drive.prescribed:
        return joint
    place = Place(scene.folder, f"{scene.path}: joints[{k}]", joint.freedom.turns)
    position, rate = initial_motion(record, place)
    return joint if (position, rate) == (joint.position, joint.rate) else replace(joint, position=position, rate=rate)
