"""Links made of beams as finite elements with one frame per node on SE(3): large deflections, geometric stiffening."""

from __future__ import annotations

from erls.formulations.nodal.equations import Nodal
from erls.formulations.nodal.run import nodal_generalized_alpha

__all__ = ["Nodal", "nodal_generalized_alpha"]
