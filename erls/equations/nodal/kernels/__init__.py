"""Compiled nodal systems: beams, bodies, joints and drives on SE(3) or R³×SO(3), their band matrices, and the steps.

Vectors are three numbers, rotations nine (rows first), twists and wrenches pairs of vectors [v; ω], [n; m], so that no
memory is needed for them. Formulas are those of `erls.equations.nodal` and `erls.maths`, which these functions are
tested against.
"""
