"""Static equilibrium of the links with the joints held."""

from __future__ import annotations

import numpy as np

from erls.equations.formulation import TreeFormulation
from erls.errors import Cause, SimulationError
from erls.maths.so3 import Array
from fe_import.model import IntArray

_ITERATIONS = 20
_STEP = 1e-6  # m, of differences
_TOLERANCE = 1e-10  # of the deflection; one more step of quadratic convergence would reach rounding


def held_equilibrium(equations: TreeFormulation, y: Array, held_joints: IntArray) -> Array:
    """Elastic coordinates in equilibrium under gravity while every physical joint angle keeps its initial value.

    Parameters
    ----------
    equations : Formulation
    y : (n,) array
        Independent coordinates with the joints in place and the links undeformed; joint coordinates first.
    held_joints : int array
        Joints whose coordinates stand in ``y``.

    Returns
    -------
    (n,) array

    Raises
    ------
    SimulationError
        NO_EQUILIBRIUM: the links are too soft for small displacements to carry the load.
    """
    f, size = len(held_joints), equations.size
    held = y[:f].copy()
    zero = np.zeros(size)
    scales = equations.length_scales
    # a mode that moves no node (torsion of the last link) takes as much energy as the others
    steps = _STEP / scales
    elastic = np.concatenate([np.zeros(0), *(link.stiffness for link in equations.mechanism.links)])
    if 0 < len(elastic) == size - f:
        energies = elastic * steps[f:] ** 2
        steps[f:] *= np.sqrt(np.minimum(1.0, np.median(energies) / energies))

    compiled = equations.compiled

    def out_of_balance(trial: Array) -> Array:
        """Held angles first, then forces on the elastic coordinates."""
        if compiled is None:
            forces = equations.residual(0.0, trial, zero, zero)
        else:
            forces = np.empty(size)
            compiled.residual(compiled.reals, compiled.integers, compiled.scratch, 0.0, trial, zero, zero, forces)
        if not f:
            return forces
        return np.concatenate([equations.state(0.0, trial, zero).angles[held_joints] - held, forces[f:]])

    y = y.copy()
    size_m = max(float(np.linalg.norm(np.ptp(link.model.nodes, axis=0))) for link in equations.mechanism.links)
    deflection = 0.0
    for _ in range(_ITERATIONS):
        value = out_of_balance(y)
        slope = np.empty((size, size))
        for k in range(size):
            trial = y.copy()
            trial[k] += steps[k]
            slope[:, k] = (out_of_balance(trial) - value) / steps[k]
        try:
            update = np.linalg.solve(slope, -value)
        except np.linalg.LinAlgError:
            break
        y += update
        deflection = float(np.abs(scales * y)[f:].max(initial=0.0))
        if not deflection < size_m:
            break
        if np.abs(scales * update).max(initial=0.0) <= _TOLERANCE * max(deflection, 1e-9):
            return y
    raise SimulationError(
        Cause.NO_EQUILIBRIUM,
        "no static equilibrium within small displacements",
        where="initial.deformation",
        value=f"deflection {deflection:.3g} m",
        limit=f"{size_m:.3g} m, the size of a link",
        remedy="start from deformation = 'zero', or check stiffness and gravity",
    )
