"""What a run says of its own range: how far off its links are, being linear in their own frames."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import cast

import numpy as np

from erls.equations.formulation import Formulation, Reaction, State, TreeFormulation
from erls.equations.loops.closed_chain import ClosedChain
from erls.equations.quasi_static.formulation import QuasiStatic
from erls.equations.quick import quick
from erls.equations.registry import TREES
from erls.equations.serial.state_series import StateSeries
from erls.equations.substructures import Substructured, solved
from erls.errors import SimulationError
from erls.integrate.base import hermite
from erls.maths.so3 import Array, cross
from erls.mechanism.chain import Mechanism, poses
from erls.run.chain.run import ChainRun
from erls.run.watches.base import NOTHING, Ended, Finding, Watch
from erls.run.watches.deflection_estimate import DeflectionError, LinkMotion, deflection_error

_SAMPLES, _SAMPLES_OF_LOOPS = 61, 31  # loads of loops take an acceleration of their own
_STEP = 1e-5  # s, of central differences, as in `erls.run.link_loads`
NOTABLE = 2e-3  # of the size of a link: errors above this make a run warn


class DeflectionRange(Watch):
    """Looks at the deflection of links."""

    def after(self, ended: Ended) -> Finding:
        """Errors of all links together, with a warning of those that matter."""
        if ended.meaningless:
            return NOTHING
        errors = deflection_errors(ended.run)
        return Finding(deflection_warnings(ended.run, errors), error=sum(found.error for found in errors.values()))


def deflection_errors(run: ChainRun) -> dict[str, DeflectionError]:
    """Estimated error of every flexible link that is linear in its frame: see `erls.run.watches.deflection_estimate`.

    Parameters
    ----------
    run : ChainRun

    Returns
    -------
    dict of DeflectionError
        By name of link, pieces of a split link together. Empty in the nodal formulation; with geometric stiffening only
        links without it.
    """
    formulation = solved(run.formulation)
    mechanism = formulation.mechanism
    if run.scene.record.simulation.formulation not in TREES:
        return {}
    stiffened = "geometric_stiffening" in mechanism.effects
    links = [
        k
        for k, link in enumerate(mechanism.links)
        if link.elastic_modes and not (stiffened and link.second_order is not None)
    ]
    start, end = float(run.solution.t[0]), run.end
    step = min(_STEP, (end - start) / 4)
    if not links or not step > 0:
        return {}
    times = run.looks(_SAMPLES_OF_LOOPS if isinstance(formulation, ClosedChain) else _SAMPLES, step)
    inner = replace(run, formulation=formulation)
    places = poses(mechanism, np.array([joint.position for joint in mechanism.joints]))
    ends = [end for loop in mechanism.loops for end in (loop.inner, loop.outer)]
    found: dict[int, DeflectionError] = {}
    with np.errstate(all="ignore"):  # a run that failed may hold anything
        try:
            motions = _motions(inner, links, times, step)
        except (SimulationError, np.linalg.LinAlgError):
            return {}
        for k in links:
            closed = any(end.link in mechanism.carried(k) for end in ends)
            error = deflection_error(mechanism.links[k], motions[k], closed, _reach(mechanism, places, k))
            if error is not None and np.isfinite(error.error):
                found[k] = error
    return _of_links(run, mechanism, found)


def deflection_warnings(run: ChainRun, errors: Mapping[str, DeflectionError] | None = None) -> list[str]:
    """Links whose estimated error is more than 0.2 % of their size, with the reason and what to do."""
    result = []
    links = {link.name: link for link in run.formulation.mechanism.links}
    for name, found in (deflection_errors(run) if errors is None else errors).items():
        size = float(np.linalg.norm(np.ptp(links[name].model.nodes, axis=0)))
        if found.error <= NOTABLE * size:
            continue
        more = "more substructures" if links[name].pieces else "substructures = 4 or more (formulation ffr)"
        remedy = f"use {more}, the effects geometric_stiffening and foreshortening, or formulation nodal"
        if found.assumed:
            remedy = (
                "this takes it to bend as a beam between its interfaces, since its second-order displacements are "
                f"{links[name].model.provenance.get('second_order', 'not in its modal file')}"
            )
        result.append(
            f"link {name!r}: expect errors of about {found.error:.2g} m, since it is linear in its own frame: it "
            f"deflects by up to {found.deflection:.2g} m under up to {100 * found.load:.2g} % of the load that would "
            f"buckle it, which makes vibrations run out of step by up to {found.drift:.2g} rad, and comes nearer by up "
            f"to {found.shortening:.2g} m; {remedy}"
        )
    return result


def _motions(run: ChainRun, links: list[int], times: Array, step: float) -> dict[int, LinkMotion]:
    """Motion of some links, with the loads on their interfaces."""
    seen = run.series(np.concatenate([times - step, times, times + step]))
    loads = _loads(run, times, seen)
    gravity = run.formulation.mechanism.gravity
    result = {}
    for k in links:
        frames, q = np.split(seen.poses[k], 3), np.split(seen.modal[k], 3)
        turn = frames[1][:, :3, :3]
        speed = np.einsum("kji,kjl->kil", turn, (frames[2] - frames[0])[:, :3]) / (2 * step)
        change = np.einsum("kji,kjl->kil", turn, (frames[2] - 2 * frames[1] + frames[0])[:, :3]) / step**2
        pull = change[:, :, 3] - np.einsum("kji,j->ki", turn, gravity)
        rates = (q[2] - q[0]) / (2 * step)
        result[k] = LinkMotion(times, q[1], rates, _axial(speed), _axial(change), pull, loads[k])
    return result


def _axial(matrices: Array) -> Array:
    """(k, 3) vectors of the skew parts of (k, 3, 3 or more) matrices."""
    m = matrices
    return np.stack([m[:, 2, 1] - m[:, 1, 2], m[:, 0, 2] - m[:, 2, 0], m[:, 1, 0] - m[:, 0, 1]], axis=1) / 2


def _loads(run: ChainRun, times: Array, seen: StateSeries) -> list[Array]:
    """(k, 6 i) of every link: what the joints on them and closing joints do to its interfaces, in its axes; the middle
    third of the states is at these times.
    """
    formulation, mechanism = run.formulation, run.formulation.mechanism
    nodes = [[i.node for i in link.model.interface_nodes] for link in mechanism.links]
    result = [np.zeros((len(times), len(own), 6)) for own in nodes]
    carriers = any(joint.seat is not None for joint in mechanism.joints)
    if not (carriers or isinstance(formulation, ClosedChain)):
        return [loads.reshape(len(times), -1) for loads in result]
    states = seen.states()[len(times) : 2 * len(times)]

    def add(sample: int, link: int, node: int, force: Array, moment: Array, place: Array) -> None:
        if node in nodes[link]:
            turn, own = states[sample].poses[link][:3, :3].T, _place(states[sample], mechanism, link, node)
            about = moment + cross(place - own, force)
            result[link][sample, nodes[link].index(node)] += np.concatenate([turn @ force, turn @ about])

    s = run.solution
    y_all, v_all = hermite(s.t, s.y, s.v, s.a, times)
    for sample, (t, y, v) in enumerate(zip(times.tolist(), y_all, v_all, strict=True)):
        if carriers:
            for k, reaction in enumerate(_reactions(formulation, t, y, v)):
                joint = mechanism.joints[k]
                if joint.seat is not None:
                    place = _place(states[sample], mechanism, k, mechanism.links[k].inboard.node)
                    add(sample, joint.parent, joint.seat.node, -reaction.force, -reaction.moment, place)
        if isinstance(formulation, ClosedChain):
            for loop, given in zip(mechanism.loops, formulation.loop_forces(t, y, v), strict=True):
                for end, sign in ((loop.outer, 1.0), (loop.inner, -1.0)):
                    if end.link is not None:
                        add(sample, end.link, end.node, sign * given.force, sign * given.moment, given.place)
    return [loads.reshape(len(times), -1) for loads in result]


def _reactions(formulation: Formulation, t: float, y: Array, v: Array) -> list[Reaction]:
    """In the joints, with the acceleration from the compiled equations of a tree, where it has any."""
    if isinstance(formulation, (ClosedChain, QuasiStatic)):
        return formulation.reactions(t, y, v)
    tree = cast(TreeFormulation, formulation)
    equations = quick(tree)
    force = equations.residual(t, y, v, np.zeros(len(y)))
    return tree.reactions_at(t, y, v, np.linalg.solve(equations.mass_matrix(t, y), -force))


def _place(state: State, mechanism: Mechanism, link: int, node: int) -> Array:
    """(3,) world position of a node, to first order in its displacement."""
    model, frame = mechanism.links[link].model, state.poses[link]
    local = model.nodes[node] + model.translation_shapes[node] @ state.modal[link]
    return np.asarray(frame[:3, :3] @ local + frame[:3, 3])


def _reach(mechanism: Mechanism, places: list[Array], number: int) -> float:
    """Largest distance from the inboard interface of a link to a node of it or of a link beyond, at the start [m]."""
    frame = places[number]
    start = frame[:3, :3] @ mechanism.links[number].inboard.position + frame[:3, 3]
    return max(
        float(np.linalg.norm(link.model.nodes @ at[:3, :3].T + at[:3, 3] - start, axis=1).max())
        for link, at in ((mechanism.links[k], places[k]) for k in mechanism.carried(number))
    )


def _of_links(run: ChainRun, mechanism: Mechanism, found: dict[int, DeflectionError]) -> dict[str, DeflectionError]:
    """By name of link; of the pieces of one link errors and shortenings add up, and the rest is the largest."""
    if not isinstance(run.formulation, Substructured):
        return {mechanism.links[k].name: error for k, error in found.items()}
    result = {}
    for link, own in zip(run.formulation.mechanism.links, run.formulation.parts.links, strict=True):
        some = [found[k] for k in own if k in found]
        if some:
            result[link.name] = DeflectionError(
                sum(e.error for e in some),
                max(e.deflection for e in some),
                sum(e.shortening for e in some),
                max(e.load for e in some),
                max(e.drift for e in some),
                any(e.assumed for e in some),
            )
    return result
