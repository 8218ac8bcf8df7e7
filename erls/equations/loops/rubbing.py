"""Friction along the coordinate of a joint by the law of points (`erls.maths.contact_law`): of one that always presses,
and whose numbers hold a force in place of a coefficient.
"""

from __future__ import annotations

from typing import Any

from erls.maths.contact_law import friction_force, friction_gains
from erls.maths.jit import part
from erls.maths.so3 import Array


@part
def grip_force(law: Array, place: Any, rate: Any) -> Any:
    """At a coordinate and its rate."""
    none = 0.0 * rate
    return friction_force(law, 1.0, rate, none, place, none)[0]


@part
def grip_gains(law: Array, rate: Any) -> tuple[Any, Any]:
    """-∂/∂coordinate and -∂/∂rate."""
    damping, _, stiffness = friction_gains(law, 1.0, rate, 0.0 * rate)
    return stiffness, damping
