"""Memory of a link in elimination link by link (`erls.equations.serial.elimination`)."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from erls.equations.serial.segments import Segment
from erls.maths.records import reader, room, table_size
from erls.maths.so3 import Array


class Condensed(NamedTuple):
    """A link in elimination: p numbers of motion, e elastic coordinates, n numbers of motion of the links on it, the s
    ports among them first.

    Attributes
    ----------
    parent, ports : int
        Of the segment.
    first, rest : int
        Where its motion stands among those on its parent: number i at first + i if it is a port, otherwise rest + i.
    compliance : (e,) array
        Inverse of the diagonal 1 + α C_d + β K_d.
    whole, diagonal : (e, e), (e,) arrays
        Factors of W where it is no diagonal; otherwise (0, 0).
    rows, rows_solved : (s, e) arrays
        N and N W⁻¹ of the ports.
    coupling_solved : (p, e) array
        B W⁻¹.
    bound : (n, n) array
        H̃ of the links on it.
    yielding, softened : (s, s), (s, n) arrays
        G, and G H̃.
    square, solver : (s, s) arrays
        Spare, and (1 + G H̃)⁻¹ of the ports.
    lead, follow, borne : (p, n) arrays
        A, Φ and H̃ Φ, transposed.
    remaining : (p, s) array
        Spare.
    articulated : (p, p) array
        Inertia on g; at last without its joint, H̃.
    subspace, push : (p,) arrays
        S of the segment, and articulated inertia times S.
    along : (2,) array
        Inertia along the joint, and what stiffness and damping add to it.
    forces : (e,) array
        Forces on decoupled coordinates, then these themselves.
    handed, moved, given : (n,) arrays
        h; m; spare.
    load, motion : (p,) arrays
        Force of the link on its parent at m = 0; g.
    """

    parent: int
    ports: int
    first: int
    rest: int
    compliance: Annotated[Array, "e"]
    whole: Annotated[Array, "f f"]
    diagonal: Annotated[Array, "f"]
    rows: Annotated[Array, "s e"]
    rows_solved: Annotated[Array, "s e"]
    coupling_solved: Annotated[Array, "p e"]
    bound: Annotated[Array, "n n"]
    yielding: Annotated[Array, "s s"]
    softened: Annotated[Array, "s n"]
    square: Annotated[Array, "s s"]
    solver: Annotated[Array, "s s"]
    lead: Annotated[Array, "p n"]
    follow: Annotated[Array, "p n"]
    borne: Annotated[Array, "p n"]
    remaining: Annotated[Array, "p s"]
    articulated: Annotated[Array, "p p"]
    subspace: Annotated[Array, "p"]
    push: Annotated[Array, "p"]
    along: Annotated[Array, "2"]
    forces: Annotated[Array, "e"]
    handed: Annotated[Array, "n"]
    moved: Annotated[Array, "n"]
    given: Annotated[Array, "n"]
    load: Annotated[Array, "p"]
    motion: Annotated[Array, "p"]


def condensed(own: list[Segment]) -> list[Condensed]:
    """Memory for all links."""
    ports, others = [0] * len(own), [0] * len(own)  # numbers of motion of the links on each
    places: list[tuple[int, int]] = []
    for link in own:
        places.append((ports[link.parent], others[link.parent]) if link.parent >= 0 else (0, 0))
        if link.parent >= 0:
            ports[link.parent] += link.ports
            others[link.parent] += len(link.pull) - link.ports
    return [
        _condensed(link, s, rest, first, ports[link.parent] + place - link.ports)
        for link, s, rest, (first, place) in zip(own, ports, others, places, strict=True)
    ]


def _condensed(own: Segment, ports: int, others: int, first: int, rest: int) -> Condensed:
    p, e = own.coupling.shape
    return room(
        Condensed,
        parent=own.parent,
        ports=own.ports,
        first=first,
        rest=rest,
        e=e,
        f=e if len(own.change) else 0,
        s=ports,
        n=ports + others,
        p=p,
    )


read_condensed = reader(Condensed)
CONDENSED = table_size(Condensed)
