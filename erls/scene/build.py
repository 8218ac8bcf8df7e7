"""From a scene to its mechanism: links reduced or read, placed on Denavit-Hartenberg frames, loaded with payloads."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias, TypeVar

import numpy as np
import platformdirs

from erls.errors import Cause, SceneError
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism, Point
from erls.mechanism.compound_joints import expand
from erls.mechanism.effects import ALL, inconsistencies, named_effects
from erls.mechanism.joints import Joint
from erls.mechanism.links import Link, Payload, payload_invariants, rigid_model, truncated
from erls.mechanism.place import Place
from erls.mechanism.thermal import at_temperature, unwarmed
from erls.mechanism.without_effects import without
from erls.scene.build_bushings import build_bushings
from erls.scene.build_circuits import with_circuits
from erls.scene.build_contacts import build_contacts
from erls.scene.build_couplings import build_couplings
from erls.scene.build_joints import build_joints, stands_on
from erls.scene.build_loads import build_loads
from erls.scene.build_loops import build_loops
from erls.scene.build_substructures import piece_links, piece_models, piece_warnings
from erls.scene.chain import Scene
from erls.scene.interface_gaps import interface_gaps
from erls.scene.links import Link as LinkRecord
from fe_import.cache import reduce_cached
from fe_import.description.link import LinkFile, load_link
from fe_import.description.records import LinkDescription
from fe_import.elements.link_shells import LinkShells
from fe_import.errors import FEImportError, ReportedError
from fe_import.files.toml import choose
from fe_import.modal.damping import damping_ratios
from fe_import.modal.equal_frequencies import KEPT_WHOLE, kept_whole, whole_count
from fe_import.modal.file import read_modal_file
from fe_import.modal.model import ModalModel
from fe_import.model import InterfaceNode, Surface
from fe_import.models.inertia import inertia_matrix

Message = Callable[[str], None]
Elements: TypeAlias = LinkDescription | LinkShells | None
"""What a link is made of, as far as formulations with elements of their own ask for it."""
T = TypeVar("T")


@dataclass(frozen=True)
class Built:
    """A mechanism, and what the user should know about how it came about."""

    mechanism: Mechanism

    @property
    def warnings(self) -> tuple[str, ...]:
        """What was found while it was built."""
        return self.mechanism.remarks


def cache_folder() -> Path:
    """Folder of reductions made on the fly: ``ERLS_CACHE``, or the user's cache folder."""
    import os

    given = os.environ.get("ERLS_CACHE")
    return Path(given) if given else Path(platformdirs.user_cache_dir("erls", appauthor=False))


def build_mechanism(
    scene: Scene,
    tell: Message = lambda text: None,
    models: Sequence[ModalModel] | None = None,
    descriptions: Sequence[Elements] = (),
    pieces: Sequence[Sequence[ModalModel]] = (),
) -> Built:
    """Read or reduce the links and put the mechanism together.

    Parameters
    ----------
    scene : Scene
    tell : callable
        Told about each step that takes time.
    models : sequence of ModalModel, optional
        Modal models of the links, instead of the ones that the scene names (a run file holds its own).
    descriptions : sequence of LinkDescription, LinkShells or None
        With ``models``: descriptions of the links that are made of beams, and shells of others, as far as they are
        known.
    pieces : sequence of sequences of ModalModel
        With ``models``: those of the substructures of each link; empty for a link in one piece.

    Raises
    ------
    SceneError, FEImportError
        Naming file, field, value and remedy.
    """
    record, file = scene.record, str(scene.path)
    rows = build_joints(scene)  # first: a faulty one is found before time goes into reductions
    if models is None:
        models, descriptions = link_models(scene, tell), _elements(scene)
        pieces = _pieces(scene, models, tell)
    links = [
        _with_elements(_link(link, model, k, file), known)
        for k, (link, model, known) in enumerate(
            zip(record.links, models, descriptions or [None] * len(models), strict=True)
        )
    ]
    rows = [[replace(row[0], seat=_seat(scene, k, links)), *row[1:]] for k, row in enumerate(rows)]
    links = [
        replace(link, pieces=piece_links(given, link, own, f"{file}: links[{k}]")) if own else link
        for k, (link, given, own) in enumerate(zip(links, record.links, pieces or [()] * len(links), strict=True))
    ]
    effects = named_effects(record.simulation.effects, f"{file}: simulation.effects")
    told = interface_gaps(record, rows, links)
    told += [f"link {link.name!r}: {text}" for link in links if (text := link.model.provenance.get(KEPT_WHOLE))]
    told += [w for link in links for w in piece_warnings(link)]
    told += inconsistencies(effects, record.simulation.formulation)
    points = [_point(scene, k, links) for k in range(len(record.points))]
    whole = expand(rows, _with_payloads(scene, rows, links, points))
    chain = Mechanism(
        name=scene.name,
        joints=whole.joints,
        links=whole.links,
        points=tuple(replace(point, link=int(whole.numbers[point.link])) for point in points),
        loads=tuple(build_loads(scene, links, points, whole.numbers)),
        contacts=tuple(build_contacts(scene, links, points, whole.numbers)),
        gravity=np.array(record.gravity),
        static_start=record.initial.deformation == "static" or record.initial.assemble == "elastic",
        allow_unstable=record.initial.allow_unstable,
        elastic_assembly=record.initial.assemble == "elastic",
        bandwidth=record.simulation.bandwidth,
        remarks=tuple(told),
    )
    chain, circuits = with_circuits(scene, chain)
    loops = build_loops(scene, chain)
    closing = loops + build_bushings(scene, chain) + build_couplings(scene, chain, loops) + circuits
    chain = without(replace(chain, loops=closing, effects=effects), ALL - effects)
    return Built(chain)


def link_models(scene: Scene, tell: Message) -> list[ModalModel]:
    """Modal model of every link; links from the same source in the same modes share one."""
    made: dict[tuple[object, ...], ModalModel] = {}
    result = []
    for k, link in enumerate(scene.record.links):
        key = (
            link.model,
            link.modal_file,
            link.flexible,
            link.elastic_modes,
            link.temperature_change,
            json.dumps([link.reduction, link.changes], sort_keys=True, default=str),
            link.name if link.rigid else "",
        )
        if key not in made:
            made[key] = link_model(scene, k, tell)
        result.append(made[key])
    return result


def _pieces(scene: Scene, models: Sequence[ModalModel], tell: Message) -> list[tuple[ModalModel, ...]]:
    """Modal models of the substructures of each link; none for a link in one piece."""
    result: list[tuple[ModalModel, ...]] = []
    solves_pieces = scene.record.simulation.formulation != "nodal"
    for k, (link, model) in enumerate(zip(scene.record.links, models, strict=True)):
        if link.substructures == 1 or not link.flexible or not solves_pieces:
            result.append(())
            continue
        description = link_description(scene, link)
        found = piece_models(link, description, model, cache_folder(), f"{scene.path}: links[{k}]", tell)
        result.append(tuple(_warmed(piece, link, f"{scene.path}: links[{k}]") for piece in found))
        tell(f"{link.name}: {link.substructures} substructures")
    return result


def _elements(scene: Scene) -> list[Elements]:
    """Descriptions of the links that are made of beams, and, for nodal elements, shells of those made of them."""
    nodal, found = scene.record.simulation.formulation == "nodal", list[Elements]()
    for link in scene.record.links:
        given = load_link(scene.folder / link.model, changes=link.changes) if link.model else None
        if given is None or given.description.frame is not None:
            found.append(None if given is None else given.description)
        elif nodal and link.flexible and given.description.shell is not None and given.description.solid is None:
            from fe_import.models.link_shells import link_shells  # here: it reads meshes

            found.append(link_shells(given))
        else:
            found.append(None)
    return found


def _with_elements(link: Link, known: Elements) -> Link:
    """A link that knows what it is made of."""
    if isinstance(known, LinkShells):
        return replace(link, shells=known)
    return replace(link, description=known)


def link_description(scene: Scene, link: LinkRecord) -> LinkFile:
    """Description of a link with a ``model``, with its changes, its reduction as the scene asks for it."""
    options = {**link.reduction, "form": "orthonormal"}
    expands = link.temperature_change is not None
    return load_link(scene.folder / link.model, options, expands=expands, changes=link.changes)


def link_model(scene: Scene, k: int, tell: Message, description: LinkFile | None = None) -> ModalModel:
    """Modal model of link ``k`` in the modes that the scene asks for.

    Parameters
    ----------
    scene : Scene
    k : int
    tell : callable
    description : LinkFile, optional
        In place of what the scene's ``model`` names; reduced now, and not kept in the cache.

    Raises
    ------
    SceneError, FEImportError
    """
    link, place = scene.record.links[k], f"{scene.path}: links[{k}]"
    if link.rigid is not None:
        rigid = link.rigid
        return rigid_model(
            link.name,
            rigid.mass,
            np.array(rigid.centre_of_mass),
            inertia_matrix(rigid.inertia, f"{place}.rigid.inertia", SceneError),
            {n: np.array(p) for n, p in rigid.points.items()},
            _surface(scene.folder / rigid.surface, f"{place}.rigid.surface") if rigid.surface else None,
        )
    if description is not None:
        from fe_import.reduce import reduce_link  # here, as in `fe_import.cache`

        model = reduce_link(description, tell)
    elif link.modal_file:
        path = scene.folder / link.modal_file
        model = _within(f"{place}.modal_file", lambda: read_modal_file(path))
        if model.form != "orthonormal":
            raise SceneError(
                Cause.BAD_FIELD,
                "this modal file is in physical form; ERLS needs rigid-body and elastic modes apart",
                where=f"{place}.modal_file",
                value=link.modal_file,
                remedy="reduce with form = 'orthonormal'",
            )
    else:
        given = _within(f"{place}.model", lambda: link_description(scene, link))
        model, cached = reduce_cached(given, cache_folder(), tell, passing=bool(link.changes))
        tell(f"{link.name}: {'reduction from the cache' if cached else 'reduced'} ({given.path.name})")
    model = _warmed(model, link, place)
    wanted = 0 if not link.flexible else link.elastic_modes
    if wanted is None:
        return model
    if wanted > model.elastic_modes:
        raise SceneError(
            Cause.BAD_FIELD,
            "the modal model has fewer elastic modes",
            where=f"{place}.elastic_modes",
            value=wanted,
            limit=model.elastic_modes,
            remedy="ask for fewer, or reduce with more",
        )
    kept = 6 + whole_count(model.frequencies_hz[6:], wanted)
    if kept - 6 != wanted:
        told = kept_whole(model.frequencies_hz[6:], wanted, kept - 6, f"links.{link.name}.elastic_modes")
        model = replace(model, provenance={**model.provenance, KEPT_WHOLE: told})
    return truncated(model if wanted else unwarmed(model), kept - 6)


def _surface(path: Path, place: str) -> Surface:
    """What a rigid link is drawn as."""
    from fe_import.mesh.surfaces import read_surface  # here: it imports meshio, which scenes without do not need

    return _within(place, lambda: read_surface(path))


def _warmed(model: ModalModel, link: LinkRecord, place: str) -> ModalModel:
    """The model at the temperature that the scene gives, if it gives one."""
    change = link.temperature_change
    return model if change is None else at_temperature(model, change, f"{place}.temperature_change")


def _within(place: str, read: Callable[[], T]) -> T:
    """Say which field of the scene named a file that cannot be read."""
    try:
        return read()
    except FEImportError as problem:
        if problem.cause in (Cause.FILE_NOT_FOUND, Cause.NOT_READABLE):
            problem.remedy = f"named by {place}; " + problem.remedy
        raise


def _link(link: LinkRecord, model: ModalModel, k: int, file: str) -> Link:
    place = f"{file}: links[{k}]"
    if link.outboard:
        _interface(model, link.outboard, f"{place}.outboard")
    omega = 2 * np.pi * model.frequencies_hz
    ratios = model.damping_ratios if link.damping is None else damping_ratios(link.damping, omega, place)
    return Link(
        name=link.name,
        model=model,
        invariants=model.invariants,
        inboard=_interface(model, link.inboard or model.interface_nodes[0].name, f"{place}.inboard"),
        stiffness=np.diag(model.stiffness)[6:].copy(),
        damping=(2 * ratios * omega)[6:],
    )


def _seat(scene: Scene, k: int, links: Sequence[Link]) -> InterfaceNode | None:
    """Where joint k stands on its link: the interface that it names, or that link's outboard one."""
    joint, parent = scene.record.joints[k], stands_on(scene.record, k)
    if parent < 0:
        return None
    record, link, file = scene.record.links[parent], links[parent], str(scene.path)
    if joint.at:
        return _interface(link.model, joint.at, f"{file}: joints[{k}].at")
    others = [i.name for i in link.model.interface_nodes if i.name != link.inboard.name]
    if not record.outboard and not others:
        message, remedy = "this link has no second interface for the next joint", "add an interface to the description"
        if record.rigid is not None:
            remedy = f"give links[{parent}].rigid.points two points: the first where its own joint sits, then this one"
        where = f"{file}: links[{parent}].outboard"
        raise SceneError(Cause.BAD_REFERENCE, message, where=where, value=link.name, remedy=remedy)
    return _interface(link.model, record.outboard or others[0], f"{file}: links[{parent}].outboard")


def _interface(model: ModalModel, name: str, where: str) -> InterfaceNode:
    choose(name, [i.name for i in model.interface_nodes], where, SceneError)
    found = model.interface(name)
    if found is None:
        raise ReportedError(Cause.BAD_REFERENCE, "no such interface", where=where, value=name)
    return found


def _point(scene: Scene, k: int, links: list[Link]) -> Point:
    """Resolve a named point to a node of a link."""
    point, place = scene.record.points[k], f"{scene.path}: points[{k}]"
    number = [link.name for link in links].index(point.link)
    model = links[number].model
    if point.position is not None:
        distance = np.linalg.norm(model.nodes - np.array(point.position), axis=1)
        node = int(distance.argmin())
        limit = 0.05 * float(np.linalg.norm(np.ptp(model.nodes, axis=0)))
        if distance[node] > limit:
            raise SceneError(
                Cause.BAD_REFERENCE,
                "no mesh node near this position",
                where=f"{place}.position",
                value=point.position,
                limit=f"{limit:.4g} m, nearest {distance[node]:.4g} m",
                remedy="positions are in the link's mesh frame",
            )
        return Point(point.name, number, node)
    known = {**{i.name: i.node for i in model.interface_nodes}, **model.node_names}
    choose(point.node, known, f"{place}.node", SceneError)
    return Point(point.name, number, known[point.node])


def _with_payloads(scene: Scene, rows: list[list[Joint]], links: list[Link], points: list[Point]) -> list[Link]:
    """Payloads on points, and motors where their joint stands."""
    result = list(links)
    names = {p.name: p for p in points}

    def add(
        number: int, node: int, offset: Array, mass: float, inertia: Array, place: str, motor: bool = False
    ) -> None:
        link = result[number]
        turning = node in link.model.rotation_nodes
        if not turning and (inertia.any() or offset.any()):
            raise SceneError(
                Cause.BAD_FIELD,
                "this node has no rotation, so it cannot carry an inertia or an offset",
                where=place,
                value=link.name,
                remedy="put the payload on an interface, or give mass only",
            )
        extra = payload_invariants(link.model, node, offset, mass, inertia)
        payloads = (*link.payloads, Payload(node, offset, mass, inertia, motor))
        result[number] = replace(link, invariants=link.invariants + extra, payloads=payloads)

    for k, payload in enumerate(scene.record.payloads):
        place = f"{scene.path}: payloads[{k}]"
        point = names[payload.point]
        mass = Place(scene.folder, place).not_negative("mass", payload.mass)
        inertia = inertia_matrix(payload.inertia, f"{place}.inertia", SceneError)
        add(point.link, point.node, np.array(payload.offset), mass, inertia, place)
    for k, joint in enumerate(scene.record.joints):
        place = f"{scene.path}: joints[{k}].motor"
        mass = Place(scene.folder, place).not_negative("mass", joint.motor.mass)
        inertia = inertia_matrix(joint.motor.inertia, f"{place}.inertia", SceneError)
        seat, parent = rows[k][0].seat, rows[k][0].parent
        if seat is not None and (mass or inertia.any()):  # others stand on the ground
            add(parent, seat.node, np.zeros(3), mass, inertia, place, motor=True)
    return result
