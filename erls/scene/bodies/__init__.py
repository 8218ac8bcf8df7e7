"""Scenes of bodies, beams and connections in any arrangement."""
