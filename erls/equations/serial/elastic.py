"""What the modes of a link are held by: forces and energy of elastic coordinates about where they are at rest."""

from __future__ import annotations

from typing import Any

from erls.maths.jit import part


@part
def elastic_force(stiffness: Any, q: Any, rest: Any) -> Any:
    """Of a coordinate at ``q`` towards that of the link without load, 0 unless it expands with temperature."""
    return stiffness * (q - rest)


@part
def elastic_energy(stiffness: Any, q: Any, rest: Any) -> Any:
    """Of the same; 0 for the link without load."""
    return stiffness * (q - rest) ** 2 / 2
