"""Problem files read and checked."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from erls.errors import Cause, SceneError
from erls.maths.so3 import Array
from erls.mechanism.drives import FreeDrive
from erls.optimization.combinations import check_choices, combinations
from erls.optimization.records import (
    DERIVATIVES,
    ENDS,
    EVERY_STEP,
    FRAMES,
    METHODS,
    OPTIMIZERS,
    OVER_TIME,
    QUANTITIES,
    TIMES,
    AnyConstraint,
    BucklingLimit,
    DeflectionLimit,
    EffortLimit,
    FrequencyLimit,
    Goal,
    PowerLimit,
    ProblemRecord,
    StressLimit,
    Term,
    Variable,
    VibrationLimit,
)
from erls.run.file import self_contained
from erls.scene.build import link_description
from erls.scene.chain import Scene
from erls.scene.checks import bad, check_names, positive
from erls.scene.integrators import FIXED_STEP
from erls.scene.links import Link
from erls.scene.overrides import apply_override, in_scene
from erls.scene.read import load_chain
from erls.sensitivity.parameters import Parameter, parameters_of
from fe_import.errors import ReportedError
from fe_import.files.toml import choose, convert, read_toml

_ABOUT = {
    StressLimit: "stress is",
    FrequencyLimit: "a frequency of a link that is pinned or clamped is",
    BucklingLimit: "buckling is",
}
_POWERS = {"diameter": -4, "width": -3, "height": -3}


@dataclass(frozen=True)
class Problem:
    """A checked problem.

    Attributes
    ----------
    path : Path
    record : ProblemRecord
    scene : Scene
        With the changes of the problem, and its tables written into it.
    start : (v,) array
    parameters : tuple of Parameter
        All fields that variables set, in the order of `factors`.
    factors : (p, v) array
        Values of these fields per unit of the variables.
    powers : (v,) array
        Of the variables in approximations.
    alternatives : tuple of (dict of str to str, Problem)
        Where there are choices: every combination, by their names, and the problem that it makes. This is the first.
    """

    path: Path
    record: ProblemRecord
    scene: Scene
    start: Array
    parameters: tuple[Parameter, ...]
    factors: Array
    powers: Array
    alternatives: tuple[tuple[dict[str, str], Problem], ...] = ()

    @property
    def name(self) -> str:
        """Its name, or that of its file."""
        return self.record.name or self.path.name.removesuffix(".toml")

    @property
    def names(self) -> tuple[str, ...]:
        """Of the variables."""
        return tuple(variable.name for variable in self.record.variables)

    @property
    def lower(self) -> Array:
        """(v,)"""
        return np.array([variable.lower for variable in self.record.variables])

    @property
    def upper(self) -> Array:
        """(v,)"""
        return np.array([variable.upper for variable in self.record.variables])

    def overrides(self, x: Array) -> list[str]:
        """KEY=VALUE of the scene at a design (v,)."""
        values = (self.factors @ x).tolist()
        return [f"{p.key}={float(value)!r}" for p, value in zip(self.parameters, values, strict=True)]

    def times(self, constraint: AnyConstraint) -> Array:
        """(k,) samples of a constraint [s]; one of what is the same at all times."""
        if isinstance(constraint, FrequencyLimit):
            return np.zeros(1)
        settings = self.scene.record.simulation
        count, fixed = constraint.samples, settings.step is not None and settings.integrator == FIXED_STEP
        if isinstance(count, str):
            count = round(settings.duration / (settings.step or settings.duration)) + 1
        found = np.linspace(0.0, settings.duration, count)
        if fixed and settings.step is not None:
            found = np.minimum(np.round(found / settings.step) * settings.step, settings.duration)
        return np.unique(found)


def load_problem(path: Path | str, changes: Sequence[str] = ()) -> Problem:
    """Read and check a problem.

    Parameters
    ----------
    path : Path or str
    changes : sequence of str
        KEY=VALUE: fields of the problem.

    Raises
    ------
    SceneError, FEImportError
        Naming file, field, value and remedy.
    """
    path = Path(path)
    data = read_toml(path, SceneError)
    for text in changes:
        apply_override(data, text)
    record = convert(data, ProblemRecord, str(path), SceneError)
    if not record.choices:
        return _checked(path, record)
    check_choices(record, str(path))
    alternatives = tuple((chosen, _checked(path, own)) for chosen, own in combinations(record))
    return replace(alternatives[0][1], record=record, alternatives=alternatives)


def _checked(path: Path, record: ProblemRecord) -> Problem:
    """Of a record without choices."""
    file = str(path)
    scene = self_contained(load_chain(path.parent / record.scene, record.set))
    _check_tables(record, file)
    for k, variable in enumerate(record.variables):
        _check_variable(variable, f"{file}: variables[{k}]")
    if scene.record.simulation.effects == "auto":
        message, remedy = "effects that change from design to design", "name them, or use 'all'"
        raise bad(f"{file}: scene", message, "effects = 'auto'", f'{remedy}: set = ["simulation.effects=all"]')
    parameters, factors, start = _parameters(record, scene, file)
    for k, constraint in enumerate(record.constraints):
        _check_constraint(constraint, scene, f"{file}: constraints[{k}]")
    for k, goal in enumerate(record.objective):
        _check_goal(goal, record, scene, f"{file}: objective[{k}]")
    for k, constraint in enumerate(record.constraints):
        if constraint.limit is None and constraint.name not in [goal.of for goal in record.objective]:
            message, remedy = "it holds nothing, and no objective asks for it", "give a 'limit', or take it out"
            raise bad(f"{file}: constraints[{k}].limit", message, None, remedy)
    _check_settings(record, file)
    powers = np.array([float(_power(variable)) for variable in record.variables])
    return Problem(path, record, scene, start, parameters, factors, powers)


def _check_tables(record: ProblemRecord, file: str) -> None:
    if not record.variables:
        raise bad(f"{file}: variables", "nothing may change", None, "add [[variables]]")
    if not record.constraints:
        message = "nothing must hold, so that the least mass lies at bounds"
        raise bad(f"{file}: constraints", message, None, "add [[constraints]]")
    for table in ("variables", "constraints"):
        check_names((f"{file}: {table}[{k}].name", one.name) for k, one in enumerate(getattr(record, table)))


def _check_variable(variable: Variable, place: str) -> None:
    if not variable.keys:
        raise bad(f"{place}.keys", "a variable sets at least one field", None, "name a field as --set takes it")
    for name in ("lower", "upper"):
        if not math.isfinite(getattr(variable, name)):
            raise bad(f"{place}.{name}", "not a finite number", getattr(variable, name), "give one")
    if not variable.lower < variable.upper:
        message = "bounds leave no room"
        raise SceneError(
            Cause.BAD_FIELD,
            message,
            where=f"{place}.lower",
            value=variable.lower,
            limit=variable.upper,
            remedy="give a lower bound below the upper one",
        )
    if variable.start is not None and not variable.lower <= variable.start <= variable.upper:
        remedy = f"give {variable.lower:g} to {variable.upper:g}"
        raise bad(f"{place}.start", "outside its bounds", variable.start, remedy)
    if variable.power is not None and (variable.power == 0 or abs(variable.power) > 6):
        raise bad(f"{place}.power", "not a power to approximate in", variable.power, "give -4 to -1, or 1 to 4")
    if _power(variable) != 1 and variable.lower <= 0:
        remedy = "give a positive lower bound, or power = 1"
        raise bad(f"{place}.lower", "a power of a number that may be zero", variable.lower, remedy)


def _power(variable: Variable) -> int:
    if variable.power is not None:
        return variable.power
    field = next(iter(variable.keys)).rpartition(".")[2]
    return next((power for word, power in _POWERS.items() if field.endswith(word)), 1)


def _parameters(record: ProblemRecord, scene: Scene, file: str) -> tuple[tuple[Parameter, ...], Array, Array]:
    """Fields that variables set, factors, and the start."""
    keys: dict[str, int] = {}
    found: list[Parameter] = []
    columns: list[tuple[int, int, float]] = []
    start = np.zeros(len(record.variables))
    for v, variable in enumerate(record.variables):
        place = f"{file}: variables[{v}]"
        given = variable.keys if isinstance(variable.keys, dict) else dict.fromkeys(variable.keys, 1.0)
        for key, factor in given.items():
            if not math.isfinite(factor) or factor == 0:
                raise bad(f"{place}.keys", "not a factor", factor, "give a number other than 0")
            if in_scene(key) in keys:
                raise bad(f"{place}.keys", "two variables set this field", key, "let one of them set it")
            keys[in_scene(key)] = v
            try:
                found += parameters_of(scene, [key])
            except ReportedError as problem:
                raise SceneError(
                    Cause.BAD_REFERENCE,
                    f"no such number in the scene: {problem.message}",
                    where=f"{place}.keys",
                    value=key,
                    remedy=problem.remedy,
                ) from None
            columns.append((len(found) - 1, v, factor))
        first = next(iter(given))
        own = next(p.value for p in found if p.key == first) / given[first]
        start[v] = own if variable.start is None else variable.start
        if not variable.lower <= start[v] <= variable.upper:
            message, remedy = "the scene is outside the bounds", "give a 'start', or wider bounds"
            raise bad(f"{place}.start", message, float(start[v]), remedy)
    factors = np.zeros((len(found), len(record.variables)))
    for p, v, factor in columns:
        factors[p, v] = factor
    return tuple(found), factors, start


def _check_constraint(constraint: AnyConstraint, scene: Scene, place: str) -> None:
    positive(f"{place}.limit", constraint.limit)
    choose(constraint.times, TIMES, f"{place}.times", SceneError)
    fixed = scene.record.simulation.step is not None and scene.record.simulation.integrator == FIXED_STEP
    if isinstance(constraint.samples, str):
        choose(constraint.samples, (EVERY_STEP,), f"{place}.samples", SceneError)
        if not fixed:
            message, remedy = "the steps of this run are its own choice", "give a number, or simulation.step"
            raise bad(f"{place}.samples", message, constraint.samples, remedy)
    elif not 2 <= constraint.samples <= 100_000:
        raise bad(f"{place}.samples", "not a number of samples", constraint.samples, "give 2 to 100000")
    record = scene.record
    if isinstance(constraint, DeflectionLimit):
        if bool(constraint.point) == bool(constraint.terms):
            raise bad(place, "give exactly one of 'point' and 'terms'", constraint.name, "say what deflects")
        for k, term in enumerate(terms_of(constraint)):
            where = f"{place}.terms[{k}]" if constraint.terms else place
            choose(term.point, [point.name for point in record.points], f"{where}.point", SceneError)
            choose(term.frame, FRAMES, f"{where}.frame", SceneError)
            wanted = term.components
            if not wanted or set(wanted) - set("xyz") or len(set(wanted)) != len(wanted):
                raise bad(f"{where}.components", "not components", wanted, "give some of x, y and z")
    elif isinstance(constraint, (StressLimit, FrequencyLimit, BucklingLimit)):
        if not isinstance(constraint, StressLimit):
            choose(constraint.ends, ENDS, f"{place}.ends", SceneError)
        names = [link.name for link in record.links]
        for k, name in enumerate(constraint.links):
            choose(name, names, f"{place}.links[{k}]", SceneError)
        for k in links_of(constraint, scene):
            link = record.links[k]
            frame = bool(link.model) and _framed(scene, link)
            if isinstance(constraint, FrequencyLimit) and constraint.ends == "cantilever" and link.model:
                continue
            if not frame:
                message, remedy = f"{_ABOUT[type(constraint)]} that of beams", "name links that are made of beams"
                raise bad(f"{place}.links", message, link.name, remedy)
        if not links_of(constraint, scene):
            raise bad(f"{place}.links", "no link deforms", None, "name links that are made of beams")
    elif isinstance(constraint, VibrationLimit):
        for link in record.links:
            if link.flexible and not link.rigid and not (link.model and _framed(scene, link)):
                message, remedy = "frequencies of the mechanism are those of beams", "use the frequency of each link"
                raise bad(f"{place}.type", message, link.name, remedy)
    elif isinstance(constraint, PowerLimit):
        for k, name in enumerate(constraint.joints):
            choose(name, [joint.name for joint in record.joints], f"{place}.joints[{k}]", SceneError)
        if not driven_joints(constraint, scene):
            raise bad(f"{place}.joints", "no joint has a drive", None, "name joints that have one")
    elif isinstance(constraint, EffortLimit):
        choose(constraint.joint, [joint.name for joint in record.joints], f"{place}.joint", SceneError)


def driven_joints(constraint: PowerLimit, scene: Scene) -> list[str]:
    """Names of the joints whose power counts."""
    return constraint.joints or [j.name for j in scene.record.joints if not isinstance(j.drive, FreeDrive)]


def _framed(scene: Scene, link: Link) -> bool:
    """Whether the description of a link is one of beams."""
    return link_description(scene, link).description.frame is not None


def terms_of(constraint: DeflectionLimit) -> list[Term]:
    """Its parts."""
    return constraint.terms or [Term(constraint.point)]


def links_of(constraint: StressLimit | FrequencyLimit | BucklingLimit, scene: Scene) -> list[int]:
    """Numbers of the links that a limit of stress, frequency or buckling looks at."""
    links = scene.record.links
    if constraint.links:
        return [k for k, link in enumerate(links) if link.name in constraint.links]
    return [k for k, link in enumerate(links) if link.rigid is None and link.flexible]


def _check_goal(goal: Goal, record: ProblemRecord, scene: Scene, place: str) -> None:
    choose(goal.quantity, QUANTITIES, f"{place}.quantity", SceneError)
    choose(goal.over_time, OVER_TIME, f"{place}.over_time", SceneError)
    if not math.isfinite(goal.weight) or goal.weight <= 0:
        raise bad(f"{place}.weight", "not a positive factor", goal.weight, "give one")
    for k, name in enumerate(goal.links):
        choose(name, [link.name for link in scene.record.links], f"{place}.links[{k}]", SceneError)
    if goal.quantity == "mass":
        if goal.of:
            raise bad(f"{place}.of", "mass is that of links", goal.of, "remove it")
        return
    kinds = {"deflection": DeflectionLimit, "effort": EffortLimit, "stress": StressLimit, "energy": PowerLimit}
    known = [c.name for c in record.constraints if isinstance(c, kinds[goal.quantity])]
    choose(goal.of, known, f"{place}.of", SceneError)


def _check_aggregates(record: ProblemRecord, file: str) -> None:
    """Nothing but aggregates may be asked for."""
    remedy = 'use settings.derivatives = "components"'
    if not record.constraints:
        raise bad(f"{file}: settings.derivatives", "there is nothing to aggregate", "aggregates", remedy)
    for k, constraint in enumerate(record.constraints):
        if constraint.times != "aggregate" or constraint.limit is None:
            message = "derivatives of aggregates alone are asked for"
            raise bad(f"{file}: constraints[{k}].times", message, constraint.times, f'use "aggregate", or {remedy}')
    for k, goal in enumerate(record.objective):
        if goal.quantity != "mass":
            message = "derivatives of aggregates alone are asked for, not of what objectives measure over time"
            raise bad(f"{file}: objective[{k}].quantity", message, goal.quantity, remedy)


def _check_settings(record: ProblemRecord, file: str) -> None:
    s, place = record.settings, f"{file}: settings"
    choose(s.optimizer, OPTIMIZERS, f"{place}.optimizer", SceneError)
    choose(s.derivatives, DERIVATIVES, f"{place}.derivatives", SceneError)
    if s.derivatives == "aggregates":
        _check_aggregates(record, file)
    if not s.methods:
        raise bad(f"{place}.methods", "no method", None, f"name some of {', '.join(METHODS)}")
    for k, method in enumerate(s.methods):
        choose(method, METHODS, f"{place}.methods[{k}]", SceneError)
    check_names((f"{place}.methods[{k}]", method) for k, method in enumerate(s.methods))
    for name in ("design_tolerance", "violation_tolerance", "optimality_tolerance", "move_limit"):
        if not 0 < getattr(s, name) < 1:
            raise bad(f"{place}.{name}", "not a share", getattr(s, name), "give a number between 0 and 1")
    for name, most in (("most_analyses", 10_000), ("starts", 1000)):
        if not 1 <= getattr(s, name) <= most:
            raise bad(f"{place}.{name}", "not a number of runs", getattr(s, name), f"give 1 to {most}")
    if s.seed < 0:
        raise bad(f"{place}.seed", "not a seed", s.seed, "give 0 or more")
    for method, known in record.published.items():
        choose(method, METHODS, f"{file}: published.{method}", SceneError)
        for name in known.variables:
            choose(name, [v.name for v in record.variables], f"{file}: published.{method}.variables", SceneError)
