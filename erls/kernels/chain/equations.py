"""The functions of a compiled chain, with the signatures of `erls.kernels.contract`."""

from erls.kernels.chain.balance import residual
from erls.kernels.chain.composite import mass_matrix
from erls.kernels.chain.elimination import acceleration
from erls.kernels.chain.gains import stiffness_and_damping

__all__ = ["acceleration", "mass_matrix", "residual", "stiffness_and_damping"]
