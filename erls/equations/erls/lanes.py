"""Forces and tangents of chains of linear links, in eightfold numbers."""

from __future__ import annotations

from erls.equations.erls.mass_matrix import mass_matrix
from erls.equations.erls.residual import residual
from erls.equations.lane_kernels import lane_kernels

forces, tangents, masses = lane_kernels(__name__, residual, mass_matrix)
