"""Drives and motions tried out: forward runs of what was found, corrections by them, motions planned with them."""
