"""A mechanism at frozen configurations: rigid links where their motion has them, at some times.

Elements are those of `erls.equations.nodal`, whose stiffness in the axes of the nodes does not depend on where links
are (V. Sonneville, A. Cardona, O. Brüls, 2014): one matrix serves all times, and joints alone depend on them. A small
displacement of all nodes, in their own axes, is

    u = Z r + w,

r twists of the links with their inboard nodes, w what links deform, zero there. What does not depend on sections of
beams is here: Z, the rows B of the joints (B u = 0), the strains of elements per displacement.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from erls.equations.nodal.assembly import NodalSystem
from erls.equations.nodal.equations import Nodal
from erls.equations.nodal.joints import Joint
from erls.equations.nodal.parts import BeamRules
from erls.equations.registry import closed_start_of, formulate
from erls.equations.serial.state_series import state_series
from erls.maths import motion_maps as motions
from erls.maths.saddle import dense
from erls.maths.se3 import pose
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.links import Link, truncated
from erls.optimization.rigid import RigidMotion
from erls.run.chain.node_motion import node_poses as node_poses_of
from erls.run.chain.run import ChainRun
from erls.scene.settings import Simulation
from fe_import.model import IntArray


def rules_of(settings: Simulation) -> BeamRules:
    """How beams become elements: as in a nodal scene; of others so that they bend as modal models do, exactly."""
    if settings.formulation == "nodal":
        return BeamRules(settings.residual_bending_flexibility, settings.inertia_interpolation == "linear")
    return BeamRules(residual_bending_flexibility=True)


def of_beams(link: Link) -> bool:
    """Whether a link is known by beams, or is rigid; others are known by their modes alone."""
    return not link.elastic_modes or (link.description is not None and link.description.frame is not None)


def _rigid(link: Link) -> Link:
    """A link as it would be if it did not deform."""
    none = np.zeros(0)
    kept = link.invariants.truncated(np.arange(6))
    return replace(link, model=truncated(link.model, 0), invariants=kept, stiffness=none, damping=none)


def nodal_of(mechanism: Mechanism, settings: Simulation) -> Nodal:
    """The mechanism as nodal elements; links that are not made of beams are rigid ones there."""
    if not all(of_beams(link) for link in mechanism.links):
        links = tuple(link if of_beams(link) else _rigid(link) for link in mechanism.links)
        mechanism = replace(mechanism, links=links)
    if settings.formulation == "nodal":
        found = formulate(mechanism, settings)
        assert isinstance(found, Nodal)
        return found
    return Nodal(mechanism, start=closed_start_of(mechanism) if mechanism.loops else None, rules=rules_of(settings))


@dataclass(frozen=True)
class Frozen:
    """Of a mechanism at k times; N nodes, L links, e elements, m rows of joints.

    Attributes
    ----------
    times : (k,) array
    frames : (k, L, 4, 4) array
        Of the inboard nodes of rigid links.
    local : (N, 4, 4) array
        Nodes from the inboard nodes of their links, undeformed.
    links : (N,) array
        Of which link each node is.
    roots : (L,) array
        Inboard nodes.
    carried : (6 N, 6 L) array
        Z.
    joints : NodalSystem
        The joints alone; coordinates that nothing prescribes or ties are held.
    ends : (e, 2) array
        Nodes of elements.
    strains : (e, 6, 12) array
        Twist of an element, from one end to the other, per displacement of its nodes.
    lengths : (e,) array
    sections : (e, 2, 4, 4) array
        At the ends of elements, in their nodes.
    straight : (e, 6) array
        Twists of elements without force.
    """

    times: Array
    frames: Array
    local: Array
    links: IntArray
    roots: IntArray
    carried: Array
    joints: NodalSystem
    ends: IntArray
    strains: Array
    lengths: Array
    sections: Array
    straight: Array

    @cached_property
    def rows(self) -> Array:
        """(k, m, 6 N) B."""
        poses = self.frames[:, self.links] @ self.local
        each = zip(self.times.tolist(), poses, strict=True)
        return np.array([dense(self.joints.constraint_matrix(t, self.joints.at(own))) for t, own in each])

    def twists(self, poses: Array) -> Array:
        """(k, e, 6) of elements beyond those without force, at poses (k, N, 4, 4), however far links have turned."""
        ends = poses[:, self.ends] @ self.sections
        return np.asarray(motions.log(motions.inverse(ends[:, :, 0]) @ ends[:, :, 1]) - self.straight)

    @property
    def places(self) -> IntArray:
        """(e, 12) of the displacements of an element's nodes among all."""
        return np.asarray((6 * self.ends[..., None] + np.arange(6)).reshape(len(self.ends), 12))

    @property
    def flexible(self) -> IntArray:
        """Places of what may deform: of all nodes but the inboard ones."""
        nodes = np.setdiff1d(np.arange(len(self.links)), self.roots)
        return np.asarray((6 * nodes[:, None] + np.arange(6)).ravel())


def frozen(mechanism: Mechanism, nodal: Nodal, times: Array) -> Frozen:
    """Of a mechanism.

    Parameters
    ----------
    mechanism : Mechanism
    nodal : Nodal
        Of it.
    times : (k,) array

    Raises
    ------
    SceneError, SimulationError
        As of `RigidMotion`.
    """
    rigid, chain = RigidMotion(mechanism, times), nodal.chain
    links = np.concatenate([np.full(s.stop - s.start, k, dtype=np.int64) for k, s in enumerate(chain.nodes)])
    roots = np.array([nodal.place_of(k, link.inboard.node) for k, link in enumerate(mechanism.links)], dtype=np.int64)
    start = chain.system.start.poses
    local = motions.inverse(start[roots][links]) @ start
    frames = rigid.frames @ np.array([pose(position=link.inboard.position) for link in mechanism.links])
    carried = np.zeros((6 * len(links), 6 * len(roots)))
    for n, k in enumerate(links.tolist()):
        carried[6 * n : 6 * n + 6, 6 * k : 6 * k + 6] = motions.adjoint_inverse(local[n])
    return Frozen(times, frames, local, links, roots, carried, _held(nodal, rigid), *_strains(nodal))


def _strains(nodal: Nodal) -> tuple[IntArray, Array, Array, Array, Array]:
    """Nodes, strains per displacement, lengths, sections and twists without force of all elements.

    P is that of `erls.equations.nodal.beam_forces`, where T⁻¹(±d) = 1 ± ad(d)/2 since elements are straight.
    """
    beams = nodal.chain.beams
    if beams is None:
        none = np.zeros((0, 6, 12)), np.zeros(0), np.zeros((0, 2, 4, 4)), np.zeros((0, 6))
        return np.zeros((0, 2), dtype=np.int64), *none
    d = np.zeros((len(beams.nodes), 6))
    d[:, 0] = beams.length
    half = motions.bracket(d) / 2
    inner, outer = (motions.adjoint_inverse(beams.frames[:, side]) for side in range(2))
    first, second = -(np.eye(6) - half) @ inner, (np.eye(6) + half) @ outer
    return beams.nodes, np.concatenate([first, second], axis=2), beams.length, beams.frames, beams.built


def _held(nodal: Nodal, rigid: RigidMotion) -> NodalSystem:
    """The joints alone; those that nothing prescribes or ties are held at the rigid motion."""
    chain = nodal.chain
    joints: list[Joint] = list(chain.system.rows.joints)
    for k in range(len(nodal.mechanism.joints)):
        if joints[k].motion is None and joints[k].type != "fixed" and k not in rigid.following:
            joints[k] = replace(joints[k], motion=_through(rigid.times, rigid.coordinates[:, k]))
    return NodalSystem(chain.system.start.poses, [], joints)


def _through(times: Array, values: Array) -> Callable[[float], tuple[float, float, float]]:
    return lambda t: (float(np.interp(t, times, values)), 0.0, 0.0)


def node_poses(run: ChainRun, times: Array, nodal: Nodal) -> Array:
    """(k, N, 4, 4) of the nodes of elements in the world, in a run of any formulation.

    Parameters
    ----------
    run : ChainRun
    times : (k,) array
    nodal : Nodal
        Elements of the run's mechanism.
    """
    own = run.formulation
    y, v = run.coordinates(times)
    if isinstance(own, Nodal):
        return own.system.poses_stored(y)
    states = state_series(own, times, y, v)
    result = np.zeros((len(times), nodal.system.count, 4, 4))
    start = nodal.chain.system.start.poses
    for k, (nodes, link) in enumerate(zip(nodal.chain.nodes, nodal.mechanism.links, strict=True)):
        root = nodal.place_of(k, link.inboard.node)
        places = (motions.inverse(start[root]) @ start[nodes])[:, :3, 3] + link.inboard.position
        apart = np.linalg.norm(link.model.nodes[:, None] - places, axis=2)
        result[:, nodes] = node_poses_of(own.mechanism, states, k, apart.argmin(axis=0))
    return result
