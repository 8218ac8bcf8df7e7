"""Bushings of a scene: frames on links and ground, where the initial coordinates put them, and matrices."""

from __future__ import annotations

import numpy as np

from erls.maths.se3 import pose
from erls.maths.so3 import Array, fixed_axes
from erls.mechanism.bushings import BUSHING, Bushing
from erls.mechanism.chain import Mechanism, poses
from erls.mechanism.loops import Loop, LoopEnd
from erls.mechanism.place import Place
from erls.scene.build_loops import turning_node
from erls.scene.bushings import Bushing as BushingRecord
from erls.scene.bushings import Stiffness
from erls.scene.chain import Scene

_SYMMETRIC = 1e-9  # of the largest entry
_DEFINITE = 1e-12  # of the largest eigenvalue


def build_bushings(scene: Scene, mechanism: Mechanism) -> tuple[Loop, ...]:
    """Bushings as what closes a chain without tying it.

    Raises
    ------
    SceneError
        BAD_REFERENCE, BAD_FIELD: naming file, field, value and remedy.
    """
    if not scene.record.bushings:
        return ()
    frames = poses(mechanism, np.array([joint.position for joint in mechanism.joints]))
    return tuple(
        _bushing(record, mechanism, frames, Place(scene.folder, f"{scene.path}: bushings[{k}]"))
        for k, record in enumerate(scene.record.bushings)
    )


def _bushing(record: BushingRecord, mechanism: Mechanism, frames: list[Array], at: Place) -> Loop:
    names, turn = [link.name for link in mechanism.links], fixed_axes(*np.radians(record.rotation_deg))

    def end(link: str, node: str, field: str) -> LoopEnd:
        number = names.index(link)
        place = turning_node(mechanism, number, node, at.field(field))
        return LoopEnd(number, place, pose(frames[number][:3, :3].T @ turn))

    outer = end(record.link, record.node, "node")
    if record.to_link:
        inner = end(record.to_link, record.to_node, "to_node")
    elif record.position is not None:
        inner = LoopEnd(None, 0, pose(turn, np.array(record.position)))
    else:
        number = names.index(record.link)
        inner = LoopEnd(None, 0, pose(turn, (frames[number] @ np.append(_local(mechanism, outer), 1.0))[:3]))
    given = Bushing(_matrix(record.stiffness, "stiffness", at), _matrix(record.damping, "damping", at))
    return Loop(record.name, BUSHING, inner, outer, bushing=given)


def _local(mechanism: Mechanism, end: LoopEnd) -> Array:
    assert end.link is not None
    return np.asarray(mechanism.links[end.link].model.nodes[end.node])


def _matrix(given: Stiffness, field: str, at: Place) -> Array:
    """(6, 6), symmetric and positive semi-definite."""
    rows = [isinstance(row, tuple) for row in given]
    if any(rows) and not all(rows):
        raise at.error(field, "numbers and rows", remedy="give six numbers, or six rows of six")
    found = np.array(given, dtype=float)
    if found.ndim == 1:
        found = np.diag(found)
    size = float(np.abs(found).max())
    if np.abs(found - found.T).max() > _SYMMETRIC * size:
        raise at.error(field, "not symmetric", remedy="give a symmetric matrix, or its diagonal")
    if np.linalg.eigvalsh(found)[0] < -_DEFINITE * size:
        least = float(np.linalg.eigvalsh(found)[0])
        raise at.error(field, "a negative principal value", least, 0.0, remedy="give a matrix that resists")
    return np.asarray((found + found.T) / 2)
