"""Rigid bodies and loads at nodes.

In the node's axes, with the constant inertia M (6, 6) and the momentum M ν (O. Brüls, M. Arnold, A. Cardona, ASME
DETC2011-48132, eq. 20): M ν̇ − ad(ν)ᵀ M ν = M [Rᵀ g; 0].
"""

from __future__ import annotations

from erls.equations.compiled_system import Array
from erls.equations.nodal.contract import Model, Work
from erls.maths.jit import part
from erls.maths.motions import cobracket, pair_minus, pair_plus
from erls.maths.vectors import (
    Twist,
    Vector,
    add,
    cross,
    dot,
    minus,
    nine,
    of_matrix,
    plus,
    scaled,
    three,
    times,
    turned,
    unit,
    vector,
)

_ZERO = (0.0, 0.0, 0.0)


@part
def _weight(model: Model, poses: Array, node: int) -> Vector:
    return turned(nine(poses, node, 3), vector(model.gravity, 1, 0))


@part
def body_forces(model: Model, work: Work) -> None:
    """Add inertia less weight to ``work.force``."""
    for k in range(len(model.body_nodes)):
        node = model.body_nodes[k]
        at = 6 * node
        v, w = three(work.twist, at), three(work.twist, at + 3)
        pull = minus(three(work.rate, at), _weight(model, work.poses, node))
        momentum = of_matrix(model.bodies, k, v, w)
        force = of_matrix(model.bodies, k, pull, three(work.rate, at + 3))
        force = pair_minus(force, cobracket(v, w, momentum[0], momentum[1]))
        add(work.force, at, force[0])
        add(work.force, at + 3, force[1])


@part
def body_derivatives(model: Model, work: Work, k: int, block: Array) -> None:
    """Mass, damping (gyroscopic) and stiffness (weight turns with the body) of body k into a block of zeros."""
    node = model.body_nodes[k]
    v, w = three(work.twist, 6 * node), three(work.twist, 6 * node + 3)
    momentum = of_matrix(model.bodies, k, v, w)
    down = _weight(model, work.poses, node)
    for j in range(6):
        a, b = unit(j), unit(j - 3)
        heavy = of_matrix(model.bodies, k, a, b)
        _fill(block[0], j, 1.0, heavy)
        spin = cobracket(v, w, heavy[0], heavy[1])
        _fill(block[1], j, -1.0, pair_plus(spin, cobracket(a, b, momentum[0], momentum[1])))
        _fill(block[2], j, 1.0, of_matrix(model.bodies, k, cross(b, down), _ZERO))


@part
def _fill(out: Array, j: int, scale: float, column: Twist) -> None:
    for i in range(3):
        out[i, j] = scale * column[0][i]
        out[3 + i, j] = scale * column[1][i]


@part
def _load(model: Model, poses: Array, k: int, factor: float) -> Twist:
    """In node axes, about the node."""
    force, moment = scaled(factor, vector(model.loads, k, 0)), scaled(factor, vector(model.loads, k, 3))
    if model.load_dead[k]:
        force, moment = _into_node(model, poses, k, force), _into_node(model, poses, k, moment)
    return force, plus(moment, cross(vector(model.load_positions, k, 0), force))


@part
def _into_node(model: Model, poses: Array, k: int, x: Vector) -> Vector:
    """From the axes in which load k is given to those of its node."""
    if model.load_nodes[k, 1] >= 0:
        x = times(nine(poses, model.load_nodes[k, 1], 3), x)
    return turned(nine(poses, model.load_nodes[k, 0], 3), x)


@part
def load_forces(model: Model, work: Work, sample: Array) -> None:
    """Subtract loads from ``work.force``; their factors follow the joints in ``sample``."""
    first = 3 * len(model.joint_nodes)
    for k in range(len(model.load_nodes)):
        at = 6 * model.load_nodes[k, 0]
        force, moment = _load(model, work.poses, k, -sample[first + k])
        add(work.force, at, force)
        add(work.force, at + 3, moment)


@part
def load_derivatives(model: Model, work: Work, sample: Array, k: int, block: Array) -> None:
    """Stiffness of load k into a block of zeros: dead ones turn in the node's axes, and with those of another node."""
    if not model.load_dead[k]:
        return
    factor, arm = sample[3 * len(model.joint_nodes) + k], vector(model.load_positions, k, 0)
    given = scaled(factor, vector(model.loads, k, 0)), scaled(factor, vector(model.loads, k, 3))
    force, moment = _into_node(model, work.poses, k, given[0]), _into_node(model, work.poses, k, given[1])
    for j in range(3):
        push = cross(unit(j), force)
        _fill(block[2], 3 + j, 1.0, (push, plus(cross(unit(j), moment), cross(arm, push))))
        if model.load_nodes[k, 1] >= 0:
            push = _into_node(model, work.poses, k, cross(unit(j), given[0]))
            turn = _into_node(model, work.poses, k, cross(unit(j), given[1]))
            _fill(block[2], 9 + j, -1.0, (push, plus(turn, cross(arm, push))))


@part
def body_energy(model: Model, work: Work, k: int) -> tuple[float, float]:
    """Kinetic, and that of gravity."""
    node = model.body_nodes[k]
    v, w = three(work.twist, 6 * node), three(work.twist, 6 * node + 3)
    momentum = of_matrix(model.bodies, k, v, w)
    inertia = model.bodies
    first = inertia[k, 5, 1], inertia[k, 3, 2], inertia[k, 4, 0]  # m c
    moment = plus(scaled(inertia[k, 0, 0], vector(work.poses, node, 0)), times(nine(work.poses, node, 3), first))
    kinetic = 0.5 * (dot(v, momentum[0]) + dot(w, momentum[1]))
    return kinetic, -dot(vector(model.gravity, 1, 0), moment)
