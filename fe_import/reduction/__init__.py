"""Reduction methods, one file each; the registry."""

from fe_import.reduction.base import Basis, ReductionMethod
from fe_import.reduction.craig_bampton import craig_bampton
from fe_import.reduction.craig_chang import craig_chang
from fe_import.reduction.guyan import guyan
from fe_import.reduction.mode_displacement import mode_displacement
from fe_import.reduction.none import no_reduction

REDUCTIONS: dict[str, ReductionMethod] = {
    "craig-bampton": craig_bampton,
    "craig-chang": craig_chang,
    "guyan": guyan,
    "mode-displacement": mode_displacement,
    "none": no_reduction,
}

__all__ = ["REDUCTIONS", "Basis", "ReductionMethod"]
