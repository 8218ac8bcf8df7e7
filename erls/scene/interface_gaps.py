"""Whether interfaces lie on the joints that they meet: told in metres, along a joint's axis and across it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from erls.maths.se3 import inverse
from erls.maths.so3 import Array
from erls.mechanism.joints import Joint
from erls.mechanism.links import Link
from erls.scene.chain import SceneRecord

SMALLEST = 1e-6  # of a link's size: what counts as a gap


def interface_gaps(record: SceneRecord, rows: Sequence[Sequence[Joint]], links: Sequence[Link]) -> list[str]:
    """A warning for each interface that a rigid arm connects with its joint; often a wrong mesh pose or length.

    The offset d of a joint's row lies along its axis: interfaces may meet before it or behind it. Along a slide nothing
    is a gap, since its coordinate says where on it a link is.

    Parameters
    ----------
    record : SceneRecord
    rows : sequence of sequences of Joint
        The motions of each joint, with their seats.
    links : sequence of Link
        As many.
    """
    result = []
    for k, (row, link) in enumerate(zip(rows, links, strict=True)):
        inner = (row[-1].after @ np.append(link.inboard.position, 1.0))[:3]
        seat, parent = row[0].seat, row[0].parent
        outer = None if seat is None else (inverse(row[0].before) @ np.append(seat.position, 1.0))[:3]
        found = _gaps(row, record.joints[k].dh.d, inner, outer)
        name, own = record.joints[k].name, f"link {link.name!r}: interface {link.inboard.name!r}"
        result += _told(own, found[0], link, name, _INNER)
        if seat is not None:
            before = links[parent]
            result += _told(f"link {before.name!r}: interface {seat.name!r}", found[1], before, name, _OUTER)
    return result


_INNER = (
    "check mesh_pose: frame = 'joint' stands behind theta and d of the joint's row, frame = 'dh' behind the whole row"
)
_OUTER = "check a, d and alpha of the rows against the length of the link"


def _gaps(row: Sequence[Joint], d: float, inner: Array, outer: Array | None) -> tuple[Array, Array]:
    """(2,) gaps [m] along and across the joint's axis, of the inner and of the outer interface; places in its frame."""
    ends = [inner] if outer is None else [inner, outer]
    slides = [motion.freedom.direction for motion in row if not motion.freedom.turns and not motion.fixed]
    turning = [motion.freedom.direction for motion in row if motion.freedom.turns and not motion.fixed]
    axis = turning[0] if len(turning) == 1 else slides[0] if len(slides) == 1 and not turning else np.zeros(3)
    best = min(([_split(p - s, axis, slides) for p in ends] for s in (np.zeros(3), -d * np.eye(3)[2])), key=_size)
    return best[0], best[-1]


def _split(gap: Array, axis: Array, slides: Sequence[Array]) -> Array:
    for direction in slides:
        gap = gap - (gap @ direction) * direction
    along = float(gap @ axis)
    return np.array([abs(along), np.linalg.norm(gap - along * axis)])


def _size(gaps: Sequence[Array]) -> float:
    return float(np.sum(gaps))


def _told(interface: str, gap: Array, link: Link, joint: str, remedy: str) -> list[str]:
    limit = SMALLEST * max(link.size, 1e-9)
    ways = zip(gap[::-1], ("off", "along"), strict=True)
    parts = [f"{value:.4g} m {where}" for value, where in ways if value > limit]
    if not parts:
        return []
    return [
        f"{interface} lies {' and '.join(parts)} the axis of joint {joint!r}; a rigid arm bridges the gap ({remedy}, "
        "if this is not meant)"
    ]
