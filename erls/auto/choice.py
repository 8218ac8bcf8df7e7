"""``effects = "auto"``: which effects may be left out within a tolerance, decided before the run.

Deciding costs coarse looks at the scene before the run, and a certificate after it. Both, and the run itself, are
estimated by counting (`erls.auto.cost`); where the run saves less than that, all effects stay. Vibrations that
prescribed motions set off need no look (`erls.auto.forced`): where they do not matter, links follow statically.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from erls.auto.certify import FEWEST
from erls.auto.coordinates import same_start
from erls.auto.cuts import Cut, possible_cuts
from erls.auto.operations import operations
from erls.auto.probe import coarse_run, deformation, difference, look_steps, needed, resolved, too_coarse
from erls.auto.purse import Purse
from erls.auto.resolution import Vibrations
from erls.auto.static import may_follow, static_cut
from erls.equations.formulation import Formulation
from erls.equations.registry import formulate
from erls.errors import Cause, SimulationError
from erls.mechanism.chain import Mechanism
from erls.mechanism.without_effects import with_rigid, without
from erls.run.chain.run import ChainRun
from erls.scene.chain import Scene

BUDGET = 0.3  # of the tolerance: what a coarse run may overlook is in the rest


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

    @property
    def bandwidth(self) -> float:
        """Below all vibrations [Hz], where links follow statically; 0 where they vibrate."""
        return max((cut.bandwidth for cut in self.cuts), default=0.0)

    def applied(self, whole: Mechanism) -> Mechanism:
        """The mechanism with what was decided."""
        less = with_rigid(without(whole, self.off), self.rigid)
        return replace(less, bandwidth=self.bandwidth) if self.bandwidth else less


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
    if mechanism.touches:
        return Choice(note="effects: auto leaves nothing out where contacts or stops act: small changes decide impacts")
    cuts = possible_cuts(mechanism, settings.formulation)
    if not cuts:
        return Choice(note="effects: auto leaves nothing out: nothing that the scene holds would save anything")
    try:
        formulation = formulate(mechanism, settings)
        purse = Purse(scene, formulation) if thrifty else None
        if purse is not None and not purse.may_pay:
            return Choice(note=_TOO_SHORT)
        return _chosen(scene, formulation, cuts, purse)
    except SimulationError as problem:
        if problem.cause == Cause.INTERRUPTED:
            raise
        return Choice(note=f"effects: auto leaves nothing out, the coarse run failed ({problem})")


_TOO_SHORT = "effects: all kept: the whole run costs less than deciding"


def _chosen(scene: Scene, formulation: Formulation, cuts: list[Cut], purse: Purse | None) -> Choice:
    settings, mechanism = scene.record.simulation, formulation.mechanism
    found, start = needed(settings, formulation)
    resolution = resolved(settings, found)
    count = look_steps(settings, resolution)
    if purse is not None:
        purse.spent += purse.amplitudes
        purse.followed = resolution.count(settings.duration, FEWEST)
        purse.set_calm(resolution.calm)
    following = _following(scene, formulation, found, purse)
    if following is not None:
        return following
    if purse is not None:
        price = purse.look(purse.cost, count)
        best = max(purse.saved(cut.applied(mechanism)) for cut in cuts)
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
    if purse is not None and choice.cuts and purse.saved(choice.applied(mechanism)) < purse.certificate:
        return Choice(note="effects: all kept: what could be left out saves less than its certificate costs")
    if not choice.cuts and looks.passed:
        return Choice(note=_TOO_SHORT)
    return replace(choice, note=_told(choice.cuts, settings.effects_tolerance))


def _following(scene: Scene, formulation: Formulation, found: Vibrations, purse: Purse | None) -> Choice | None:
    """All links following statically, where that is within the tolerances and pays."""
    settings, mechanism = scene.record.simulation, formulation.mechanism
    if found.forced is None or not may_follow(mechanism, settings):
        return None
    cut = static_cut(scene, formulation, found.forced)
    if cut is None or not _Room(settings.effects_tolerance, settings.effects_effort_tolerance).take(cut):
        return None
    if purse is not None and purse.saved(cut.applied(mechanism)) <= purse.certificate:
        return None
    return Choice((cut,), _told((cut,), settings.effects_tolerance))


@dataclass
class _Looks:
    """Looks at cuts, one after the other, as long as they may pay."""

    scene: Scene
    whole: ChainRun
    count: int
    room: _Room
    purse: Purse | None
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
            price = self.purse.look(operations(less), self.count) + self.purse.comparison
            after = self.purse.saved(Choice((*self.taken, cut)).applied(mechanism))
            gain = after - self.purse.won - (0.0 if self.taken else self.purse.certificate)
            if not self.purse.affords(price) or gain < price:
                self.passed = True
                return
            self.purse.spent += price
        s = self.whole.solution
        start = (s.y[0], s.v[0]) if same_start(mechanism, less) else None
        found = difference(self.whole, coarse_run(self.scene, less, self.count, start, self.whole))
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
