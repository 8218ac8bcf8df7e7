"""The functions of a compiled chain with second-order displacements, with the signatures of `erls.kernels.contract`."""

from erls.kernels.chain.gains import stiffness_and_damping
from erls.kernels.stiffened.balance import residual
from erls.kernels.stiffened.elimination import acceleration
from erls.kernels.stiffened.inertia import mass_matrix

__all__ = ["acceleration", "mass_matrix", "residual", "stiffness_and_damping"]
