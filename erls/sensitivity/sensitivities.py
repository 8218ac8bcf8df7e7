"""Derivatives of outputs of a run by parameters of its scene: the one door."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from erls.equations.registry import system_of
from erls.errors import Cause, SceneError
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.run.chain.run import ChainRun
from erls.run.record import Run
from erls.scene.build import build_mechanism
from erls.scene.chain import Scene
from erls.scene.integrators import FIXED_STEP
from erls.scene.read import AnyScene, chain_alone, load_chain
from erls.sensitivity.forward import differentiated
from erls.sensitivity.outputs import Output, derivative_of, value_of
from erls.sensitivity.parameters import parameters_of
from erls.sensitivity.schemes import Scheme, generalized_alpha, lobatto
from erls.sensitivity.variants import differences
from erls.simulation.simulate import simulate

_ROOM = 50_000_000
"""Numbers of derivatives of a motion that are held at a time, 400 MB: more parameters go one group after the other."""

_UNKNOWN = {
    "nodal": "the nodal formulation",
    "pieces": "links in substructures",
    "quasi-static": "modes that follow statically",
    "absolute": "absolute coordinates",
}
"""Kinds of systems that are not differentiated yet."""


@dataclass(frozen=True)
class Sensitivities:
    """Outputs of a run, and their derivatives.

    Attributes
    ----------
    run : ChainRun
    parameters : dict of str to float
        Values that the derivatives are taken at, by key.
    values : dict of str to array
        By name of the output.
    derivatives : dict of str to dict of str to array
        By name of the output and key of the parameter, in the shape of the output, per unit of the parameter.
    """

    run: ChainRun
    parameters: dict[str, float]
    values: dict[str, Array]
    derivatives: dict[str, dict[str, Array]]


def sensitivities(
    scene: AnyScene | Run | Path | str,
    outputs: Mapping[str, Output],
    parameters: Sequence[str] | Mapping[str, float],
    *,
    tell: Callable[[str], None] = lambda text: None,
) -> Sensitivities:
    """Differentiate what a run gives by numbers of its scene.

    The derivative is that of the run as it was computed, its steps held: exact to about 1e-8, whatever the tolerance of
    the run, where differences of runs hold their steps' noise against the change of a parameter.

    Parameters
    ----------
    scene : Scene, Path, str or ChainRun
        Of a chain of joints and links, with loops or without; or a run of it, which is not run again then.
    outputs : mapping of str to callable
        Functions of a run that give a number or an array, smooth in the motion: ``lambda run: run.position("tip",
        1.0)``.
    parameters : sequence of str, or mapping of str to float
        Keys as ``--set`` takes them; behind ``links.NAME.model`` they go on in the description of that link. With a
        mapping, about how large a change of each would be large: its own size unless given, which zero has not.
    tell : callable, optional
        Told about each preparation that takes time.

    Returns
    -------
    Sensitivities

    Raises
    ------
    SceneError, FEImportError
        Bad input, or something that cannot be differentiated yet: names what, and what to do.
    SimulationError
        The run failed.

    Examples
    --------
    >>> import erls
    >>> scene = erls.load_scene("data/l_shape/steel_tall.toml", ["simulation.duration=0.02"])
    >>> found = erls.sensitivities(
    ...     scene,
    ...     {"height": lambda run: run.position("tip", 0.02)[2]},
    ...     ["gravity.2", "joints.0.damping"],
    ... )
    >>> bool(found.derivatives["height"]["gravity.2"] > 0)
    True
    """
    if isinstance(scene, ChainRun):
        run, keys = scene, parameters_of(scene.scene, parameters)
    else:
        given: Any = scene.scene if isinstance(scene, Run) else scene
        loaded = load_chain(given) if isinstance(given, (Path, str)) else chain_alone(given)
        refuse(loaded, build_mechanism(loaded, tell).mechanism)
        keys = parameters_of(loaded, parameters)
        run = simulate(loaded, tell=tell, verdict=False)
    scheme = scheme_of(run)
    values = {name: value_of(output, run, name) for name, output in outputs.items()}
    derivatives: dict[str, dict[str, Array]] = {name: {} for name in outputs}
    some = max(1, _ROOM // max(1, 3 * run.solution.y.size))
    for first in range(0, len(keys), some):
        found = differences(run, keys[first : first + some])
        motion = differentiated(run, found, scheme)
        for k, one in enumerate(found):
            for name, output in outputs.items():
                key = one.parameter.key
                derivatives[name][key] = derivative_of(output, name, run, one, motion[..., k])
    return Sensitivities(run, {one.key: one.value for one in keys}, values, derivatives)


def scheme_of(run: ChainRun) -> Scheme:
    """What made a run, as maps of small changes.

    Raises
    ------
    SceneError
        BAD_FIELD: this cannot be differentiated yet; names what.
    """
    settings = run.scene.record.simulation
    refuse(run.scene, run.formulation.mechanism)
    if run.failure is not None:
        raise _refusal("a run that did not come to its end", str(run.scene.path), "shorten it, or mend why it failed")
    return generalized_alpha(settings.spectral_radius) if settings.integrator == FIXED_STEP else lobatto()


def refuse(scene: Scene, mechanism: Mechanism) -> None:
    """Refuse what cannot be differentiated yet.

    Raises
    ------
    SceneError
        BAD_FIELD: names what.
    """
    settings, where = scene.record.simulation, f"{scene.path}: simulation"
    if settings.output_step is not None:
        raise _refusal("a run that keeps only some of its steps", f"{where}.output_step", "keep all steps")
    if settings.integrator not in (FIXED_STEP, "lobatto", "auto"):
        raise _refusal(f"steps of {settings.integrator}", f"{where}.integrator", "use auto, lobatto or a step")
    kind = system_of(mechanism, settings)
    if kind in _UNKNOWN:
        raise _refusal(_UNKNOWN[kind], where, "use erls or ffr with independent coordinates and links in one piece")
    if settings.gauge == "minimum-norm":
        raise _refusal("the minimum-norm gauge", f"{where}.gauge", "use the joint-angle gauge")
    if mechanism.sticks:
        remedy = "use friction.law = 'smooth'"
        raise _refusal("motions of joints that stick", f"{scene.path}: friction.law", remedy)
    if mechanism.rotation_vectors:
        raise _refusal("coordinates that are rotation vectors", f"{scene.path}: joints", "use universal joints")
    if kind == "loops" and settings.integrator == FIXED_STEP:
        remedy = "use integrator auto or lobatto, whose equations hold the forces of loops"
        raise _refusal("generalized-alpha with loops", f"{where}.integrator", remedy)


def _refusal(what: str, where: str, remedy: str) -> SceneError:
    return SceneError(Cause.BAD_FIELD, f"derivatives of {what} are not known yet", where=where, remedy=remedy)
