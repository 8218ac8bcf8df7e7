"""Frequencies and buckling loads of links, held apart from the mechanism: eigenvalues as components of constraints.

Both are largest eigenvalues μ of A φ = μ K φ, K being the stiffness of a link between its ends: of the mass A, μ is
1/(2πf)²; of the negative stiffness of its axial forces, μ is one over the factor by which these make it buckle.

Largest eigenvalues have edges where they are repeated, as those of round sections are. Components are therefore not
eigenvalues, but the symmetric matrix

    C = Φᵀ A Φ - ½ (μᵢ + μⱼ) (Φᵀ K Φ - 1)

over the modes Φ of a design, which is diag μ there and whose derivatives are those of the whole space of repeated modes
(A. P. Seyranian, E. Lund, N. Olhoff, Struct. Optim. 8 (1994) 207–227). Its largest eigenvalue is convex in it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
import scipy.sparse.linalg as sla

from erls.errors import Cause, SceneError
from erls.maths.so3 import Array, skew
from erls.mechanism.chain import Mechanism
from erls.mechanism.links import Link, Payload
from erls.optimization.beams import elements_of
from erls.optimization.link_numbers import LinkNumbers
from erls.optimization.problem import Problem
from erls.scene.build import link_description
from fe_import.description.link import LinkFile
from fe_import.description.records import LinkDescription
from fe_import.elements.frame import FrameElement, assemble_frame, element_stretch
from fe_import.models.frame_parts import frame_parts
from fe_import.models.model import build_model

MODES = 4  # that are followed: repeated ones come in pairs
FINE = 4  # elements in place of each: errors of cubic shapes fall with the fourth power
_DENSE = 600  # coordinates, up to which all eigenvalues are found at once


class Basis(NamedTuple):
    """Modes of a design for n cases: ``values`` (n, q), ``shapes`` (n, d, q) with ΦᵀKΦ = 1."""

    values: Array
    shapes: Array


@dataclass(frozen=True)
class HeldLink:
    """A link between its ends.

    Attributes
    ----------
    stiffness, mass : (d, d) arrays, dense or sparse
        Over what its ends leave free.
    free : (n, d) array or None
        Displacements of all nodes by these; None where no axial forces are asked for.
    elements : list of FrameElement
        Its beams, `FINE` for each of those in the scene.
    shear : bool
    """

    stiffness: Array | sp.csc_array
    mass: Array | sp.csc_array
    free: Array | None = None
    elements: Sequence[FrameElement] = ()
    shear: bool = True

    def softening(self, forces: Array) -> Array:
        """(k, d, d) what axial forces (k, e), tension positive, take from the stiffness."""
        assert self.free is not None
        result = np.zeros((len(forces), self.free.shape[1], self.free.shape[1]))
        for number, element in enumerate(self.elements):
            rows = self.free[[6 * n + i for n in element.nodes for i in range(6)]]
            local = la.block_diag(*4 * [element.axes]) @ rows
            stretch = local.T @ element_stretch(element, self.shear) @ local
            result -= forces[:, number // FINE, None, None] * stretch
        return result


def held_link(problem: Problem, mechanism: Mechanism, numbers: LinkNumbers, x: Array, k: int, ends: str) -> HeldLink:
    """A link of the scene at a design (v,), held at its ``ends``.

    Raises
    ------
    SceneError
        A link that is not made of beams, held at more than its inboard interface.
    """
    link = mechanism.links[mechanism.bodies[k]]
    weights = tuple((p.node, p.mass, *p.offset, *p.inertia.ravel()) for p in link.payloads)
    make = partial(_held, problem, link, k, ends)
    return numbers.kept(f"held, {ends}, {weights}", k, x, lambda: make(numbers.at(k, x)))


def _held(problem: Problem, link: Link, k: int, ends: str, description: LinkDescription | None) -> HeldLink:
    record = problem.scene.record.links[k]
    assert description is not None
    if description.frame is None:
        return _meshed(replace(link_description(problem.scene, record), description=description), link)
    parts = frame_parts(description, description.frame, record.name, elements_of(problem.scene.record.simulation), FINE)
    mesh, frame = parts.mesh, parts.frame
    mass, stiffness, _ = assemble_frame(
        len(mesh.nodes),
        mesh.elements,
        shear=frame.theory == "timoshenko",
        mass=frame.mass,
        rotary_inertia=frame.rotary_inertia,
    )
    weight = mass.toarray()
    payloads = [Payload(m.node, np.zeros(3), m.mass, m.inertia) for m in parts.masses]
    payloads += [replace(p, node=_nearest(mesh.nodes, link.model.nodes[p.node])) for p in link.payloads]
    for payload in payloads:
        own = slice(6 * payload.node, 6 * payload.node + 6)
        weight[own, own] += _rigid(payload)
    names = {i.name: _nearest(mesh.nodes, i.position) for i in link.model.interface_nodes}
    inboard = names.pop(link.inboard.name)
    free = _free(mesh.nodes, inboard, list(names.values()), ends)
    return HeldLink(
        free.T @ (stiffness @ free), free.T @ weight @ free, free, mesh.elements, frame.theory == "timoshenko"
    )


def _rigid(payload: Payload) -> Array:
    """(6, 6) mass matrix of a payload about its node."""
    arm = np.block([[np.eye(3), -skew(payload.offset)], [np.zeros((3, 3)), np.eye(3)]])
    return np.asarray(arm.T @ la.block_diag(payload.mass * np.eye(3), payload.inertia) @ arm)


def _nearest(nodes: Array, place: Array) -> int:
    return int(np.linalg.norm(nodes - place, axis=1).argmin())


def _free(nodes: Array, inboard: int, others: Sequence[int], ends: str) -> Array:
    """(6 n, d) displacements that the ends allow; every end but the inboard one may come nearer to that."""
    rows = [np.eye(6 * len(nodes))[6 * inboard + i] for i in range(6)]
    if ends == "pinned":
        rows = rows[:3]
    for other in others if ends != "cantilever" else ():
        along = nodes[other] - nodes[inboard]
        along = along / np.linalg.norm(along)
        across = la.null_space(along[None]).T
        held = [np.pad(a, (0, 3)) for a in across]
        held += [np.pad(a, (3, 0)) for a in (np.eye(3) if ends == "clamped" else along[None])]
        rows += [np.pad(row, (6 * other, 6 * (len(nodes) - other - 1))) for row in held]
    return np.asarray(la.null_space(np.array(rows)))


def _meshed(link: LinkFile, built: Link) -> HeldLink:
    """A link of solids, shells or matrices, held at its inboard interface."""
    model = build_model(link)
    inboard = next(i.node for i in model.interface_nodes if i.name == built.inboard.name)
    held = model.dof_map[inboard]
    kept = sp.csc_array(model.coupling)[:, np.flatnonzero(~np.isin(model.independent, held))]
    mass = sp.csc_array(model.mass).tolil()
    for payload in built.payloads:
        node = _nearest(model.nodes, built.model.nodes[payload.node])
        dofs = model.dof_map[node]
        turns = payload.offset.any() or payload.inertia.any()
        if turns and (dofs < 0).any():
            message, remedy = "a payload on a node that does not turn", "put it on an interface"
            raise SceneError(Cause.BAD_FIELD, message, where=f"link {built.name!r}", remedy=remedy)
        own = np.flatnonzero(dofs >= 0)
        mass[np.ix_(dofs[own], dofs[own])] += _rigid(payload)[np.ix_(own, own)]
    return HeldLink(*(sp.csc_array(kept.T @ sp.csc_array(m) @ kept) for m in (model.stiffness, mass)))


def basis_of(stiffness: Array | sp.csc_array, inner: Sequence[Array | sp.csc_array]) -> Basis:
    """Modes of the largest eigenvalues of matrices over the stiffness, the largest first."""
    count = min(MODES, stiffness.shape[0])
    found = [_largest(one, stiffness, count) for one in inner]
    return Basis(np.array([values for values, _ in found]), np.array([shapes for _, shapes in found]))


def _largest(inner: Array | sp.csc_array, stiffness: Array | sp.csc_array, count: int) -> tuple[Array, Array]:
    size = stiffness.shape[0]
    if size <= _DENSE or isinstance(stiffness, np.ndarray):
        a, k = (m if isinstance(m, np.ndarray) else m.toarray() for m in (inner, stiffness))
        values, shapes = la.eigh(a, k, subset_by_index=[size - count, size - 1])
    else:
        factor = sla.splu(stiffness)
        start = np.random.default_rng(0).random(size)
        inverse = sla.LinearOperator((size, size), factor.solve)
        values, shapes = sla.eigsh(inner, count, M=stiffness, Minv=inverse, which="LA", v0=start)
    order = np.argsort(-values)
    return values[order], shapes[:, order]


def components(stiffness: Array | sp.csc_array, inner: Sequence[Array | sp.csc_array], basis: Basis) -> Array:
    """(n, q²) C of each case, over the modes of a design."""
    values, shapes = basis
    within = np.array([phi.T @ (a @ phi) for a, phi in zip(inner, shapes, strict=True)])
    stiff = np.array([phi.T @ (stiffness @ phi) for phi in shapes])
    mean = (values[:, :, None] + values[:, None, :]) / 2
    found = within - mean * (stiff - np.eye(values.shape[1]))
    return np.asarray(found.reshape(len(found), -1))


class LargestEigenvalue:
    """Of a symmetric matrix (q, q), its entries being the components: a `erls.optimization.measures.Measure`."""

    def value(self, components: Array) -> Array:
        """(n,)"""
        return np.asarray(np.linalg.eigvalsh(_square(components))[:, -1])

    def slope(self, components: Array) -> Array:
        """(n, q²)"""
        shapes = np.linalg.eigh(_square(components))[1][:, :, -1]
        return np.asarray((shapes[:, :, None] * shapes[:, None, :]).reshape(len(components), -1))


def _square(components: Array) -> Array:
    size = round(components.shape[1] ** 0.5)
    found = components.reshape(len(components), size, size)
    return (found + np.swapaxes(found, 1, 2)) / 2
