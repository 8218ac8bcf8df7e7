"""The process behind a co-simulation unit: ``python -m erls.fmi.serve RESOURCES``, with a socket as its stdin.

What is asked and answered is told in ``sources/unit.c``.
"""

from __future__ import annotations

import os
import socket
import struct
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from erls.errors import Cause, SceneError
from erls.fmi.channels import Channels
from erls.run.chain.run import ChainRun
from erls.run.file import load_run
from erls.simulation.stepper import Saved, Stepper
from fe_import.errors import ReportedError

RUN = "start.run.h5"
"""Among the resources of a unit: a run that holds the scene and the modal models of its links."""

_NUMBER = struct.Struct("=Q")


def stepper_of(resources: Path) -> Stepper:
    """The mechanism of a unit at its start.

    Raises
    ------
    ReportedError
        Resources that are damaged.
    """
    run = load_run(resources / RUN)
    assert isinstance(run, ChainRun)  # no other is packed
    mechanism = run.formulation.mechanism
    return Stepper(run.scene, models=[mechanism.links[k].model for k in mechanism.bodies])


class Served:
    """A mechanism, its states that are kept, and what is asked of both.

    Parameters
    ----------
    stepper : Stepper
    """

    def __init__(self, stepper: Stepper) -> None:
        self._stepper, self._channels = stepper, Channels(stepper)
        self._start, self._kept, self._count = stepper.save(), dict[int, Saved](), 0
        inputs = len(self._channels.inputs)
        self.asked: dict[bytes, tuple[int, Callable[[bytes], bytes]]] = {
            b"b": (0, lambda data: self._go(self._start)),
            b"s": (8 * (2 + inputs), self._step),
            b"v": (0, self._keep),
            b"g": (_NUMBER.size, lambda data: self._go(self._known(data))),
            b"f": (_NUMBER.size, self._forget),
        }
        """Bytes that come with each letter, and what it does."""

    def _outputs(self) -> bytes:
        return self._channels.read().astype("=f8").tobytes()

    def _step(self, data: bytes) -> bytes:
        t, h, *values = np.frombuffer(data).tolist()
        self._channels.step(t, h, np.array(values))
        return self._outputs()

    def _keep(self, data: bytes) -> bytes:
        self._count += 1
        self._kept[self._count] = self._stepper.save()
        return _NUMBER.pack(self._count)

    def _known(self, data: bytes) -> Saved:
        (number,) = _NUMBER.unpack(data)
        if number not in self._kept:
            message, remedy = "no such state is kept", "set states that this instance gave, and did not forget"
            raise SceneError(Cause.BAD_REFERENCE, message, where="state", value=number, remedy=remedy)
        return self._kept[number]

    def _forget(self, data: bytes) -> bytes:
        self._known(data)
        del self._kept[_NUMBER.unpack(data)[0]]
        return b""

    def _go(self, saved: Saved) -> bytes:
        self._stepper.restore(saved)
        return self._outputs()


def serve(door: Any, resources: Path) -> None:
    """Answer until nobody asks any more.

    Parameters
    ----------
    door : socket
    resources : Path
        Of the unit.
    """
    try:
        served = Served(stepper_of(resources))
    except ReportedError as problem:
        door.sendall(_said(problem))
        return
    door.sendall(_answer(0, ""))
    while letter := _taken(door, 1):
        size, does = served.asked[letter]
        data = _taken(door, size)
        if len(data) < size:
            return
        try:
            door.sendall(_answer(0, "", does(data)))
        except ReportedError as problem:
            door.sendall(_said(problem))


def _said(problem: ReportedError) -> bytes:
    return _answer(1, str(problem))


def _answer(status: int, text: str, more: bytes = b"") -> bytes:
    said = text.encode()
    return struct.pack("=II", status, len(said)) + said + more


def _taken(door: Any, size: int) -> bytes:
    """That many bytes; fewer where the other side has gone."""
    parts, left = [], size
    while left:
        part = door.recv(left)
        if not part:
            break
        parts.append(part)
        left -= len(part)
    return b"".join(parts)


def main() -> None:
    """Serve the socket that is stdin."""
    door = socket.socket(fileno=os.dup(0))
    try:
        serve(door, Path(sys.argv[1]))
    except (BrokenPipeError, ConnectionResetError, KeyboardInterrupt):
        pass  # the program that asked has ended
    finally:
        door.close()


if __name__ == "__main__":
    main()
