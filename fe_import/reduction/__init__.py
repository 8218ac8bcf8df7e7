"""Reduction methods, one file each; the registry."""

from fe_import.reduction.base import Basis, ReductionMethod
from fe_import.reduction.craig_bampton import craig_bampton
from fe_import.reduction.none import no_reduction

REDUCTIONS: dict[str, ReductionMethod] = {
    "craig-bampton": craig_bampton,
    "none": no_reduction,
}

__all__ = ["REDUCTIONS", "Basis", "ReductionMethod"]
