"""Forces of chains in floating frames, in eightfold numbers."""

from __future__ import annotations

from erls.equations.ffr.residual import residual
from erls.equations.lane_kernels import lane_kernel

forces = lane_kernel(__name__, residual)
