"""Derivatives of what runs give, by parameters of their scenes."""
