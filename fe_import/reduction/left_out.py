"""What a reduced link leaves out of its finite-element model: the static answers to its loads that it lacks.

A link in motion bears loads of joints and payloads on some nodes, the inertia of its rigid-body motion, centrifugal
forces ρ S x of its turning, the inertia M Φ q̈ of the modes kept, and what a change of temperature does to it. With f
one of them, balanced by the inertia of the rigid-body acceleration that it causes, the full model answers by u = K⁺ f
(`fe_import.reduction.free_body`) and the modes kept by Φ Ω⁻² Φᵀ f; the difference is what is left out, up to the square
of the ratio of the frequencies. The fields that these differences span, the largest first, are the beginning of a
Krylov space (moment matching): the first change of every frequency by what is left out is exact in them.

Each load is measured by the strain energy that it causes, loads of a mode of frequency ω also by ω₁ / ω, since slow
ones move it by ω⁻². Fields below `NEGLIGIBLE` of that are dropped, and the smallest of too many.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
import scipy.linalg as la

from fe_import.description.link import LinkFile
from fe_import.errors import Cause, FEImportError
from fe_import.modal.inertia import inertia_invariants
from fe_import.modal.left_out import LeftOut
from fe_import.modal.model import ModalModel
from fe_import.model import Array, FEModel
from fe_import.models.model import build_model
from fe_import.models.refined import on_refined, refined_frame
from fe_import.reduction.base import expanded, gathered
from fe_import.reduction.free_body import FreeBody, free_body

NEGLIGIBLE = 1e-2  # of the root of the strain energy of a load: 1e-4 of its flexibility
MOST_FIELDS = 8  # of a link of many modes; one of few gets more, up to
MOST_COORDINATES = 22  # with its elastic modes
REFINED = 2  # elements in place of each: leaves 1/16 of the error of a mesh in bending, a quarter in torsion
_NO_LOAD = 1e-12  # of the largest energy of a kind of load: rounding
_MASSLESS = 1e-12  # of the largest 1/ω²


def left_out_of(link: LinkFile, modal: ModalModel, loaded: Sequence[int] = ()) -> LeftOut:
    """What a reduction of a link leaves out, for a frame also against a finer mesh.

    Parameters
    ----------
    link : LinkFile
        Description of the link.
    modal : ModalModel
        Its reduction, in orthonormal form; truncated to the modes in use.
    loaded : sequence of int
        Nodes that bear loads beside the interfaces.

    Raises
    ------
    FEImportError
        As `fe_import.models.model.build_model`; MODAL_FILE: modes that are not of this model.
    """
    refined = link.description.frame is not None
    return left_out(refined_frame(link, REFINED) if refined else build_model(link), modal, loaded, refined)


def left_out(
    model: FEModel, modal: ModalModel, loaded: Sequence[int] = (), refined: bool = False
) -> LeftOut:
    """The same of a finite-element model; of a ``refined`` one the nodes of ``modal`` come first."""
    shapes = on_refined(model, _nodal_fields(model, modal))
    body = free_body(model, model.source)
    elastic = shapes[model.independent][:, 6:]
    expansion = _expansion(model, modal)
    loads, weights = _loads(model, body, elastic, modal, loaded)
    loads, weights = np.hstack([loads, expansion]), [*weights, np.ones(expansion.shape[1])]
    answers = body.static(loads)
    scale = _scale(np.einsum("fb,fb->b", body.balanced(loads), answers), weights)
    missing = _less(body, elastic, answers)
    most = max(MOST_FIELDS, MOST_COORDINATES - elastic.shape[1])
    fields, squares = _main_fields(body, missing * scale, most)
    fields = _less(body, elastic, fields)  # once more, for what rounding left of large answers
    extra = expanded(model, fields)
    rigid = np.vstack([modal.invariants.rigid, np.zeros((len(squares), 6))])
    nodes, turning = len(modal.nodes), modal.rotation_nodes
    return LeftOut(
        stiffness=squares,
        translation_shapes=np.ascontiguousarray(extra[model.dof_map[:nodes, :3]]),
        rotation_shapes=np.ascontiguousarray(extra[model.dof_map[turning, 3:]]),
        thermal=(fields.T @ expansion).sum(axis=1),
        invariants=inertia_invariants(model.mass, np.hstack([shapes, extra]), model.dof_map, rigid),
        refined=refined,
    )


def _nodal_fields(model: FEModel, modal: ModalModel) -> Array:
    """(c, m) displacement fields of the modes at the dofs of the nodes of the modal model.

    Raises
    ------
    FEImportError
        MODAL_FILE: the nodes are not those of the model, or do not carry all its dofs, as of a superelement.
    """
    nodes, turning = len(modal.nodes), modal.rotation_nodes
    rows = model.dof_map[:nodes]
    same = len(rows) == nodes and np.allclose(model.nodes[:nodes], modal.nodes)
    same = same and np.array_equal(np.flatnonzero((rows[:, 3:] >= 0).all(axis=1)), turning)
    count = 3 * nodes + 3 * len(turning)
    if not same or (len(model.nodes) == nodes and count < model.mass.shape[0]):
        raise FEImportError(
            Cause.MODAL_FILE,
            "mode shapes at the nodes are not those of the finite-element model",
            where=model.source,
            remedy="reduce the link again; superelements keep their inner displacements to themselves",
        )
    fields = np.zeros((count, modal.modes))
    fields[rows[:, :3]] = modal.translation_shapes
    fields[rows[turning, 3:]] = modal.rotation_shapes
    return fields


def _loads(
    model: FEModel, body: FreeBody, elastic: Array, modal: ModalModel, loaded: Sequence[int]
) -> tuple[Array, list[Array]]:
    """(f, b) loads on the independent dofs: units at nodes, centrifugal forces, inertia of the modes; weights of each
    of these kinds.
    """
    places = np.full(model.mass.shape[0], -1)
    places[model.independent] = np.arange(len(model.independent))
    rows = np.concatenate([body.interfaces, *(places[model.dof_map[node]] for node in loaded)])
    rows = np.unique(rows[rows >= 0])
    units = np.zeros((body.mass.shape[0], len(rows)))
    units[rows, np.arange(len(rows))] = 1.0
    turning = np.zeros((model.mass.shape[0], 6))
    for k, (i, j) in enumerate(itertools.combinations_with_replacement(range(3), 2)):
        for a, b in {(i, j), (j, i)}:
            turning[model.dof_map[:, a], k] = model.nodes[:, b]
    spin = body.mass @ body.elastic(turning[model.independent])
    omega = np.sqrt(np.diag(modal.stiffness)[6:])
    weights = [np.ones(len(rows)), np.ones(6), omega.min(initial=np.inf) / omega]
    return np.hstack([units, spin, body.mass @ elastic]), weights


def _expansion(model: FEModel, modal: ModalModel) -> Array:
    """(f, 1) load per kelvin on the independent dofs; (f, 0) without a change of temperature."""
    if model.thermal is None or modal.thermal is None or not modal.thermal.change:
        return np.zeros((len(model.independent), 0))
    return gathered(model, model.thermal.force[:, None])


def _scale(energy: Array, weights: list[Array]) -> Array:
    """(b,) factors that give each load its weight in the root of the energy (b,) that it causes; 0 for no load."""
    ends = np.cumsum([len(own) for own in weights])[:-1]
    factors = []
    for part, own in zip(np.split(energy, ends), weights, strict=True):
        acting = part > _NO_LOAD * part.max(initial=0.0)
        factors.append(np.where(acting, own / np.sqrt(np.where(acting, part, 1.0)), 0.0))
    return np.concatenate(factors)


def _less(body: FreeBody, elastic: Array, fields: Array) -> Array:
    """Fields (f, k) without what the modes kept hold of them, in strain energy, and without rigid-body motion."""
    if elastic.shape[1]:
        forces = body.stiffness @ elastic
        factor = la.cho_factor(elastic.T @ forces)
        for _ in range(2):
            fields = fields - elastic @ la.cho_solve(factor, forces.T @ fields)
    return body.elastic(fields)


def _main_fields(body: FreeBody, missing: Array, most: int) -> tuple[Array, Array]:
    """(f, x) fields that span the largest answers, orthonormal in mass and diagonal in stiffness; (x,) the latter."""
    energy = missing.T @ (body.stiffness @ missing)
    values, turn = la.eigh((energy + energy.T) / 2)
    chosen = np.flatnonzero(values > NEGLIGIBLE**2)[::-1][:most]
    fields = missing @ (turn[:, chosen] / np.sqrt(values[chosen]))
    if not len(chosen):
        return fields, np.zeros(0)
    # as M φ = μ K φ, μ = 1/ω²: fields without mass have none
    inverse, mixed = la.eigh(fields.T @ (body.mass @ fields), fields.T @ (body.stiffness @ fields))
    found = np.flatnonzero(inverse > _MASSLESS * inverse[-1])[::-1]
    return fields @ (mixed[:, found] / np.sqrt(inverse[found])), 1 / inverse[found]
