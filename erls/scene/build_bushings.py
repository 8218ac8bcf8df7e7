"""Bushings of a scene: frames on links and ground, where the initial coordinates put them, and matrices."""

from __future__ import annotations

import numpy as np

from erls.maths.own_units import in_own_units
from erls.maths.so3 import Array, fixed_axes
from erls.mechanism.bushings import BUSHING, Bushing
from erls.mechanism.chain import Mechanism, poses
from erls.mechanism.loops import Loop
from erls.mechanism.place import Place
from erls.scene.build_loops import ends_of
from erls.scene.bushings import Bushing as BushingRecord
from erls.scene.bushings import Stiffness
from erls.scene.chain import Scene

_SYMMETRIC = 1e-9  # in the units of the diagonal
_DEFINITE = 1e-12  # the same


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
    inner, outer = ends_of(record, fixed_axes(*np.radians(record.rotation_deg)), mechanism, frames, at.where)
    given = Bushing(_matrix(record.stiffness, "stiffness", at), _matrix(record.damping, "damping", at))
    return Loop(record.name, BUSHING, inner, outer, bushing=given)


def _matrix(given: Stiffness, field: str, at: Place) -> Array:
    """(6, 6), symmetric and positive semi-definite."""
    rows = [isinstance(row, tuple) for row in given]
    if any(rows) and not all(rows):
        raise at.error(field, "numbers and rows", remedy="give six numbers, or six rows of six")
    found = np.array(given, dtype=float)
    if found.ndim == 1:
        found = np.diag(found)
    scaled = in_own_units(found)
    if np.abs(scaled - scaled.T).max() > _SYMMETRIC:
        raise at.error(field, "not symmetric", remedy="give a symmetric matrix, or its diagonal")
    if np.linalg.eigvalsh(scaled)[0] < -_DEFINITE:
        least = float(np.linalg.eigvalsh(found)[0])
        raise at.error(field, "a negative principal value", least, 0.0, remedy="give a matrix that resists")
    return np.asarray((found + found.T) / 2)
