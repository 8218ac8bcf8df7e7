"""One link as nodes, beam or shell elements and rigid bodies, in its mesh frame.

Elements with consistent mass interpolate motion as they do strains; lumped ones are massless between rigid bodies at
their nodes. Euler-Bernoulli members get `STIFF_SHEAR` times their shear stiffness.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from erls.equations.nodal.beam import Beam, lumped
from erls.equations.nodal.rigid_body import RigidBody
from erls.equations.nodal.scatter import IntArray
from erls.equations.nodal.section import BeamSection, beam_section
from erls.equations.nodal.shell import Shell
from erls.errors import Cause, SceneError
from erls.maths import motion_maps as motions
from erls.maths.se3 import pose
from erls.maths.so3 import Array
from erls.mechanism.links import Link, link_mass_properties
from erls.mechanism.thermal import temperature_change
from fe_import.description.records import Frame
from fe_import.elements.frame import FrameElement
from fe_import.models.frame import FrameMesh
from fe_import.models.frame_parts import FrameParts, frame_parts

STIFF_SHEAR = 1e4  # shear then counts 1e-7 of the bending of a slender member
SAME = 1e-9


@dataclass(frozen=True)
class LinkParts:
    """Nodes, elements and bodies of a link, numbered within it.

    Attributes
    ----------
    nodes : (k, 3) array
        In the mesh frame, whose axes their frames take [m].
    beams : list of Beam
        Sections in the mesh frame.
    bodies : list of RigidBody
    elements, fractions : (n,) arrays
        Where the nodes of the modal model lie: beam, and share of its length. Empty for other links.
    shells : list of Shell
        Corners in the mesh frame.
    corners : (q, 4) int array
        Which nodes of the mesh these are, as many nodes of the modal model first as there are.
    carriers : (n,) int array
        Of a link of shells the node that each node of the modal model goes with.
    """

    nodes: Array
    beams: list[Beam] = field(default_factory=list)
    bodies: list[RigidBody] = field(default_factory=list)
    elements: IntArray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    fractions: Array = field(default_factory=lambda: np.zeros(0))
    shells: list[Shell] = field(default_factory=list)
    corners: IntArray = field(default_factory=lambda: np.zeros((0, 4), dtype=np.int64))
    carriers: IntArray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))


class BeamRules(NamedTuple):
    """How beams become elements.

    Attributes
    ----------
    residual_bending_flexibility : bool
        Shear takes what constant curvature leaves out of bending (R. H. MacNeal, Comput. Struct. 8 (1978) 175–183):
        1/(κ G A) + l²/(12 E I).
    linear_inertia : bool
        See `erls.equations.nodal.beam_linear`.
    """

    residual_bending_flexibility: bool = False
    linear_inertia: bool = False


def link_parts(link: Link, elements: int | None, times: int, rules: BeamRules = BeamRules()) -> LinkParts:  # noqa: B008
    """Parts of a link, with ``elements`` in each member of beams, or as the description says; ``times`` as many.

    Raises
    ------
    SceneError
        The link is not made of beams or of shells, has modal damping, or a payload between nodes.
    """
    where = f"link {link.name!r}"
    if link.elastic_modes == 0:
        body = link_mass_properties(link)
        rigid = RigidBody(0, body.mass, _symmetric(body.inertia), body.centre_of_mass - link.inboard.position)
        return LinkParts(link.inboard.position[None], bodies=[rigid])
    if link.damping.any():
        remedy = "set damping = { ratio = 0.0 } for the link, or use another formulation"
        raise refused("modes, which could be damped", where, "modal damping", remedy)
    if link.shells is not None:
        from erls.equations.nodal.shell_parts import shell_link_parts  # here: most links have none

        return shell_link_parts(link, link.shells, times)
    if link.description is None or link.description.frame is None:
        remedy = "give 'model' with a table [frame] or [shell], 'flexible = false', or use another formulation"
        what = "links that are neither beams, nor shells, nor rigid"
        raise refused(what, where, "solid, or reduced elsewhere", remedy)
    frame = link.description.frame
    parts = frame_parts(link.description, frame, where, elements, times)
    same = elements is None and times == 1
    own = parts.mesh if same else frame_parts(link.description, frame, where).mesh
    places = _places(own, parts.mesh)
    return LinkParts(parts.mesh.nodes, *_beams_and_bodies(link, parts, places, rules), *places)


def refused(what: str, where: str, value: str, remedy: str) -> SceneError:
    """Why a link has no nodal elements."""
    return SceneError(Cause.BAD_FIELD, f"the nodal formulation has no {what}", where=where, value=value, remedy=remedy)


def _places(own: FrameMesh, mesh: FrameMesh) -> tuple[IntArray, Array]:
    """Element of ``mesh``, and share of its length, where each node of the link's own mesh lies."""
    elements, fractions = np.zeros(len(own.nodes), dtype=np.int64), np.zeros(len(own.nodes))
    for before, after in zip(own.members, mesh.members, strict=True):
        chain = [own.elements[before[0]].nodes[0], *(own.elements[e].nodes[1] for e in before)]
        along = np.linspace(0.0, len(after), len(chain))
        within = np.clip(np.floor(along + SAME), 0, len(after) - 1).astype(np.int64)
        elements[chain], fractions[chain] = after[0] + within, along - within
    return elements, fractions


def node_at(parts: LinkParts, number: int, where: str) -> int:
    """Node that carries a node of the modal model.

    Raises
    ------
    SceneError
        There is none.
    """
    if len(parts.carriers):
        return carried(parts.carriers, number, where)
    if not parts.beams:
        return 0
    end = round(float(parts.fractions[number]))
    if abs(parts.fractions[number] - end) > SAME:
        raise SceneError(
            Cause.BAD_FIELD,
            "a payload, a load or a joint sits between the nodes",
            where=where,
            value=f"node {number}",
            remedy="let simulation.elements_per_member be a multiple of the link's own elements",
        )
    return parts.beams[int(parts.elements[number])].nodes[end]


def carried(carriers: IntArray, number: int, where: str) -> int:
    """Node of a link of shells that carries a node of its mesh.

    Raises
    ------
    SceneError
        BAD_FIELD: there is none.
    """
    found = int(carriers[number])
    if found < 0:
        raise SceneError(
            Cause.BAD_FIELD,
            "a mass, a payload, a load or a point sits where the mesh has no shell",
            where=where,
            value=f"node {number}",
            remedy="put it at a corner of a shell or at an interface, or use another formulation",
        )
    return found


def _beams_and_bodies(
    link: Link, parts: FrameParts, places: tuple[IntArray, Array], rules: BeamRules
) -> tuple[list[Beam], list[RigidBody]]:
    warmer = temperature_change(link)
    beams = [
        replace(_beam(e, parts.frame, parts.mesh.nodes, rules), expansion=warmer * e.thermal_expansion)
        for e in parts.mesh.elements
    ]
    bodies = [RigidBody(m.node, m.mass, _symmetric(m.inertia)) for m in parts.masses]
    meshed = LinkParts(parts.mesh.nodes, beams, [], *places)
    for payload in link.payloads:
        node = node_at(meshed, payload.node, f"link {link.name!r}")
        bodies.append(RigidBody(node, payload.mass, payload.inertia, payload.offset))
    if parts.frame.mass == "lumped":
        poses = np.array([pose(position=x) for x in parts.mesh.nodes])
        bodies += lumped(beams, poses)
        beams = [replace(b, section=BeamSection(b.section.stiffness, np.zeros((6, 6)))) for b in beams]
    return beams, [b for b in bodies if b.mass or b.inertia.any()]


def _beam(e: FrameElement, frame: Frame, nodes: Array, rules: BeamRules) -> Beam:
    s, density = e.section, e.density
    rigidity = e.shear_modulus * s.area * (1.0 if frame.theory == "timoshenko" else STIFF_SHEAR)
    shear = s.shear_factor_y * rigidity, s.shear_factor_z * rigidity
    if rules.residual_bending_flexibility:
        bending = 12 * e.youngs_modulus / e.length**2
        shear = 1 / (1 / shear[0] + 1 / (bending * s.inertia_z)), 1 / (1 / shear[1] + 1 / (bending * s.inertia_y))
    rotary = (density * s.inertia_y, density * s.inertia_z)
    section = beam_section(
        e.youngs_modulus * s.area,
        shear,
        e.shear_modulus * s.torsion_constant,
        (e.youngs_modulus * s.inertia_y, e.youngs_modulus * s.inertia_z),
        density * s.area,
        rotary,
    )
    if not frame.rotary_inertia:
        inertia = section.inertia.copy()
        inertia[4, 4] = inertia[5, 5] = 0.0
        if frame.mass == "lumped":
            inertia[3, 3] = 0.0
        section = BeamSection(section.stiffness, inertia)
    axes = e.axes.T
    ends = nodes[list(e.nodes)]
    return Beam(e.nodes, motions.poses(np.array([axes, axes]), ends), section, linear=rules.linear_inertia)


def _symmetric(matrix: Array) -> Array:
    return (matrix + matrix.T) / 2
