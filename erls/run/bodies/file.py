"""What the file of a run of bodies holds beside what all hold: the knots of a motion, or equilibria and modes."""

from __future__ import annotations

from typing import Any

import h5py
import msgspec
import numpy as np

from erls.equations.nodal.scenes.build import Assembly, assemble
from erls.equations.nodal.statics import Equilibrium, Statics, Turn
from erls.integrate.constrained import ConstrainedSolution
from erls.run.bodies.motion import BodyMotion
from erls.run.bodies.rest import BodyPath, BodyRest, Modes
from erls.run.knots import End, read_solution, write_solution
from erls.scene.bodies.analyses import Buckling, Continuation, Dynamics, Frequencies
from erls.scene.bodies.schema import BodyScene
from fe_import.errors import ReportedError
from fe_import.files.hdf5.files import write_array, write_attribute, write_strings
from fe_import.files.hdf5.values import Reader


def write_bodies(group: h5py.Group, run: BodyMotion | BodyRest) -> None:
    """Names of all nodes, and their places at every step."""
    write_strings(group, "node_names", tuple(run.assembly.numbers), "in the order of nodes")
    if isinstance(run, BodyMotion):
        solution = run.solution
        write_solution(group, solution, "m, 1", "knot; of each node position and rows of its rotation matrix")
        write_array(group, "knots/multipliers", solution.multipliers, "N, N m", "knot, condition of a connection")
        return
    path, count = run.statics.path, run.assembly.system.count
    write_array(group, "equilibria/load", np.array([e.t for e in path]), "1", "load parameters of the load steps")
    poses = np.array([e.q.poses for e in path]).reshape(len(path), count, 4, 4)
    write_array(group, "equilibria/poses", poses, "m, 1", "load step, node, homogeneous matrix")
    multipliers = np.array([e.multipliers for e in path]).reshape(len(path), run.assembly.system.constraints)
    write_array(group, "equilibria/multipliers", multipliers, "N, N m", "load step, condition of a connection")
    iterations = np.array([e.iterations for e in path], dtype=np.int64)
    write_array(group, "equilibria/iterations", iterations, "1", "that each load step took")
    if isinstance(run, BodyPath):
        write_array(group, "equilibria/arc", run.times, "1", "length of the path up to each step")
        unstable = np.array([e.unstable for e in path], dtype=np.int64)
        write_array(group, "equilibria/unstable", unstable, "1", "ways in which each equilibrium is unstable")
        turns = run.statics.turns
        write_strings(group, "turns/kind", tuple(x.kind for x in turns), "limit points and bifurcations")
        write_array(group, "turns/load", np.array([x.t for x in turns]), "1", "their load parameters")
        write_array(group, "turns/arc", np.array([x.arc for x in turns]), "1", "how far along the path")
        write_array(group, "turns/ways", np.array([x.ways for x in turns], dtype=np.int64), "1", "at once")
    for name in ("factorizations", "cut_steps"):
        write_attribute(group["equilibria"], name, int(getattr(run.statics, name)))
    write_strings(group, "tangents", msgspec.json.encode(run.tangents).decode(), "work of each tangent, as JSON")
    if run.modes is not None:
        unit = "Hz" if run.modes.quantity == "frequency_hz" else "1"
        write_array(group, "modes/values", run.modes.values, unit, run.modes.quantity)
        write_array(group, "modes/moved", run.modes.moved, "1", "mode, node, how it moves in the world")
        write_array(group, "modes/turned", run.modes.turned, "rad/m", "mode, node, how it turns in the world")


def read_bodies(file: Reader, scene: BodyScene, end: End) -> BodyMotion | BodyRest:
    """The run of a scene of bodies.

    Raises
    ------
    SceneError, FEImportError
        Anything wrong inside.
    """
    try:
        assembly = assemble(scene)
    except ReportedError as problem:
        problem.where = f"{file.where}: /scene: {problem.where}"
        raise
    names = file.names("node_names", assembly.system.count)
    if names != tuple(assembly.numbers):
        raise file.fail("node_names", "not the nodes of the scene", names)
    shared = (scene, assembly, end.wall_s, end.warnings)
    if isinstance(scene.record.simulation, Dynamics):
        s = read_solution(file, 12 * assembly.system.count, end.failure)
        multipliers = file.subgroup("knots").array("multipliers", (len(s.t), assembly.system.constraints))
        return BodyMotion(*shared, ConstrainedSolution(s.t, s.y, s.v, s.a, s.work, s.failure, multipliers=multipliers))
    tangents: dict[str, Any] = {}
    try:
        tangents = msgspec.json.decode(file.text("tangents"), type=dict[str, dict[str, Any]])
    except (msgspec.DecodeError, RecursionError) as problem:
        raise file.fail("tangents", f"not JSON: {problem}") from None
    path = isinstance(scene.record.simulation, Continuation)
    statics = _statics(file, assembly, end, path)
    return (BodyPath if path else BodyRest)(*shared, statics, _modes(file, scene, assembly), tangents)


def _statics(file: Reader, assembly: Assembly, end: End, along_path: bool) -> Statics:
    group, system = file.subgroup("equilibria"), assembly.system
    loads = group.array("load", (None,))
    steps = len(loads)
    rising = "arc" if along_path else "load"
    arcs = group.array(rising, (steps,))
    if (np.diff(arcs) <= 0).any():
        raise group.fail(rising, "values must rise")
    unstable = group.integers("unstable", (steps,), 0).tolist() if along_path else [0] * steps
    poses = group.array("poses", (steps, system.count, 4, 4))
    multipliers = group.array("multipliers", (steps, system.constraints))
    iterations = group.integers("iterations", (steps,), 0).tolist()
    q, path = system.start, []
    for k in range(steps):
        q = system.at(poses[k], q)
        arc = float(arcs[k]) if along_path else 0.0
        path.append(Equilibrium(float(loads[k]), q, multipliers[k], iterations[k], arc, unstable[k]))
    factorizations, cut_steps = (group.attribute(name, int) for name in ("factorizations", "cut_steps"))
    turns = _turns(file) if along_path else ()
    return Statics(tuple(path), factorizations, cut_steps, end.failure, turns)


def _turns(file: Reader) -> tuple[Turn, ...]:
    group = file.subgroup("turns")
    loads = group.array("load", (None,))
    kinds = group.names("kind", len(loads))
    arcs, ways = group.array("arc", (len(loads),)), group.integers("ways", (len(loads),), 0)
    every = zip(kinds, loads.tolist(), arcs.tolist(), ways.tolist(), strict=True)
    return tuple(Turn(*x) for x in every)


def _modes(file: Reader, scene: BodyScene, assembly: Assembly) -> Modes | None:
    analysis = scene.record.simulation
    if not isinstance(analysis, (Buckling, Frequencies)) or "modes" not in file.names_inside():
        return None
    values = file.subgroup("modes").array("values", (None,))
    shape = len(values), assembly.system.count, 3
    moved, turned = (file.subgroup("modes").array(name, shape) for name in ("moved", "turned"))
    return Modes("load" if isinstance(analysis, Buckling) else "frequency_hz", values, moved, turned)
