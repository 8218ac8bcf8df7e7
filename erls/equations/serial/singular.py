"""What to tell where nothing resists the motion of a coordinate."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from erls.equations.formulation import TreeFormulation
from erls.errors import Cause, SimulationError
from erls.maths.so3 import Array


def _numbered(place: int) -> str:
    return f"elastic coordinate {place + 1}"


def singular_mass(
    equations: TreeFormulation, t: float, mass: Array, name_of: Callable[[int], str] = _numbered
) -> SimulationError:
    """The failure for a mass matrix (n, n) over independent coordinates that is not positive definite.

    ``name_of`` tells elastic coordinates by their place among them.
    """
    values, vectors = np.linalg.eigh(mass)
    worst = int(equations.free[int(np.abs(vectors[:, 0]).argmax())])
    joints = equations.mechanism.joints
    name = f"joint {joints[worst].name!r}" if worst < len(joints) else name_of(worst - len(joints))
    return SimulationError(
        Cause.SINGULAR_MASS,
        f"nothing resists the motion of {name}",
        where=f"t = {t:.6g} s",
        value=float(values[0]),
        limit="above 0",
        remedy="give the link mass and inertia, or the joint rotor inertia",
    )
