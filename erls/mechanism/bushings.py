"""Bushings: elastic connections of two frames, with a spring and a damper for all six ways that they move apart.

With the pose (Q, p) of the outer frame in the inner one and the rotation vector ψ of Q, d = [p; ψ] is what the bushing
is deformed by, ½ dᵀ K d its elastic energy, and -(K d + C ḋ) the force along d.
"""

from __future__ import annotations

from dataclasses import dataclass

from erls.maths.so3 import Array
from erls.mechanism.joint_types import JointType

BUSHING = JointType("bushing", None, (), axes=0)
"""Among what closes a chain: frames that no condition ties."""


@dataclass(frozen=True)
class Bushing:
    """A spring and a damper.

    Attributes
    ----------
    stiffness, damping : (6, 6) arrays
        K and C, symmetric: forces along, then moments about the axes of the inner frame.
    """

    stiffness: Array
    damping: Array
