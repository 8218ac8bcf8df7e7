"""The springs of a scene as elements; a new kind is a record of the schema, a file of elements, a line in `KINDS`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from erls.equations.nodal.elements import Elements
from erls.equations.nodal.springs import Spring, Springs
from erls.equations.nodal.turning_springs import TurningSpring, TurningSprings
from erls.errors import Cause, SceneError
from erls.maths.motion_maps import inverse
from erls.maths.so3 import Array
from erls.scene.bodies.schema import GROUND, BodySceneRecord, LineSpring
from erls.scene.bodies.schema import TurningSpring as TurningRecord


def springs(record: BodySceneRecord, numbers: dict[str, int], poses: Array, file: str) -> list[Elements]:
    """Springs of one kind as one set of elements.

    Raises
    ------
    SceneError
        BAD_FIELD: a line of no length.
    """
    groups: dict[type, list[Any]] = {}
    for k, spring in enumerate(record.springs):
        ends = [numbers[name] for name in (spring.to, spring.node) if name != GROUND]
        frames = [poses[n] for n in ends] if len(ends) == 2 else [np.eye(4), poses[ends[0]]]
        make, _ = KINDS[type(spring)]
        made = make(spring, tuple(ends), frames[0], frames[1], f"{file}: springs[{k}]")
        groups.setdefault(type(spring), []).append(made)
    return [KINDS[kind][1](members) for kind, members in groups.items()]


def _line(record: LineSpring, nodes: tuple[int, ...], first: Array, second: Array, place: str) -> Spring:
    at = second[:3, 3] if record.position is None else np.array(record.position)
    other = first[:3, 3] if record.to_position is None else np.array(record.to_position)
    built = float(np.linalg.norm(at - other))
    if built == 0.0:
        raise SceneError(
            Cause.BAD_FIELD,
            "both ends of the spring lie in one place, so that it has no direction",
            where=f"{place}.to_position",
            value=other.tolist(),
            remedy="give ends apart",
        )
    arms = [inverse(frame)[:3, :3] @ (x - frame[:3, 3]) for frame, x in ((first, other), (second, at))]
    length = built if record.length is None else record.length
    return Spring(nodes, arms[0], arms[1], record.stiffness, record.damping, length)


def _turning(record: TurningRecord, nodes: tuple[int, ...], first: Array, second: Array, place: str) -> TurningSpring:
    axis = np.array(record.axis) / np.linalg.norm(record.axis)
    rest = float(np.radians(record.rest_deg))
    return TurningSpring(nodes, first[:3, :3].T, second[:3, :3].T, axis, record.stiffness, record.damping, rest)


KINDS: dict[type, tuple[Callable[..., Any], Callable[..., Elements]]] = {
    LineSpring: (_line, Springs),
    TurningRecord: (_turning, TurningSprings),
}
