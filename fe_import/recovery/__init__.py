"""Stresses and section forces from modal coordinates."""
