"""Closed loops over the equations of any tree of links, which are known by their compiled functions alone.

The conditions hold between frames on displaced nodes. The tree says how these move, and by the rows of their twists
what forces on them do to the coordinates (`erls.equations.compiled_system`). A row of the conditions is a force on the
relative twist of a joint's two frames (`closure`); drives, springs and rotors act along the coordinate that a joint
leaves free (`actuated`).

With M = UᵀU, Z = U⁻ᵀ Φ_yᵀ and z = U⁻ᵀ f the forces of the loops solve

    ZᵀZ λ = Zᵀ z + Φ̈(ÿ = 0) + 2 δ Φ̇ + δ² Φ,

so that a residual takes substitutions one way only. Between steps of generalized-α Φ = 0 holds to its tolerance
(`steps`); other integrators get accelerations that let violations decay (`system`).

`records` says what is kept, `compiled` puts it behind what belongs to the tree, in the same arrays.
"""
