"""Writers of mass and stiffness matrices for other programs, one file each; the registry."""

from fe_import.writers.abaqus import ABAQUS
from fe_import.writers.base import MatrixFormat, WrittenLink
from fe_import.writers.mat import MAT
from fe_import.writers.matrix_market import MATRIX_MARKET
from fe_import.writers.nastran_dmig import NASTRAN_DMIG
from fe_import.writers.nastran_op4 import NASTRAN_OP4

WRITERS: dict[str, MatrixFormat] = {
    "abaqus": ABAQUS,
    "mat": MAT,
    "matrix-market": MATRIX_MARKET,
    "nastran-dmig": NASTRAN_DMIG,
    "nastran-op4": NASTRAN_OP4,
}

__all__ = ["WRITERS", "MatrixFormat", "WrittenLink"]
