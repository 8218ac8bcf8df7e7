"""Second-order kinematics of a link: what its points move by beyond the linear modes, ½ qᵀ Ψ q.

A link deforms as u(x) = Φ(x) q + ½ qᵀ Ψ(x) q. The field Ψ is such that strains stay what the linear modes give, to
second order: of beams, stretch, shear and curvature in the axes of the turned cross section; of solids, the strains of
Green and Lagrange, as near as the displacements allow; of matrices, those of their line of cross sections. Elastic
energy stays ½ qᵀ Ω² q. The virtual work of every load through δ(½ qᵀ Ψ q) is geometric stiffening (centrifugal, weight,
acceleration, joint forces); the displacement itself is foreshortening.

Displacement and rotation (its vector, of exp) of one interface, the reference, are linear in q: Ψ vanishes there.
"""
