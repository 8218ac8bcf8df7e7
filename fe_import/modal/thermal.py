"""Thermal expansion of a reduced link.

A temperature change ΔT adds ΔT f to the modal forces, q̈ + Ω² q = ... + ΔT f, and section forces are those of
N = E A (ε - α ΔT): what the coordinates give, and ΔT times those of the link held in its shape.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from fe_import.model import Array, IntArray


@dataclass(frozen=True)
class ThermalExpansion:
    """What a uniform temperature change does to a link with m modal coordinates and p places of recovery.

    Attributes
    ----------
    change : float
        From the temperature of the stated shape without stress [K].
    force : (m,) array
        Generalized force per kelvin, Φᵀ ∫ Bᵀ E A α dx; zero in the rigid-body modes.
    restrained : (p, 6) array
        Section forces per kelvin of the link held in its shape, N = -E A α; they add to those of the coordinates.
    relaxed : (p, 6) array
        Static ones per kelvin of the free link, none of its modes left out, for mode acceleration.
    """

    change: float
    force: Array
    restrained: Array
    relaxed: Array

    def truncated(self, modes: IntArray) -> ThermalExpansion:
        """That of some of the modes, in the given order."""
        return replace(self, force=self.force[modes])
