"""Denavit-Hartenberg parameters, standard and modified (Craig)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from erls.maths.se3 import pose
from erls.maths.so3 import Array, rotation_x, rotation_z

CONVENTIONS = ("standard", "modified")


@dataclass(frozen=True)
class DHRow:
    """One row of the table: lengths [m], angles [rad]; the joint coordinate adds to ``theta`` or ``d``."""

    convention: str
    a: float
    alpha: float
    d: float
    theta: float


def split(row: DHRow) -> tuple[Array, Array]:
    """Constant poses before and after the joint's motion about or along z.

    The pose of frame k in frame k-1 is ``before`` @ joint_pose(coordinate) @ ``after``: Rz(θ)Tz(d)Tx(a)Rx(α) in the
    standard convention (Denavit & Hartenberg 1955), Rx(α)Tx(a)Rz(θ)Tz(d) in the modified one (Craig 1986).

    Returns
    -------
    before, after : (4, 4) arrays
    """
    screw_x = pose(rotation_x(row.alpha), np.array([row.a, 0.0, 0.0]))
    screw_z = pose(rotation_z(row.theta), np.array([0.0, 0.0, row.d]))
    # rotation about z and translation along z commute with the joint's motion, so the constant part may stand first
    if row.convention == "modified":
        return screw_x @ screw_z, np.eye(4)
    return screw_z, screw_x
