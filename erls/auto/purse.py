"""Whether deciding what to leave out pays: operations against operations (`erls.auto.operations`)."""

from __future__ import annotations

from erls.auto import certify, probe
from erls.auto.operations import (
    CALL,
    CALM,
    EFFORT,
    FIXED,
    FOLLOWING,
    ITERATIONS,
    PREPARE,
    REACTION,
    STATE,
    Operations,
    operations,
)
from erls.auto.outputs import driven_joints, reacting
from erls.auto.pilot import count_steps
from erls.auto.static import may_follow
from erls.equations.formulation import Formulation
from erls.mechanism.chain import Mechanism
from erls.scene.chain import Scene

_IN_VAIN = 0.08  # of the run: what looks may cost that find nothing to leave out
_FOLLOWED = 4  # iterations of a step of the certificate


class Purse:
    """Operations: of the run, of what was spent on looks, and what they won."""

    def __init__(self, scene: Scene, formulation: Formulation) -> None:
        self.settings, self.mechanism = scene.record.simulation, formulation.mechanism
        self.cost = operations(self.mechanism)
        self.steps = count_steps(scene, self.mechanism)
        self.forced = may_follow(self.mechanism, self.settings)
        freed = reacting(self.mechanism, self.settings) is not None
        self.effort = (EFFORT if freed else REACTION) if driven_joints(self.mechanism) else 0
        self.spent = self.won = 0.0
        self.followed = certify.FEWEST
        self.set_calm(self.forced)

    def set_calm(self, calm: bool) -> None:
        """Whether steps need few iterations."""
        fixed = self.settings.integrator == "generalized_alpha"  # others are counted as they are
        self.iterations = CALM if calm and fixed else ITERATIONS

    @property
    def may_pay(self) -> bool:
        """Whether the shortest decision costs less than the run."""
        if self.forced:
            vain = self.amplitudes > _IN_VAIN * (self.run + CALL * FIXED)
            return not vain and self.certificate + self.amplitudes < self.run - self.cost.calls(FOLLOWING)
        shortest = self.look(self.cost, probe.FEWEST) + self.comparison
        return self.affords(shortest) and self.certificate + shortest < self.run

    @property
    def run(self) -> float:
        """With all effects."""
        return self.steps * self.cost.step(self.iterations)

    @property
    def certificate(self) -> float:
        """Of what was left out."""
        looks = 2 * (certify.PLACES * STATE + certify.EFFORTS * self.effort + PREPARE)
        step = _FOLLOWED * self.cost.iteration + self.cost.evaluation
        return self.followed * step + self.cost.calls(looks) + self.amplitudes

    @property
    def amplitudes(self) -> float:
        """Of what prescribed motions set off."""
        return self.cost.forced if self.forced else 0.0

    def look(self, cost: Operations, count: int) -> float:
        """One coarse run."""
        return count * cost.coarse_step + cost.calls(PREPARE)

    @property
    def comparison(self) -> float:
        """Of two coarse runs."""
        return self.cost.calls(2 * (probe.PLACES * STATE + probe.EFFORTS * self.effort))

    def affords(self, price: float) -> bool:
        """Whether looks may cost so much more, when this one finds nothing to leave out."""
        return self.spent + price <= _IN_VAIN * self.run + self.won / 2

    def saved(self, less: Mechanism) -> float:
        """By the mechanism without what was chosen."""
        if less.bandwidth is not None:
            return self.run - self.cost.calls(FOLLOWING)
        return self.run - self.steps * operations(less).step(self.iterations)
