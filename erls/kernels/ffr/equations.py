"""The functions of a compiled chain, with the signatures of `erls.kernels.contract`; accelerations apart."""

from erls.kernels.ffr.balance import residual
from erls.kernels.ffr.composite import mass_matrix
from erls.kernels.ffr.joints import stiffness_and_damping

__all__ = ["mass_matrix", "residual", "stiffness_and_damping"]
