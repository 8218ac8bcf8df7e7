"""Inverse dynamics: the drives, and the internal motion that stays bounded, by which a mechanism moves as demanded."""
