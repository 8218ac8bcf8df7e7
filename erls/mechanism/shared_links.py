"""Links that variants of a mechanism have in common: what was found of one serves the others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from erls.mechanism.chain import Mechanism
from erls.mechanism.links import Link, Payload


def sharing_links(mechanism: Mechanism, known: Mechanism) -> Mechanism:
    """A mechanism with the links of another one where they are the same."""
    if len(mechanism.links) != len(known.links):
        return mechanism
    pairs = zip(mechanism.links, known.links, strict=True)
    return replace(mechanism, links=tuple(old if same_link(new, old) else new for new, old in pairs))


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
