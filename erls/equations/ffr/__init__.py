"""FFR in independent coordinates: floating frames of reference on joints, one link at a time.

From the floating frame of a link the node follows on which a joint stands, displaced, from that the frame behind the
joint, from that, displaced by the inboard node, the floating frame of the next link: three changes of frame for
velocities and accelerations outward, and their transposes for wrenches inward. So a residual takes time in proportion
to the number of links. Mass matrices and solutions link by link come from what `segments` says of each link.

`records` says what is kept of a link, `pack` puts it into memory, `motion` and `nodes` go outward, `inertia` and `bent`
hold the forces of a link, `residual` goes inward, `ends` moves the frames that loops hold. In absolute coordinates
(`constrained`, `absolute`) links float freely (`floating`), and joints close like those of loops.
"""
