"""The functions of a compiled chain, with the signatures of `erls.equations.compiled_system`; accelerations apart."""

from erls.equations.erls.balance import residual
from erls.equations.erls.composite import mass_matrix
from erls.equations.serial.gains import stiffness_and_damping

__all__ = ["mass_matrix", "residual", "stiffness_and_damping"]
