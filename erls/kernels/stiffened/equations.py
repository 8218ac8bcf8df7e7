"""The functions of a compiled chain with second-order displacements (`erls.kernels.contract`), but accelerations."""

from erls.kernels.chain.gains import stiffness_and_damping
from erls.kernels.stiffened.balance import residual
from erls.kernels.stiffened.inertia import mass_matrix

__all__ = ["mass_matrix", "residual", "stiffness_and_damping"]
