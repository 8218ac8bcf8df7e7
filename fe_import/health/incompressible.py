"""Materials that hardly change in volume, on elements that cannot follow.

First clamped frequency of a bar of 4 x 1 x 1 against a fine mesh, Poisson's ratio 0.3, 0.49 and 0.4999: compatible
hexahedra of 8 nodes 2, 18, 133 percent too high, tetrahedra of 4 nodes 9, 55, 203; all elements with middle nodes and
those with incompatible modes 1, 4 and 4 to 6.
"""

from __future__ import annotations

import numpy as np

from fe_import.elements.solid_stress import SolidStress
from fe_import.modal.model import HealthCheck

_LINEAR = 0.47  # Poisson's ratio up to which compatible linear elements follow
_OTHERS = 0.4995


def check_incompressible(source: SolidStress) -> tuple[HealthCheck, ...]:
    """The largest Poisson's ratio, per that which its elements take."""
    ratio = source.lame[:, 0] / (2 * (source.lame[:, 0] + source.lame[:, 1]))
    worst, told = 0.0, ""
    for block, _, numbers in source.mesh.parts():
        linear = not block.element.midpoints and not block.element.incompatible
        largest = float(np.max(ratio[numbers]))
        share = largest / (_LINEAR if linear else _OTHERS)
        if share > max(worst, 1.0):
            remedy = "set raise_order = true in [solid]" if linear else "refine the mesh"
            told = f"; {block.type} with {largest:.6g} are too stiff, as they keep their volume: {remedy}, or lower it"
        worst = max(worst, share)
    return (HealthCheck(f"material: Poisson's ratio, per the largest that its elements take{told}", worst, 1.0),)
