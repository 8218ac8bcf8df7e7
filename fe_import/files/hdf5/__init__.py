"""Hostile-safe HDF5: what is opened, audited, read and written."""
