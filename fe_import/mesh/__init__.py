"""Meshes: readers behind one door, sets, checks."""
