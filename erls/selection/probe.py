"""How large each effect is in a scene, from coarse runs: with everything, and without one effect at a time.

A coarse run takes large steps with strong numerical damping: rigid motion is followed, vibrations that the steps do not
resolve follow statically. Its own error is common to the runs with and without an effect, and cancels in first order
from their difference.
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import dataclass

import msgspec
import numpy as np

from erls.effects import in_order
from erls.errors import Cause
from erls.formulations import formulate, integrator
from erls.formulations.substructures import solved
from erls.integrators.base import Array, Options, hermite
from erls.mechanism.chain import Mechanism
from erls.mechanism.effects import present, with_rigid, without
from erls.mechanism.links import link_mass_properties
from erls.mechanism.substructures import is_split
from erls.run import Run
from erls.scene import Scene
from erls.selection.coordinates import kept_places
from erls.selection.outputs import Outputs, effort_error, largest_distance, watched_nodes
from erls.selection.quick import quick

STEPS = 120
SAMPLES = 60
RADIUS = 0.3
_FORCES = 20  # knots at which forces are compared
_REPEATS, _CALLS = 9, 20


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
        Part of the time of an evaluation of the equations of motion that leaving it out saves; None unless measured.
    link : str
        Of ``flexibility``: the one link that it is about; empty for all of them.
    """

    name: str
    present: bool
    force: float = 0.0
    error: float = 0.0
    effort_error: float | None = None
    share: float | None = None
    link: str = ""


def effect_sizes(
    scene: Scene, mechanism: Mechanism, names: Iterable[str], measure: bool = False
) -> tuple[EffectSize, ...]:
    """Sizes of effects in a scene; flexibility also link by link, where several are flexible.

    Parameters
    ----------
    scene : Scene
    mechanism : Mechanism
        With all effects among which to choose.
    names : iterable of str
    measure : bool
        Whether to measure shares of run time as well.

    Raises
    ------
    SimulationError
        The coarse run with all effects failed.
    """
    there = present(mechanism)
    whole = coarse_run(scene, mechanism)
    if whole.failure is not None:
        raise whole.failure
    expected = _Curves(scene, whole)
    result = []
    for name in in_order(names):
        if name not in there:
            result.append(EffectSize(name, False))
            continue
        cuts = [("", without(mechanism, {name}))]
        if name == "flexibility":
            cuts += [(link, with_rigid(mechanism, {link})) for link in flexible_links(mechanism)]
        for link, less in cuts:
            run = coarse_run(scene, less)
            share = _share(whole, run) if measure else None
            force, error, effort = _force(whole, run), np.inf, None
            if run.failure is None:
                found = _Curves(scene, run)
                error = largest_distance(expected.positions, found.positions)
                effort = effort_error(expected.efforts, found.efforts)
            result.append(EffectSize(name, True, force, float(error), effort, share, link))
    return tuple(result)


def flexible_links(mechanism: Mechanism) -> list[str]:
    """Links that may be made rigid alone: the flexible ones of several, none of which is split."""
    names = [link.name for link in mechanism.links if link.elastic_modes]
    return names if len(names) > 1 and not is_split(mechanism) else []


def coarse_run(scene: Scene, mechanism: Mechanism) -> Run:
    """A run in large steps; failures stand in the run."""
    settings = scene.record.simulation
    coarse = msgspec.structs.replace(
        settings, integrator="generalized_alpha", step=settings.duration / STEPS, spectral_radius=RADIUS
    )
    formulation = formulate(mechanism, coarse)
    y, v = formulation.initial_state()
    options = Options(coarse.step, coarse.rtol, coarse.atol, RADIUS, newton_tolerance=1e-9)
    solution = integrator(mechanism, coarse)(formulation, (0.0, settings.duration), y, v, options, None)
    if solution.failure is not None and solution.failure.cause == Cause.INTERRUPTED:
        raise solution.failure
    return Run(scene, formulation, solution)


class _Curves:
    """Points and drive forces of a coarse run at even times."""

    def __init__(self, scene: Scene, run: Run) -> None:
        outputs = Outputs(scene, run.formulation, watched_nodes(run.formulation.mechanism))
        times = np.linspace(0.0, scene.record.simulation.duration, SAMPLES + 1)
        self.positions = [outputs.positions(state) for state in run.states(times)]
        self.efforts: list[Array] = []
        if outputs.driven:
            at, s = times[2::4], run.solution
            states = zip(at.tolist(), *hermite(s.t, s.y, s.v, s.a, at), strict=True)
            self.efforts = [outputs.efforts(*state) for state in states]


def _force(whole: Run, less: Run) -> float:
    """Largest difference of generalized forces along the coarse run; without flexibility, what holds the modes.

    Forces F count as sqrt(μ Fᵀ M⁻¹ F) with the mass μ of all links: one that acts on all mass alike counts as it is,
    whatever the coordinates.
    """
    system, other = quick(solved(whole.formulation)), quick(solved(less.formulation))
    if not hasattr(system, "residual") or not system.size:
        return 0.0
    mass = sum(link_mass_properties(link).mass for link in whole.formulation.mechanism.links)
    s = whole.solution
    kept = kept_places(whole.formulation.mechanism, less.formulation.mechanism, system.size)
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


def _share(whole: Run, less: Run) -> float:
    """Part of the time of an evaluation that is saved: least of several measurements of either, taken in turn."""
    systems = [quick(solved(run.formulation)) for run in (whole, less)]
    if not systems[1].size:
        return 1.0  # nothing is left to integrate
    if not all(hasattr(system, "residual") for system in systems):
        return 0.0
    best = [np.inf, np.inf]
    for _ in range(_REPEATS):
        for k, (system, run) in enumerate(zip(systems, (whole, less), strict=True)):
            s = run.solution
            t, y, v, a = float(s.t[0]), s.y[-1].copy(), s.v[-1].copy(), s.a[-1].copy()
            begun = time.perf_counter()
            for _ in range(_CALLS):
                system.residual(t, y, v, a)
            best[k] = min(best[k], time.perf_counter() - begun)
    return max(0.0, 1 - best[1] / best[0])
