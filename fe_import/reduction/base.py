"""The contract of a reduction.

Rules for adding a method:

1. One file with a function ``(model, options, where) -> Basis`` and one line in the registry of
   ``fe_import/reduction/__init__.py``.
2. ``Basis.vectors`` spans the six rigid-body motions exactly; ``Basis.rigid`` holds their coordinates.
3. Couplings are honoured: work with ``model.reduced_matrices()``, expand with `expanded`.
4. Options that mean nothing to the method are refused (`refuse_fields`), not ignored.
5. With ``options.static_correction`` the vectors span the static response to unit interface loads and to the inertia
   of rigid-body accelerations, or the option is refused.
6. Temperature is not the method's business: `fe_import.reduction.thermal` adds the expanded shape to any basis.
7. Nothing is orthonormalized or truncated here: that is common to all methods (`fe_import.reduction.modes`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fe_import.description.reduction import Reduction
from fe_import.errors import Cause, FEImportError
from fe_import.modal.model import FixedInterfaceModes
from fe_import.model import Array, FEModel, IntArray

HeldSolution = Callable[[Array, int], Array]
"""Static displacements (f, k) for loads (f, k) on the independent dofs, an interface of this number held at rest."""


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
    selection : dict
        How the modes were chosen, when not simply the lowest: plain numbers and texts.
    flexibility : (6 n_interfaces, 6 n_interfaces) array or None
        Static flexibility of the full model between its interfaces, inertia-relieved, from a method whose basis
        lacks it.
    thermal : (k,) array or None
        Generalized force of thermal expansion per kelvin.
    held : HeldSolution or None
        By the factors that the basis was made with; they stay in memory as long as it.
    """

    vectors: Array
    interface_columns: int
    rigid: Array
    fixed_interface: FixedInterfaceModes
    selection: dict[str, Any] = field(default_factory=dict)
    flexibility: Array | None = None
    thermal: Array | None = None
    held: HeldSolution | None = None


ReductionMethod = Callable[[FEModel, Reduction, str], Basis]


def no_fixed_interface_modes() -> FixedInterfaceModes:
    """An empty table."""
    return FixedInterfaceModes(np.zeros(0), np.zeros((0, 6)))


def expanded(model: FEModel, fields: Array) -> Array:
    """(d, k) all nodal components of fields (f, k) over the independent dofs."""
    return fields if model.coupling is None else np.asarray(model.coupling @ fields)


def gathered(model: FEModel, loads: Array) -> Array:
    """(f, k) loads on the independent dofs that do the same work as loads (d, k) on all nodal components."""
    return loads if model.coupling is None else np.asarray(model.coupling.T @ loads)


def interface_places(model: FEModel) -> IntArray:
    """(6 n_interfaces,) positions of the interface dofs among the independent dofs."""
    place = np.full(model.mass.shape[0], -1)
    place[model.independent] = np.arange(len(model.independent))
    return place[model.interface_dofs]


def refuse_fields(
    options: Reduction, where: str, refused: Mapping[str, str], selections: Mapping[str, str] | None = None
) -> None:
    """Refuse options that mean nothing to a method.

    Parameters
    ----------
    options : Reduction
    where : str
        File, for messages.
    refused : mapping
        Field to the reason why it means nothing and the remedy, as ``"reason; remedy"``.
    selections : mapping, optional
        Likewise for values of ``selection``.

    Raises
    ------
    FEImportError
        BAD_FIELD.
    """
    reasons = {**refused, "selection": (selections or {}).get(options.selection, "")}
    defaults = Reduction()
    for name, reason in reasons.items():
        value = getattr(options, name)
        if reason and value and value != getattr(defaults, name):
            message, _, remedy = reason.partition("; ")
            place = f"{where}: reduction.{name}"
            raise FEImportError(Cause.BAD_FIELD, message, where=place, value=value, remedy=remedy)
