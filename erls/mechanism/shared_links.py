"""What variants of a mechanism have in common: what was found of one serves the others."""

from __future__ import annotations

from collections.abc import Set
from dataclasses import replace
from typing import Any

import numpy as np

from erls.mechanism.chain import Mechanism
from erls.mechanism.links import Link, Payload


def sharing_links(mechanism: Mechanism, known: Mechanism) -> Mechanism:
    """A mechanism with the links of another one where they are the same."""
    if len(mechanism.links) != len(known.links):
        return mechanism
    pairs = zip(mechanism.links, known.links, strict=True)
    return replace(mechanism, links=tuple(old if same_link(new, old) else new for new, old in pairs))


def differ_in_numbers(mechanism: Mechanism, known: Mechanism) -> bool:
    """Whether all that two mechanisms differ in is where joints start, and how large loads are: the rest is the same
    objects.
    """
    pairs: list[tuple[object, object, Set[str]]] = [(mechanism, known, {"joints", "loads"})]
    for several, others, own in (
        (mechanism.joints, known.joints, {"position", "rate"}),
        (mechanism.loads, known.loads, {"wrench", "axes"}),
    ):
        if len(several) != len(others):
            return False
        pairs += [(one, other, own) for one, other in zip(several, others, strict=True)]
    return all(one is other or _same_but(one, other, own) for one, other, own in pairs) and all(
        one.axes == other.axes for one, other in zip(mechanism.loads, known.loads, strict=True)
    )


def _same_but(one: Any, other: Any, own: Set[str]) -> bool:
    return all(value is vars(other)[name] for name, value in vars(one).items() if name not in own)


def same_link(new: Link, old: Link) -> bool:
    """Whether two links of the same modal model are the same."""
    if new.model is not old.model or new.pieces or old.pieces or len(new.payloads) != len(old.payloads):
        return False
    if (new.name, new.intermediate) != (old.name, old.intermediate) or new.inboard is not old.inboard:
        return False
    one, other = ((x.stiffness, x.damping, x.invariants.m, x.invariants.X, x.invariants.Z) for x in (new, old))
    loads = zip(new.payloads, old.payloads, strict=True)
    return (
        new.description is old.description
        and new.shells is old.shells
        and all(map(np.array_equal, one, other))
        and all(_same_payload(*both) for both in loads)
    )


def _same_payload(new: Payload, old: Payload) -> bool:
    return (
        (new.node, new.mass, new.motor) == (old.node, old.mass, old.motor)
        and np.array_equal(new.offset, old.offset)
        and np.array_equal(new.inertia, old.inertia)
    )
