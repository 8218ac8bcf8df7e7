"""What the commands share: messages and progress on stderr, JSON on stdout, checks of paths and times."""

from __future__ import annotations

import contextlib
import json
import math
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

Json = Annotated[bool, Parameter(name="--json", negative="")]
Output = Annotated[Path | None, Parameter(name=["--output", "-o"])]
Force = Annotated[bool, Parameter(name="--force", negative="")]


def report_times(text: str, end: float, unit: str = "s") -> list[float]:
    """Times of ``--at``."""
    from erls.errors import Cause, SceneError

    result = []
    for part in (p for p in text.split(",") if p.strip()):
        try:
            value = float(part)
        except ValueError:
            value = float("nan")
        if not 0 <= value <= end:
            raise SceneError(
                Cause.TIME_OUT_OF_RANGE,
                "not a time within the run",
                where="--at",
                value=part.strip(),
                limit=f"0 to {end:g} {unit}".rstrip(),
                remedy=f"give {'times in seconds' if unit else 'load parameters'}, separated by commas",
            )
        result.append(value)
    return result


def remove(path: Path | None) -> None:
    """Delete a file if there is one."""
    if path is not None:
        path.unlink(missing_ok=True)


def peak_memory_mb() -> float | None:
    """Largest memory of this process so far; None where the system does not tell."""
    try:
        import resource
    except ImportError:  # Windows
        return None
    unit = 2**20 if sys.platform == "darwin" else 2**10
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / unit


class Told:
    """What stderr gets: with ``--quiet`` errors and warnings alone, with ``--verbose`` also when."""

    quiet, verbose = False, False
    begun = time.monotonic()


def listen(tokens: list[str]) -> list[str]:
    """Words of a command without ``--quiet`` and ``--verbose``, which all commands take."""
    Told.quiet, Told.verbose, Told.begun = "--quiet" in tokens, "--verbose" in tokens, time.monotonic()
    return [token for token in tokens if token not in ("--quiet", "--verbose")]


def tell(text: str) -> None:
    """A message on stderr; nobody may be listening any more."""
    if Told.quiet and not text.startswith(("error: ", "warning: ")):
        return
    when = f"{time.monotonic() - Told.begun:8.3f} s  " if Told.verbose else ""
    with contextlib.suppress(OSError):
        print(when + text, file=sys.stderr)


def print_json(summary: dict[str, Any]) -> None:
    """One JSON object on stdout."""
    print(json_text(summary))


def json_text(summary: dict[str, Any]) -> str:
    """JSON on one line."""
    return json.dumps(_finite(summary), allow_nan=False)


def _finite(value: Any) -> Any:
    """JSON has no infinities and no NaN, which a run that failed may hold."""
    if isinstance(value, dict):
        return {k: _finite(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(v) for v in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


class Progress:
    """A progress bar on stderr; plain lines where stderr is no terminal."""

    def __init__(self, what: str) -> None:
        self.what = what
        self.bar: Any = None
        self.task: Any = None
        self.told = time.monotonic()
        self.last = 0.0

    def __enter__(self) -> Callable[[float, float], None]:
        if sys.stderr.isatty() and not Told.quiet:
            from rich.console import Console
            from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

            columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.percentage:.0f} %"))
            self.bar = Progress(*columns, TimeRemainingColumn(), console=Console(stderr=True), transient=True)
            self.bar.start()
            self.task = self.bar.add_task(self.what, total=1.0)
        return self.advance

    def advance(self, done: float, total: float) -> None:
        now = time.monotonic()
        share = done / total if total else 1.0
        if self.bar is not None:
            if now - self.last > 0.05:
                self.last = now
                self.bar.update(self.task, completed=share)
        elif now - self.told > 5:
            self.told = now
            tell(f"{self.what}: {100 * share:.0f} %")

    def __exit__(self, *exception: object) -> None:
        if self.bar is not None:
            self.bar.stop()
