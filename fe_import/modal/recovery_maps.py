"""Recovery maps: stress or section forces of a link as a linear map of its modal coordinates and of its loads.

With modal coordinates q of the elastic modes Φ, and loads f (on the interfaces, and centrifugal ω_a ω_b c_ab):

    mode displacement  σ = S Φ q,
    mode acceleration  σ = S G (f - M Φ q̈),  q̈ = Φᵀf - Ω² q.

G is the static flexibility of the free link, loads balanced by rigid-body acceleration (inertia relief; Rubin, AIAA
J. 13, 1975), so that the modes left out follow the loads at rest, and stresses balance loads and inertia even where
the kept shapes are no modes of the link. Gravity and rigid-body acceleration load the nodes as M R does, which G takes
to zero; they need no column. Modal damping acts as M Φ, on the kept modes only, and cancels.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from fe_import.model import Array, IntArray

COMPONENTS = {
    "stress": ("xx", "yy", "zz", "xy", "yz", "zx"),
    "section forces": ("N", "Vy", "Vz", "T", "My", "Mz"),
}
UNITS = {"stress": ("Pa",) * 6, "section forces": ("N", "N", "N", "N m", "N m", "N m")}
SPIN_PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))


@dataclass(frozen=True)
class RecoveryMaps:
    """Stress or section forces at p places of a link.

    Attributes
    ----------
    quantity : str
        ``"stress"`` (xx, yy, zz, xy, yz, zx [Pa], mesh axes, averaged at nodes) or ``"section forces"`` (N, V_y,
        V_z [N], T, M_y, M_z [N m] at element ends, local axes: what the part at larger local x does to the other).
    nodes : (p,) int array
    elements : (p,) int array
        Element (line of the model's pictures) whose end this is; -1 for nodal stress.
    axes : (p, 3, 3) array
        Rows are the axes in which the components are counted, in the mesh frame.
    modes : (p, 6, m) array
        Per unit modal coordinate; zero for rigid-body modes.
    inertia : (p, 6, m) array
        Static, per unit modal acceleration backwards: S G M Φ; S Φ Ω⁻² where Φ are modes of the full model.
    loads : (p, 6, 6 i) array
        Static, per unit force [N] and moment [N m] on each interface, the link free with inertia relief.
    spin : (p, 6, 6) array
        Static, per unit ω_x², ω_y², ω_z², ω_x ω_y, ω_y ω_z, ω_z ω_x [rad²/s²] about the mesh frame's axes.
    """

    quantity: str
    nodes: IntArray
    elements: IntArray
    axes: Array
    modes: Array
    inertia: Array
    loads: Array
    spin: Array

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the six components."""
        return COMPONENTS[self.quantity]

    @property
    def megabytes(self) -> float:
        """Size of the maps."""
        return (self.modes.nbytes + self.inertia.nbytes + self.loads.nbytes + self.spin.nbytes) / 1e6

    def truncated(self, modes: IntArray) -> RecoveryMaps:
        """The maps of some of the modes, in the given order."""
        return replace(self, modes=self.modes[:, :, modes], inertia=self.inertia[:, :, modes])


def spin_products(omega: Array) -> Array:
    """(..., 6) ω_x², ω_y², ω_z², ω_x ω_y, ω_y ω_z, ω_z ω_x of angular velocities (..., 3)."""
    return np.stack([omega[..., a] * omega[..., b] for a, b in SPIN_PAIRS], axis=-1)


def von_mises(stress: Array) -> Array:
    """(...) von Mises stress of components (..., 6) xx, yy, zz, xy, yz, zx.

    Examples
    --------
    >>> float(von_mises(np.array([3.0, 0.0, 0.0, 0.0, 0.0, 0.0])))
    3.0
    """
    x, y, z, xy, yz, zx = np.moveaxis(np.asarray(stress), -1, 0)
    return np.asarray(np.sqrt(((x - y) ** 2 + (y - z) ** 2 + (z - x) ** 2) / 2 + 3 * (xy**2 + yz**2 + zx**2)))
