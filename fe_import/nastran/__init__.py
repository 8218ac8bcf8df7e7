"""Bulk data of Nastran: cards, grid points with their coordinate systems."""
