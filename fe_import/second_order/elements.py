"""Second-order field of solids and shells: modal derivatives that keep finite strains linear in the modes.

With modes u = φ_a q_a the strains of Green and Lagrange hold, in second order, ε(u₂) + ½ ∇uᵀ∇u. They cannot vanish
everywhere; the field that makes them smallest in energy, the reference interface at rest, solves for each pair of modes

    K Ψ_ab = -∫ ε(δ) : C : sym(∇φ_aᵀ ∇φ_b) dV

so that the energy stays quadratic in q up to and including third order (material of Saint-Venant and Kirchhoff; on
modal derivatives see S. R. Idelsohn and A. Cardona, Comput. Methods Appl. Mech. Eng. 49 (1985) 253-279).
Nodes that follow an interface are turned finitely with it: ½ (θ_a × (θ_b × r) + θ_b × (θ_a × r)).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fe_import.modal.second_order import SecondOrder
from fe_import.model import Array, FEModel, IntArray
from fe_import.reduction.base import HeldSolution, expanded, interface_places
from fe_import.second_order.composition import composed_rotation, twice_turned
from fe_import.second_order.moments import LEVI_CIVITA, of_inertia, of_modes, of_moments
from fe_import.solver.sparse import factorize

_BLOCK_VALUES = 45_000_000  # of test fields held at a time


Work = Callable[[Array, Array, IntArray, IntArray], Array]  # of tests (d, p), fields (d, n) and pairs, (p, pairs)


def elements_second_order(
    model: FEModel, work: Work, shapes: Array, reference: int, nodes: IntArray, held: HeldSolution | None = None
) -> SecondOrder:
    """Solve for what is asked of the fields of all pairs of elastic modes.

    That are few numbers of each field: its momenta, its work on modes and its values at some nodes, each a product
    with a vector l. With K y = l the product lᵀΨ is that of y with the forces, so that as many systems are solved as
    numbers are asked for, whatever the number of pairs, and no field is made.

    Parameters
    ----------
    model : FEModel
        In SI.
    work : callable
        ∫ ε(δ) : C : sym(∇φ_aᵀ ∇φ_b) dV of its elements, see `fe_import.second_order.element_forces`.
    shapes : (d, m) array
        Modes, the six rigid-body ones first.
    reference : int
        Interface.
    nodes : (k,) int array
        Rising; whose fields are stored.
    held : HeldSolution, optional
        Where there are factors already.

    Raises
    ------
    FEImportError
        NOT_DEFINITE: some part can move without strain; TOO_LARGE.
    """
    start = model.interface_nodes[reference].node
    motions = model.rigid_body_modes()
    rows = model.dof_map[start]
    relative = shapes[:, 6:] - motions @ np.linalg.solve(motions[rows], shapes[rows, 6:])
    n, m = relative.shape[1], shapes.shape[1]
    first, second = np.triu_indices(n)
    stored = np.zeros((2, len(nodes), 3, len(first)))
    places = model.dof_map[:, :3].ravel()
    weights, moving = _weights(model), np.asarray(model.mass @ shapes[:, 6:])[places]
    linear, moment, modal = np.zeros((3, m, m)), np.zeros((3, 3, m, m)), np.zeros((n, m, m))
    turned = model.dof_map[nodes][:, 3] >= 0
    kept = np.concatenate([model.dof_map[nodes, :3].ravel(), model.dof_map[nodes[turned], 3:].ravel()])
    asked = np.zeros((len(relative), 12 + n))
    asked[:, :12] = weights
    asked[places, 12:] = moving
    found = _asked(model, work, relative, held or _held(model), reference, (first, second), asked, kept)
    stored[0] = found[12 + n : 12 + n + 3 * len(nodes)].reshape(stored[0].shape)
    stored[1][turned] = found[12 + n + 3 * len(nodes) :].reshape(stored[1][turned].shape)
    for a, b in ((first, second), (second, first)):  # S, then ∫ρ x ⊗ Ψ, then the modes
        linear[:, 6 + a, 6 + b] = found[:3]
        moment[:, :, 6 + a, 6 + b] = found[3:12].reshape(3, 3, len(first))
        modal[:, 6 + a, 6 + b] = found[12 : 12 + n]
    phi = shapes[rows[3:]]
    _add_rigid(model, relative, phi, start, weights, linear, moment)
    modal += _modal_rigid(relative[places], phi, model.nodes - model.nodes[start], moving)
    momentum, spin = of_moments(linear, moment)
    for node, inertia in _turning_masses(model):
        moved = np.zeros((3, m))
        moved[:, 6:] = relative[model.dof_map[node, 3:]]
        place = int(np.searchsorted(nodes, node))
        own = np.zeros((3, n, n))
        own[:, first, second] = own[:, second, first] = stored[1, place]
        terms = of_inertia(inertia, phi + moved, composed_rotation(own, moved, phi))
        momentum, spin = momentum + terms[0], spin + terms[1]
        modal += of_modes((phi + moved)[:, 6:], terms[0][3:])
    return SecondOrder(reference, momentum, spin, modal, nodes, stored[0], stored[1])


def _asked(
    model: FEModel,
    work: Work,
    relative: Array,
    held: HeldSolution,
    reference: int,
    pairs: tuple[IntArray, IntArray],
    asked: Array,
    kept: IntArray,
) -> Array:
    """(p + k, pairs) products of the fields with ``asked`` (d, p), then their components ``kept`` (k,)."""
    given = _followed(model, relative, *pairs)
    count, step = asked.shape[1] + len(kept), max(1, _BLOCK_VALUES // len(relative))
    result = np.empty((count, len(pairs[0])))
    for begin in range(0, count, step):
        some = slice(begin, min(begin + step, count))
        loads = np.zeros((len(relative), some.stop - begin))
        own = asked[:, some]
        loads[:, : own.shape[1]] = own
        single = np.arange(max(begin, asked.shape[1]), some.stop)
        loads[kept[single - asked.shape[1]], single - begin] = 1.0
        reduced = loads if model.coupling is None else model.coupling.T @ loads
        tests = expanded(model, held(reduced, reference))
        result[some] = -work(tests, relative, *pairs)
        left = loads - model.stiffness @ tests  # what follows an interface moves as given, and strains the rest
        for rows, moved in given:
            result[some] += left[rows].T @ moved
    return result


def _held(model: FEModel) -> HeldSolution:
    """By factors of its own."""

    def solution(loads: Array, reference: int) -> Array:
        _, stiffness = model.reduced_matrices()
        places = interface_places(model)[6 * reference : 6 * reference + 6]
        free = np.setdiff1d(np.arange(stiffness.shape[0]), places)
        solve = factorize(
            stiffness[free][:, free].tocsc(), "stiffness of the link held at its inboard interface",
            model.dof_positions()[free],
        )  # fmt: skip
        answers = np.zeros_like(loads)
        answers[free] = solve(np.ascontiguousarray(loads[free]))
        return answers

    return solution


def _followed(
    model: FEModel, relative: Array, first: IntArray, second: IntArray
) -> list[tuple[IntArray, Array]]:
    """Rows of nodes that follow an interface, and their finite turning (rows, pairs), one interface after the other."""
    result = []
    for interface in model.interface_nodes:
        others = interface.coupled_nodes[interface.coupled_nodes != interface.node]
        theta = relative[model.dof_map[interface.node, 3:]]
        arms = model.nodes[others] - interface.position
        moved = [twice_turned(theta, arm)[:, first, second] for arm in arms]
        if moved:
            result.append((model.dof_map[others, :3].ravel(), np.concatenate(moved)))
    return result


def _weights(model: FEModel) -> Array:
    """(d, 12) such that their product with a field is ∫ρ u, then ∫ρ x ⊗ u (axis of x first)."""
    rows = model.dof_map[:, :3]
    fields = np.zeros((model.mass.shape[0], 12))
    for d in range(3):
        fields[rows[:, d], d] = 1.0
        for c in range(3):
            fields[rows[:, d], 3 + 3 * c + d] = model.nodes[:, c]
    return np.asarray(model.mass @ fields)


def _add_rigid(
    model: FEModel, relative: Array, phi: Array, start: int, weights: Array, linear: Array, moment: Array
) -> None:
    """Add what the rotation φ of the reference does to displacements and to the undeformed link; see `composed`."""
    rows, m = model.dof_map[:, :3], phi.shape[1]
    arms = np.zeros(len(relative))
    arms[rows.ravel()] = (model.nodes - model.nodes[start]).ravel()
    first = np.zeros((12, m))
    first[:, 6:] = weights.T @ relative
    arm = weights.T @ arms
    for block, out in ((slice(0, 3), linear[None]), (slice(3, 12), moment)):
        u, d = first[block].reshape(-1, 3, m), arm[block].reshape(-1, 3)
        for k in range(len(u)):
            once = np.cross(phi[:, :, None], u[k][:, None, :], axis=0)
            out[k] += once + once.transpose(0, 2, 1) + twice_turned(phi, d[k])


def _modal_rigid(relative: Array, phi: Array, arms: Array, moving: Array) -> Array:
    """(n, m, m) modal terms of what `_add_rigid` adds; ``moving``, the mass times the elastic modes, and ``relative``
    are of displacements (3 nodes, n).
    """
    n, m = relative.shape[1], phi.shape[1]
    force, moved = (field.reshape(len(arms), 3, n) for field in (moving, relative))
    result = np.zeros((n, m, m))
    for i, k, j in np.argwhere(LEVI_CIVITA):
        once = np.zeros((n, m))
        once[:, 6:] = LEVI_CIVITA[i, k, j] * (force[:, i].T @ moved[:, j])
        turned = phi[k][:, None] * once[:, None, :]
        result += turned + turned.transpose(0, 2, 1)
    for i in range(3):
        result += twice_turned(phi, force[:, i].T @ arms)[:, i]
    return result


def _turning_masses(model: FEModel) -> list[tuple[int, Array]]:
    """Nodes with an inertia of their own."""
    result = []
    for interface in model.interface_nodes:
        dofs = model.dof_map[interface.node, 3:]
        block = model.mass[dofs][:, dofs].toarray()
        if block.any():
            result.append((interface.node, block))
    return result
