"""Forces and tangents of chains in floating frames, in eightfold numbers."""

from __future__ import annotations

from erls.equations.ffr.mass import mass_matrix
from erls.equations.ffr.residual import residual
from erls.equations.lane_kernels import lane_kernels

forces, tangents, masses = lane_kernels(__name__, residual, mass_matrix)
