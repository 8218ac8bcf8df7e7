"""Optimization of mechanisms: links that are as light as the motion allows."""
