"""Couplings of a scene: joint coordinates tied by ratios and cams."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from erls.mechanism.chain import Mechanism
from erls.mechanism.couplings import ELASTIC, IDEAL, Coupling, Term
from erls.mechanism.drives import Drive
from erls.mechanism.joint_types import Freedom, Z
from erls.mechanism.joints import JointForces
from erls.mechanism.loops import Loop, LoopEnd, LoopFreedom
from erls.mechanism.place import Place
from erls.scene.build_cams import build_cam
from erls.scene.build_contacts import build_stops
from erls.scene.build_joints import angle
from erls.scene.build_loops import UNCOUNTED, countable
from erls.scene.chain import Scene
from erls.scene.check_couplings import coupled_coordinates
from erls.scene.couplings import Coupling as CouplingRecord


def build_couplings(scene: Scene, mechanism: Mechanism, loops: Sequence[Loop]) -> tuple[Loop, ...]:
    """Couplings of a scene as what closes its chain, after all that does so.

    Parameters
    ----------
    scene : Scene
    mechanism : Mechanism
        The chain, without what closes it.
    loops : sequence of Loop
        Its closing joints.

    Raises
    ------
    SceneError
        BAD_FIELD: naming file, field, value and remedy.
    """
    known, found = coupled_coordinates(scene.record), list[Loop]()
    uncounted = {
        loop.name for loop in loops if loop.freedom and loop.freedom.may_lose_turns and not countable(mechanism, loop)
    }
    for k, record in enumerate(scene.record.couplings):
        place = Place(scene.folder, f"{scene.path}: couplings[{k}]", known[record.joint].turns)
        tied = _coupling(record, known, place)
        assert tied.coupling is not None
        lost = [term.joint for term in tied.coupling.terms if term.joint in uncounted]
        if lost:
            remedy = "couple a joint of the chain"
            raise place.error("joint" if record.joint in lost else "follows", UNCOUNTED, lost[0], remedy=remedy)
        found.append(tied)
    return tuple(found)


def _coupling(record: CouplingRecord, known: dict[str, Freedom], place: Place) -> Loop:
    turns = known[record.joint].turns
    terms = (Term(record.joint, 1.0), *(Term(name, -ratio) for name, ratio in record.follows.items()))
    if record.cam is not None:
        carrier = known[record.cam.joint].turns
        terms = (*terms, Term(record.cam.joint, -1.0, build_cam(record.cam, place.at("cam"), carrier, turns)))
    tied = Coupling(terms, angle(place, "offset", record.offset, record.offset_deg), turns)
    ground = LoopEnd(None, 0, np.eye(4))
    if not record.elastic:
        return Loop(record.name, IDEAL, ground, ground, coupling=tied)
    forces = JointForces(
        stiffness=record.stiffness or 0.0,
        damping=record.damping,
        stops=build_stops(record.stops, place.at("stops")) if record.stops else None,
    )
    free = LoopFreedom(Freedom(Z, turns), 0.0, forces, 0.0, Drive())
    return Loop(record.name, ELASTIC, ground, ground, free, tied)
