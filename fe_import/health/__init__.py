"""Checks of models and reductions, and the report of them."""
