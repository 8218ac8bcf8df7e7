"""The functions of a compiled chain, with the signatures of `erls.kernels.contract`."""

from erls.kernels.ffr.balance import residual
from erls.kernels.ffr.composite import mass_matrix
from erls.kernels.ffr.joints import stiffness_and_damping
from erls.kernels.ffr.solve import acceleration

__all__ = ["acceleration", "mass_matrix", "residual", "stiffness_and_damping"]
