"""How far off a link is that is linear in its own frame: what its computed motion says about second order.

Two things are left out. Points do not come nearer when the link bends: the second-order displacement u₂ = ½ qᵀΨq
(foreshortening, ½∫w'²dx of a beam). And loads do no work on it, so that compression does not soften nor tension
stiffen: with G the stiffness that interface loads F, inertia and weight make of it,

    G = -Σ F·Ψ + (a - g)·S + α·P - ω_c ω_d W_cd        (S, P, W: `fe_import.modal.second_order.SecondOrder`),

r = qᵀGq / qᵀΩ²q is the load relative to the one that would buckle the link in the shape that it has. A deflection δ is
then wrong by δ |r|, and vibrations run out of step by ½ ω ∫r dt, which moves them by 2 δ at most. With σ for ω times
the share of δ that vibrates, σ² = max |q̇|² / max |q|², the estimate is

    max |u₂| + δ (max |r| + min(2, ½ σ max |∫r dt|)),

times the lever that links beyond make of it. A link whose modal model knows no second order is taken to bend as
`erls.run.watches.assumed_bow` says. The estimate tells the size: on the L-shaped pendulums, the two-link robot and the
fast slider-crank in 1 to 8 pieces it lies within a factor of 2.5 of the distance from exact beams.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from erls.maths.so3 import Array
from erls.mechanism.links import Link, node_shape6
from erls.mechanism.second_order import LinkSecondOrder
from erls.run.watches.assumed_bow import assumed_second_order

_SMALL = 1e-3  # of the largest strain energy: r means nothing below it


@dataclass(frozen=True)
class LinkMotion:
    """Motion of a link at k times, in the axes of its frame.

    Attributes
    ----------
    times : (k,) array
        [s]
    modal, rates : (k, m) arrays
        Modal coordinates q, and q̇.
    omega, alpha, pull : (k, 3) arrays
        Angular velocity and acceleration of the frame, acceleration of its origin less that of gravity.
    loads : (k, 6 i) array
        Forces [N] and moments [N m] of joints on the interfaces.
    """

    times: Array
    modal: Array
    rates: Array
    omega: Array
    alpha: Array
    pull: Array
    loads: Array


@dataclass(frozen=True)
class DeflectionError:
    """What second order is estimated to make of a link's motion.

    Attributes
    ----------
    error : float
        Estimated error of its points [m].
    deflection : float
        Largest displacement of a node, against the inboard interface, or the mean of a link that loops hold, times the
        lever of the links beyond [m].
    shortening : float
        Largest second-order displacement of a node against the inboard interface, times the same lever [m].
    load : float
        Largest load relative to the one that would buckle the link in its shape; 0.1 is 10 %.
    drift : float
        Largest phase by which vibrations run out of step, in rad.
    assumed : bool
        Whether second-order displacements are assumed, those of the link being unknown.
    """

    error: float
    deflection: float
    shortening: float
    load: float
    drift: float
    assumed: bool = False


def deflection_error(link: Link, motion: LinkMotion, closed: bool, reach: float) -> DeflectionError | None:
    """Estimate of the error of a link; None for a rigid one.

    Parameters
    ----------
    link : Link
    motion : LinkMotion
    closed : bool
        Whether a loop holds its outer end too: it then deflects against its mean, else against its inboard interface.
    reach : float
        Largest distance from its inboard interface to what it carries [m].
    """
    second = link.second_order or (assumed_second_order(link) if link.elastic_modes else None)
    if not link.elastic_modes or second is None:
        return None
    elastic, model = motion.modal[:, 6:], link.model
    clamped = elastic @ _tangent(link).T
    held = np.hstack([np.zeros((len(elastic), 6)), elastic]) if closed else clamped
    lever = max(1.0, reach / max(float(np.linalg.norm(np.ptp(model.nodes, axis=0))), 1e-9))
    deflection = lever * float(np.linalg.norm(model.translation_shapes @ held.T, axis=1).max())
    nodes = np.array(sorted({*second.field.nodes.tolist(), link.inboard.node}), dtype=np.int64)
    shortening = lever * float(np.linalg.norm(second.displacements(nodes, clamped), axis=-1).max(initial=0.0))
    strain = elastic**2 @ link.stiffness
    frames = motion.modal[:, :6] - held[:, :6]
    work = _load_work(link, second, motion, frames, held)
    ratio = work / np.maximum(strain, _SMALL * strain.max(initial=0.0) + 1e-300)
    steps = np.diff(motion.times)
    area = np.concatenate([[0.0], np.cumsum((ratio[1:] + ratio[:-1]) / 2 * steps)])
    amplitude = np.sqrt((elastic**2).sum(axis=1).max()) or 1.0
    sigma = float(np.sqrt((motion.rates[:, 6:] ** 2).sum(axis=1).max()) / amplitude)
    load, drift = float(np.abs(ratio).max()), 0.5 * sigma * float(np.ptp(area))
    error = float(shortening + deflection * (load + min(2.0, drift)))
    return DeflectionError(error, deflection, shortening, load, drift, link.second_order is None)


def _tangent(link: Link) -> Array:
    """(m, n) modal coordinates per elastic one, with the inboard interface at rest."""
    rows = np.vstack(node_shape6(link.model, link.inboard.node))
    return np.vstack([-np.linalg.solve(rows[:, :6], rows[:, 6:]), np.eye(link.elastic_modes)])


def _load_work(link: Link, second: LinkSecondOrder, motion: LinkMotion, frames: Array, held: Array) -> Array:
    """(k,) qᵀGq at q = ``held`` (k, m), in axes turned against the link's frame by rigid-body coordinates (k, 6)."""
    rotation = node_shape6(link.model, link.inboard.node)[1][:, :6]
    turn = np.eye(3) + np.cross(np.eye(3), (frames @ rotation.T)[:, None])
    pairs = (held[:, :, None] * held[:, None]).reshape(len(held), -1)

    def turned(vectors: Array) -> Array:
        return np.asarray(np.einsum("kji,kj->ki", turn, vectors))

    def work(forces: Array, stiffness: Array) -> Array:
        """Of forces (k, n) with the stiffness that a unit of each makes (n, m, m)."""
        return np.asarray((forces * (pairs @ stiffness.reshape(len(stiffness), -1).T)).sum(axis=1))

    omega = turned(motion.omega)
    squares = (omega[:, :, None] * omega[:, None]).reshape(-1, 9)
    result = work(np.hstack([turned(motion.pull), turned(motion.alpha)]), second.momentum)
    result -= work(squares, second.spin.reshape(9, *second.spin.shape[2:]))
    for number, interface in enumerate(link.model.interface_nodes):
        load = motion.loads[:, 6 * number : 6 * number + 6]
        if interface.node != link.inboard.node and load.any():
            result -= work(np.hstack([turned(load[:, :3]), turned(load[:, 3:])]), second.node(interface.node))
    return result
