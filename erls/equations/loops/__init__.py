"""Chains with closed loops as kernels: `erls.equations.loops.closed_chain` over the compiled equations of
`kernels.chain`.

The conditions hold between frames on displaced nodes. Where such a frame goes is computed outward with the links. A row
of the conditions is a force on the relative twist of a joint's two frames; what it does to the coordinates is computed
inward, as the forces of the links are: through the shape of the node, then from link to link. No matrix of rates of
frames over coordinates is formed.

With M = UᵀU, Z = U⁻ᵀ Φ_yᵀ and z = U⁻ᵀ f the forces of the loops solve

    ZᵀZ λ = Zᵀ z + Φ̈(ÿ = 0) + 2 δ Φ̇ + δ² Φ,

so that a residual takes substitutions one way only. Between steps of generalized-α Φ = 0 holds to its tolerance
(`steps`); other integrators get accelerations that let violations decay.

`layout` says where everything lies, `erls.equations.loops.compiled` puts it there: behind what belongs to the
chain, in the same arrays.
"""
