"""``effects = "auto"``: which effects may be left out within a tolerance, decided before the run.

Deciding costs coarse looks at the scene before the run, and a certificate after it. Both, and the run itself, are
estimated by counting (`erls.selection.cost`); where the run saves less than that, all effects stay.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from erls.errors import Cause, SimulationError
from erls.formulations import formulate
from erls.mechanism.chain import Mechanism
from erls.mechanism.effects import with_rigid, without
from erls.run import Run
from erls.scene import Scene
from erls.selection import certify, probe
from erls.selection.coordinates import same_start
from erls.selection.cost import CALM, ITERATIONS, PREPARE, STATE, Cost, cost_of, count_steps, effort_cost
from erls.selection.cuts import Cut, possible_cuts
from erls.selection.probe import coarse_run, deformation, difference, look_steps, needed, too_coarse

BUDGET = 0.3  # of the tolerance: what a coarse run may overlook is in the rest
_IN_VAIN = 0.08  # of the run: what looks may cost that find nothing to leave out
_FOLLOWED = 4  # iterations of a step of the certificate


@dataclass(frozen=True)
class Choice:
    """What ``auto`` decided.

    Attributes
    ----------
    cuts : tuple of Cut
        What to leave out.
    note : str
        What the user should know.
    """

    cuts: tuple[Cut, ...] = ()
    note: str = ""

    @property
    def off(self) -> frozenset[str]:
        """Effects to leave out."""
        return frozenset(name for cut in self.cuts for name in cut.off)

    @property
    def rigid(self) -> frozenset[str]:
        """Links to make rigid."""
        return frozenset(cut.link for cut in self.cuts if cut.link)

    def applied(self, whole: Mechanism) -> Mechanism:
        """The mechanism with what was decided."""
        return with_rigid(without(whole, self.off), self.rigid)


def choose_effects(scene: Scene, mechanism: Mechanism, thrifty: bool = True) -> Choice:
    """Decide what to leave out.

    Parameters
    ----------
    scene : Scene
        With the tolerances.
    mechanism : Mechanism
        With all effects among which to choose.
    thrifty : bool
        Whether what is left out has to save more than deciding costs.

    Raises
    ------
    SimulationError
        INTERRUPTED.
    """
    settings = scene.record.simulation
    cuts = possible_cuts(mechanism, settings.formulation)
    if not cuts:
        return Choice(note="effects: auto leaves nothing out: nothing that the scene holds would save anything")
    try:
        purse = _Purse(scene, mechanism) if thrifty else None
        if purse is not None and not purse.may_pay:
            return Choice(note=_TOO_SHORT)
        return _chosen(scene, mechanism, cuts, purse)
    except SimulationError as problem:
        if problem.cause == Cause.INTERRUPTED:
            raise
        return Choice(note=f"effects: auto leaves nothing out, the coarse run failed ({problem})")


_TOO_SHORT = "effects: all kept: the whole run costs less than deciding"


class _Purse:
    """Estimated times [s]: of the run, of what was spent on looks, and what they won."""

    def __init__(self, scene: Scene, mechanism: Mechanism) -> None:
        self.scene, self.mechanism = scene, mechanism
        formulation = formulate(mechanism, scene.record.simulation)
        self.cost = cost_of(formulation)
        self.steps = count_steps(scene, mechanism)
        self.effort = effort_cost(formulation)
        self.spent = self.won = 0.0
        self.followed, self.iterations = certify.FEWEST, ITERATIONS

    @property
    def may_pay(self) -> bool:
        """Whether the shortest decision costs less than the run."""
        shortest = self.look(self.cost, probe.FEWEST) + self.comparison
        return self.affords(shortest) and self.certificate + shortest < self.run

    @property
    def run(self) -> float:
        """With all effects."""
        return self.steps * self.cost.step(self.iterations)

    @property
    def certificate(self) -> float:
        """Of what was left out."""
        places = 2 * (certify.PLACES * STATE + certify.EFFORTS * self.effort + PREPARE)
        step = _FOLLOWED * self.cost.iteration + self.cost.evaluation
        return self.followed * step + places * self.cost.links

    def look(self, cost: Cost, count: int) -> float:
        """One coarse run."""
        return count * cost.coarse_step + PREPARE * cost.links

    @property
    def comparison(self) -> float:
        """Of two coarse runs."""
        return 2 * (probe.PLACES * STATE + probe.EFFORTS * self.effort) * self.cost.links

    def affords(self, price: float) -> bool:
        """Whether looks may cost so much more, when this one finds nothing to leave out."""
        return self.spent + price <= _IN_VAIN * self.run + self.won / 2

    def saved(self, choice: Choice) -> float:
        """By leaving out what was chosen."""
        cost = cost_of(formulate(choice.applied(self.mechanism), self.scene.record.simulation))
        return self.run - self.steps * cost.step(self.iterations)


def _chosen(scene: Scene, mechanism: Mechanism, cuts: list[Cut], purse: _Purse | None) -> Choice:
    settings = scene.record.simulation
    resolution, start = needed(scene, mechanism)
    count = look_steps(settings, resolution)
    if purse is not None:
        purse.followed = resolution.count(settings.duration, certify.FEWEST)
        if resolution.calm and settings.integrator == "generalized_alpha":
            purse.iterations = CALM
        price = purse.look(purse.cost, count)
        best = max(purse.saved(Choice((cut,))) for cut in cuts)
        if not purse.affords(price + purse.comparison) or best < purse.certificate + price + purse.comparison:
            return Choice(note=_TOO_SHORT)
        purse.spent += price
    whole = coarse_run(scene, mechanism, count, start)
    if whole.solution.failure is not None:
        raise whole.solution.failure
    if too_coarse(whole, count):
        return Choice(note="effects: all kept: the motion is too fast for a coarse look at it")
    room = _Room(settings.effects_tolerance, settings.effects_effort_tolerance)
    looks = _Looks(scene, whole, count, room, purse)
    for cut in cuts:
        looks.consider(cut)
    choice = Choice(tuple(looks.taken))
    if purse is not None and choice.cuts and purse.saved(choice) < purse.certificate:
        return Choice(note="effects: all kept: what could be left out saves less than its certificate costs")
    if not choice.cuts and looks.passed:
        return Choice(note=_TOO_SHORT)
    return replace(choice, note=_told(choice.cuts, settings.effects_tolerance))


@dataclass
class _Looks:
    """Looks at cuts, one after the other, as long as they may pay."""

    scene: Scene
    whole: Run
    count: int
    room: _Room
    purse: _Purse | None
    taken: list[Cut] = field(default_factory=list)
    passed: bool = False  # whether a look would have cost too much

    def consider(self, cut: Cut) -> None:
        """Take a cut when it fits beside those that were taken."""
        mechanism = self.whole.formulation.mechanism
        before = Choice(tuple(self.taken))
        if "flexibility" in before.off or (cut.off and cut.off <= before.off):
            return  # nothing of it is left
        if (cut.link or "flexibility" in cut.off) and deformation(self.whole, cut.link) > self.room.error:
            return
        less = cut.applied(mechanism)
        if self.purse is not None:
            cost = cost_of(formulate(less, self.scene.record.simulation))
            price = self.purse.look(cost, self.count) + self.purse.comparison
            after = self.purse.saved(Choice((*self.taken, cut)))
            gain = after - self.purse.won - (0.0 if self.taken else self.purse.certificate)
            if not self.purse.affords(price) or gain < price:
                self.passed = True
                return
            self.purse.spent += price
        s = self.whole.solution
        start = (s.y[0], s.v[0]) if same_start(mechanism, less) else None
        found = difference(self.whole, coarse_run(self.scene, less, self.count, start))
        measured = replace(cut, error=found.error, effort_error=found.effort_error or 0.0)
        if self.room.take(measured):
            self.taken.append(measured)
            if self.purse is not None:
                self.purse.won = after


def affordable(cuts: Iterable[Cut], tolerance: float, effort_tolerance: float) -> tuple[Cut, ...]:
    """Cuts whose errors add up to no more than a share of the tolerances, in the order given."""
    room = _Room(tolerance, effort_tolerance)
    taken: list[Cut] = []
    for cut in cuts:
        off = Choice(tuple(taken)).off
        if "flexibility" not in off and not (cut.off and cut.off <= off) and room.take(cut):
            taken.append(cut)
    return tuple(taken)


class _Room:
    """What is left of the tolerances."""

    def __init__(self, tolerance: float, effort_tolerance: float) -> None:
        self.error, self.effort_error = BUDGET * tolerance, BUDGET * effort_tolerance

    def take(self, cut: Cut) -> bool:
        """Whether there is room; takes it if so."""
        if cut.error > self.error or cut.effort_error > self.effort_error:
            return False
        self.error, self.effort_error = self.error - cut.error, self.effort_error - cut.effort_error
        return True


def _told(cuts: tuple[Cut, ...], tolerance: float) -> str:
    if not cuts:
        return "effects: auto leaves nothing out: the tolerance does not allow it"
    return f"effects: auto leaves out {', '.join(map(str, cuts))}; tolerance {tolerance:.2g} m"
