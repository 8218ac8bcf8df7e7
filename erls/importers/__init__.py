"""Robots described for other programs, into scenes."""
