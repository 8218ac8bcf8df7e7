"""ERLS in the joint-angle gauge with second-order displacements (`erls.equations.erls.paper.second_order_inertia`,
`erls.equations.erls.paper.second_order_compatibility`) as kernels.

Modes, linear displacement u of the link frames and all that is rigid are those of `erls.equations.erls`, whose
constants and memory come first. With x = (u, q_d) the frame of a link is displaced by u + e,

    e_k = T_k (e_{k-1} + ½ xᵀ P x) + ½ φ × (φ × d),   d = θ s - d₀,

where P is what the outboard interface moves to second order, seen as a motion of the link's frame, φ the turn in u, d₀
the arm from the inboard interface to its joint and s the axis of a slide. Forces on virtual u and those on virtual e go
inward apart. Inertia acts at (u + e, q_d) with the twist ν + M₀⁻¹ (C q̇ + H ν) in place of ν.

Of rigid-body displacements only turns are of second order; on the ground u = e = 0. The tensors hold the m coordinates
that are left: those of q from n - m on.

`layout` says where everything lies, `erls.equations.erls.stiffened.compiled` puts it there.
"""
