"""Contacts of nodes whose points may stick: their modes among the constants of a nodal system."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np

from erls.equations.switches.grips import NO_GRIPS, Grips, Touch, held_point
from erls.maths.so3 import Array

if TYPE_CHECKING:
    from erls.equations.nodal.assembly import NodalSystem
    from erls.equations.nodal.chain import ChainSystem

_FRICTION, _GAP, _SLIP = 19, 0, 11  # columns of `Model.contacts`, and of `NodalSystem.in_contacts`


def nodal_grips(system: ChainSystem) -> Grips:
    """Modes at what is stored of knots."""
    contacts = system.kinds.contacts.contacts
    numbers = [k for k, contact in enumerate(contacts) if contact.sticks]
    if not numbers:
        return NO_GRIPS

    def look(t: Array, y: Array, v: Array) -> Touch:
        found = [system.in_contacts(*system.from_stored(*at))[numbers] for at in zip(y, v, strict=True)]
        return Touch.of(np.array(found)[..., [_GAP, *range(_SLIP, _SLIP + 4)]])

    laws = [system.model.contacts[k, _FRICTION:] for k in numbers]
    return Grips([held_point(contacts[k]) for k in numbers], laws, look)


@contextmanager
def contacts_of(one: NodalSystem, other: NodalSystem) -> Iterator[None]:
    """One system has the modes of contacts of another one meanwhile."""
    laws, before = one.model.contacts, one.model.contacts.copy()
    try:
        laws[:] = other.model.contacts
        yield
    finally:
        laws[:] = before
