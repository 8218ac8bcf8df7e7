"""What a caller of a simulation asks for beside its scene."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from erls.run.chain.run import ChainRun
from erls.run.watches.progress import Checkpoint, Progress


@dataclass(frozen=True)
class Asked:
    """The arguments of `erls.simulation.simulate.simulate`, which says what they mean."""

    progress: Callable[[float, float], None] | None
    tell: Callable[[str], None]
    checkpoint: Path | None
    strict: bool
    like: ChainRun | None
    verdict: bool = True

    def watches(self) -> list[Progress | Checkpoint]:
        """What looks at each run on the caller's behalf."""
        found: list[Progress | Checkpoint] = [] if self.progress is None else [Progress(self.progress)]
        if self.checkpoint is not None:
            found.append(Checkpoint(self.checkpoint))
        return found
