"""Scene in, run out: the one door to a simulation."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from erls.equations.loops.closed_chain import ClosedChain
from erls.equations.registry import FORMULATIONS, TREES, formulate
from erls.equations.substructures import solved
from erls.errors import SceneError, SimulationError
from erls.integrate.base import Options, Solution
from erls.integrate.choice import compile_kernels, integrator
from erls.maths.jit import announcing
from erls.mechanism.chain import Mechanism
from erls.run.events import Stopper, cut
from erls.run.file import self_contained, write_run
from erls.run.record import Run
from erls.run.watches.deflection_range import deflection_errors, deflection_warnings
from erls.run.watches.impulses import impulse_warnings
from erls.run.watches.mass import indefinite_mass
from erls.run.watches.runaway import Runaway
from erls.run.watches.small_displacements import range_warnings
from erls.run.watches.spin_stability import missing_stiffening, planned_spin_warnings, spin_warnings
from erls.run.watches.stored_output import output_step, output_warnings
from erls.scene.build import Message, build_mechanism
from erls.scene.chain import Scene
from erls.scene.read import load_chain
from fe_import.description.link import LinkDescription
from fe_import.files.toml import choose
from fe_import.modal.file import ModalModel

Progress = Callable[[float, float], None]  # (time, duration)

CHECKPOINT_S = 20.0  # a killed run loses at most this much work


def simulate(
    scene: Scene | Path | str,
    *,
    progress: Progress | None = None,
    tell: Message = lambda text: None,
    checkpoint: Path | None = None,
    strict: bool = False,
    like: Run | None = None,
) -> Run:
    """Simulate a scene.

    Parameters
    ----------
    scene : Scene, Path or str
    progress : callable, optional
        Called with (time, duration) after each step.
    tell : callable, optional
        Told about each preparation that takes time, and every warning as soon as it is known.
    checkpoint : Path, optional
        Run file to which a long run saves what it has, every 20 s of work.
    strict : bool
        With ``effects = "auto"``: whether to repeat the run where what was left out passes the tolerance, and to fail
        where its own estimate still does.
    like : Run, optional
        A run of a scene with the same links, whose modal models serve again instead of being read. Where links are
        split, it is of the nodal formulation if the scene is.

    Returns
    -------
    Run

    Raises
    ------
    SceneError, FEImportError
        Bad input: names file, field, value and remedy.
    SimulationError
        The integration failed or was interrupted: says when, why and what to try. What was computed is in its
        attribute ``run``.

    Examples
    --------
    >>> import erls
    >>> scene = erls.load_scene("data/l_shape/steel_tall.toml", ["simulation.duration=0.01"])
    >>> run = erls.simulate(scene)
    >>> bool(run.position("tip", 0.01)[2] < 0)
    True
    """
    if not isinstance(scene, Scene):
        scene = load_chain(scene)
    settings = scene.record.simulation
    choose(settings.formulation, FORMULATIONS, f"{scene.path}: simulation.formulation", SceneError)
    built = build_mechanism(scene, tell) if like is None else build_mechanism(scene, tell, *models_of(like))
    scene = self_contained(scene)  # whatever becomes of the tables that it names while it runs
    warn = _Warnings(tell)
    warn((*built.warnings, *impulse_warnings(built.mechanism, settings.duration)))

    def run_with(scene: Scene, mechanism: Mechanism) -> Run:
        return _integrated(scene, mechanism, warn.beside(), progress, checkpoint)

    if settings.effects == "auto":
        from erls.auto.automatic import automatic  # here: most runs need none of it

        if built.mechanism.bandwidth is None:
            return automatic(scene, built.mechanism, run_with, tell, strict)
        from erls.run.all_modes import with_all_modes

        runs: list[Run] = []

        def run_reduced(scene: Scene, mechanism: Mechanism) -> Run:
            runs.append(run_with(scene, replace(mechanism, bandwidth=built.mechanism.bandwidth)))
            return with_all_modes(runs[-1])

        found = automatic(scene, replace(built.mechanism, bandwidth=None), run_reduced, tell, strict)
        return replace(runs[-1], warnings=found.warnings, certificate=found.certificate)
    return run_with(scene, built.mechanism)


def models_of(run: Run) -> tuple[list[ModalModel], list[LinkDescription | None], list[list[ModalModel]]]:
    """Modal models of the links of a run, descriptions, and modal models of their pieces, for `build_mechanism`."""
    links = run.formulation.mechanism.links
    pieces = [[piece.model for piece in link.pieces] for link in links]
    return [link.model for link in links], [link.description for link in links], pieces


class _Warnings:
    """Warnings so far, each told once."""

    def __init__(self, tell: Message) -> None:
        self.tell = tell
        self.told: list[str] = []

    def __call__(self, texts: Iterable[str]) -> None:
        for text in texts:
            if text not in self.told:
                self.told.append(text)
                self.tell(f"warning: {text}")

    def beside(self) -> _Warnings:
        """For one of several runs of a scene: with what is known before it."""
        result = _Warnings(self.tell)
        result.told += self.told
        return result


def _integrated(
    scene: Scene, mechanism: Mechanism, warn: _Warnings, progress: Progress | None, checkpoint: Path | None
) -> Run:
    """Run a mechanism as the scene says."""
    settings = scene.record.simulation
    modal = settings.formulation in TREES
    planned = planned_spin_warnings(mechanism, settings.duration) if modal else []
    warn((*missing_stiffening(mechanism), *planned) if modal else ())
    formulation = formulate(mechanism, settings)
    with announcing(warn.tell):
        compile_kernels(formulation, settings)
    y, v = formulation.initial_state()
    if isinstance(chain := solved(formulation), ClosedChain):
        warn(chain.warnings)
    step = None if settings.integrator in ("lobatto", "auto") else settings.step  # what they need follows the tolerance
    options = Options(
        step,
        settings.rtol,
        settings.atol,
        settings.spectral_radius,
        tolerance=settings.tolerance,
        output_step=output_step(settings),
    )
    begun = saved = time.perf_counter()

    def make_run(solution: Solution) -> Run:
        return Run(scene, formulation, solution, time.perf_counter() - begun, tuple(warn.told))

    first = True
    stops = {event.name for event in scene.record.events if event.stop}
    looked_for = stops or (scene.record.events and settings.output_step is not None)
    stopper = Stopper(make_run, stops)
    runaway = Runaway(formulation, every=1 if settings.output_step is not None else 16) if modal else None

    def observe(t: float, knots: Callable[[], Solution]) -> Sequence[float]:
        nonlocal first, saved
        found = stopper.look(knots()) if looked_for else ()
        if runaway is not None:
            runaway.pass_by(knots)
        if first:
            first = False
            warn(knots().warnings)
        if progress is not None:
            progress(t, settings.duration)
        if checkpoint is not None and time.perf_counter() - saved > CHECKPOINT_S:
            try:
                write_run(checkpoint, make_run(knots()), "unfinished")
            except SceneError as problem:  # a full disk may have room again at the end
                warn.tell(f"warning: no checkpoint: {problem}")
            saved = time.perf_counter()
        return found

    times = (0.0, settings.duration)
    solution = integrator(mechanism, settings)(formulation, times, y, v, options, observe)
    if stopper.happened is not None:
        solution = cut(solution, stopper.happened.time)
        warn.tell(f"event {stopper.happened.name!r} at t = {stopper.happened.time:.6g} s: the run ends")
    if solution.choice:
        warn.tell(f"integrator: {solution.choice}")
    if runaway is not None and runaway.ended is None:
        solution = runaway.judged(solution)
    gone = None if runaway is None else runaway.ended
    if gone is not None:
        solution = cut(solution, gone)
    run = make_run(solution)
    seen = run.series(run.looks(101))
    warn(solution.warnings)
    if gone is None:
        errors = deflection_errors(run)
        run = replace(run, second_order_error=sum(e.error for e in errors.values()))
        warn((*range_warnings(run, seen), *deflection_warnings(run, errors), *output_warnings(run)))
    if mechanism.bandwidth is not None and gone is None:
        from erls.run.watches.static_following import static_warnings  # here: most runs need none of it

        warn(static_warnings(formulation, solution, settings.effects_tolerance))
    if step is None and any(joint.drive.torque_limit < np.inf for joint in mechanism.joints):
        from erls.run.watches.motor_limits import limit_warnings

        warn(limit_warnings(formulation, solution, settings.tolerance))
    if modal and not planned and any(j.drive.reference(0.0) is None for j in mechanism.joints):
        warn(spin_warnings(mechanism, zip(seen.times.tolist(), seen.coordinates, seen.rates, strict=True)))
    run = replace(run, warnings=tuple(warn.told))
    failure = (modal and indefinite_mass(formulation, solution)) or solution.failure
    if failure:
        failure.run = run
        raise failure
    return run


__all__ = ["SimulationError", "simulate"]
