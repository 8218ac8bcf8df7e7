"""Inversions on nodal elements: poses of all nodes at all knots, with multipliers and efforts, at once."""
