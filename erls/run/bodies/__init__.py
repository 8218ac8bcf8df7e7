"""Runs of scenes of bodies and beams: motions, equilibria, and what their files hold."""
