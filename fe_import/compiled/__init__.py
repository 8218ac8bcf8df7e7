"""Compiled functions: where their code is kept, and what they call."""
