"""The contract of a reduction.

Rules for adding a method:

1. One file with a function ``(model, options, where) -> Basis`` and one line in the registry of
   ``fe_import/reduction/__init__.py``.
2. ``Basis.vectors`` spans the six rigid-body motions exactly; ``Basis.rigid`` holds their coordinates.
3. Nothing is orthonormalized or truncated here: that is common to all methods (`fe_import.modes`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fe_import.link import Reduction
from fe_import.modal_file import FixedInterfaceModes
from fe_import.model import Array, FEModel


@dataclass(frozen=True)
class Basis:
    """A reduction basis over all nodal components.

    Attributes
    ----------
    vectors : (d, k) array
        Displacement fields.
    interface_columns : int
        How many of the first columns are unit displacements of the interfaces; 0 if none are.
    rigid : (k, 6) array
        Coordinates of unit translations and unit rotations about the mesh origin.
    fixed_interface : FixedInterfaceModes
        Empty for methods without such modes.
    """

    vectors: Array
    interface_columns: int
    rigid: Array
    fixed_interface: FixedInterfaceModes


ReductionMethod = Callable[[FEModel, Reduction, str], Basis]


def no_fixed_interface_modes() -> FixedInterfaceModes:
    """An empty table."""
    return FixedInterfaceModes(np.zeros(0), np.zeros((0, 6)))
