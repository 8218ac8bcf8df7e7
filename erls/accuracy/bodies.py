"""What a run of bodies and beams states about its error: of the integration of motions, and of the mesh.

Beams are geometrically exact and nothing is left out, so that ``links`` and ``effects`` are zero. Their mesh is judged
by one of twice the elements along beams and both ways of shells, as that of chains is (`erls.accuracy.mesh_of_beams`).
"""

from __future__ import annotations

from dataclasses import replace

import msgspec
import numpy as np

from erls.accuracy.body_audits import body_audits
from erls.accuracy.constrained_integration import constrained_integration_error
from erls.accuracy.integration import SUDDEN
from erls.accuracy.mesh_of_beams import FINER, SHARE, larger_steps
from erls.accuracy.verdict import verdict
from erls.equations.nodal.scenes.build import assemble
from erls.equations.nodal.scenes.equilibria import equilibria
from erls.equations.nodal.scenes.shell_refined import refined_mesh
from erls.errors import Cause, SimulationError
from erls.integrate.base import hermite
from erls.integrate.choice import body_options
from erls.integrate.lie_generalized_alpha import lie_generalized_alpha
from erls.maths.so3 import Array
from erls.run.accuracy import Accuracy
from erls.run.bodies.motion import BodyMotion
from erls.run.bodies.rest import BodyRest
from erls.run.bodies.run import BodyRun
from erls.scene.bodies.analyses import Dynamics
from erls.scene.bodies.schema import BodyScene, BodySceneRecord, ShellSurface

_LOOKS = 101
_REMEDIES = {
    "integration": "a smaller simulation.tolerance, or a smaller step",
    "modes": "more elements per beam or shell (this part is their mesh)",
}


def stated_bodies(run: BodyMotion | BodyRest) -> BodyMotion | BodyRest:
    """The run with ``accuracy`` and ``trust``.

    Raises
    ------
    SimulationError
        INTERRUPTED.
    """
    tolerance, horizon = run.scene.record.simulation.tolerance, None
    unjudged: dict[str, str] = {}
    found: float | None = 0.0
    if isinstance(run, BodyMotion):
        known = constrained_integration_error(run)
        if isinstance(known, str):
            found, unjudged["integration"] = None, known
        else:
            found = known.total * (SUDDEN if run.scene.record.contacts else 1.0)
            if found > tolerance:
                horizon = known.horizon(tolerance)
    mesh, why = mesh_error(run)
    if mesh is None:
        unjudged["modes"] = why
    accuracy = Accuracy(found, mesh, 0.0, 0.0, 0.0, horizon=horizon, judged_at=run.point_names, unjudged=unjudged)
    breaches = []
    if isinstance(run, BodyMotion):
        breaches = [audit.text for audit in body_audits(run, accuracy.integration) if not audit.ok]
    return replace(run, accuracy=accuracy, trust=verdict(accuracy, breaches, tolerance, _REMEDIES))


def mesh_error(run: BodyRun) -> tuple[float | None, str]:
    """Of the reported nodes [m], from a mesh of twice the elements; None, and why, where that has no solution."""
    scene = run.scene
    if not (scene.record.beams or scene.record.shells):
        return 0.0, ""
    try:
        own, finer = _both(run, refined(scene))
    except SimulationError as problem:
        if problem.cause == Cause.INTERRUPTED:
            raise
        return None, f"the same with twice the elements fails: {problem}"
    apart = float(np.linalg.norm(own - finer, axis=-1).max(initial=0.0))
    return SHARE * apart, ""


def refined(scene: BodyScene) -> BodyScene:
    """The same with `FINER` times the elements; inner nodes that are named keep their places."""
    record = scene.record

    def renamed(name: str) -> str:
        return _renamed(name, record)

    def moved(item: object) -> object:
        own: dict[str, object] = {key: renamed(getattr(item, key)) for key in ("node", "to") if hasattr(item, key)}
        plane = getattr(item, "plane", None)
        if plane is not None:
            own["plane"] = msgspec.structs.replace(plane, on=renamed(plane.on))
        return msgspec.structs.replace(item, **own)  # type: ignore[type-var]

    finer = msgspec.structs.replace(
        record,
        beams=[msgspec.structs.replace(beam, elements=FINER * beam.elements) for beam in record.beams],
        shells=[_finer(shell, scene, f"shells[{k}]") for k, shell in enumerate(record.shells)],
        masses=[moved(x) for x in record.masses],
        connections=[moved(x) for x in record.connections],
        springs=[moved(x) for x in record.springs],
        loads=[moved(x) for x in record.loads],
        contacts=[moved(x) for x in record.contacts],
        report=[renamed(name) for name in record.report],
    )
    return replace(scene, record=finer)


def _finer(shell: ShellSurface, scene: BodyScene, place: str) -> ShellSurface:
    if shell.corners is None:
        return refined_mesh(shell, scene.folder, place)
    return msgspec.structs.replace(shell, elements=(FINER * shell.elements[0], FINER * shell.elements[1]))


def _renamed(name: str, record: BodySceneRecord) -> str:
    """A node of a beam or shell in a mesh of `FINER` times the elements."""
    part, *places = name.split("/")
    names = {beam.name for beam in record.beams} | {shell.name for shell in record.shells if shell.corners}
    inner = part in names and all(map(str.isdigit, places))
    return "/".join([part, *(str(FINER * int(k)) for k in places)]) if inner else name


def _both(run: BodyRun, scene: BodyScene) -> tuple[Array, Array]:
    """(k, p, 3) places of reported nodes in both meshes [m].

    Raises
    ------
    SimulationError
        The finer one has no solution.
    """
    finer = assemble(scene)
    nodes = [run.assembly.numbers[name] for name in run.point_names]
    others = [finer.numbers[_renamed(name, scene.record)] for name in run.point_names]
    if isinstance(run, BodyRest):
        analysis = run.scene.record.simulation
        assert not isinstance(analysis, Dynamics)
        statics = equilibria(finer.system, analysis)
        if statics.failure is not None:
            raise statics.failure
        here, there = run.statics.path[-1].q.poses, statics.path[-1].q.poses
        return here[nodes, :3, 3][None], there[others, :3, 3][None]
    assert isinstance(run, BodyMotion)
    settings, s = run.scene.record.simulation, run.solution
    assert isinstance(settings, Dynamics)
    options, times = replace(body_options(settings), follows_tolerance=False), (float(s.t[0]), run.end)
    found = lie_generalized_alpha(
        finer.system, times, finer.system.start, finer.velocity, options, plan=larger_steps(s)
    )
    if found.failure is not None:
        raise found.failure
    looks = run.spread(_LOOKS)
    columns = (12 * np.array(others)[:, None] + np.arange(3)).ravel()
    y, v, a = (x[:, columns] for x in (found.y, found.v, found.a))
    there = hermite(found.t, y, v, a, looks)[0].reshape(len(looks), len(others), 3)
    return run.poses(looks, nodes)[..., :3, 3], there
