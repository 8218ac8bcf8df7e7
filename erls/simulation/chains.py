"""Runs of chains of joints and links: mechanism, equations of motion, integrator, watches."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial

from erls.accuracy.kernels import kernels_of
from erls.equations.registry import FORMULATIONS, formulate, share
from erls.errors import SceneError
from erls.integrate.base import Solution
from erls.integrate.charts import joined
from erls.integrate.choice import compile_kernels, compiled_steps, compiling_steps, integrator, options_of
from erls.maths.beside import compiling_beside
from erls.maths.jit import announcing
from erls.mechanism.chain import Mechanism
from erls.mechanism.shared_links import sharing_links
from erls.run.chain.run import ChainRun
from erls.run.file import self_contained
from erls.run.watches.base import Begun, Plan
from erls.run.watches.watching import Warnings, Watching
from erls.scene.build import Built, Elements, build_mechanism
from erls.scene.build_joints import led_by_inversion
from erls.scene.chain import Scene
from erls.scene.rebuild import rebuilt, settings_of_mechanism
from erls.simulation.asked import Asked
from erls.simulation.kept import kept_to
from erls.simulation.statements import with_statement
from fe_import.files.toml import choose
from fe_import.modal.model import ModalModel


def run_chain(scene: Scene, asked: Asked) -> ChainRun:
    """Build the mechanism of a scene and run it, with all effects that it names or those that ``auto`` chooses."""
    settings = scene.record.simulation
    choose(settings.formulation, FORMULATIONS, f"{scene.path}: simulation.formulation", SceneError)
    if asked.until is not None:
        from erls.simulation.extension import extended, refuse_time, refuse_unextendable  # here: it runs mechanisms

        refuse_time(settings, asked.until)
    like, tell = asked.like, asked.tell
    found_before: tuple[str, ...] = ()
    if led_by_inversion(scene.record):
        from erls.inverse.feed import fed  # here: few scenes are inverted before they run

        scene, found_before = fed(scene, tell)
    built = build_mechanism(scene, tell) if like is None else build_like(scene, like, tell)
    if scene.record.sensors:
        from erls.run.chain.sensors import with_compliances  # here: scenes without sensors need none of it

        scene = with_compliances(scene, built.mechanism)
    scene = self_contained(scene)  # whatever becomes of the tables that it names while it runs
    if asked.checkpoints is not None:
        links = built.mechanism.links
        asked.checkpoints.identify(scene, [part.model for link in links for part in (link, *link.pieces)])
    warnings = Warnings(tell)
    warnings((*found_before, *built.warnings))
    run = partial(run_mechanism, asked=asked, warnings=warnings)
    if settings.effects == "auto":
        run = partial(run, asked=replace(asked, bending=True))  # its certificate rests on it
        from erls.auto.automatic import automatic  # here: most runs need none of it

        found = automatic(scene, built.mechanism, run, tell, asked.strict)
    else:
        found = run(scene, built.mechanism)
    if asked.until is not None:
        return extended(refuse_unextendable(found, asked.until), asked.until, asked)
    if not asked.verdict:
        return found
    from erls.accuracy.statement import stated  # here: runs without a verdict need none of it

    with announcing(tell):
        found = with_statement(found, stated)
        if asked.strict:
            return kept_to(found, lambda other: run(other, _mechanism(other, found, tell)), tell)
    return found


def _mechanism(scene: Scene, run: ChainRun, tell: Callable[[str], None]) -> Mechanism:
    """That of a run, or one built anew where the scene has other links or settings that enter it."""
    now, before = scene.record, run.scene.record
    if now.links == before.links and settings_of_mechanism(now) == settings_of_mechanism(before):
        return run.formulation.mechanism
    return build_mechanism(scene, tell).mechanism


def models_of(run: ChainRun) -> tuple[list[ModalModel], list[Elements], list[list[ModalModel]]]:
    """Modal models of a run's links, what these are made of, and models of their pieces, for `build_mechanism`."""
    mechanism = run.formulation.mechanism
    links = [mechanism.links[k] for k in mechanism.bodies]
    pieces = [[piece.model for piece in link.pieces] for link in links]
    return [link.model for link in links], [link.description or link.shells for link in links], pieces


def build_like(scene: Scene, like: ChainRun, tell: Callable[[str], None] = lambda text: None) -> Built:
    """The mechanism of a scene whose links and effects are those of a run: modal models serve again, and with them what
    was found of links that are the same to the last payload.
    """
    mechanism = like.formulation.mechanism
    if (found := rebuilt(scene, like.scene.record, mechanism)) is not None:
        return found
    built = build_mechanism(scene, tell, *models_of(like))
    return replace(built, mechanism=sharing_links(built.mechanism, mechanism))


def run_mechanism(
    scene: Scene, mechanism: Mechanism, asked: Asked, warnings: Warnings, before: ChainRun | None = None
) -> ChainRun:
    """Run a mechanism as the scene says, from the end of a run that was before it, if there is one."""
    settings, plan, told = scene.record.simulation, Plan(scene, mechanism, asked.bending), warnings.beside()
    checkpoint = asked.checkpoint(scene)
    watching = Watching(plan, told, asked.watches(checkpoint))
    watching.before()
    later = kernels_of(mechanism, settings) if asked.verdict else ()
    steps = compiled_steps(mechanism, settings)
    with announcing(asked.tell), compiling_beside(*later), compiling_steps(steps):
        formulation = formulate(mechanism, settings)
        if asked.like is not None:
            share(formulation, asked.like.formulation)
        compile_kernels(formulation, settings)
    if before is None:
        start, spent, state = 0.0, 0.0, formulation.initial_state()
    else:
        start, spent, state = before.end, before.wall_s, (before.solution.y[-1], before.solution.v[-1])
    begun = time.perf_counter() - spent - (0.0 if checkpoint is None else checkpoint.spent)

    def run_of(solution: Solution) -> ChainRun:
        whole = joined(None if before is None else before.solution, solution)
        return ChainRun(scene, formulation, whole, time.perf_counter() - begun, tuple(told.texts))

    since = start if checkpoint is None else max(start, checkpoint.since)
    watching.begins(Begun(settings.duration, run_of, plan, formulation, since=since))
    integrate = integrator(mechanism, settings)
    times, options = (start, settings.duration), replace(options_of(settings), keeper=checkpoint)
    solution = integrate(formulation, times, *state, options, watching.observe)
    return watching.judged(run_of(watching.ended(solution)))
