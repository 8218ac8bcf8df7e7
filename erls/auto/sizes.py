"""How large each effect is in a scene, and what it costs: for the table of ``erls effects``."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from erls.auto.coordinates import kept_places
from erls.auto.cuts import flexible_links, partners
from erls.auto.operations import Operations, operations
from erls.auto.probe import Difference, coarse_run, difference, look_steps, needed, resolved
from erls.equations.formulation import Formulation
from erls.equations.quick import quick
from erls.equations.registry import TREES, formulate
from erls.equations.substructures import solved
from erls.errors import Cause, SimulationError
from erls.mechanism.chain import Mechanism
from erls.mechanism.effects import in_order
from erls.mechanism.links import link_mass_properties
from erls.mechanism.without_effects import present, with_rigid, without
from erls.run.chain.run import ChainRun
from erls.scene.chain import Scene

T = TypeVar("T")
FAILS, UNSTABLE = "fails", "unstable"
_FORCES = 20  # knots at which forces are compared


@dataclass(frozen=True)
class EffectSize:
    """What an effect is in a scene.

    Attributes
    ----------
    name : str
    present : bool
        Whether the scene holds anything of it.
    force : float
        Largest generalized force that goes with it, weighted so that coordinates do not matter [N].
    error : float
        Largest distance of named points without it [m]; infinite where they cannot move without it.
    effort_error : float or None
        Largest difference of drive forces without it, relative to their peak; None where no drive reacts.
    share : float or None
        Part of the operations of an evaluation of the equations of motion that leaving it out saves, with the effects
        that share its products.
    link : str
        Of ``flexibility``: the one link that it is about; empty for all of them.
    outcome : str
        ``FAILS`` or ``UNSTABLE`` where there is no error to tell; else empty.
    """

    name: str
    present: bool
    force: float = 0.0
    error: float = 0.0
    effort_error: float | None = None
    share: float | None = None
    link: str = ""
    outcome: str = ""


def effect_sizes(scene: Scene, mechanism: Mechanism, names: Iterable[str]) -> tuple[EffectSize, ...]:
    """Sizes of effects in a scene; flexibility also link by link, where several are flexible.

    Parameters
    ----------
    scene : Scene
    mechanism : Mechanism
        With all effects among which to choose.
    names : iterable of str

    Raises
    ------
    SimulationError
        The coarse run with all effects failed.
    """
    there = present(mechanism)
    settings = scene.record.simulation
    found, start = needed(settings, formulate(mechanism, settings))
    count = look_steps(settings, resolved(settings, found))
    whole = coarse_run(scene, mechanism, count, start)
    if whole.solution.failure is not None:
        raise whole.solution.failure
    result, limit = [], 2 * _reach(mechanism)
    for name in in_order(names):
        if name not in there:
            result.append(EffectSize(name, False))
            continue
        cuts = [("", without(mechanism, {name}))]
        if name == "flexibility":
            cuts += [(link, with_rigid(mechanism, {link})) for link in flexible_links(mechanism)]
        for link, less in cuts:
            apart, force, share = _size(scene, whole, less, less if link else without(mechanism, partners(name)), count)
            outcome = FAILS if np.isinf(apart.error) else UNSTABLE if not apart.error <= limit else ""
            result.append(EffectSize(name, True, force, apart.error, apart.effort_error, share, link, outcome))
    return tuple(result)


def effect_forces(run: ChainRun) -> dict[str, float]:
    """Largest generalized force that goes with each effect along a run, as `EffectSize.force` [N].

    Of those that it holds anything of; not a number where the equations cannot be solved without it, nothing of runs
    whose equations have no such parts: beam elements, modes that follow statically.
    """
    mechanism, settings = run.formulation.mechanism, run.scene.record.simulation
    if settings.formulation not in TREES or mechanism.bandwidth is not None or len(run.solution.t) < 2:
        return {}

    def force(name: str) -> float:
        return _or_fails(lambda: _force(run, formulate(without(mechanism, {name}), settings)), np.nan)

    there = present(mechanism)
    return {name: force(name) for name in in_order(mechanism.effects) if name in there}


def _size(
    scene: Scene, whole: ChainRun, less: Mechanism, faster: Mechanism, count: int
) -> tuple[Difference, float, float]:
    """Difference, largest force, and share of the operations of an evaluation."""
    settings = scene.record.simulation
    apart = _or_fails(lambda: difference(whole, coarse_run(scene, less, count, whole=whole)), Difference(np.inf, None))
    force = _or_fails(lambda: _force(whole, formulate(less, settings)), np.inf)
    return apart, force, _share(operations(whole.formulation.mechanism), operations(faster))


def _or_fails(value: Callable[[], T], otherwise: T) -> T:
    """A value, or what stands for one where equations without an effect cannot be solved."""
    try:
        return value()
    except SimulationError as problem:
        if problem.cause == Cause.INTERRUPTED:
            raise
        return otherwise


def _reach(mechanism: Mechanism) -> float:
    """Size of all links together [m]: points that are farther apart than twice that left them."""
    return sum(link.size for link in mechanism.links)


def _force(whole: ChainRun, less: Formulation) -> float:
    """Largest difference of generalized forces along a run; without flexibility, what holds the modes.

    Forces F count as sqrt(μ Fᵀ M⁻¹ F) with the mass μ of all links: one that acts on all mass alike counts as it is,
    whatever the coordinates.
    """
    system, other = quick(solved(whole.formulation)), quick(solved(less))
    if not hasattr(system, "residual") or not system.size:
        return 0.0
    mass = sum(link_mass_properties(link).mass for link in whole.formulation.mechanism.links)
    s = whole.solution
    kept = kept_places(whole.formulation.mechanism, less.mechanism, system.size)
    rigid = np.setdiff1d(np.arange(system.size), kept)
    largest = 0.0
    for k in np.unique(np.linspace(1, len(s.t) - 1, _FORCES).astype(int)):
        t, y, v, a = float(s.t[k]), s.y[k].copy(), s.v[k].copy(), s.a[k].copy()
        if len(rigid):
            y[rigid], v[rigid], a[rigid] = 0.0, 0.0, 0.0
            force = system.residual(t, y, v, a)
            force[kept] = 0.0
        else:
            force = system.residual(t, y, v, a) - other.residual(t, y, v, a)
        largest = max(largest, float(force @ np.linalg.solve(system.mass_matrix(t, y), force)))
    return float(np.sqrt(max(mass, 0.0) * largest))


def _share(whole: Operations, less: Operations) -> float:
    """Part of the operations of an evaluation that is saved; all of them where nothing is left to integrate."""
    return 1 - less.evaluation / whole.evaluation if less.size else 1.0
