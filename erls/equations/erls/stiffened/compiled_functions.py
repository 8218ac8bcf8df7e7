"""The functions of a compiled chain with second-order displacements (`erls.equations.compiled_system`), but
accelerations.
"""

from erls.equations.erls.stiffened.balance import residual
from erls.equations.erls.stiffened.inertia import mass_matrix
from erls.equations.serial.gains import stiffness_and_damping

__all__ = ["mass_matrix", "residual", "stiffness_and_damping"]
