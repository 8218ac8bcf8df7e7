"""Joints of a URDF file that follow others (``mimic``) as couplings of a scene."""

from __future__ import annotations

import json
from collections.abc import Sequence

from erls.importers.urdf import UrdfJoint


def follows(joint: UrdfJoint, joints: Sequence[UrdfJoint]) -> bool:
    """Whether a joint follows one that moves, too; it does not where the ratio is 0."""
    return bool(joint.multiplier) and joint.mimics in {other.name for other in joints} - {joint.name}


def couplings_of(joints: Sequence[UrdfJoint]) -> tuple[list[str], list[str]]:
    """Tables of a scene, and what is told of joints that cannot follow.

    Parameters
    ----------
    joints : sequence of UrdfJoint
        Those that move.
    """
    tables, told = list[str](), list[str]()
    for joint in (joint for joint in joints if joint.mimics):
        if not follows(joint, joints):
            told.append(f"joint {joint.name!r} should follow {joint.mimics!r}, which does not move: it moves alone")
            continue
        ratio = f"{json.dumps(joint.mimics, ensure_ascii=False)} = {joint.multiplier!r}"
        name, own = (json.dumps(text, ensure_ascii=False) for text in (f"{joint.name} follows", joint.name))
        lines = ["[[couplings]]", f"name = {name}", f"joint = {own}", f"follows = {{ {ratio} }}"]
        tables.append("\n".join([*lines, *([f"offset = {joint.offset!r}"] if joint.offset else []), ""]))
    return tables, told
