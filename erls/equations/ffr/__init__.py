"""FFR in independent coordinates as kernels: a serial chain of floating frames, one link at a time.

From the frame of a link its displaced outboard node follows, from that the joint's frame on the next link, from that,
displaced by the inboard node, the frame of the next link: three changes of frame, ν' = Ad⁻¹ν + ξ, for velocities and
accelerations outward, and their transposes for wrenches inward (`erls.equations.ffr.recursion` multiplies the three
to one). So a residual takes time in proportion to the number of links. The mass matrix comes from composite inertias
(Featherstone, Rigid Body Dynamics Algorithms, ch. 6); accelerations take its Cholesky factors. Many coordinates are
solved for by eliminating link after link instead (`factoring`).

`layout` says where everything lies, `erls.equations.ffr.compiled` puts it there. Of the kernels of ERLS it uses
vector algebra and curves over time.
"""
