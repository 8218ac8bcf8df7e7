"""Forces and tangents of chains in floating frames, in eightfold numbers."""

from __future__ import annotations

from erls.equations.ffr.residual import residual
from erls.equations.lane_kernels import lane_kernels

forces, tangents = lane_kernels(__name__, residual)
