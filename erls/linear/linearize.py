"""From a scene, or a run, to its linear model: the one door."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import msgspec

from erls.equations.formulation import Formulation
from erls.equations.neighbours import Linearizable, Neighbours
from erls.equations.registry import formulate
from erls.equations.substructures import solved
from erls.errors import Cause, SceneError
from erls.linear.assembly import linear_model
from erls.linear.inputs import inputs_of
from erls.linear.model import LinearModel
from erls.linear.outputs import outputs_of
from erls.linear.plants import ChainPlant, Plant
from erls.linear.rest import at_rest
from erls.maths.jit import announcing
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.run.chain.run import ChainRun
from erls.run.chain.sensors import sensors_of
from erls.run.record import Run
from erls.scene.bodies.analyses import Dynamics
from erls.scene.bodies.schema import BodyScene
from erls.scene.build import build_mechanism
from erls.scene.chain import Scene
from erls.scene.read import AnyScene, load_scene
from erls.simulation.chains import models_of
from erls.simulation.simulate import simulate
from fe_import.files.log import log

EQUILIBRIUM = "equilibrium"
Message = Callable[[str], None]


def linearize(
    scene: AnyScene | Run | Path | str,
    *,
    at: float | str = 0.0,
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
    tell: Message = log,
) -> LinearModel:
    """Small motions of a mechanism about a state, with inputs and outputs.

    Parameters
    ----------
    scene : Scene, BodyScene, Run, Path or str
        A scene, or a run of it.
    at : float or str
        A time of the motion [s], which is computed up to it unless a run is given; 0 is the start. ``"equilibrium"``:
        where forces balance at rest with all joints free, next to the start. A scene of bodies that asks for equilibria
        is taken in the last one.
    inputs : sequence of str, optional
        ``joint.NAME.effort``; ``joint.NAME.acceleration`` of a prescribed or wanted motion, whose place and rate are
        two more states; ``point.NAME.force.x`` and ``.moment.x``, in the world; ``load.NUMBER.factor`` of a load of the
        scene. Efforts of all drives and all prescribed motions unless given.
    outputs : sequence of str, optional
        ``joint.NAME.angle``, ``.rate``, ``.acceleration``, ``.effort``; ``point.NAME.x``, ``.velocity.x``,
        ``.acceleration.x``; ``sensor.NAME``, ``sensor.NAME.x``. Angles, places and sensors unless given.
    tell : callable, optional
        Told about each preparation that takes time.

    Returns
    -------
    LinearModel

    Raises
    ------
    SceneError, FEImportError
        Bad input: names file, field, value and remedy.
    SimulationError
        The motion up to the time failed, or there is no equilibrium.

    Examples
    --------
    >>> import erls
    >>> model = erls.linearize("data/l_shape/torque.toml", at="equilibrium", outputs=["joint.shoulder.angle"])
    >>> model.inputs[0].name, model.B.shape == (2 * model.size, 1)
    ('joint.shoulder.effort', True)
    >>> [round(mode.frequency_hz, 2) for mode in model.modes[:3]]  # it swings, and bends in and out of its plane
    [0.69, 8.45, 12.28]
    """
    with announcing(tell):
        found = state_of(scene, at, tell)
        chosen = inputs_of(found.plant, inputs), outputs_of(found.plant, outputs)
        return linear_model(found.plant, *chosen, (found.scene, found.at), found.warnings)


class StateOf(NamedTuple):
    """A plant in its state, the names of its scene and of that state, and what the user should know."""

    plant: Plant
    scene: str
    at: str
    warnings: tuple[str, ...]


def state_of(given: AnyScene | Run | Path | str, at: float | str, tell: Message = log) -> StateOf:
    """What `linearize` linearizes.

    Raises
    ------
    SceneError, FEImportError, SimulationError
        As `linearize`.
    """
    if isinstance(at, str) and at != EQUILIBRIUM:
        message, remedy = "neither a time nor 'equilibrium'", "give a time in seconds, or 'equilibrium'"
        raise SceneError(Cause.BAD_FIELD, message, where="at", value=at, remedy=remedy)
    if not isinstance(at, str) and not 0.0 <= at < float("inf"):
        message, remedy = "not a time of the motion", "give a time in seconds, 0 or later"
        raise SceneError(Cause.TIME_OUT_OF_RANGE, message, where="at", value=at, remedy=remedy)
    if isinstance(given, (str, Path)):
        given = load_scene(given)
    if not isinstance(given, (Scene, ChainRun)):
        return _of_bodies(given, at, tell)
    scene = with_all_modes(given.scene if isinstance(given, ChainRun) else given)
    if isinstance(given, ChainRun):
        if isinstance(at, str):
            return plant_of(build_mechanism(scene, tell, *models_of(given)).mechanism, scene, at, None, ())
        if scene.record.simulation != given.scene.record.simulation:
            message = "the run left out modes or effects, or used absolute coordinates: its states are not those of all"
            raise SceneError(Cause.BAD_FIELD, message, where="at", value=at, remedy="give the scene instead of the run")
        return plant_of(given.formulation.mechanism, scene, at, given, ())
    if isinstance(at, str) or at == 0.0:
        built = build_mechanism(scene, tell)
        return plant_of(built.mechanism, scene, at, None, built.warnings)
    _refuse_later(at, scene.record.simulation.duration, str(scene.path))
    settings = msgspec.structs.replace(scene.record.simulation, duration=at, output_step=None)
    short = Scene(scene.path, msgspec.structs.replace(scene.record, simulation=settings))
    run = simulate(short, tell=tell, verdict=False)
    return plant_of(run.formulation.mechanism, scene, at, run, run.warnings)


def _refuse_later(at: float, duration: float, file: str) -> None:
    """Refuse a time after the end of the motion, as runs do."""
    if at > duration:
        message = "the motion ends before this time"
        remedy = f"give a time up to the duration, or let {file} run longer: simulation.duration"
        raise SceneError(Cause.TIME_OUT_OF_RANGE, message, where="at", value=at, limit=f"{duration:g} s", remedy=remedy)


def _of_bodies(given: BodyScene | Run, at: float | str, tell: Message) -> StateOf:
    """The same of a scene of bodies and beams."""
    from erls.equations.nodal.scenes.build import assemble  # here: nodal elements, which chains do not need
    from erls.linear import bodies
    from erls.run.bodies.motion import BodyMotion
    from erls.run.bodies.rest import BodyRest
    from erls.run.bodies.run import BodyRun

    scene = given.scene if isinstance(given, BodyRun) else given
    assert isinstance(scene, BodyScene)
    moving, analysis = not isinstance(at, str), scene.record.simulation
    if not isinstance(analysis, Dynamics):
        run = simulate(scene, tell=tell, verdict=False) if isinstance(given, BodyScene) else given
        assert isinstance(run, BodyRest)
        return StateOf(bodies.rested(run), scene.name, EQUILIBRIUM, run.warnings)
    if not moving or at == 0.0:
        assembly = given.assembly if isinstance(given, BodyRun) else assemble(scene)
        plant, warnings = bodies.started(assembly), tuple[str, ...]()
        plant = plant if moving else plant.at(at_rest(plant.near))
    else:
        assert not isinstance(at, str)
        if isinstance(given, BodyScene):
            _refuse_later(at, analysis.duration, str(scene.path))
            short = msgspec.structs.replace(analysis, duration=at)
            record = msgspec.structs.replace(scene.record, simulation=short)
            given = simulate(BodyScene(scene.path, record), tell=tell, verdict=False)
        assert isinstance(given, BodyMotion)
        plant, warnings = bodies.reached(given, at), given.warnings
    return StateOf(plant, scene.name, f"t = {at:g} s" if moving else EQUILIBRIUM, warnings)


def with_all_modes(scene: Scene) -> Scene:
    """The scene in independent coordinates with all of its modes, and all effects where it chooses by itself."""
    own = scene.record.simulation
    effects = "all" if own.effects == "auto" else own.effects
    settings = msgspec.structs.replace(own, bandwidth=None, coordinates="independent", effects=effects)
    return Scene(scene.path, msgspec.structs.replace(scene.record, simulation=settings))


def plant_of(
    mechanism: Mechanism, scene: Scene, at: float | str, run: ChainRun | None, warnings: Sequence[str]
) -> StateOf:
    """A mechanism in the state that is asked for: that of a run, or else the start or the equilibrium next to it."""
    settings = scene.record.simulation
    formulation = formulate(mechanism, settings) if run is None else run.formulation
    equations, sensors = solved(formulation), sensors_of(scene, mechanism)
    if isinstance(at, str):
        near = at_rest(_near(equations, 0.0, *equations.initial_state()))
        return StateOf(ChainPlant(formulation, settings, near, sensors), scene.name, at, tuple(warnings))
    y, v = equations.initial_state() if run is None else (part[0] for part in run.coordinates([at]))
    plant = ChainPlant(formulation, settings, _near(equations, at, y, v), sensors)
    return StateOf(plant, scene.name, f"t = {at:g} s", tuple(warnings))


def _near(equations: Formulation, t: float, y: Array, v: Array) -> Neighbours:
    assert isinstance(equations, Linearizable)
    return equations.neighbours(t, y, v)
