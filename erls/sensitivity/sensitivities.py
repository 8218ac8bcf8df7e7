"""Derivatives of outputs of a run by parameters of its scene: the one door."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

from erls.equations.registry import system_of
from erls.equations.system import metre_scales
from erls.errors import Cause, SceneError
from erls.integrate.base import legs, walked
from erls.maths.jit import announcing
from erls.maths.so3 import Array
from erls.mechanism.chain import Mechanism
from erls.run.chain.run import ChainRun
from erls.run.record import Run
from erls.scene.build import build_mechanism
from erls.scene.chain import Scene
from erls.scene.integrators import FIXED_STEP
from erls.scene.read import AnyScene, chain_alone, load_chain
from erls.sensitivity import forward
from erls.sensitivity.adjoint import gradients
from erls.sensitivity.gradients import Asking
from erls.sensitivity.nodal_motion import metres_of
from erls.sensitivity.outputs import EVALUATIONS, Output, around, at_knots, derivative_of, own_derivative, value_of
from erls.sensitivity.parameters import Parameter, parameters_of
from erls.sensitivity.schemes import Scheme, generalized_alpha, lobatto
from erls.sensitivity.variants import Difference, differences
from erls.simulation.simulate import simulate
from fe_import.files.log import log
from fe_import.files.toml import choose
from fe_import.model import IntArray

_Differ = Callable[[Sequence[Parameter]], list[Difference]]

_ROOM = 50_000_000
"""Numbers of derivatives of a motion that are held at a time, 400 MB: more parameters go one group after the other."""

Method = Literal["auto", "forward", "adjoint"]

_FEW = 4
"""Parameters by which the forward method is taken, whatever the outputs."""

_UNKNOWN = {
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
    method : str
        ``"forward"`` or ``"adjoint"``.
    """

    run: ChainRun
    parameters: dict[str, float]
    values: dict[str, Array]
    derivatives: dict[str, dict[str, Array]]
    method: str = "forward"


def sensitivities(
    scene: AnyScene | Run | Path | str,
    outputs: Mapping[str, Output],
    parameters: Sequence[str] | Mapping[str, float],
    method: Method = "auto",
    *,
    weights: Mapping[str, Array] | None = None,
    models: bool = True,
    times: Array | None = None,
    tell: Callable[[str], None] = log,
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
    method : str, optional
        ``"forward"``: all states of the run by each parameter, for outputs of any size. ``"adjoint"``: backward over
        the run, for few outputs by many parameters; outputs must ask the run at fixed times. ``"auto"``: the one that
        asks outputs less often. Both agree to 1e-9.
    weights : mapping of str to (m, size) array, optional
        By name of an output: factors of its components, one after the other. Derivatives are then those of the m sums,
        which cost the adjoint method what m numbers cost, however many components go into them.
    models : bool, optional
        Whether outputs of a nodal run may ask for numbers of modal models, such as masses of links. Without that a link
        of another section needs no reduction: nodal elements take nothing but nodes and interfaces from models.
    times : (k,) array, optional
        All at which outputs look at the run [s]: the forward method then leaves out what is between.
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
    if method not in get_args(Method):
        message, remedy = "no such method", f"take one of {', '.join(get_args(Method))}"
        raise SceneError(Cause.BAD_FIELD, message, where="method", value=method, remedy=remedy)
    given: Any = scene.scene if isinstance(scene, Run) else scene
    loaded = load_chain(given) if isinstance(given, (Path, str)) else chain_alone(given)
    if not outputs:
        message, remedy = "nothing is differentiated", "give one function of a run at least, by a name"
        raise SceneError(Cause.BAD_FIELD, message, where="outputs", value=0, limit=1, remedy=remedy)
    if isinstance(scene, ChainRun):
        run, keys = scene, parameters_of(loaded, parameters)
    else:
        refuse(loaded, build_mechanism(loaded, tell).mechanism)
        keys = parameters_of(loaded, parameters)
        run = simulate(loaded, tell=tell, verdict=False)
    refuse_run(run)
    values = {name: value_of(output, run, name) for name, output in outputs.items()}
    with announcing(tell):
        sums = _sums(weights or {}, values)
        askings = _askings(run, outputs, values, sums, len(keys), method)
        differ = partial(differences, run, models=models)
        if askings is None:
            rows = None if times is None else around(run, times, outputs, values)
            made = _forward(run, outputs, values, sums, keys, differ, rows)
        else:
            made = _adjoint(askings, keys, differ)
    at = {one.key: one.value for one in keys}
    return Sensitivities(run, at, values, made, "forward" if askings is None else "adjoint")


def _sums(weights: Mapping[str, Array], values: Mapping[str, Array]) -> dict[str, Array]:
    """(m, size) factors of outputs, by name."""
    found = {}
    for name, given in weights.items():
        choose(name, list(values), "weights", SceneError)
        found[name] = np.asarray(given, dtype=float)
        if found[name].ndim != 2 or found[name].shape[1] != values[name].size:
            message, remedy = "factors do not fit the output", f"give (m, {values[name].size}) of them"
            raise SceneError(
                Cause.BAD_FIELD, message, where=f"weights of {name}", value=found[name].shape, remedy=remedy
            )
    return found


def _askings(
    run: ChainRun,
    outputs: Mapping[str, Output],
    values: Mapping[str, Array],
    sums: Mapping[str, Array],
    parameters: int,
    method: Method,
) -> list[tuple[Asking, dict[int, Array]]] | None:
    """For the adjoint method, outputs with their derivatives by states; None for the forward one.

    Tangents, factors and forces by parameters are the same for both: what differs is how often outputs are asked.
    """
    if method == "forward":
        return None
    chosen = method == "adjoint"
    sizes = [len(sums[name]) if name in sums else value.size for name, value in values.items()]
    few = sum(sizes) < parameters and parameters > _FEW
    if not chosen and not few:
        return None
    found = [Asking(output, name, run, sums.get(name)) for name, output in outputs.items()]
    if not chosen and sum(asking.evaluations for asking in found) > EVALUATIONS * parameters * len(outputs):
        return None
    try:
        return [(asking, asking.by_knots()) for asking in found]
    except SceneError:
        if chosen:
            raise
        return None


def _forward(
    run: ChainRun,
    outputs: Mapping[str, Output],
    values: Mapping[str, Array],
    sums: Mapping[str, Array],
    keys: Sequence[Parameter],
    differ: _Differ,
    rows: IntArray | None,
) -> dict[str, dict[str, Array]]:
    derivatives: dict[str, dict[str, Array]] = {name: {} for name in outputs}
    seen = run if rows is None else at_knots(run, rows)
    some = max(1, _ROOM // max(1, 3 * run.solution.y.size))
    for first in range(0, len(keys), some):
        found = differ(keys[first : first + some])
        motion, metres = _motion(run, found, slice(None) if rows is None else rows)
        for k, one in enumerate(found):
            for name, output in outputs.items():
                derivative = derivative_of(output, name, seen, one, motion[..., k], metres, values[name])
                if name in sums:
                    derivative = sums[name] @ derivative.ravel()
                derivatives[name][one.parameter.key] = derivative
    return derivatives


def _adjoint(
    askings: Sequence[tuple[Asking, dict[int, Array]]], keys: Sequence[Parameter], differ: _Differ
) -> dict[str, dict[str, Array]]:
    derivatives: dict[str, dict[str, Array]] = {asking.name: {} for asking, _ in askings}
    run = askings[0][0].run
    ends = np.cumsum([asking.count for asking, _ in askings]).tolist()
    columns = [slice(end - asking.count, end) for end, (asking, _) in zip(ends, askings, strict=True)]
    n = run.solution.y.shape[1]
    seeds: dict[int, Array] = {}
    for (_, by_knots), own in zip(askings, columns, strict=True):
        for knot, seed in by_knots.items():
            seeds.setdefault(knot, np.zeros((3, n, ends[-1])))[..., own] += seed
    found = differ(keys)
    if _of_nodes(run):
        from erls.sensitivity import nodal_adjoint  # here: most runs need none of it

        through = nodal_adjoint.gradients(run, found, seeds, ends[-1])
    elif _eventful(run):
        from erls.sensitivity import eventful  # here: most runs need none of it

        through = eventful.gradients(run, found, scheme_of(run), seeds, ends[-1])
    else:
        through = gradients(run, found, scheme_of(run), seeds, ends[-1])
    for one, row in zip(found, through, strict=True):
        for (asking, _), own in zip(askings, columns, strict=True):
            held = own_derivative(asking.output, asking.name, run, one, asking.value)
            derivatives[asking.name][one.parameter.key] = np.asarray(
                asking.summed(held) + row[own].reshape(asking.shape)
            )
    return derivatives


def _of_nodes(run: ChainRun) -> bool:
    return system_of(run.formulation.mechanism, run.scene.record.simulation) == "nodal"


def _motion(run: ChainRun, differences: Sequence[Difference], rows: IntArray | slice) -> tuple[Array, Array]:
    """(k, 3, n, p) derivatives of what a run keeps of some of its knots, with rates and accelerations, and (n,) metres
    per unit of it.
    """
    formulation: Any = run.formulation
    if _of_nodes(run):
        from erls.sensitivity import nodal_forward  # here: most runs need none of it

        return nodal_forward.differentiated(run, differences, rows), metres_of(formulation)
    metres = metre_scales(formulation)
    if _eventful(run):
        from erls.sensitivity import eventful  # here: most runs need none of it

        return eventful.differentiated(run, differences, scheme_of(run))[rows], metres
    return forward.differentiated(run, differences, scheme_of(run))[rows], metres


def _eventful(run: ChainRun) -> bool:
    """Whether forces change at times that parameters move."""
    mechanism = run.formulation.mechanism
    return mechanism.sticks or mechanism.touches


def scheme_of(run: ChainRun) -> Scheme:
    """What made a run of a chain with coordinates of its own, as maps of small changes."""
    settings = run.scene.record.simulation
    return generalized_alpha(settings.spectral_radius) if settings.integrator == FIXED_STEP else lobatto()


def refuse_run(run: ChainRun) -> None:
    """Refuse what cannot be differentiated yet.

    Raises
    ------
    SceneError
        NO_DERIVATIVE: names what.
    """
    refuse(run.scene, run.formulation.mechanism)
    if run.failure is not None:
        raise _refusal("a run that did not come to its end", str(run.scene.path), "shorten it, or mend why it failed")
    if run.formulation.mechanism.limited:
        system: Any = getattr(run.formulation, "system", run.formulation)  # of nodes
        t = run.solution.t
        begun = {leg.start for leg in legs(system, (float(t[0]), float(t[-1])))}
        if any(leg.start not in begun for _, _, leg in walked(system, t)):
            remedy = "end the run before, or give the motors a larger torque_limit"
            raise _refusal("a run whose motors come to their limits", f"{run.scene.path}: torque_limit", remedy)


def refuse(scene: Scene, mechanism: Mechanism) -> None:
    """Refuse what cannot be differentiated yet.

    Raises
    ------
    SceneError
        NO_DERIVATIVE: names what.
    """
    settings, where = scene.record.simulation, f"{scene.path}: simulation"
    if settings.output_step is not None:
        raise _refusal("a run that keeps only some of its steps", f"{where}.output_step", "keep all steps")
    if settings.integrator not in (FIXED_STEP, "lobatto", "auto"):
        raise _refusal(f"steps of {settings.integrator}", f"{where}.integrator", "use auto, lobatto or a step")
    kind = system_of(mechanism, settings)
    if kind in _UNKNOWN:
        raise _refusal(_UNKNOWN[kind], where, "use erls or ffr with independent coordinates and links in one piece")
    if settings.gauge == "minimum-norm" and kind != "nodal":
        raise _refusal("the minimum-norm gauge", f"{where}.gauge", "use the joint-angle gauge")
    closing = [loop.freedom.forces.sticks for loop in mechanism.loops if loop.freedom is not None]
    if (mechanism.sticks or any(closing)) and (kind != "tree" or mechanism.limited):
        remedy = "use friction.law = 'smooth'"
        what = "loops or nodal runs whose joints stick" if kind != "tree" else "joints that stick beside limited motors"
        raise _refusal(what, f"{scene.path}: friction.law", remedy)
    if mechanism.grips:
        remedy = "use friction.law = 'smooth'"
        raise _refusal("contacts whose points stick", f"{scene.path}: contacts.friction.law", remedy)
    if mechanism.rotation_vectors and kind != "nodal":
        raise _refusal("coordinates that are rotation vectors", f"{scene.path}: joints", "use universal joints")
    if kind == "nodal" and mechanism.touches:
        remedy = "use formulation erls or ffr, which differentiate through them"
        raise _refusal("nodal runs with contacts or stops", f"{where}.formulation", remedy)
    if kind == "nodal" and any(link.shells is not None and link.elastic_modes for link in mechanism.links):
        remedy = "use formulation erls or ffr"
        raise _refusal("nodal runs of links made of shells", f"{where}.formulation", remedy)
    if kind == "loops" and settings.integrator == FIXED_STEP:
        remedy = "use integrator auto or lobatto, whose equations hold the forces of loops"
        raise _refusal("generalized-alpha with loops", f"{where}.integrator", remedy)


def _refusal(what: str, where: str, remedy: str) -> SceneError:
    return SceneError(Cause.NO_DERIVATIVE, f"derivatives of {what} are not known yet", where=where, remedy=remedy)
