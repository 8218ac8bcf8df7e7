"""Conditions of joints that follow from others: found by rank, named, left out; and the smallest forces in their place.

A planar loop of revolute joints in space, or a shaft in three bearings, says some things twice. Motion and equilibrium
do not depend on which of them is left out; how the joints share their forces does, for rigid parts. The smallest
multipliers that give the same forces on the nodes, in newtons, are the even-handed choice.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from erls.equations.consistency import redundant_constraints
from erls.equations.nodal.assembly import NodalSystem
from erls.equations.nodal.joints import Joint
from erls.equations.nodal.nodes import Nodes
from erls.equations.system import metre_scales
from erls.errors import Cause, SimulationError
from erls.maths.saddle import Scales, dense
from erls.maths.so3 import Array

_KEPT = 1e-6  # of the size of the mechanism: left-out conditions are closed to this, unless they said something new


def without_redundant(system: NodalSystem) -> tuple[list[Joint], tuple[str, ...]]:
    """Joints with what follows from the others left out, as built; and the names of those conditions."""
    rows = dense(system.constraint_matrix(0.0, system.start))
    found = redundant_constraints(rows, 1 / metre_scales(system))
    joints = list(system.rows.joints)
    first = np.searchsorted(system.rows.joint_of_row, np.arange(len(joints)))
    for row in found:
        k = int(system.rows.joint_of_row[row])
        name = system.rows.joints[k].conditions[row - int(first[k])].name
        joints[k] = replace(joints[k], left_out=joints[k].left_out | {name})
    return joints, tuple(system.constraint_names[row] for row in found)


def smallest_multipliers(full: NodalSystem, t: float, q: Nodes, force: Array, units: Array | None = None) -> Array:
    """(m,) multipliers of all conditions of ``full`` with Bᵀ λ = ``force`` (n,), the least ones in newtons.

    Parameters
    ----------
    full : NodalSystem
    t : float
    q : Nodes
    force : (n,) array
    units : (m,) array, optional
        Multiplier per newton of each condition; 0: it does not count how large that is. Unless given, all count.
    """
    rows, metres = full.constraint_matrix(t, q), metre_scales(full)
    if units is None:
        units = Scales(metres, np.eye(1), rows).constraint
    counted, right = units > 0, force / metres
    units = np.where(counted, units, 1.0)
    matrix = (dense(rows) / metres * units[:, None]).T
    others, unknowns = matrix[:, ~counted], np.zeros(len(units))
    beside = np.linalg.qr(others, mode="complete")[0][:, others.shape[1] :].T  # what they cannot balance
    unknowns[counted] = np.linalg.lstsq(beside @ matrix[:, counted], beside @ right, rcond=1e-9)[0]
    unknowns[~counted] = np.linalg.lstsq(others, right - matrix @ unknowns, rcond=None)[0]
    return np.asarray(unknowns * units)


def refuse_open(full: NodalSystem, t: float, q: Nodes, left_out: tuple[str, ...]) -> None:
    """Raise when conditions that were left out do not hold: they followed from the others only as built.

    Raises
    ------
    SimulationError
        With cause REDUNDANT_CONSTRAINTS.
    """
    gap = np.abs(full.constraint(t, q))
    open_ones = [k for k, name in enumerate(full.constraint_names) if name in left_out and gap[k] > _limit(full)]
    if open_ones:
        worst = max(open_ones, key=lambda k: float(gap[k]))
        raise SimulationError(
            Cause.REDUNDANT_CONSTRAINTS,
            f"{full.constraint_names[worst]} followed from the other conditions as built, and is open here",
            where=f"t = {t:.9g}",
            value=float(gap[worst]),
            limit=_limit(full),
            remedy="build the scene away from this special position, where the mechanism can move two ways",
        )


def _limit(full: NodalSystem) -> float:
    return _KEPT * max(1.0, float(metre_scales(full).max(initial=1.0)))
