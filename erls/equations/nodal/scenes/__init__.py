"""Scenes of bodies as nodes, elements and joints."""
