"""Compiled loops of the integrators."""
