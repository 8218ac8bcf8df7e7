"""The floating frame of reference formulation: links as bodies with absolute frames and elastic modes.

It shares modal files, Denavit-Hartenberg kinematics and drives with ERLS-CMS, and no equation of motion, so that each
checks the other. Every link has a floating frame with its own position and rotation matrix; elastic modes are re-based
to that frame, the rigid-body ones removed; inertia comes from standard input data (O. Wallrapp, Mech. Struct. & Mach.
22 (1994) 283-304) up to second order.
"""

from erls.formulations.ffr.equations import Ffr

__all__ = ["Ffr"]
