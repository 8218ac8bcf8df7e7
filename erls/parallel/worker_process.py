"""What a worker process does (`erls.parallel.workers`): call functions that it is sent, in the order they come in.

Messages are pickles of (number, what), over the standard streams, which nobody else holds. To the worker: a call
(number, pickled function and argument), or (`STOP`, None) and (`GO`, None), which set and reset what `stopped` tells.
From it: (number, (pickled result, error)), of which one is None.
"""

from __future__ import annotations

import os
import pickle
import signal
import sys
import threading
import traceback
from queue import SimpleQueue
from typing import IO, Any

from fe_import.errors import ReportedError

STOP, GO = -1, -2
_stopped = threading.Event()
_inside = threading.Event()


def stopped() -> bool:
    """Whether the calls of this worker are of no use any more."""
    return _stopped.is_set()


def inside() -> bool:
    """Whether this process is a worker."""
    return _inside.is_set()


def serve() -> None:
    """Work until the other side closes the stream of calls."""
    _inside.set()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is left to the process that started this one
    answers_to = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what libraries print must not come between the answers
    calls: SimpleQueue[tuple[int, bytes]] = SimpleQueue()
    answers: SimpleQueue[tuple[int, tuple[bytes | None, BaseException | None]]] = SimpleQueue()
    threading.Thread(target=_read, args=(sys.stdin.buffer, calls), daemon=True).start()
    threading.Thread(target=_write, args=(answers_to, answers), daemon=True).start()
    while True:
        number, call = calls.get()
        answers.put((number, _answer(call)))


def _read(stream: IO[bytes], calls: SimpleQueue[tuple[int, bytes]]) -> None:
    """Beside the work, so that `STOP` is heard during it."""
    while True:
        try:
            number, call = pickle.load(stream)
        except (EOFError, OSError, pickle.UnpicklingError):
            os._exit(0)
        if number == GO:
            _stopped.clear()
        elif number == STOP:
            _stopped.set()
        else:
            calls.put((number, call))


def _write(stream: IO[bytes], answers: SimpleQueue[Any]) -> None:
    """Beside the work, which need not wait until answers are read."""
    while True:
        try:
            pickle.dump(answers.get(), stream, pickle.HIGHEST_PROTOCOL)
            stream.flush()
        except OSError:
            os._exit(0)


def _answer(call: bytes) -> tuple[bytes | None, BaseException | None]:
    try:
        function, argument = pickle.loads(call)
        return pickle.dumps(function(argument), pickle.HIGHEST_PROTOCOL), None
    except ReportedError as problem:
        return None, problem  # pickled without the run that it may carry
    except MemoryError:
        return None, MemoryError()
    except BaseException as problem:  # an error of the program: told there as it would be here
        return None, RuntimeError(f"{problem!r} in a worker process:\n{traceback.format_exc()}")
