"""A scene that is moved on one step at a time, by whoever controls it: controllers in Python, in the loop.

Steps are those of generalized-α in runs, and see the same equations: with the inputs of the scene itself they give the
run of the scene with that step.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from erls.equations.inputs import Inputs, with_inputs
from erls.equations.registry import formulate, system_of
from erls.errors import Cause, SceneError
from erls.integrate.base import Options, legs
from erls.integrate.charts import exchanged
from erls.integrate.choice import compile_kernels, compiled_steps, compiling_steps
from erls.integrate.memory import Memory
from erls.integrate.single_steps import SingleSteps
from erls.maths.jit import announcing
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.mechanism.place import LARGEST, LATEST
from erls.run.chain.instants import Instants
from erls.run.chain.sensors import sensors_of, with_compliances
from erls.run.file import self_contained
from erls.run.readings import shaped
from erls.scene.build import Message, build_mechanism
from erls.scene.chain import Scene
from erls.scene.integrators import FIXED_STEP
from erls.scene.read import AnyScene, load_chain
from fe_import.files.log import log
from fe_import.modal.model import ModalModel

STEP = 1e-3
"""Of scenes that give none [s]."""

_ALIKE = 1e-12  # of an input: what rounding leaves of a curve at one time, from either side

_SYSTEMS = {
    "nodal": ("formulation", "use erls or ffr"),
    "pieces": ("formulation", "leave links in one piece (substructures = 1)"),
    "quasi-static": ("bandwidth", "remove it, so that all modes are integrated"),
    "absolute": ("coordinates", "use coordinates = 'independent'"),
}
"""What cannot be stepped, with the field of the settings that says so."""


@dataclass(frozen=True)
class Saved:
    """A state of a `Stepper`; nothing changes it."""

    time: float
    clock: tuple[float, float, int]
    inputs: Array
    memory: Memory
    fresh: bool


class Stepper:
    """A mechanism at one time, which moves on when it is told to.

    Parameters
    ----------
    scene : Scene, Path or str
        A chain. Its ``duration`` and integrator do not matter; drives that it prescribes or controls act as they do in
        runs.
    tell : callable, optional
        Told about each preparation that takes time.
    models : sequence of ModalModel, optional
        Of the links, instead of the ones that the scene names (a run file holds its own).

    Attributes
    ----------
    scene : Scene
    formulation : Formulation
        The equations of motion, with the mechanism, its inputs as they are set.
    time : float
        [s]
    warnings : tuple of str
        What the user should know about links and loops.
    input_names, sensor_names : tuple of str
        Inputs are efforts [N m or N] of drives of type torque and of free joints, by the names of their joints, and
        factors of the loads of the scene, ``loads[0]`` and on.

    Raises
    ------
    SceneError, FEImportError
        Bad input, or a scene that cannot be stepped: names file, field, value and remedy.
    SimulationError
        There is no start.

    Examples
    --------
    >>> import erls
    >>> stepper = erls.stepper(erls.load_scene("data/l_shape/steel_tall.toml"))
    >>> stepper.input_names
    ('shoulder',)
    >>> start = stepper.save()
    >>> for _ in range(10):
    ...     readings = stepper.step({"shoulder": -8.0})
    >>> round(stepper.time, 9)
    0.01
    >>> stepper.restore(start)
    >>> stepper.time
    0.0
    """

    def __init__(
        self,
        scene: AnyScene | Path | str,
        *,
        tell: Message = log,
        models: Sequence[ModalModel] | None = None,
    ) -> None:
        path = scene if isinstance(scene, (Path, str)) else scene.path
        loaded = scene if isinstance(scene, Scene) else load_chain(path)
        settings = msgspec.structs.replace(loaded.record.simulation, integrator=FIXED_STEP, output_step=None)
        _refuse_auto(loaded)
        built = build_mechanism(loaded, tell, models)
        _refuse_system(loaded, system_of(built.mechanism, settings))
        _refuse_sticking(loaded, built.mechanism)
        loaded = with_compliances(loaded, built.mechanism) if loaded.record.sensors else loaded
        self.scene = self_contained(loaded)
        mechanism, inputs = with_inputs(built.mechanism)
        with announcing(tell), compiling_steps(compiled_steps(mechanism, settings)):
            self.formulation = formulate(mechanism, settings)
            compile_kernels(self.formulation, settings)
        self._inputs = Inputs(self.formulation, inputs)
        self.input_names = tuple(known.name for known in inputs)
        self._numbers = {name: k for k, name in enumerate(self.input_names)}
        self._sensors = sensors_of(self.scene, built.mechanism)
        self.sensor_names = tuple(sensor.name for sensor in self._sensors)
        jumps = [(t, known.name) for known in inputs if known.own is not None for t in known.own.breakpoints]
        jumps += [(t, "") for t in self.formulation.breakpoints]  # type: ignore[attr-defined]
        self._jumps = sorted(jumps)
        self._charts = mechanism.rotation_vector_places
        self.step_size = settings.step or STEP
        options = Options(self.step_size, spectral_radius=settings.spectral_radius)
        self.time, self._fresh = 0.0, True
        self._clock = 0.0, 0.0, 0  # where steps of this length began, and how many there were
        start = legs(self._ahead({}, self.step_size), (0.0, self.step_size))[0].first
        self._set({}, start, False)
        y, v = self.formulation.initial_state()
        self._steps = SingleSteps(self.formulation, options)
        self._steps.begin(start, *exchanged(y, v, self._charts), True)
        self.warnings = (*built.warnings, *getattr(self.formulation, "warnings", ()))

    @property
    def state(self) -> tuple[Array, Array, Array]:
        """(n,) independent coordinates, rates and accelerations: those of a run's solution."""
        return self._steps.state

    def step(
        self,
        inputs: Mapping[str, float] | None = None,
        h: float | None = None,
        *,
        held: bool = False,
        added: bool = False,
    ) -> dict[str, Any]:
        """Move on by a step.

        Parameters
        ----------
        inputs : mapping, optional
            Values by name, of this step alone. They act as forces of a scene do: in full at its end, on the way in
            proportion from what was before. Inputs that are not named do what the scene says.
        h : float, optional
            Length of the step [s]; ``step`` of the scene, or 1 ms, unless given. Jumps of what the scene prescribes are
            met by shorter ones.
        held : bool
            The values act in full all through the step, as those of a controller that holds them from one sample to the
            next: where they differ from before they jump at its start.
        added : bool
            They are added to what the scene says, instead of taking its place.

        Returns
        -------
        dict
            What the sensors read after it: numbers, or arrays (c,).

        Raises
        ------
        SceneError
            BAD_FIELD, BAD_REFERENCE: an unknown input, or a number that is none.
        SimulationError
            The step fails: says when, why and what to try; the stepper stands where it began, or at the last jump that
            it met.
        """
        given, h = dict(inputs or {}), self.step_size if h is None else h
        self._check(given, h)
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # infinities are found and reported
            origin, width, count = self._clock if self._clock[1] == h else (self.time, h, 0)
            end, jumps = origin + (count + 1) * width, self._ahead({} if added else given, h)
            self._clock = self.time, 0.0, 0  # of a step that fails
            for leg in legs(jumps, (self.time, end)):
                before = self._inputs.values if held else None
                if before is not None and not self._fresh:
                    self._set(given, leg.first, False, added)
                    self._fresh = not np.allclose(self._inputs.values, before, rtol=_ALIKE, atol=0.0)
                if self._fresh or jumps.at(leg.start):
                    self._set(given, leg.first, False, added)
                    self._steps.begin(leg.first, *self._steps.state[:2], False)
                last = leg.last if jumps.at(leg.end) else leg.end
                self._set(given, last, True, added)
                self._steps.advance(leg._replace(last=last))
                self.time, self._fresh = leg.end, False
            self._clock = origin, width, count + 1
        self._exchange()
        return self.readings()

    def readings(self) -> dict[str, Any]:
        """What the sensors read now: numbers, or arrays (c,)."""
        if not self._sensors:
            return {}
        seen = self.seen()
        return {sensor.name: shaped(sensor, seen, (1,))[0] for sensor in self._sensors}

    def seen(self) -> Instants:
        """The mechanism as it stands, for sensors of one's own."""
        y, v, a = self.state
        return Instants(self.formulation, np.array([self.time]), y[None], v[None], a[None])

    def save(self) -> Saved:
        """The present state, all that later steps depend on."""
        return Saved(self.time, self._clock, self._inputs.values, self._steps.memory(), self._fresh)

    def restore(self, saved: Saved) -> None:
        """Stand where the state was saved, by this stepper or another one of the same scene; steps from there on are
        those from then on, bit for bit.

        Raises
        ------
        SceneError
            RUN_FILE: it is the state of something else.
        """
        self._steps.restore(saved.memory)
        self._inputs.set(saved.inputs)
        self.time, self._clock, self._fresh = saved.time, saved.clock, saved.fresh

    def _ahead(self, given: Mapping[str, float], h: float) -> _Jumps:
        """Jumps of what acts in the next step, its ends included."""
        first = bisect_left(self._jumps, (self.time - _Jumps.NEAR * max(1.0, self.time), ""))
        last = bisect_left(self._jumps, (self.time + h + _Jumps.NEAR * max(1.0, self.time + h), "\uffff"))
        return _Jumps(tuple(t for t, name in self._jumps[first:last] if name not in given))

    def _set(self, given: Mapping[str, float], t: float, left: bool, added: bool = False) -> None:
        """Inputs at a time; ``left``: before a jump there."""
        own = np.array([known.at(t, left) if added or known.name not in given else 0.0 for known in self._inputs.every])
        more = np.array([given.get(known.name, 0.0) for known in self._inputs.every])
        self._inputs.set(own + more)

    def _check(self, given: Mapping[str, float], h: float) -> None:
        for name, value in given.items():
            if name not in self._numbers:
                raise SceneError(
                    Cause.BAD_REFERENCE,
                    "no such input",
                    where="inputs",
                    value=name,
                    remedy=f"known: {', '.join(self.input_names) or 'none'}; drives of type pd and motion are none",
                )
            if not abs(value) <= LARGEST:
                message, remedy = "not a finite number of plausible size", "give a number"
                raise SceneError(Cause.BAD_FIELD, message, where=f"inputs: {name}", value=value, remedy=remedy)
        if not (math.isfinite(h) and h >= 1e-9 and self.time + h <= LATEST):
            message, remedy = "not a length of a step", "give seconds, at least 1e-9"
            raise SceneError(Cause.BAD_FIELD, message, where="h", value=h, remedy=remedy)

    def _exchange(self) -> None:
        """Rotation vectors that have grown long for shorter ones."""
        if not self._charts:
            return
        y, v, _ = self._steps.state
        short, rates = exchanged(y, v, self._charts)
        if not np.array_equal(short, y):
            self._steps.begin(self.time, short, rates, False)


class _Jumps:
    """Times at which forces jump; as `erls.equations.system.MovingSystem` for `legs`."""

    NEAR = 1e-12  # s, or of a time: what rounding leaves

    def __init__(self, times: tuple[float, ...]) -> None:
        self.breakpoints = times
        self.length_scales = np.zeros(0)

    def at(self, t: float) -> bool:
        """Whether there is one."""
        return any(abs(b - t) <= self.NEAR * max(1.0, abs(t)) for b in self.breakpoints)


def _refuse_auto(scene: Scene) -> None:
    if scene.record.simulation.effects == "auto":
        where, remedy = f"{scene.path}: simulation.effects", "use 'all', or the names that a run with 'auto' chose"
        raise SceneError(Cause.BAD_FIELD, "a stepper takes no choice", where=where, value="auto", remedy=remedy)


def _refuse_system(scene: Scene, kind: str) -> None:
    if kind not in _SYSTEMS:
        return
    field, remedy = _SYSTEMS[kind]
    where, value = f"{scene.path}: simulation.{field}", getattr(scene.record.simulation, field)
    message = "a stepper moves chains in independent coordinates, with all modes"
    raise SceneError(Cause.BAD_FIELD, message, where=where, value=value, remedy=remedy)


def _refuse_sticking(scene: Scene, mechanism: Mechanism) -> None:
    if mechanism.sticks or mechanism.grips:
        where, remedy = f"{scene.path}: friction.law", "use law = 'smooth'"
        what = "a joint" if mechanism.sticks else "a point"
        message = f"a stepper makes the steps that it is asked for, and none to where {what} sticks"
        raise SceneError(Cause.BAD_FIELD, message, where=where, value="stick", remedy=remedy)


def stepper(
    scene: AnyScene | Path | str,
    *,
    tell: Message = log,
    models: Sequence[ModalModel] | None = None,
) -> Stepper:
    """A mechanism at its start, which moves on when it is told to (`Stepper`)."""
    return Stepper(scene, tell=tell, models=models)
