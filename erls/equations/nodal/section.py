"""Cross sections of beams: stiffness and inertia per length, in the order of strains [γ; κ] and twists [v; ω]."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from erls.errors import Cause, SceneError
from erls.maths.so3 import Array


@dataclass(frozen=True)
class BeamSection:
    """A section about its centroid; x runs along the beam.

    Attributes
    ----------
    stiffness : (6, 6) array
        Force and moment per strain [γ_x, γ_y, γ_z, κ_x, κ_y, κ_z]; symmetric, positive definite.
    inertia : (6, 6) array
        Mass matrix of twists per length; symmetric, positive semi-definite.

    Raises
    ------
    SceneError
        With cause BAD_FIELD.
    """

    stiffness: Array
    inertia: Array

    def __post_init__(self) -> None:
        for name, least in (("stiffness", 1e-15), ("inertia", -1e-12)):
            matrix = np.asarray(getattr(self, name))
            size = float(np.abs(matrix).max(initial=0.0))
            good = matrix.shape == (6, 6) and np.isfinite(size) and np.abs(matrix - matrix.T).max() <= 1e-12 * size
            if not good or np.linalg.eigvalsh(matrix).min() < least * size or (name == "stiffness" and size == 0):
                raise SceneError(
                    Cause.BAD_FIELD,
                    "no section has this",
                    where=f"section: {name}",
                    value=matrix.tolist(),
                    remedy="give a symmetric 6x6 matrix; no strain may be free of force, no motion of negative mass",
                )


def beam_section(
    stretch: float,
    shear: tuple[float, float],
    torsion: float,
    bending: tuple[float, float],
    mass: float = 0.0,
    rotary: tuple[float, float] = (0.0, 0.0),
) -> BeamSection:
    """A section with principal axes y and z.

    Parameters
    ----------
    stretch : float
        E A [N].
    shear : (float, float)
        k_y G A and k_z G A [N].
    torsion : float
        G J [N m²].
    bending : (float, float)
        E I_y and E I_z [N m²].
    mass : float
        ρ A [kg/m].
    rotary : (float, float)
        ρ I_y and ρ I_z [kg m]; about x it is their sum.
    """
    stiffness = np.diag([stretch, *shear, torsion, *bending])
    return BeamSection(stiffness, np.diag([mass, mass, mass, sum(rotary), *rotary]))
