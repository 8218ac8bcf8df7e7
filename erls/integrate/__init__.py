"""Integrators: the contract, the walk through legs, and the methods."""
