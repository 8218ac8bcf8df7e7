"""Motion of the nodes of a chain's links, in the world: from the motion of the links' frames and from their modes.

With the frame's twist (v, ω) in its own axes, a node at x = X + u, u = Φ q + ½ qᵀ Ψ q, moves there by

    v + ω × x + u̇,    v̇ + ω × v + ω̇ × x + ω × (ω × x) + 2 ω × u̇ + ü,

and turns by exp(ψ), ψ linear in q or quadratic too, whose own angular velocity is exp(ψ) T(ψ) ψ̇ in the frame's axes
(`erls.maths.rotation_maps.tangent`).
"""

from __future__ import annotations

import numpy as np

from erls.equations.serial.motion_series import MotionSeries, spin_of
from erls.equations.serial.state_series import StateSeries
from erls.maths.rotation_maps import exp, skews, tangent, tangent_derivative
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.links import node_shape6
from erls.mechanism.sensors.base import NodeMotion
from fe_import.model import IntArray


def node_motion(mechanism: Mechanism, motion: MotionSeries, link: int, node: int) -> NodeMotion:
    """Of a node of a link; one that has no rotation turns with the frame of the link.

    Parameters
    ----------
    mechanism : Mechanism
    motion : MotionSeries
    link, node : int
        Numbers of the link, and of the node in its model.
    """
    if motion.nodes is not None and motion.turns is not None:
        moved, turned = motion.nodes[link], motion.turns[link]
        turn = turned.place[:, node]
        spin, spin_rate = spin_of(turn, turned.rate[:, node], turned.acceleration[:, node])
        place, velocity, acceleration = (x[:, node] for x in (moved.place, moved.rate, moved.acceleration))
        return NodeMotion(place, velocity, acceleration, turn, _turned(turn, spin), _turned(turn, spin_rate))
    pose = motion.states.poses[link]
    v, w = motion.twists[link][:, :3], motion.twists[link][:, 3:]
    dv, dw = motion.twist_rates[link][:, :3], motion.twist_rates[link][:, 3:]
    u, du, ddu, psi, dpsi, ddpsi = _displacements(mechanism, motion, link, node)
    x, turn, spinning = mechanism.links[link].model.nodes[node] + u, pose[:, :3, :3], skews(w)
    carried = v + _turned(spinning, x) + du
    acceleration = dv + _turned(skews(dw), x) + _turned(spinning, carried + du) + ddu
    own, rows = exp(psi), tangent(psi)
    about = _turned(rows, dpsi)
    slope = _turned(tangent_derivative(psi, dpsi), dpsi) + _turned(rows, ddpsi)
    own_spin, own_rate = _turned(own, about), _turned(own, slope)
    return NodeMotion(
        _turned(turn, x) + pose[:, :3, 3],
        _turned(turn, carried),
        _turned(turn, acceleration),
        turn @ own,
        _turned(turn, w + own_spin),
        _turned(turn, dw + own_rate + _turned(spinning, own_spin)),
    )


def node_poses(mechanism: Mechanism, states: StateSeries, link: int, nodes: IntArray) -> Array:
    """(k, N, 4, 4) places and axes alone of nodes of a link, as `node_motion` has them."""
    result = np.zeros((len(states.times), len(nodes), 4, 4))
    result[..., 3, 3] = 1.0
    if states.nodes is not None and states.turns is not None:
        result[..., :3, 3], result[..., :3, :3] = states.nodes[link][:, nodes], states.turns[link][:, nodes]
        return result
    own, q = mechanism.links[link], states.modal[link]
    moved = q @ np.concatenate([np.vstack(node_shape6(own.model, n)) for n in nodes.tolist()]).T
    moved = moved.reshape(len(q), len(nodes), 6)
    if "foreshortening" in mechanism.effects and own.second_order is not None:
        bent = np.stack([own.second_order.bending(n) for n in nodes.tolist()])
        moved = moved + np.einsum("ka,nija,kj->kni", q, bent, q, optimize=True) / 2
    result[..., :3, 3] = own.model.nodes[nodes] + moved[..., :3]
    result[..., :3, :3] = exp(moved[..., 3:].reshape(-1, 3)).reshape(*moved.shape[:-1], 3, 3)
    return np.asarray(states.poses[link][:, None] @ result)


def _displacements(mechanism: Mechanism, motion: MotionSeries, link: int, node: int) -> tuple[Array, ...]:
    """(k, 3) displacement of a node with two derivatives, then the same of its rotation vector."""
    own = mechanism.links[link]
    shape = np.vstack(node_shape6(own.model, node))
    q, rate, acceleration = motion.states.modal[link], motion.modal_rates[link], motion.modal_accelerations[link]
    values, rates, accelerations = (x @ shape.T for x in (q, rate, acceleration))
    if "foreshortening" in mechanism.effects and own.second_order is not None:
        bent = own.second_order.bending(node)
        along, speeding = (np.tensordot(x, bent, (1, 1)) for x in (q, rate))  # (k, 6, m)
        values = values + (along @ q[:, :, None])[..., 0] / 2
        rates = rates + (along @ rate[:, :, None])[..., 0]
        accelerations = accelerations + (along @ acceleration[:, :, None] + speeding @ rate[:, :, None])[..., 0]
    return tuple(x[:, part] for part in (slice(3), slice(3, 6)) for x in (values, rates, accelerations))


def _turned(matrices: Array, vectors: Array) -> Array:
    """(k, 3) of matrices (k, 3, 3) and vectors (k, 3)."""
    return np.asarray((matrices @ vectors[:, :, None])[..., 0])
