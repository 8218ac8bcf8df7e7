"""How far drive efforts and joint reactions of two motions are apart, relative to their peaks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from erls.equations.formulation import Formulation
from erls.equations.serial.state_series import reaction_series
from erls.errors import SimulationError
from erls.maths.so3 import Array

_SMALL_PEAK = 1e-3  # of the largest of any joint: forces that are nothing but errors are measured by that


@dataclass(frozen=True)
class ForceDifferences:
    """Of efforts, forces and moments of all joints.

    Attributes
    ----------
    apart : (3, k, joints) array
        At each pair of states.
    peak : (3, joints) array
        Of the largest values in any state.
    """

    apart: Array
    peak: Array

    def relative(self, apart: Array) -> tuple[Array, Array]:
        """(joints,) of efforts, and of reactions, from differences (3, joints)."""
        peak = np.maximum(self.peak, _SMALL_PEAK * self.peak.max(axis=1, initial=0.0)[:, None])
        found = np.where(peak > 0, apart / np.where(peak > 0, peak, 1.0), 0.0)
        return found[0], found[1:].max(axis=0)


def force_differences(
    formulation: Formulation, t: Array, one: tuple[Array, Array], other: tuple[Array, Array]
) -> ForceDifferences | None:
    """Between states at the same times; None where the equations cannot be solved for them.

    Parameters
    ----------
    formulation : Formulation
    t : (k,) array
        [s]
    one, other : two (k, n) arrays each
        Coordinates and rates.
    """
    y, v = (np.concatenate(pair) for pair in zip(one, other, strict=True))
    try:
        with np.errstate(all="ignore"):
            every = reaction_series(formulation, np.concatenate([t, t]), y, v)
    except (SimulationError, np.linalg.LinAlgError):
        return None
    half = len(t)
    kinds = every.effort[..., None], every.force, every.moment
    apart = [np.linalg.norm(x[:half] - x[half:], axis=-1) for x in kinds]
    peak = [np.linalg.norm(x, axis=-1).max(axis=0, initial=0.0) for x in kinds]
    return ForceDifferences(np.stack(apart), np.stack(peak))
