"""One link made of shells as nodes, shell elements and rigid bodies, in its mesh frame.

What a joint's interface holds rigidly is no condition: corners of shells there are fixed to the interface's node, and
shells all of whose corners are so are mass alone.
"""

from __future__ import annotations

import numpy as np

from erls.equations.nodal.parts import LinkParts, carried, refused
from erls.equations.nodal.rigid_body import RigidBody, joined
from erls.equations.nodal.shell import Shell, lumped_shells
from erls.equations.nodal.surfaces import FOLD_DEG, corner_frames, quartered
from erls.maths.se3 import pose
from erls.maths.so3 import Array
from erls.mechanism.links import Link
from fe_import.elements.link_shells import LinkShells
from fe_import.model import IntArray


def shell_link_parts(link: Link, shells: LinkShells, times: int) -> LinkParts:
    """Parts of a link; ``times``, a power of two, as many elements along each side.

    Raises
    ------
    SceneError
        An averaged interface, attachments other than masses, or a mass where no shell is; the link is named.
    """
    where = f"link {link.name!r}"
    model = link.model
    if shells.others:
        remedy = "leave them out (ignore in [shell]), or use another formulation"
        what = "springs, beams and constraints that a mesh file attaches"
        raise refused(what, where, ", ".join(shells.others), remedy)
    averaged = [i.name for i in model.interface_nodes if i.coupling == "averaged"]
    if averaged:
        remedy = "couple them rigidly, or use another formulation"
        raise refused("interfaces that move as shells do on average", where, ", ".join(averaged), remedy)
    places, cells, make = model.nodes, shells.cells, shells.make
    rims = [(i.node, i.coupled_nodes) for i in model.interface_nodes if i.coupling == "rigid"]
    frames = _frames(shells, places, cells, make, where)
    while times > 1:
        finer = quartered(places, cells, frames)
        places, cells, make = finer.places, finer.cells, make[finer.parents]
        rims = [(node, finer.grown(rim)) for node, rim in rims]
        frames = _frames(shells, places, cells, make, where)
        times //= 2
    carriers = np.arange(len(places))
    for node, rim in rims:
        carriers[rim] = node
    used = np.unique(carriers[np.concatenate([cells.ravel(), [i.node for i in model.interface_nodes]])])
    numbers = np.full(len(places), -1, dtype=np.int64)
    numbers[used] = np.arange(len(used))
    own = numbers[carriers]
    every = [
        Shell(
            tuple(own[cell].tolist()),
            frame,
            shells.stiffness[k],
            shells.moments[k],
            shells.drilling,
            shells.surfaces[k] if len(shells.surfaces) else None,
        )
        for cell, frame, k in zip(cells, frames, make.tolist(), strict=True)
    ]
    poses = np.array([pose(position=x) for x in places[used]])
    bodies = lumped_shells(every, poses) + _masses(shells, own, places, places[used], where)
    for payload in link.payloads:
        carrier = carried(own, payload.node, where)
        arm = model.nodes[payload.node] - places[used][carrier]
        bodies.append(RigidBody(carrier, payload.mass, payload.inertia, arm + payload.offset))
    bending = np.array([len(set(shell.nodes)) > 1 for shell in every])
    return LinkParts(
        nodes=places[used],
        shells=[shell for shell, bends in zip(every, bending, strict=True) if bends],
        corners=cells[bending],
        bodies=joined(bodies),
        carriers=own[: len(model.nodes)],
    )


def _frames(shells: LinkShells, places: Array, cells: IntArray, make: IntArray, where: str) -> Array:
    """At the corners; normals are those of the whole surface, first axes those of each make."""
    return corner_frames(places, cells, FOLD_DEG, where, shells.directions[make])


def _masses(shells: LinkShells, own: IntArray, places: Array, nodes: Array, where: str) -> list[RigidBody]:
    """Point masses."""
    found = []
    for row, node in zip(shells.masses, shells.mass_nodes.tolist(), strict=True):
        carrier = carried(own, node, where)
        inertia = row[4:].reshape(3, 3)
        found.append(RigidBody(carrier, float(row[0]), inertia, places[node] - nodes[carrier] + row[1:4]))
    return found
