"""Finite elements: spatial frames with their sections, solids."""
