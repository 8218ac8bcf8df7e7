"""Knots of a motion in a run file, and how the run ended."""

from __future__ import annotations

from typing import NamedTuple

import h5py
import msgspec
import numpy as np

from erls.errors import SimulationError
from erls.integrate.base import Solution, Work
from fe_import.files.hdf5.files import write_array, write_attribute
from fe_import.files.hdf5.values import Reader


class End(NamedTuple):
    """What a file says of every run: why it ended early, the time it took, warnings."""

    failure: SimulationError | None
    wall_s: float
    warnings: tuple[str, ...]


_CHOICE = "integrator chosen"
_NODES = "nodes per step"


def write_solution(group: h5py.Group, solution: Solution, unit: str, coordinates: str) -> None:
    """Knots and work; ``unit`` and meaning of the coordinates."""
    write_array(group, "knots/time", solution.t, "s", "times of the steps; twice where forces jump")
    for name, values, rate in (
        ("position", solution.y, unit),
        ("velocity", solution.v, "per s"),
        ("acceleration", solution.a, "per s^2"),
    ):
        write_array(group, f"knots/{name}", values, rate, coordinates)
    for name, count in msgspec.to_builtins(solution.work).items():
        write_attribute(group["knots"], name, int(count))
    if solution.choice:
        write_attribute(group["knots"], _CHOICE, solution.choice)
    if solution.nodes_per_step != 1:
        write_attribute(group["knots"], _NODES, solution.nodes_per_step)


def read_solution(file: Reader, size: int, failure: SimulationError | None) -> Solution:
    """The same of ``size`` coordinates.

    Raises
    ------
    SceneError
        RUN_FILE.
    """
    knots = file.subgroup("knots")
    t = knots.array("time", (None,))
    if not len(t) or (np.diff(t) < 0).any():
        raise file.fail("knots/time", "times must rise", None)
    work = Work(**{name: knots.attribute(name, int) for name in msgspec.to_builtins(Work())})
    y, v, a = (knots.array(name, (len(t), size)) for name in ("position", "velocity", "acceleration"))
    known = knots.attribute_names()
    choice = knots.attribute(_CHOICE, str) if _CHOICE in known else ""
    nodes = knots.attribute(_NODES, int) if _NODES in known else 1
    if not 1 <= nodes <= max(len(t), 1):
        raise file.fail(f"knots/@{_NODES}", "not a number of knots", nodes)
    return Solution(t, y, v, a, work, failure, choice=choice, nodes_per_step=nodes)
