"""Forces and tangents of chains of linear links, in eightfold numbers."""

from __future__ import annotations

from erls.equations.erls.residual import residual
from erls.equations.lane_kernels import lane_kernels

forces, tangents = lane_kernels(__name__, residual)
