"""Readers of matrices that a finite-element program exported, one file each; the registry."""

from fe_import.exports.abaqus import ABAQUS
from fe_import.exports.base import Export, ExportFormat
from fe_import.exports.calculix import CALCULIX
from fe_import.exports.matrix_market import MATRIX_MARKET
from fe_import.exports.nastran_dmig import NASTRAN_DMIG
from fe_import.exports.nastran_op4 import NASTRAN_OP4
from fe_import.exports.npz import NPZ

EXPORTS: dict[str, ExportFormat] = {
    "abaqus": ABAQUS,
    "calculix": CALCULIX,
    "matrix-market": MATRIX_MARKET,
    "nastran-dmig": NASTRAN_DMIG,
    "nastran-op4": NASTRAN_OP4,
    "npz": NPZ,
}

__all__ = ["EXPORTS", "Export", "ExportFormat"]
