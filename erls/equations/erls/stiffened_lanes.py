"""Forces and tangents of chains whose links have second-order displacements, in eightfold numbers."""

from __future__ import annotations

from erls.equations.erls.stiffened_mass_matrix import mass_matrix
from erls.equations.erls.stiffened_residual import residual
from erls.equations.lane_kernels import lane_kernels

forces, tangents, masses = lane_kernels(__name__, residual, mass_matrix)
