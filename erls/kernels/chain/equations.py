"""The functions of a compiled chain, with the signatures of `erls.kernels.contract`; accelerations apart."""

from erls.kernels.chain.balance import residual
from erls.kernels.chain.composite import mass_matrix
from erls.kernels.chain.gains import stiffness_and_damping

__all__ = ["mass_matrix", "residual", "stiffness_and_damping"]
