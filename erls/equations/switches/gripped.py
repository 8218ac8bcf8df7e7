"""Contacts whose points may stick, in systems in flat memory: trees, and trees that loops close."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from erls.equations.compiled_system import RESIDUAL
from erls.equations.serial.contacts import Flat, friction_laws, seen_places
from erls.equations.series import residuals_leaving
from erls.equations.switches.grips import NO_GRIPS, Grips, Touch
from erls.maths.calls import handed
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from fe_import.model import IntArray


def gripping(mechanism: Mechanism) -> list[int]:
    """Numbers of the contacts whose points may stick."""
    return [k for k, contact in enumerate(mechanism.contacts) if contact.sticks]


def grips_in(mechanism: Mechanism, system: Flat, residual: Callable[..., Any]) -> Grips:
    """Their modes, among the constants of a system whose links move as ``residual`` says."""
    numbers = gripping(mechanism)
    if not numbers:
        return NO_GRIPS
    laws, contacts = friction_laws(system), [mechanism.contacts[k] for k in numbers]
    places, address = seen_places(system)[numbers].ravel(), handed(residual, RESIDUAL)

    def look(t: Array, y: Array, v: Array) -> Touch:
        return _touch(system, address, places, t, y, v)

    return Grips(contacts, [laws[k] for k in numbers], look)


def _touch(system: Flat, address: Any, places: IntArray, t: Array, y: Array, v: Array) -> Touch:
    found = residuals_leaving(address, system.reals, system.integers, system.scratch, t, y, v, places)
    return Touch.of(found.reshape(len(t), -1, 5))


@contextmanager
def lent(grips: Grips, mechanism: Mechanism, system: Flat) -> Iterator[None]:
    """Another system of the same mechanism has their modes meanwhile."""
    every = friction_laws(system) if grips.names else []
    laws = [every[k] for k in gripping(mechanism)] if every else []
    before = [law.copy() for law in laws]
    try:
        for law, own in zip(laws, grips.laws, strict=True):
            law[:] = own
        yield
    finally:
        for law, own in zip(laws, before, strict=True):
            law[:] = own
