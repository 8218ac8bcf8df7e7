"""ERLS in the joint-angle gauge as kernels: a serial chain of flexible links, one link at a time.

The mode shapes of each link are combined once and for all into six rigid ones, ρ, and elastic ones that leave its
inboard interface where it is, Ψ = [D; 1] with D = -A_r⁻¹ A_e (`erls.equations.erls.paper.compatibility`). Then q = ρ
u + Ψ q_d,
where u is the displacement of the link's frame, a small motion [translation; rotation]. Rigid motions pass through
joints as twists do, so compatibility reads

    u_k = T_k(θ_k) (u_{k-1} + C_{k-1} q_d,k-1),   ν_k = T_k(θ_k) ν_{k-1} + S_k θ̇_k,

with T the change of frame and C constant: what the outboard interface moves, seen as a motion of the link's frame. All
is computed outward for the motion and inward for the forces. As the velocities s = q̇ + ρ ν = ρ (ν + u̇) + Ψ q̇_d tell,
inertia knows of ν and u̇ only w = ν + u̇ and ω: nine numbers per link, which accelerations are solved for by eliminating
link after link from the tip inward (Featherstone, Rigid Body Dynamics Algorithms, ch. 7, with the elastic coordinates
of a link eliminated before its joint).

`layout` says where everything lies, `erls.equations.erls.compiled` puts it there.
"""
