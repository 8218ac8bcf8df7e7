"""What colours may say of the inside of links: stress and section forces.

Stress is von Mises, the largest over the thickness of a shell [MPa]; section forces of beams are the lengths of N, V_y,
V_z [N] and of T, M_y, M_z [N m], the larger of the ends that meet at a node. Links that hold recovery maps have them
recovered, shells of the nodal formulation and of scenes of bodies tell their own stress; what is not known is not a
number, and drawn grey.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from erls.equations.nodal.shell_stress import SurfaceStress
from erls.errors import Cause, SceneError
from erls.maths.so3 import Array
from erls.run.bodies.mode import BodyMode
from erls.run.bodies.run import BodyRun
from erls.run.chain.recovered import maps_of, recovered
from erls.run.chain.run import ChainRun
from erls.run.link_mode import LinkMode
from erls.run.record import Run
from erls.view.figure import DEFLECTION, FORCE, MOMENT, STRESS, Shade
from fe_import.modal.recovery_maps import von_mises

_MPA = 1e-6


_MEASURES: dict[Shade, tuple[str, Callable[[Array], Array]]] = {
    STRESS: ("stress", lambda found: _MPA * von_mises(found)),
    FORCE: ("section forces", lambda found: np.linalg.norm(found[..., :3], axis=-1)),
    MOMENT: ("section forces", lambda found: np.linalg.norm(found[..., 3:], axis=-1)),
}
"""Of what links recover: which quantity, and its size from six components."""


def holds(run: Run, shade: Shade) -> bool:
    """Whether links or shells of a run tell it; the amplitude of a mode means nothing, and so does its stress."""
    if shade is DEFLECTION or isinstance(run, LinkMode):
        return shade is DEFLECTION
    if isinstance(run, ChainRun):
        models = [run.formulation.mechanism.links[k].model for k in run.formulation.mechanism.bodies]
        wanted = _MEASURES[shade][0]
        return any(model.recovery is not None and model.recovery.quantity == wanted for model in models)
    shells = isinstance(run, BodyRun) and not isinstance(run, BodyMode) and run.assembly.shells
    return shade is STRESS and bool(shells)


def chain_values(run: ChainRun, times: Sequence[float] | Array, shade: Shade = STRESS) -> list[Array | None]:
    """(k, n) at the nodes of each link at times (k,); None of links that do not hold it."""
    links, seen = run.formulation.mechanism.links, run.instants(np.asarray(times, dtype=float))
    quantity, size = _MEASURES[shade]
    found: list[Array | None] = [None] * len(links)
    for number in run.formulation.mechanism.bodies:
        link = links[number]
        if link.model.recovery is None or maps_of(link).quantity != quantity:
            continue
        each = size(recovered(seen, number))
        at = np.full((len(link.model.nodes), len(each)), np.nan)
        np.fmax.at(at, maps_of(link).nodes, each.T)
        found[number] = at.T
    return found


def surface_stress(run: BodyRun) -> list[SurfaceStress]:
    """Where to look for that of each shell of a scene of bodies."""
    built = run.assembly.system.start.poses
    every = run.assembly.shells.values()
    return [SurfaceStress(own.elements, built, own.cells, len(own.nodes)) for own in every]


def largest(stress: Array) -> Array:
    """(n,) of (n, 3, 6) at bottom, middle and top [Pa]."""
    return np.asarray(_MPA * von_mises(stress).max(axis=1))


def holds_none(run: Run, shade: Shade) -> SceneError:
    """The error where nothing of a run holds any."""
    bodies, links = ("link or shell", "a solid or shell link") if shade is STRESS else ("link", "a link of beams")
    message = f"no {bodies} of this run holds {'stress' if shade is STRESS else 'section forces'}"
    remedy = f'add "[recovery]" with "all = true" to the description of {links}, and simulate again'
    return SceneError(Cause.BAD_FIELD, message, where="color", value=run.title, remedy=remedy)
