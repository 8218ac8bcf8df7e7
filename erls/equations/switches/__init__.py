"""Equations with modes that are constant until they are set anew: joints that stick or slide, motors at their limit."""
