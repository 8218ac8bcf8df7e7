"""What an integration needs to go on as though it had never ended: its memory, and who keeps it.

Rules for an integrator whose runs can be resumed:

1. What it knows between two steps lies in arrays and numbers that `Remembering.memory` gives by name; `restore` puts
   them back, bit for bit. What follows from the system and the options alone is made again.
2. `Keeping` offers the memory after each look of the observer, once the recorder has dropped what need not be kept. A
   keeper that takes it copies it: the arrays change with the next step.
3. Nothing that depends on when it was offered may influence a step.
4. An integrator that cannot do this offers nothing, and its runs cannot be resumed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from erls.errors import Cause, SceneError

if TYPE_CHECKING:
    from erls.integrate.base import Leg
    from erls.integrate.driver import Recorder
    from erls.maths.so3 import Array

Memory = Mapping[str, NDArray[Any]]
"""Arrays of float64 or int64 by name; names of nested integrations are joined by dots."""

_LEG = "leg"


class Keeper(Protocol):
    """Who keeps the memory of an integration."""

    memory: Memory | None
    """What the integration goes on from; None from the start."""

    def offer(self, memory: Callable[[], Memory]) -> None:
        """A memory to keep, for who asks now."""


class Remembering(Protocol):
    """What knows something between two steps."""

    resumable: bool
    """Whether ``memory`` holds all of it."""

    def memory(self) -> Memory:
        """What it knows."""

    def restore(self, memory: Memory) -> None:
        """Know that again."""


class Method(Remembering, Protocol):
    """A method that can advance over one leg."""

    def begin(self, leg: Leg, y: Array, v: Array, a: Array) -> None:
        """Stand at the start of a leg, unless it is restored inside of one."""

    def finish(self, leg: Leg) -> tuple[Array, Array]:
        """Add the knots after the first one of a leg; the state at its end. Raises `SimulationError` when it cannot."""


class Keeping:
    """What keeps the memory of a walk over legs.

    Parameters
    ----------
    keeper : Keeper or None
    recorder : Recorder
    method : Remembering
    """

    def __init__(self, keeper: Keeper | None, recorder: Recorder, method: Remembering) -> None:
        self._keeper = keeper if method.resumable else None
        self._recorder, self._method = recorder, method
        self._leg, self._resumed = 0, -1
        if self._keeper is not None:
            recorder.kept_by(self._offer)
            found = self._keeper.memory
            if found is not None:
                self._resumed = count(found, _LEG)

    def resumes(self, leg: int) -> bool:
        """Whether that leg is the one to go on in, whose memory then is restored."""
        self._leg = leg
        if leg != self._resumed:
            return False
        assert self._keeper is not None
        assert self._keeper.memory is not None
        self._method.restore(self._keeper.memory)
        self._recorder.restore(self._keeper.memory)
        return True

    def passed(self, leg: int) -> bool:
        """Whether that leg was finished before."""
        return leg < self._resumed

    def _offer(self) -> None:
        assert self._keeper is not None
        self._keeper.offer(
            lambda: {_LEG: np.array([self._leg]), **self._recorder.memory(), **self._method.memory()}
        )


class Within:
    """The keeper of an integration inside another one, which adds what it knows itself.

    Parameters
    ----------
    outer : Keeper
    more : callable
        What the other one knows.
    memory : Memory or None
        Of the inner one.
    """

    def __init__(self, outer: Keeper, more: Callable[[], Memory], memory: Memory | None) -> None:
        self._outer, self._more, self.memory = outer, more, memory

    def offer(self, memory: Callable[[], Memory]) -> None:
        """Both together."""
        self._outer.offer(lambda: {**self._more(), **memory()})


def time_of(keeper: Keeper | None) -> float | None:
    """Time up to which an integration that goes on was looked at; None from the start."""
    if keeper is None or keeper.memory is None:
        return None
    return float(taken(keeper.memory, "time", np.zeros(1))[0])


def count(memory: Memory, name: str) -> int:
    """One whole number, not negative."""
    found = int(taken(memory, name, np.zeros(1, dtype=np.int64))[0])
    if found < 0:
        raise unfit(name, found)
    return found


def flat(array: NDArray[Any]) -> NDArray[Any]:
    """An array as a `Memory` holds it: complex numbers as pairs."""
    return array.view(np.float64).reshape(*array.shape, 2) if array.dtype.kind == "c" else array


def recall(memory: Memory, name: str, into: NDArray[Any]) -> None:
    """Put an array back where it was."""
    place = flat(into)
    place[...] = taken(memory, name, place)


def taken(memory: Memory, name: str, like: NDArray[Any], axis: int | None = None) -> NDArray[Any]:
    """An array of the type and shape of another one, of any length along ``axis``.

    Raises
    ------
    SceneError
        RUN_FILE.
    """
    found = memory.get(name)
    if found is None:
        raise unfit(name, "missing")
    shapes = [list(found.shape), list(like.shape)]
    if axis is not None and len(shapes[0]) == len(shapes[1]):
        for shape in shapes:
            shape[axis] = 0
    if found.dtype != like.dtype or shapes[0] != shapes[1]:
        raise unfit(name, f"{found.dtype} {found.shape}")
    return found


def unfit(name: str, value: Any) -> SceneError:
    """The error for a memory of something else."""
    message, remedy = "what a checkpoint holds does not fit these equations", "run the scene again without --resume"
    return SceneError(Cause.RUN_FILE, message, where=name, value=value, remedy=remedy)
