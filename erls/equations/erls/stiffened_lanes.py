"""Forces of chains whose links have second-order displacements, in eightfold numbers."""

from __future__ import annotations

from erls.equations.erls.stiffened_residual import residual
from erls.equations.lane_kernels import lane_kernel

forces = lane_kernel(__name__, residual)
