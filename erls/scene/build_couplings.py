"""Couplings of a scene: joint coordinates tied by ratios."""

from __future__ import annotations

import numpy as np

from erls.mechanism.couplings import ELASTIC, IDEAL, Coupling, Term
from erls.mechanism.drives import Drive
from erls.mechanism.joint_types import Freedom, Z
from erls.mechanism.joints import JointForces
from erls.mechanism.loops import Loop, LoopEnd, LoopFreedom
from erls.mechanism.place import Place
from erls.scene.build_contacts import build_stops
from erls.scene.build_joints import angle
from erls.scene.chain import Scene
from erls.scene.check_couplings import coupled_coordinates
from erls.scene.couplings import Coupling as CouplingRecord


def build_couplings(scene: Scene) -> tuple[Loop, ...]:
    """Couplings of a scene as what closes its chain, after all that does so.

    Raises
    ------
    SceneError
        BAD_FIELD: naming file, field, value and remedy.
    """
    known = coupled_coordinates(scene.record)
    return tuple(
        _coupling(record, known, Place(scene.folder, f"{scene.path}: couplings[{k}]", known[record.joint].turns))
        for k, record in enumerate(scene.record.couplings)
    )


def _coupling(record: CouplingRecord, known: dict[str, Freedom], place: Place) -> Loop:
    turns = known[record.joint].turns
    terms = Term(record.joint, 1.0), *(Term(name, -ratio) for name, ratio in record.follows.items())
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
