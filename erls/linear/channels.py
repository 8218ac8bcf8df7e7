"""Inputs and outputs of a linear model by name, ``subject.NAME.quantity``: what both have in common."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

from erls.errors import Cause, SceneError
from erls.linear.plants import Plant, unknown


class Kind(Protocol):
    """A kind of channel: ``subject.NAME.quantity``, or ``subject.NAME`` without a quantity."""

    @property
    def subject(self) -> str:
        """First part of its name."""

    @property
    def quantity(self) -> str:
        """Last part of its name."""

    @property
    def names(self) -> Callable[[Plant], Sequence[str]]:
        """Of what there is one."""

    @property
    def unit(self) -> Callable[[Plant, str], str]:
        """Of a plant and a name."""


K = TypeVar("K", bound=Kind)


@dataclass(frozen=True)
class Bound(Generic[K]):
    """One channel of a plant."""

    kind: K
    subject: str
    unit: str

    @property
    def name(self) -> str:
        """As it is asked for."""
        return f"{self.kind.subject}.{self.subject}.{self.kind.quantity}".rstrip(".")


B = TypeVar("B")


def bound(plant: Plant, kinds: Iterable[K], make: Callable[[K, str, str], B]) -> list[B]:
    """All channels of some kinds that a plant has."""
    return [make(kind, name, kind.unit(plant, name)) for kind in kinds for name in kind.names(plant)]


def checked(what: str, names: Sequence[str], known: list[str]) -> Sequence[str]:
    """Names that are known, each once.

    Raises
    ------
    SceneError
        BAD_REFERENCE.
    """
    for k, name in enumerate(names):
        if name not in known:
            raise unknown(what, name, known)
        if name in names[:k]:
            raise SceneError(Cause.BAD_REFERENCE, f"this {what} is named twice", where=what, value=name, remedy="once")
    return names
