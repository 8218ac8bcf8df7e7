"""From a scene to its inversion: the one door."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from erls.errors import Cause, SceneError, SimulationError
from erls.inverse.conditions import Condition
from erls.inverse.internal import without_internal
from erls.inverse.inversion import Inversion
from erls.inverse.marching import march
from erls.inverse.nature import Nature
from erls.inverse.opened import in_modes
from erls.inverse.problem import Problem, problem_of
from erls.inverse.servoed import States, followed
from erls.inverse.work import SAME, Found, Work
from erls.maths.jit import announcing
from erls.maths.so3 import Array
from erls.scene.build import Message
from erls.scene.chain import Scene
from erls.scene.read import AnyScene, chain_alone, load_chain
from fe_import.files.log import log
from fe_import.files.toml import choose

METHODS = ("auto", "collocation", "shooting", "forward")
_JUMP, _LEAST = 1e-6, 1e-3  # of the largest acceleration at a jump, which counts as at least that [m/s², rad/s²]
_LOST = 1e4  # what goes ahead of a motion over what is cut off of it


def invert(
    scene: AnyScene | Path | str,
    *,
    method: str = "auto",
    force: bool = False,
    tell: Message = log,
    progress: Callable[[int, float], None] = lambda iteration, change: None,
) -> Inversion:
    """Find the drives by which a mechanism moves as the tables ``servo`` of its scene demand.

    Parameters
    ----------
    scene : Scene, Path or str
        A chain; ``simulation.step`` is the distance of knots, 1 ms unless given.
    method : str
        ``collocation`` over all steps at once; multiple ``shooting``; ``forward``: plain integration; ``auto``: forward
        where internal motions do not grow, else collocation.
    force : bool
        Integrate forward what grows, as far as it goes.
    tell : callable, optional
        Told about each preparation that takes time.
    progress : callable, optional
        Told the number of each iteration and its largest change.

    Returns
    -------
    Inversion

    Raises
    ------
    SceneError, FEImportError
        Bad input: names file, field, value and remedy; TOO_FEW_DRIVES.
    SimulationError
        OUT_OF_REACH, SINGULAR_SERVO: what is demanded cannot be; UNSTABLE_INVERSE, UNDAMPED_INVERSE: internal motions
        do not let it; NEWTON_FAILED. Says when, why and what to try.

    Examples
    --------
    >>> import erls
    >>> found = erls.invert("data/inverse/passive_arm.toml")
    >>> found.nature.minimum_phase
    False
    >>> bool(0.0 < found.pre_actuation() < 0.1)
    True
    """
    choose(method, METHODS, "method", SceneError)
    loaded: Scene = load_chain(scene) if isinstance(scene, (Path, str)) else chain_alone(scene)
    modes = in_modes(loaded)
    if modes is not loaded and method not in ("auto", "collocation"):
        message, remedy = "nodal elements are inverted by collocation alone", "leave it out, or use erls or ffr"
        raise SceneError(Cause.BAD_FIELD, message, where="method", value=method, remedy=remedy)
    found = _in_modes(modes, method, force, tell, progress)
    if modes is loaded:
        return found
    from erls.inverse.nodal.invert import on_nodes  # here: modes do without its functions

    with announcing(tell), np.errstate(over="ignore", invalid="ignore", divide="ignore"), _singular():
        return on_nodes(found, loaded, progress)


def _in_modes(
    loaded: Scene, method: str, force: bool, tell: Message, progress: Callable[[int, float], None]
) -> Inversion:
    """Of modes, or of rigid links."""
    begun = time.perf_counter()
    with announcing(tell), np.errstate(over="ignore", invalid="ignore", divide="ignore"), _singular():
        problem = problem_of(loaded, tell)
        rigid = rigid_motion(problem)
        work = Work(problem, rigid)
        nature = work.nature

        def made(how: str, states: States, found: Found, warnings: tuple[str, ...]) -> Inversion:
            spent = time.perf_counter() - begun
            return Inversion(problem, how, nature, states, rigid, *found, spent, warnings)

        plain = method == "forward" or (method == "auto" and nature.minimum_phase)
        nature.refuse(method == "forward", force)
        if plain and not nature.minimum_phase:
            states, steps, reason = march(work.solved, work.scales)
            warnings = (reason,) if reason else ()
            return made("forward", states, Found(steps, 0.0), warnings)
        chosen = "shooting" if method == "shooting" else "forward" if plain else "collocation"
        found = work.solve(chosen, progress)
        return made(chosen, work.solved.states, found, (*_cut(problem, nature), *_followed(found)))


def _followed(found: Found) -> tuple[str, ...]:
    """Where fast motions are not what they would be."""
    if found.left <= SAME:
        return ()
    return (f"fast internal motions follow; the last pass changed efforts by {100 * found.left:.2g} % of their peak",)


def _jumps(condition: Condition, times: Array) -> Iterator[str]:
    """Times at which its acceleration does."""
    curve = condition.curve
    inside = [t for t in curve.breakpoints if times[0] < t < times[-1]]
    sides = [[curve.derivatives(t, left)[2] for left in (True, False)] for t in inside]
    largest = max((abs(x) for pair in sides for x in pair), default=0.0)
    for t, (before, after) in zip(inside, sides, strict=True):
        if abs(after - before) > _JUMP * max(largest, _LEAST):
            yield f"the demanded acceleration of {condition.name} jumps at t = {t:g} s: forward runs ring after it"


@contextmanager
def _singular() -> Iterator[None]:
    """Say what it means where a matrix has no inverse."""
    try:
        yield
    except np.linalg.LinAlgError:
        raise SimulationError(
            Cause.SINGULAR_MASS,
            "internal motions are not determined: something that moves has no mass, or the drives do not move what is "
            "demanded",
            where="inverse dynamics",
            remedy="give every moving part a mass and a moment of inertia, or name other drives (inverse.drives)",
        ) from None


def rigid_motion(problem: Problem) -> States:
    """Motion and efforts of rigid links."""
    servoed, demand = problem.rigid, problem.conditions.demand(problem.t)
    y = followed(servoed, problem.conditions, problem.t)
    assert not servoed.count
    if servoed.closing is not None:
        servoed.closing.refuse_uncontrolled(demand.t, y, servoed.driven, servoed.metres)
    return without_internal(servoed, demand, y)


def _cut(problem: Problem, nature: Nature) -> tuple[str, ...]:
    """What the user should know about the ends of the interval."""
    found = [*problem.warnings, *nature.warnings]
    demand = problem.conditions.demand(problem.t[[0, -1]])
    for at, name in enumerate(("start", "end")):
        if np.abs(demand.rate[at]).max() or np.abs(demand.acceleration[at]).max():
            found.append(f"what is demanded moves at the {name} of the run: it is taken to go on as it does there")
    found += [text for each in problem.conditions.every for text in _jumps(each, problem.t)]
    begins = [float(t) for t in problem.conditions.breakpoints if problem.t[0] <= t <= problem.t[-1]]
    room, slowest = (begins[0] if begins else 0.0), float(np.abs(nature.growing.real).min(initial=math.inf))
    if slowest * room < math.log(_LOST):
        share = math.exp(-slowest * room)
        text = f"only {room:.3g} s before the motion: drives that start from rest lose a share of {share:.1g}"
        found.append(f"{text} of what goes ahead of it; start it later")
    return tuple(found)


