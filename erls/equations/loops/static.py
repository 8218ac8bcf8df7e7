"""Static equilibrium of a chain with loops: links deform, joints follow; those that the loops leave free are held."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from erls.errors import Cause, SimulationError
from erls.maths.so3 import Array
from fe_import.model import IntArray

if TYPE_CHECKING:
    from erls.equations.loops.closed_chain import ClosedChain

_ITERATIONS = 20
_TOLERANCE = 1e-10  # of the deflection; one more step of quadratic convergence would reach rounding
_ROUNDING = 1e-13  # of the size of a link


def closed_equilibrium(chain: ClosedChain, y: Array, held: IntArray) -> Array:
    """(n,) equilibrium under gravity, springs and drives.

    Parameters
    ----------
    chain : ClosedChain
    y : (n,) array
        Loops closed, links undeformed.
    held : int array
        Free joints, by their place in y, whose physical angles keep their values.

    Raises
    ------
    SimulationError
        NO_EQUILIBRIUM: the links are too soft for small displacements to carry the load.
    """
    n, still, kept, free = chain.size, np.zeros(chain.size), chain.kept, chain.tree.free
    numbers = chain.tree.free_joints[held]
    angles = chain.tree.state(0.0, y, still).angles[numbers]
    metres = chain.metres

    def state(trial: Array) -> tuple[Array, Array, Array]:
        """Forces, conditions of loops and held joints, and the rows of the former conditions."""
        found = chain.closure(0.0, trial, still)
        turned = chain.tree.state(0.0, trial, still).angles[numbers] - angles
        conditions = np.concatenate([found.violation[kept], turned])
        return chain.tree.residual(0.0, trial, still, still), conditions, found.rows[kept][:, free]

    y = y.copy()
    multipliers = np.zeros(0)
    deflection, joints = 0.0, len(chain.tree.free_joints)
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
