"""What a caller of a simulation asks for beside its scene."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from erls.run.chain.run import ChainRun
from erls.run.checkpoints import Checkpoints, key_of
from erls.run.watches.base import Watch
from erls.run.watches.checkpoint import Checkpoint
from erls.run.watches.progress import Progress
from erls.scene.records import SceneFile


@dataclass(frozen=True)
class Asked:
    """The arguments of `erls.simulation.simulate.simulate`, which says what they mean."""

    progress: Callable[[float, float], None] | None
    tell: Callable[[str], None]
    checkpoints: Checkpoints | None
    strict: bool
    like: ChainRun | None
    verdict: bool = True
    until: float | None = None
    bending: bool = True  # whether the run looks at how far off links are that bend (`erls.run.watches`)

    def checkpoint(self, scene: SceneFile) -> Checkpoint | None:
        """Of the integration of a scene."""
        return None if self.checkpoints is None else Checkpoint(self.checkpoints, key_of(scene))

    def watches(self, checkpoint: Checkpoint | None) -> list[Watch]:
        """What looks at an integration on the caller's behalf; what is saved is what all others have seen."""
        found: list[Watch] = [] if self.progress is None else [Progress(self.progress)]
        return found if checkpoint is None else [*found, checkpoint]
