"""What a formulation says of its links at a configuration, and the mass matrix from it: composite rigid bodies.

The motion of a link is told by a few numbers μ (p,): twists and what else inertia and joints feel. From its parent's
motion and the rates of the parent's elastic coordinates q̇, and from its joint's rate θ̇, follows

    μ = L μ_parent + N q̇_parent + S θ̇,

and its kinetic energy is ½ μᵀ I μ + μᵀ B q̇ + ½ q̇ᵀ (M_ee + ½ (EᵀF + FᵀE)) q̇. That is all that is needed for the mass
matrix (R. Featherstone, Rigid Body Dynamics Algorithms, ch. 6, with elastic coordinates) and for solving with it link
by link (`erls.equations.serial.elimination`); no equation of motion stands here. p may differ from link to link.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

from erls.equations.serial.records import JOINT, MODES, Serial, read_joint, read_modes
from erls.maths.jit import part
from erls.maths.products import add_product, add_transposed_product, copy_matrix, dot
from erls.maths.records import reader, room, table_size
from erls.maths.so3 import Array
from fe_import.model import IntArray


class Segment(NamedTuple):
    """A link in this form; rows and columns over elastic coordinates are those of the link, or decoupled ones.

    Attributes
    ----------
    parent : int
        Number of the link it stands on, -1 for the ground.
    inertia : (p, p) array
        I.
    coupling : (p, e) array
        B.
    lead : (p, p of the parent) array
        L.
    reach : (p, e of the parent) array
        N, of which only the first ``ports`` rows are not zero.
    ports : int
    subspace : (p,) array
        S.
    change, partner : (r, e) arrays
        E and F; r = 0 where the inertia of the modes is constant.
    composite : (p, p) array
        Working memory: I with all that the link bears.
    bearing : (p, e) array
        Working memory: B with all that the link bears.
    pull : (p,) array
        Working memory.
    """

    parent: int
    ports: int
    inertia: Annotated[Array, "p p"]
    coupling: Annotated[Array, "p e"]
    lead: Annotated[Array, "p p_before"]
    reach: Annotated[Array, "p e_before"]
    subspace: Annotated[Array, "p"]
    change: Annotated[Array, "r e"]
    partner: Annotated[Array, "r e"]
    composite: Annotated[Array, "p p"]
    bearing: Annotated[Array, "p e"]
    pull: Annotated[Array, "p"]
    spare: Annotated[Array, "p p_before"]
    spare_reach: Annotated[Array, "p e_before"]


def segment(parent: int, size: int, modes: int, size_before: int, modes_before: int, ports: int, extra: int) -> Segment:
    """Memory for a link with p = ``size`` and e = ``modes``; both of its parent, ``ports``, and r = ``extra``."""
    return room(
        Segment, parent=parent, ports=ports, p=size, e=modes, p_before=size_before, e_before=modes_before, r=extra
    )


read_segment = reader(Segment)
SEGMENT = table_size(Segment)


@part
def fill_mass_matrix(
    serial: Serial, segments: int, reals: Array, integers: IntArray, scratch: Array, out: Array
) -> None:
    """M from segments in coordinates of the links, whose first one has its table at ``segments``."""
    out[:, :] = 0.0
    for k in range(serial.links):
        own = read_segment(scratch, integers, segments + k * SEGMENT)
        copy_matrix(own.inertia, own.composite)
        copy_matrix(own.coupling, own.bearing)
    for k in range(serial.links - 1, -1, -1):
        own = read_segment(scratch, integers, segments + k * SEGMENT)
        modes = read_modes(reals, integers, serial.modes + k * MODES)
        joint = read_joint(reals, integers, serial.joints + k * JOINT)
        first, e = modes.first, len(modes.stiffness)
        for i in range(e):
            row, constant = out[first + i, first : first + e], modes.mass[i]
            for j in range(i + 1):
                row[j] += constant[j]
            for r in range(own.change.shape[0]):
                left, right = own.change[r, i] / 2, own.partner[r, i] / 2
                for j in range(i + 1):
                    row[j] += left * own.partner[r, j] + right * own.change[r, j]
            for j in range(i):
                out[first + j, first + i] = row[j]
            for m in range(len(own.pull)):
                own.pull[m] = own.bearing[m, i]
            _fill_rows(serial, segments, reals, integers, scratch, k, first + i, out)
        if joint.place >= 0:
            for m in range(len(own.pull)):
                own.pull[m] = dot(own.composite[m], own.subspace)
            _fill_rows(serial, segments, reals, integers, scratch, k, joint.place, out)
            out[joint.place, joint.place] += joint.rotor
        if own.parent >= 0:
            _bear(serial, segments, reals, integers, scratch, k, out)


@part
def _bear(
    serial: Serial, segments: int, reals: Array, integers: IntArray, scratch: Array, k: int, out: Array
) -> None:
    """Add what a link is with all that it bears to its parent."""
    own = read_segment(scratch, integers, segments + k * SEGMENT)
    before = read_segment(scratch, integers, segments + own.parent * SEGMENT)
    first = read_modes(reals, integers, serial.modes + own.parent * MODES).first
    own.spare[:, :] = 0.0
    own.spare_reach[:, :] = 0.0
    add_product(own.composite, own.lead, own.spare)
    add_product(own.composite[:, : own.ports], own.reach[: own.ports], own.spare_reach)
    add_transposed_product(own.lead, own.spare, before.composite)
    add_transposed_product(own.lead, own.spare_reach, before.bearing)
    for m in range(own.ports):
        reach, borne = own.reach[m], own.spare_reach[m]
        for i in range(len(reach)):
            row = out[first + i, first : first + i + 1]
            for j in range(i + 1):
                row[j] += reach[i] * borne[j]


@part
def _fill_rows(
    serial: Serial, segments: int, reals: Array, integers: IntArray, scratch: Array, k: int, place: int, out: Array
) -> None:
    """Row and column of a coordinate of link k whose unit acceleration pulls at its motion with ``pull``.

    Its joint and all that stands before the link feel it.
    """
    while True:
        own = read_segment(scratch, integers, segments + k * SEGMENT)
        joint = read_joint(reals, integers, serial.joints + k * JOINT).place
        if joint >= 0:
            out[joint, place] = out[place, joint] = dot(own.subspace, own.pull)
        if own.parent < 0:
            return
        before = read_segment(scratch, integers, segments + own.parent * SEGMENT)
        modes = read_modes(reals, integers, serial.modes + own.parent * MODES)
        row = out[place, modes.first : modes.first + len(modes.stiffness)]
        for m in range(own.ports):
            weight, reach = own.pull[m], own.reach[m]
            for j in range(len(row)):
                row[j] += weight * reach[j]
        for j in range(len(row)):
            out[modes.first + j, place] = row[j]
        for m in range(len(before.pull)):
            total = 0.0
            for i in range(len(own.pull)):
                total += own.lead[i, m] * own.pull[i]
            before.pull[m] = total
        k = own.parent
