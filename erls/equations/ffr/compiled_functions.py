"""The functions of a compiled chain, with the signatures of `erls.equations.compiled_system`; accelerations apart."""

from erls.equations.ffr.balance import residual
from erls.equations.ffr.composite import mass_matrix
from erls.equations.ffr.joints import stiffness_and_damping

__all__ = ["mass_matrix", "residual", "stiffness_and_damping"]
