"""Effects as data of a mechanism: leaving them out, and which of them it holds at all."""

from __future__ import annotations

from collections.abc import Set
from dataclasses import replace
from typing import TypeVar

import numpy as np

from erls.mechanism.chain import Mechanism
from erls.mechanism.effects import EFFECTS
from erls.mechanism.joints import Joint
from erls.mechanism.links import Link, payload_invariants, truncated
from erls.mechanism.loops import Loop, LoopFreedom
from erls.mechanism.thermal import temperature_change, unwarmed

_Acting = TypeVar("_Acting", Joint, LoopFreedom)


def without(mechanism: Mechanism, off: Set[str]) -> Mechanism:
    """The mechanism without some effects.

    Parameters
    ----------
    mechanism : Mechanism
    off : set of str
        Names from `erls.mechanism.effects`. What the equations of motion ask for is taken off the names in
        ``mechanism.effects``; the other effects are taken out of joints, links and gravity as well.
    """
    if not off:
        return mechanism
    return replace(
        mechanism,
        joints=tuple(_joint_without(joint, off) for joint in mechanism.joints),
        links=tuple(_link_without(link, off) for link in mechanism.links),
        loops=tuple(_loop_without(loop, off) for loop in mechanism.loops),
        gravity=np.zeros(3) if "gravity" in off else mechanism.gravity,
        effects=mechanism.effects - off,
    )


def with_rigid(mechanism: Mechanism, links: Set[str]) -> Mechanism:
    """The mechanism with the links of these names rigid."""
    rigid = {"flexibility"}
    return replace(mechanism, links=tuple(_link_without(k, rigid) if k.name in links else k for k in mechanism.links))


def present(mechanism: Mechanism) -> frozenset[str]:
    """Effects that are on and of which the mechanism holds anything; what turning and deformation add to inertia is
    taken to be there whenever a link is flexible.
    """
    links = mechanism.links
    joints: list[Joint | LoopFreedom] = [*mechanism.joints]
    joints += [loop.freedom for loop in mechanism.loops if loop.freedom is not None]
    flexible = any(link.elastic_modes for link in links)
    found = {
        "gravity": bool(mechanism.gravity.any()),
        "modal_damping": any(link.damping.any() for link in links),
        "thermal_expansion": any(temperature_change(link) for link in links),
        "joint_stiffness": any(joint.forces.stiffness for joint in joints),
        "joint_damping": any(joint.forces.damping for joint in joints),
        "joint_friction": any(joint.forces.friction for joint in joints),
        "motor_inertia": any(joint.rotor_inertia for joint in joints),
        "flexibility": flexible,
        "static_correction": flexible and mechanism.bandwidth is not None,
        "geometric_stiffening": (curved := any(link.elastic_modes and link.second_order for link in links)),
        "foreshortening": curved,
        "modal_inertia": curved,
        "payload": any(p.mass or p.inertia.any() for link in links for p in link.payloads if not p.motor),
    }
    return frozenset(name for name in mechanism.effects if found.get(name, flexible or not EFFECTS[name].of_links))


def _loop_without(loop: Loop, off: Set[str]) -> Loop:
    if loop.freedom is None or loop.coupling is not None:  # elasticity is all that a coupling consists of
        return loop
    return replace(loop, freedom=_joint_without(loop.freedom, off))


def _joint_without(joint: _Acting, off: Set[str]) -> _Acting:
    forces = joint.forces
    if "joint_stiffness" in off:
        forces = replace(forces, stiffness=0.0)
    if "joint_damping" in off:
        forces = replace(forces, damping=0.0)
    if "joint_friction" in off:
        forces = replace(forces, friction=0.0, static=0.0)
    return replace(joint, forces=forces, rotor_inertia=0.0 if "motor_inertia" in off else joint.rotor_inertia)


def _link_without(link: Link, off: Set[str]) -> Link:
    if "modal_damping" in off:
        link = replace(link, damping=np.zeros_like(link.damping))
    if not off.isdisjoint({"thermal_expansion", "flexibility"}):
        link = replace(link, model=unwarmed(link.model))
    if "flexibility" in off and link.elastic_modes:
        link = replace(link, model=truncated(link.model, 0), stiffness=np.zeros(0), damping=np.zeros(0), pieces=())
    link = replace(link, pieces=tuple(_link_without(piece, off) for piece in link.pieces))
    if {"payload", "flexibility"}.isdisjoint(off):
        return link
    payloads = tuple(p for p in link.payloads if p.motor or "payload" not in off)
    invariants = link.model.invariants
    for p in payloads:
        invariants = invariants + payload_invariants(link.model, p.node, p.offset, p.mass, p.inertia)
    return replace(link, payloads=payloads, invariants=invariants)
