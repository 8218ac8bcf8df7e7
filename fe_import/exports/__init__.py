"""Readers of matrices that a finite-element program exported, one file each; the registry."""

from fe_import.exports.base import Export, ExportFormat

EXPORTS: dict[str, ExportFormat] = {}

__all__ = ["EXPORTS", "Export", "ExportFormat"]
