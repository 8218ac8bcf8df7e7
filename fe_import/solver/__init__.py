"""Sparse solvers: the registry, and which one is used.

The multifrontal one is used unless the environment variable ``ERLS_SOLVER`` names another. It has the speed of
Pardiso, needs no package and less memory than any of the others (`benchmarks/factorization.py`).
"""

from __future__ import annotations

import importlib.util
import os

from fe_import.errors import Cause, FEImportError
from fe_import.solver import cholmod, multifrontal, superlu
from fe_import.solver.base import Factor, SingularMatrix, Solver
from fe_import.solver.elimination import Elimination, analyse

SOLVERS: dict[str, Solver] = {
    solver.name: solver
    for solver in (
        Solver("multifrontal", multifrontal.factorize, multifrontal.bytes_needed),
        Solver("superlu", superlu.factorize, superlu.bytes_needed),
        Solver("cholmod", cholmod.factorize, cholmod.bytes_needed, package="scikit-sparse"),
    )
}
_VARIABLE = "ERLS_SOLVER"


def chosen_solver() -> Solver:
    """The solver that is used.

    Raises
    ------
    FEImportError
        BAD_FIELD: the environment names one that does not exist or is not installed.
    """
    name = os.environ.get(_VARIABLE) or "multifrontal"
    if name not in SOLVERS:
        raise FEImportError(
            Cause.BAD_FIELD,
            "unknown solver",
            where=f"environment variable {_VARIABLE}",
            value=name,
            remedy="one of " + ", ".join(SOLVERS),
        )
    solver = SOLVERS[name]
    if solver.package and importlib.util.find_spec("sksparse") is None:
        raise FEImportError(
            Cause.BAD_FIELD,
            f"this solver needs the package {solver.package}, which is not installed",
            where=f"environment variable {_VARIABLE}",
            value=name,
            remedy="pip install 'erls[cholmod]', or unset the variable",
        )
    return solver


__all__ = ["SOLVERS", "Elimination", "Factor", "SingularMatrix", "Solver", "analyse", "chosen_solver"]
