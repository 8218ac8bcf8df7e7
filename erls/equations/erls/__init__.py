"""ERLS in the joint-angle gauge: flexible links on joints, one link at a time.

The mode shapes of each link are combined once and for all into six rigid ones, ρ, and elastic ones that leave its
inboard interface where it is, Ψ = [D; 1] with D = -A_r⁻¹ A_e. Then q = ρ u + Ψ q_d, where u is the displacement of the
link's frame. All is computed outward for the motion (`frames`, `second_order`) and inward for the forces (`balance`,
with `link_forces` for each link). As the velocities s = q̇ + ρ ν = ρ (ν + u̇) + Ψ q̇_d tell, inertia knows of ν and u̇
only w = ν + u̇ and ω: what `segments` says of links for mass matrices and for solving link by link. Constants and
working memory are `records`, filled by `pack`; `formulation` is what runs ask. `paper` holds the dense form.
"""
