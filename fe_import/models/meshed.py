"""From the description of a link meshed with solids or shells to its finite-element model."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from fe_import.description.base import Vector
from fe_import.description.link import LinkFile
from fe_import.description.meshes import Shell, Solid
from fe_import.description.records import Interface, LinkDescription
from fe_import.elements.attachments import AttachedBeam, AttachedSpring, needs_rotations
from fe_import.elements.elasticity import turned_moduli
from fe_import.elements.mixed_stress import MixedStress
from fe_import.elements.shell_stress import ShellPart, shell_stress
from fe_import.elements.solid import SolidMaterial, assemble_solid, volume
from fe_import.elements.solid_mesh import FILLING, SolidMesh, surface_triangles
from fe_import.elements.solid_orders import raised, with_incompatible_modes
from fe_import.elements.solid_stress import solid_stress
from fe_import.errors import Cause, FEImportError
from fe_import.files.toml import as_spelt, choose
from fe_import.interfaces.coupling import couple_interfaces
from fe_import.interfaces.faces import InterfaceFace, interface_face
from fe_import.mesh.geometry_files import Meshing, is_geometry
from fe_import.mesh.read import Wanted, read_mesh
from fe_import.model import Array, FEModel, IntArray, StressSource
from fe_import.models.attached import AttachedNodes, Entries, add_attached, attached_constraints, attached_nodes
from fe_import.models.hinges import check_hinges
from fe_import.models.model import unit_factors
from fe_import.models.shell import add_shells, shell_parts
from fe_import.models.stretch import stretched


def meshed_model(link: LinkFile) -> FEModel:
    """Read the mesh, assemble mass and stiffness, and let each interface node move its face.

    Raises
    ------
    FEImportError
        A faulty mesh, set, material or interface.
    """
    return mesh_model(mesh_of(link), link.description, str(link.path))


def mesh_of(link: LinkFile) -> SolidMesh:
    """The checked mesh that a description names.

    Raises
    ------
    FEImportError
        A faulty mesh, or none.
    """
    description, where = link.description, str(link.path)
    solid, shell = description.solid, description.shell
    table, name = ("solid", solid.mesh) if solid is not None else ("shell", "" if shell is None else shell.mesh)
    path = link.folder / name
    if "\0" in name or not path.is_file():
        raise FEImportError(
            Cause.FILE_NOT_FOUND,
            "no such mesh file",
            where=f"{where}: {table}.mesh",
            value=name,
            remedy="give a path that starts at the folder of the link description",
        )
    sets = () if shell is None else tuple(region.set for region in shell.regions)
    wanted = Wanted(solid is not None, shell is not None, sets if solid is not None else ())
    meshing = None if solid is None else _meshing(solid, unit_factors(description, where)[0], path, where)
    return read_mesh(path, (solid or shell or Shell()).ignore, wanted, meshing)


def _meshing(solid: Solid, unit: float, path: Path, where: str) -> Meshing | None:
    """How a geometry is meshed; a mesh has its size and sets already."""
    if is_geometry(path):
        if solid.size is None:
            message, remedy = "a geometry is meshed with elements of some size", "give size = LENGTH, as its thickness"
            raise FEImportError(Cause.BAD_FIELD, message, where=f"{where}: solid.size", remedy=remedy)
        return Meshing(solid.size, unit, solid.faces)
    for name, value in (("size", solid.size), ("faces", solid.faces or None)):
        if value is not None:
            message = f"{path.name} is a mesh, no geometry: it has its elements and sets"
            raise FEImportError(Cause.BAD_FIELD, message, where=f"{where}: solid.{name}", remedy="remove the field")
    return None


def mesh_model(mesh: SolidMesh, description: LinkDescription, where: str) -> FEModel:
    """The model of a checked mesh; see `meshed_model`."""
    mesh, description = stretched(mesh, description)
    solid, shell = description.solid, description.shell
    names = {} if solid is None and shell is None else (solid or shell or Shell()).nodes
    materials: list[SolidMaterial] = []
    if solid is not None:
        if solid.raise_order:
            mesh = raised(mesh)
        if solid.hex8 == "incompatible-modes":
            mesh = with_incompatible_modes(mesh)
        materials = _materials(description, solid, mesh, where)
        mass, stiffness = assemble_solid(mesh, materials, _fillings(mesh, materials, where))
    own = solid is None or not (solid.material or solid.regions)
    brought = (solid is not None and own) or (
        shell is not None and not (shell.material or shell.layers or shell.regions)
    )
    parts = [] if shell is None else shell_parts(description, shell, mesh, where)
    faces, untied = _faces(description, names, mesh, where), dict[str, int]()
    if mesh.attachments or mesh.shells:
        places = attached_nodes(mesh)
        added = _added(mesh, places, parts, "consistent" if shell is None else shell.mass)
        mass, stiffness = added if solid is None else (_sum(mass, added[0]), _sum(stiffness, added[1]))
        constraints, untied = attached_constraints(mesh, places)
        coupled = couple_interfaces(places.nodes, faces, where, places.dof_map, places.rows, constraints)
    else:
        coupled = couple_interfaces(mesh.nodes, faces, where)
    stiffness = coupled.extended(stiffness)
    if mesh.attachments:
        check_hinges(mesh, places, coupled, stiffness)
    return FEModel(
        name=description.name,
        nodes=coupled.nodes,
        dof_map=coupled.dof_map,
        mass=coupled.extended(mass),
        stiffness=stiffness,
        interface_nodes=coupled.interface_nodes,
        independent=coupled.independent,
        coupling=coupled.coupling,
        node_names=_named_nodes(names, "solid" if solid is not None else "shell", mesh, where),
        triangles=surface_triangles(mesh),
        kind="shell" if solid is None else "solid",
        source=where,
        stress=_stress(mesh, materials, parts),
        left_out={name: n for name, n in mesh.left_out.items() if not own or name not in mesh.materials.names},
        materials=_constants(mesh, brought),
        notes=_attached_notes(mesh, untied),
        second_order_lack=_second_order_lack(mesh),
    )


def _added(
    mesh: SolidMesh, places: AttachedNodes, parts: list[ShellPart], form: str
) -> tuple[sp.csc_array, sp.csc_array]:
    """Mass and stiffness of what turns: shells and attachments."""
    mass, stiffness = Entries(), Entries()
    add_attached(mesh, places, mass, stiffness)
    add_shells(parts, places, form, mass, stiffness)
    return mass.matrix(places.rows), stiffness.matrix(places.rows)


def _stress(mesh: SolidMesh, materials: list[SolidMaterial], parts: list[ShellPart]) -> StressSource:
    if not parts:
        return solid_stress(mesh, materials)
    shells = shell_stress(mesh.nodes, parts, mesh.node_sets, mesh.shell_sets)
    return shells if not mesh.blocks else MixedStress((solid_stress(mesh, materials), shells))


def _sum(matrix: sp.csc_array, added: sp.csc_array) -> sp.csc_array:
    """A matrix of the first rows, and one of all."""
    coo = sp.coo_array(matrix)
    return (sp.csc_array((coo.data, coo.coords), shape=added.shape) + added).tocsc()


def _attached_notes(mesh: SolidMesh, untied: dict[str, int]) -> dict[str, str]:
    counts = Counter(item.keyword for item in mesh.attachments)
    if not counts:
        return {}
    free = {name: f" ({count} nodes beyond its tolerance stay free)" for name, count in untied.items()}
    return {"attached": ", ".join(f"{count} {name}{free.get(name, '')}" for name, count in counts.items())}


def _second_order_lack(mesh: SolidMesh) -> str:
    """Why there is no second-order field: nodes that turn, and springs, would need theirs."""
    if mesh.shells and mesh.blocks:
        return "the link is of solid elements and shells"
    turning = any(needs_rotations(item) or isinstance(item, AttachedSpring) for item in mesh.attachments)
    return "the mesh file attaches springs, or nodes that turn" if turning else ""


def _materials(link: LinkDescription, solid: Solid, mesh: SolidMesh, where: str) -> list[SolidMaterial]:
    if not solid.material and not solid.regions:
        return _materials_of_mesh(mesh, where)
    if solid.material and solid.regions:
        raise FEImportError(
            Cause.BAD_FIELD,
            "give one of 'material' and 'regions'",
            where=f"{where}: solid",
            remedy="one material for the whole mesh, or one per element set",
        )
    if solid.material:
        choose(solid.material, link.materials, f"{where}: solid.material")
        m = link.materials[solid.material]
        return [SolidMaterial(m.youngs_modulus, m.poissons_ratio, m.density)]
    result = []
    for k, region in enumerate(solid.regions):
        choose(region.material, link.materials, f"{where}: solid.regions[{k}].material")
        name = as_spelt(region.set, mesh.element_sets.keys() | mesh.lost_sets.keys())
        if name in mesh.lost_sets and name not in mesh.element_sets:
            raise FEImportError(
                Cause.MESH,
                f"set {name!r} of the mesh is not usable: {mesh.lost_sets[name]}",
                where=f"{where}: solid.regions[{k}].set",
                remedy="mend the set in the mesh file",
            )
        choose(name, mesh.element_sets, f"{where}: solid.regions[{k}].set")
        m = link.materials[region.material]
        elements = mesh.element_sets[name]
        result.append(SolidMaterial(m.youngs_modulus, m.poissons_ratio, m.density, elements))
    return result


def _materials_of_mesh(mesh: SolidMesh, where: str) -> list[SolidMaterial]:
    found = mesh.materials
    lost = next((s.elements for s in found.sections if s.elements not in mesh.element_sets), None)
    if found.lack or lost is not None:
        reason = found.lack or f"its set {lost!r} holds no solid elements that could be followed"
        raise FEImportError(
            Cause.BAD_FIELD,
            f"no 'material' and no 'regions', and the materials of the mesh file cannot be used: {reason}",
            where=f"{where}: solid",
            remedy="give material = NAME for the whole mesh, or [[solid.regions]] for its element sets",
        )
    result = []
    for section in found.sections:
        m, elements = found.constants[section.material], mesh.element_sets[section.elements]
        moduli = m.moduli
        if moduli is not None and section.orientation:
            moduli = turned_moduli(moduli, found.orientations[section.orientation](mesh.centres(elements)))
        result.append(SolidMaterial(m.youngs_modulus, m.poissons_ratio, m.density, elements, moduli))
    return result


def _fillings(mesh: SolidMesh, materials: list[SolidMaterial], where: str) -> list[tuple[IntArray, float]]:
    """Elements with nonstructural mass and its density."""
    result: list[tuple[IntArray, float]] = []
    for filling in () if FILLING in mesh.left_out else mesh.materials.fillings:
        if filling.elements not in mesh.element_sets:
            raise FEImportError(
                Cause.NOT_USED,
                f"{FILLING}: its set {filling.elements!r} holds no solid elements that could be followed",
                where=where,
                remedy=f'mend the set, or ignore = ["{FILLING}"] in [solid]',
            )
        elements = mesh.element_sets[filling.elements]
        if not filling.total:
            result.append((elements, filling.density))
            continue
        parts = [elements if m.elements is None else np.intersect1d(elements, m.elements) for m in materials]
        shares = [m.density if filling.by_mass else 1.0 for m in materials]
        whole = sum(share * volume(mesh, part) for share, part in zip(shares, parts, strict=True))
        result += [(part, share * filling.total / whole) for share, part in zip(shares, parts, strict=True)]
    return result


def _constants(mesh: SolidMesh, own: bool) -> dict[str, tuple[float, float, float]]:
    """Young's modulus, Poisson's ratio and density of the materials of the file that are used: solids', beams'."""
    found = mesh.materials.constants if own else {}
    result = {name: (m.youngs_modulus, m.poissons_ratio, m.density) for name, m in found.items()}
    for item in mesh.attachments:
        if isinstance(item, AttachedBeam) and (item.element.density or not item.line_mass):
            e = item.element
            ratio = e.youngs_modulus / (2 * e.shear_modulus) - 1
            result.setdefault(item.material, (e.youngs_modulus, ratio, e.density))
    return result


def _faces(link: LinkDescription, given: dict[str, Vector], mesh: SolidMesh, where: str) -> list[InterfaceFace]:
    result = []
    table = "shell" if link.solid is None else "solid"
    names = _named_nodes(given, table, mesh, where)
    for k, interface in enumerate(link.interfaces):
        place = f"{where}: interfaces[{k}]"
        if bool(interface.node) == bool(interface.face):
            raise FEImportError(
                Cause.INTERFACE,
                "an interface of a meshed link sits on a face, or on a node that turns",
                where=place,
                value=interface.node or None,
                remedy="give face = SET, or node = NAME for a node of a shell, of a beam or of a rigid body",
            )
        if interface.node:
            result.append(_node(interface, mesh, names, place))
            continue
        position = None if interface.position is None else np.asarray(interface.position, dtype=float)
        try:
            weights = interface.weights or ("area" if interface.coupling == "averaged" else "uniform")
            face = interface_face(mesh, interface.name, interface.face, position, interface.coupling, weights)
            result.append(face)
        except FEImportError as problem:  # found in the mesh, to be mended in the description
            problem.where = f"{place}.face"
            problem.remedy = problem.remedy or "name a face of the mesh with 3 nodes or more, not on one line"
            raise
    return result


def _node(interface: Interface, mesh: SolidMesh, names: dict[str, int], place: str) -> InterfaceFace:
    """An interface on a node: of ``solid.nodes``, or the only one of a set of the mesh."""
    count = len(mesh.nodes) + len(mesh.further_nodes)
    alone = {name: int(own[0]) for name, own in mesh.node_sets.items() if len(own) == 1}
    known = {**alone, **{name: count + k for name, k in mesh.further_names.items()}, **names}
    if interface.node not in known:
        raise FEImportError(
            Cause.INTERFACE,
            "no node of this name, neither of [solid.nodes] nor alone in a set of the mesh",
            where=f"{place}.node",
            value=interface.node,
            limit=", ".join(sorted(known)) or "none is named",
            remedy="give face = SET, or a node of a shell, a beam or a rigid body by the set that holds it alone",
        )
    for field in ("position", "weights"):
        if getattr(interface, field):
            message, remedy = f"an interface on a node has no {field}", "remove the field, or couple a face"
            raise FEImportError(Cause.INTERFACE, message, where=f"{place}.{field}", remedy=remedy)
    if interface.coupling != "rigid":
        message, remedy = "an interface on a node couples no others", "remove the field, or couple a face"
        raise FEImportError(Cause.INTERFACE, message, where=f"{place}.coupling", remedy=remedy)
    node = known[interface.node]
    return InterfaceFace(interface.name, np.array([node]), _positions(mesh)[node], "node")


def _positions(mesh: SolidMesh) -> Array:
    return np.vstack([mesh.nodes, mesh.further_nodes])


def _named_nodes(given: dict[str, Vector], table: str, mesh: SolidMesh, where: str) -> dict[str, int]:
    """Nodes of the mesh, and of what is attached to it, nearest to the named positions."""
    result = {}
    nodes = _positions(mesh)
    limit = 0.05 * float(np.linalg.norm(np.ptp(nodes, axis=0)))
    for name, position in given.items():
        distance = np.linalg.norm(nodes - np.asarray(position), axis=1)
        nearest = int(distance.argmin())
        if not distance[nearest] <= limit:
            raise FEImportError(
                Cause.BAD_REFERENCE,
                "no mesh node near this position",
                where=f"{where}: {table}.nodes.{name}",
                value=tuple(position),
                limit=f"{limit:.4g}, nearest {distance[nearest]:.4g}",
                remedy="positions are in the mesh's frame and units",
            )
        result[name] = nearest
    return result
