"""What stands where among the numbers of a contact, and its modes, for those who need no compiler; see
`erls.maths.contact_law`.
"""

STIFFNESS, EXPONENT, LOSS, TRANSITION = range(4)
"""Places of k, n, d and w among the numbers of a law."""

COEFFICIENT, RATE, MODE, AHEAD, ANCHOR, GIVE, SETTLING = 0, 1, 2, 3, 5, 7, 8
"""Places of µ, r, the mode, e (2), the place (2) of a point that sticks, d and τ among the (9,) numbers of friction."""

SMOOTH, SLIDES, STICKS = 0.0, 1.0, 2.0
"""Modes of friction."""
