"""Cutting a link made of beams into pieces along its load path: one link description for each.

The load path is the shortest way along the elements from the inboard node to the outboard one. It is cut at equal arc
lengths; an element with a cut inside becomes two or more. Elements beside the path go with the piece that carries
them, so does a point mass. Nodes keep their positions and names.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import dataclass

import msgspec
import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components, dijkstra

from fe_import.description.link import LinkFile
from fe_import.description.records import MOST_PIECES, Interface, LinkDescription, Member, Recovery
from fe_import.description.reduction import Reduction
from fe_import.errors import Cause, FEImportError
from fe_import.model import Array, IntArray
from fe_import.models.frame import FrameMesh, frame_mesh

_ALWAYS = 16  # pieces that a coarse mesh may have too: elements are cut where need be
_SAME = 1e-9  # of the length of the path


@dataclass(frozen=True)
class _Path:
    """Nodes of the load path in order, (k,); elements between them, (k - 1,); arc length at the nodes, (k,)."""

    nodes: IntArray
    elements: IntArray
    along: Array


@dataclass(frozen=True)
class _Bar:
    """Part of an element: its ends by name, the member that it belongs to, and its piece."""

    start: str
    end: str
    member: int
    piece: int


def split_link(link: LinkFile, count: int, inboard: str, outboard: str, where: str) -> tuple[LinkFile, ...]:
    """Descriptions of the pieces of a link, from its inboard end outward, in its own mesh frame.

    Parameters
    ----------
    link : LinkFile
        A link made of beams.
    count : int
        Number of pieces, 2 or more, at most as many as elements on the load path, or 16.
    inboard : str
        Interface where the load path begins.
    outboard : str
        Interface where it ends; unless given, the farthest node along the elements.
    where : str
        Field that asks for it, for messages.

    Returns
    -------
    tuple of LinkFile
        Interface 0 of each is its inboard one, interface 1 its outboard one (of the last piece only if ``outboard`` is
        given), named as in the link where it had them there, else ``cut/1`` ...; the other interfaces follow. Mode
        counts of the table ``reduction`` hold for every piece, as far as it has that many. Asked for recovery, a piece
        holds it everywhere.

    Raises
    ------
    FEImportError
        Not made of beams; more than 16 pieces and than elements on the load path; a ring that one cut leaves in one;
        options that name interfaces or modes of the whole.
    """
    description, frame = link.description, link.description.frame
    if frame is None:
        kind = "a solid" if description.solid is not None else "exported matrices"
        message = "only links made of beams can be split into substructures"
        remedy = "give the link as a [frame], or remove substructures and use geometric_stiffening if it is available"
        raise FEImportError(Cause.BAD_FIELD, message, where=where, value=kind, remedy=remedy)
    _check_options(description, where)
    mesh = frame_mesh(description, frame, str(link.path))
    nodes_of = {i.name: mesh.names[i.node] for i in description.interfaces if i.node in mesh.names}
    path = _load_path(mesh, nodes_of[inboard], nodes_of.get(outboard))
    elements = len(path.elements)
    most = min(max(elements, _ALWAYS), MOST_PIECES)
    if count > most:
        message = f"too many substructures for a load path of {elements} elements"
        remedy = "2 to 16 are usual; beyond these give its members as many elements as it is to have pieces"
        raise FEImportError(Cause.BAD_FIELD, message, where=where, value=count, limit=most, remedy=remedy)
    bars, placed, cuts = _cut(mesh, path, count, where)
    return tuple(_piece(link, mesh, bars, placed, cuts, k, (inboard, outboard)) for k in range(count))


def _check_options(description: LinkDescription, where: str) -> None:
    options = description.reduction
    if options.selection == "ranking":
        message = "a ranking names interfaces of the whole link, which its pieces do not have"
        remedy = "use another selection, or remove substructures"
        raise FEImportError(Cause.BAD_FIELD, message, where=where, value="ranking", remedy=remedy)
    if description.damping.ratios:
        message = "damping ratios of the modes of the whole link do not belong to the modes of its pieces"
        remedy = "use damping.ratio, or damping.rayleigh with beta, which is the same for both"
        raise FEImportError(Cause.BAD_FIELD, message, where=where, value="ratios", remedy=remedy)


def _load_path(mesh: FrameMesh, first: int, last: int | None) -> _Path:
    ends = np.array([e.nodes for e in mesh.elements])
    lengths = np.array([e.length for e in mesh.elements])
    order = np.argsort(-lengths)  # of elements side by side the shortest is the last
    number = {(int(i), int(j)): int(e) for e in order for i, j in (ends[e], ends[e][::-1])}
    pairs = np.array(list(number))
    weights = lengths[list(number.values())]
    graph = sp.csr_array((weights, pairs.T), shape=(len(mesh.nodes),) * 2)
    distance, before = dijkstra(graph, indices=first, return_predecessors=True)
    at = int(distance.argmax()) if last is None else last
    nodes = [at]
    while nodes[-1] != first:
        nodes.append(int(before[nodes[-1]]))
    nodes.reverse()
    elements = [number[pair] for pair in itertools.pairwise(nodes)]
    return _Path(np.array(nodes), np.array(elements), distance[nodes])


def _cut(
    mesh: FrameMesh, path: _Path, count: int, where: str
) -> tuple[list[_Bar], dict[str, int], dict[str, Array]]:
    """Parts of all elements, the piece of every node of the link, and the cuts by name with their positions."""
    names = {number: name for name, number in mesh.names.items()}
    member_of = {e: k for k, own in enumerate(mesh.members) for e in own}
    length = float(path.along[-1])
    cuts: dict[str, Array] = {}
    bars: list[_Bar] = []
    levels = [k * length / count for k in range(count + 1)]
    for level in levels[1:-1]:
        near = int(np.abs(path.along - level).argmin())
        if abs(path.along[near] - level) <= _SAME * length:
            cuts[names[int(path.nodes[near])]] = mesh.nodes[path.nodes[near]]
            continue
        place = int(np.searchsorted(path.along, level))
        share = (level - path.along[place - 1]) / (path.along[place] - path.along[place - 1])
        position = (1 - share) * mesh.nodes[path.nodes[place - 1]] + share * mesh.nodes[path.nodes[place]]
        cuts[_free_name(f"cut/{len(cuts) + 1}", mesh)] = position
    order = list(cuts)
    for place, element in enumerate(path.elements.tolist()):
        start, end = float(path.along[place]), float(path.along[place + 1])
        inside = [k for k, level in enumerate(levels[1:-1]) if start + _SAME * length < level < end - _SAME * length]
        chain = [names[int(path.nodes[place])], *(order[k] for k in inside), names[int(path.nodes[place + 1])]]
        stops = [start, *(levels[k + 1] for k in inside), end]
        if mesh.elements[element].nodes[0] != path.nodes[place]:  # keep the direction of the element's local axes
            chain.reverse()
            stops.reverse()
        for k in range(len(chain) - 1):
            piece = min(int((stops[k] + stops[k + 1]) / 2 / length * count), count - 1)
            bars.append(_Bar(chain[k], chain[k + 1], member_of[element], piece))
    placed: dict[str, int] = {}
    for number, s in zip(path.nodes.tolist(), path.along.tolist(), strict=True):
        placed[names[number]] = _pieces_at(s, length, count)[0]
    for elements, piece in _branches(mesh, path, length, count, where):
        for e in elements:
            start_name, end_name = (names[n] for n in mesh.elements[e].nodes)
            bars.append(_Bar(start_name, end_name, member_of[e], piece))
            placed.setdefault(start_name, piece)
            placed.setdefault(end_name, piece)
    return bars, placed, cuts


def _free_name(name: str, mesh: FrameMesh) -> str:
    while name in mesh.names:
        name += "'"
    return name


def _pieces_at(s: float, length: float, count: int) -> list[int]:
    """Pieces that hold a node of the path: two at a cut."""
    share = s / length * count
    nearest = round(share)
    if abs(share - nearest) <= 2 * _SAME * count and 0 < nearest < count:
        return [nearest - 1, nearest]
    return [min(int(share), count - 1)]


def _branches(
    mesh: FrameMesh, path: _Path, length: float, count: int, where: str
) -> Iterable[tuple[IntArray, int]]:
    """Elements that hang together beside the path, and their piece."""
    beside = np.setdiff1d(np.arange(len(mesh.elements)), path.elements)
    if not len(beside):
        return
    ends = np.array([mesh.elements[e].nodes for e in beside])
    on_path = np.isin(ends, path.nodes)
    own = ends.copy()  # every branch meets path nodes of its own: they join no branches
    own[on_path] = len(mesh.nodes) + np.arange(int(on_path.sum()))
    size = int(own.max()) + 1
    _, label = connected_components(sp.coo_array((np.ones(len(own)), own.T), shape=(size, size)), directed=False)
    along = dict(zip(path.nodes.tolist(), path.along.tolist(), strict=True))
    for number in np.unique(label[own[:, 0]]):
        members = label[own[:, 0]] == number
        feet = [along[int(n)] for n in np.unique(ends[members][on_path[members]])]
        common = set(_pieces_at(feet[0], length, count)).intersection(*(_pieces_at(s, length, count) for s in feet))
        if not common:
            names = {k: name for name, k in mesh.names.items()}
            first = ", ".join(repr(names[int(n)]) for n in ends[members][0])
            raise FEImportError(
                Cause.BAD_FIELD,
                f"members beside the load path bridge a cut, as that at nodes {first}",
                where=where,
                value=count,
                remedy="use another number of substructures; a ring cannot be cut at one node",
            )
        yield beside[members], min(common)


def _piece(
    link: LinkFile,
    mesh: FrameMesh,
    bars: list[_Bar],
    placed: dict[str, int],
    cuts: dict[str, Array],
    number: int,
    ends: tuple[str, str],
) -> LinkFile:
    description, frame = link.description, link.description.frame
    assert frame is not None
    own = [bar for bar in bars if bar.piece == number]
    names = list(dict.fromkeys(name for bar in own for name in (bar.start, bar.end)))
    positions = {name: cuts[name] if name in cuts else mesh.nodes[mesh.names[name]] for name in names}
    members = [
        Member(m.start, m.end, old.material, old.section, 1, old.local_z)
        for m in own
        for old in (frame.members[m.member],)
    ]
    interfaces = _interfaces(description, list(cuts), placed, number, ends)
    resolved = {i.name: i.node for i in description.interfaces}
    masses = [
        msgspec.structs.replace(mass, node=node)
        for mass in description.masses
        for node in (mass.node if mass.node in mesh.names else resolved[mass.node],)
        if placed[node] == number
    ]
    nodes = {name: (float(p[0]), float(p[1]), float(p[2])) for name, p in positions.items()}
    piece = msgspec.structs.replace(
        description,
        name=f"{description.name}/{number + 1}",
        frame=msgspec.structs.replace(frame, nodes=nodes, members=members),
        interfaces=interfaces,
        masses=masses,
        reduction=_reduction(description.reduction, len(names), interfaces),
        recovery=None if description.recovery is None else Recovery(all=True),
    )
    return LinkFile(link.path, piece)


def _interfaces(
    description: LinkDescription, cuts: list[str], placed: dict[str, int], number: int, ends: tuple[str, str]
) -> list[Interface]:
    """Inboard, outboard, and those others of the link that sit on the piece."""
    named = {i.node: i.name for i in description.interfaces}
    at = {i.name: i.node for i in description.interfaces}
    nodes = [at[ends[0]], *cuts, *([at[ends[1]]] if ends[1] else [])][number : number + 2]
    taken = {i.name for i in description.interfaces}
    result = []
    for node in nodes:
        name = named.get(node, node)
        while node not in named and name in taken:
            name += "'"
        result.append(Interface(name, node=node))
    return result + [i for i in description.interfaces if placed[i.node] == number and i.node not in nodes]


def _reduction(options: Reduction, nodes: int, interfaces: list[Interface]) -> Reduction:
    """The link's options, with mode counts that the piece can fill."""
    boundary = 6 * len(interfaces)
    inner = 6 * nodes - boundary
    fixed, free, elastic = options.fixed_interface_modes, options.free_modes, options.elastic_modes
    fixed = None if fixed is None else min(fixed, inner)
    free = None if free is None else min(free, 6 * nodes - 6)
    most = 6 * nodes - 6
    if options.method in ("craig-bampton", "guyan"):
        kept = 0 if options.method == "guyan" else min(12, inner) if fixed is None else fixed
        counted = options.selection == "lowest" and not options.static_correction
        most = min(most, boundary - 6 + kept) if counted else most
    elastic = None if elastic is None else min(elastic, most)
    return msgspec.structs.replace(
        options, fixed_interface_modes=fixed, free_modes=free, elastic_modes=elastic, inboard=interfaces[0].name
    )
