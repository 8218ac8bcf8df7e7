"""A mechanism whose links hold what their reduction leaves out, beside the one that was run.

What a reduced link leaves out (`fe_import.modal.left_out`) becomes further elastic coordinates of it. A link without a
finite-element model, from a modal file, is taken to leave out about what the highest third of its modes contribute:
these are then the coordinates that the lesser model lacks.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence, Set
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from erls.mechanism.chain import Mechanism
from erls.mechanism.links import Link, payload_invariants
from erls.mechanism.loads import CENTRE
from erls.scene.build import cache_folder, link_description
from erls.scene.chain import Scene
from erls.scene.links import Link as LinkRecord
from fe_import.cache import left_out_cached
from fe_import.description.link import LinkFile
from fe_import.modal.inertia import InertiaInvariants
from fe_import.modal.left_out import LeftOut, extended
from fe_import.modal.model import MESH_ERROR
from fe_import.model import IntArray

_EQUAL = 1e-9  # of the largest: rounding
_KEPT_OF_FILE = 2 / 3  # of the modes of a link that is nothing but a modal file


@dataclass(frozen=True)
class FinerLinks:
    """A mechanism with all that counts as left out.

    Attributes
    ----------
    mechanism : Mechanism
    run : (e,) int array
        Places of the elastic coordinates that were run, among those of ``mechanism``.
    kept : (k,) int array
        Those of them that do not count as left out.
    exact : bool
        Whether inertia and stiffness of what was run are those of ``mechanism`` over its coordinates. Not so on a finer
        mesh: lumped masses lie elsewhere, and displacements turned across a beam are of higher order than its elements.
    notes : tuple of str
        What is not judged, or how.
    """

    mechanism: Mechanism
    run: IntArray
    kept: IntArray
    exact: bool
    notes: tuple[str, ...]


def finer_links(scene: Scene, whole: Mechanism, solved: Mechanism) -> FinerLinks:
    """The mechanism that a run solved, its links finer.

    Parameters
    ----------
    scene : Scene
    whole : Mechanism
        Of whole links.
    solved : Mechanism
        Of their pieces, where links are split; the same otherwise.

    Raises
    ------
    FEImportError
        A finite-element model that cannot be made again, or is no longer the one that was reduced.
    """
    sources = _sources(scene, whole)
    links: list[Link] = []
    run: list[IntArray] = []
    kept: list[IntArray] = []
    notes: dict[str, None] = {}
    at, exact = 0, True
    for number, (link, source) in enumerate(zip(solved.links, sources, strict=True)):
        own, lesser, finer = link.elastic_modes, link.elastic_modes, link
        if own and source is not None:
            finer, left = _finer(
                link,
                source,
                [p.node for p in solved.points if p.link == number],
                {node for link, node in _pressed(solved) if link == number},
            )
            exact &= _same_inertia(link.model.invariants, left.invariants.truncated(np.arange(link.model.modes)))
            if not left.refined:
                notes[_of_mesh(link)] = None
        elif lumped(link) and source is not None:
            finer = _weighed(link, source)
            exact &= _same_inertia(link.invariants, finer.invariants)
        elif own:
            lesser = int(np.ceil(_KEPT_OF_FILE * own))
            notes[f"link {_name(link)!r} is a modal file: judged by the highest third of its modes"] = None
        run.append(at + np.arange(own))
        kept.append(at + np.arange(lesser))
        at += finer.elastic_modes
        links.append(finer)
    mechanism = replace(solved, links=tuple(links), bandwidth=None)
    return FinerLinks(mechanism, np.concatenate(run), np.concatenate(kept), exact, tuple(notes))


def _pressed(mechanism: Mechanism) -> Iterator[tuple[int, int]]:
    """Links and nodes on which loads and contacts act."""
    yield from ((load.link, load.node) for load in mechanism.loads if load.node != CENTRE)
    for contact in mechanism.contacts:
        yield contact.link, contact.node
        if contact.base is not None:
            yield contact.base


def lumped(link: Link) -> bool:
    """Whether the inertia of a link hangs on its mesh, rigid as it may be: that of beams with lumped masses does."""
    frame = None if link.description is None else link.description.frame
    return frame is not None and frame.mass == "lumped"


def _same_inertia(first: InertiaInvariants, second: InertiaInvariants) -> bool:
    """But for rounding."""
    pairs = ((first.m, second.m), (first.X, second.X), (first.Z, second.Z))
    return all(np.abs(one - other).max() <= _EQUAL * np.abs(one).max() for one, other in pairs)


def _of_mesh(link: Link) -> str:
    """What is known of a mesh that is not refined here."""
    found = next((check.value for check in link.model.health if check.name.startswith(MESH_ERROR)), None)
    if found is None:
        return f"the mesh of link {_name(link)!r} is not judged"
    return f"the mesh of link {_name(link)!r} is not in it: by its stress its frequencies are {100 * found:.2g} % off"


def _name(link: Link) -> str:
    """Of the whole link that a piece belongs to."""
    return link.name.partition("/")[0]


def _sources(scene: Scene, whole: Mechanism) -> list[Callable[[], LinkFile] | None]:
    """What gives the description of each link that is solved for; None where there is none."""
    records = dict(zip(whole.bodies, scene.record.links, strict=True))
    result: list[Callable[[], LinkFile] | None] = []
    for number, link in enumerate(whole.links):
        record = records.get(number)
        described = record is not None and bool(record.model)
        for piece in range(max(1, len(link.pieces))):
            result.append(_source(scene, record, link, piece) if record is not None and described else None)
    return result


def _source(scene: Scene, record: LinkRecord, link: Link, piece: int) -> Callable[[], LinkFile]:
    def described() -> LinkFile:
        found = link_description(scene, record)
        if not link.pieces:
            return found
        from erls.scene.build_substructures import piece_descriptions

        return piece_descriptions(record, found, link.model, f"{scene.path}: {record.name}")[piece]

    return described


_KEPT = 32
_lately: dict[tuple[Any, ...], tuple[LeftOut, Link]] = {}


def _finer(
    link: Link, source: Callable[[], LinkFile], points: Sequence[int], loaded: Set[int]
) -> tuple[Link, LeftOut]:
    """A link with what it leaves out under forces on its nodes ``loaded`` too as further coordinates; one made lately
    where nothing tells them apart.
    """
    interfaces = {i.node for i in link.model.interface_nodes}
    carrying = sorted(({p.node for p in link.payloads} | loaded) - interfaces)
    left = left_out_cached(source, link.model, cache_folder(), carrying)
    thermal = link.model.thermal
    key = (
        id(left),  # the one of this model and its modes
        link.inboard.name,
        link.damping.tobytes(),
        None if thermal is None else thermal.change,
        tuple(points),
        tuple(carrying),
        *((p.node, p.mass, p.motor, p.offset.tobytes(), p.inertia.tobytes()) for p in link.payloads),
    )
    if key not in _lately or _lately[key][0] is not left:
        _lately[key] = left, _extended(link, left, [*points, *carrying])
        while len(_lately) > _KEPT:
            del _lately[next(iter(_lately))]
    return _lately[key][1], left


def _weighed(link: Link, source: Callable[[], LinkFile]) -> Link:
    """A rigid link with the inertia of the finer mesh."""
    left = left_out_cached(source, link.model, cache_folder())
    difference = left.invariants.truncated(np.arange(link.model.modes)) - link.model.invariants
    return replace(link, invariants=link.invariants + difference)


def _extended(link: Link, left: LeftOut, nodes: Sequence[int]) -> Link:
    model = extended(link.model, left, np.array(nodes, dtype=np.int64))
    invariants = model.invariants
    for p in link.payloads:
        invariants = invariants + payload_invariants(model, p.node, p.offset, p.mass, p.inertia)
    return replace(
        link,
        model=model,
        invariants=invariants,
        stiffness=np.concatenate([link.stiffness, left.stiffness]),
        damping=np.concatenate([link.damping, np.zeros(left.fields)]),
        description=None,
        pieces=(),
    )
