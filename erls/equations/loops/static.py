"""Static equilibrium of a chain with loops: links deform, joints follow; those that the loops leave free are held."""

from __future__ import annotations

import numpy as np

from erls.equations.loops.tied import Tied
from erls.errors import Cause, SimulationError
from erls.maths.so3 import Array
from fe_import.model import IntArray

_ITERATIONS = 20
_TOLERANCE = 1e-10  # of the deflection; one more step of quadratic convergence would reach rounding
_ROUNDING = 1e-13  # of the size of a link


def closed_equilibrium(chain: Tied, y: Array, held: IntArray, kept: IntArray) -> Array:
    """(n,) equilibrium under gravity, springs and drives.

    Parameters
    ----------
    chain : Tied
    y : (n,) array
        Loops closed, links undeformed.
    held : int array
        Free joints, by their place in y, whose physical angles keep their values.
    kept : int array
        Rows of the conditions that do not follow from others.

    Raises
    ------
    SimulationError
        NO_EQUILIBRIUM: the links are too soft for small displacements to carry the load.
    """
    n, still, free = chain.size, np.zeros(chain.size), chain.bare.free
    numbers = chain.bare.free_joints[held]
    angles = chain.bare.state(0.0, y, still).angles[numbers]
    metres = chain.metres

    def state(trial: Array) -> tuple[Array, Array, Array]:
        """Forces, conditions of loops and held joints, and the rows of the former conditions."""
        found = chain.closure(0.0, trial, still)
        turned = chain.bare.state(0.0, trial, still).angles[numbers] - angles
        conditions = np.concatenate([found.violation[kept], turned])
        return chain.whole.forces(0.0, trial, still, still), conditions, found.rows[kept][:, free]

    y = y.copy()
    multipliers = np.zeros(0)
    deflection, joints = 0.0, len(chain.bare.free_joints)
    for _ in range(_ITERATIONS):
        forces, conditions, rows = state(y)
        stiffness, slopes = np.empty((n, n)), np.empty((len(conditions), n))
        for k in range(n):
            step = 1e-6 / metres[k]
            trial = y.copy()
            trial[k] += step
            more, moved, turned = state(trial)
            slopes[:, k] = (moved - conditions) / step
            stiffness[:, k] = (more - forces) / step
            if len(multipliers):
                stiffness[:, k] += (turned - rows).T @ multipliers[: len(kept)] / step
        slopes[: len(kept)] = rows
        block = np.block([[stiffness, slopes.T], [slopes, np.zeros((len(slopes),) * 2)]])
        try:
            solved = np.linalg.solve(block, -np.concatenate([forces, conditions]))
        except np.linalg.LinAlgError:
            break
        y, multipliers = y + solved[:n], solved[n:]
        deflection = float(np.abs(metres * y)[joints:].max(initial=0.0))
        if not deflection < chain.reach:
            break
        if np.abs(metres * solved[:n]).max(initial=0.0) <= max(_TOLERANCE * deflection, _ROUNDING * chain.reach):
            return y
    raise SimulationError(
        Cause.NO_EQUILIBRIUM,
        "no static equilibrium of the closed chain within small displacements",
        where="initial.deformation",
        value=f"deflection {deflection:.3g} m",
        limit=f"{chain.reach:.3g} m, the size of a link",
        remedy="start from deformation = 'zero', or check stiffness and gravity",
    )
