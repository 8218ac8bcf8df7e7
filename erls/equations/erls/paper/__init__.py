"""ERLS-CMS in the notation of the paper, dense: compatibility C q = 0, pseudo-inverse, D, G, link inertia.

`dense_chain` is the formulation, made by `pack` from `records`. Its functions: `elimination` (C, C_r⁺, D, G, n) with
`second_order_rows`, `motion` (Jacobians, V N, physical joint angles), `forces` and `bent` (one link), `functions` and
`acceleration` (the sums over links). They serve the minimum-norm gauge, and judge the recursion in the other one.
"""
