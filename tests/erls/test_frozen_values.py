"""Equations of motion against frozen values, and against their energy."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import chain_cases
import frozen_values
import numpy as np
import pytest
from chain_cases import State
from frozen_values import TABLES, Values

from erls.equations.loops.closed_chain import ClosedChain
from erls.equations.quasi_static.formulation import QuasiStatic

SAME = 1e-10  # relative: about a hundred terms are summed in another order
ALL = [(table, case) for table, content in TABLES.items() for case in content.cases]
TREES = [(table, case) for table, case in ALL if "quasi" not in table and "loops" not in table]
CONSERVED = [(table, case) for table, case in TREES if "without" not in case and "only" not in case]
"""Where every effect comes with all its forces."""
CLOSED = [(table, case) for table, case in ALL if "loops" in table]


@pytest.fixture(scope="module")
def tables() -> dict[str, dict[str, list[tuple[State, Values]]]]:
    """What was read, by table."""
    return {}


def _read(tables: dict[str, Any], table: str, case: str) -> list[tuple[State, Values]]:
    if table not in tables:
        tables[table] = frozen_values.read(table)
    return list(tables[table][case])


def _free(system: Any) -> int:
    """Coordinates of joints."""
    if isinstance(system, QuasiStatic):
        return system.size - len(system.modes.frequencies_hz)
    return len((system.bare if isinstance(system, ClosedChain) else system).free_joints)


@pytest.mark.parametrize(("table", "case"), ALL)
def test_the_equations_are_those_of_the_table(table: str, case: str, tables: dict[str, Any], tmp_path: Path) -> None:
    """Residual, matrices, acceleration by methods and by compiled functions, and what runs report."""
    system = TABLES[table].build(tmp_path, case)
    states = _read(tables, table, case)
    if isinstance(system, QuasiStatic):
        system = frozen_values.in_frozen_modes(system, states[0][1])
    for at, frozen in states:
        ways = [frozen_values.functions(system, at), frozen_values.outputs(system, frozen_values.closed(at, frozen))]
        if system.compiled is not None:
            ways.append(chain_cases.evaluate(system.compiled, at))
        for found in ways:
            if "acceleration" not in frozen:
                found.pop("acceleration", None)
            problems = frozen_values.compare(found, frozen, SAME, _free(system))
            if problems and isinstance(system, ClosedChain):
                rounding = frozen_values.disturbed(system, frozen_values.closed(at, frozen))
                problems = frozen_values.compare(found, frozen, SAME, _free(system), rounding)
            assert not problems


def test_a_difference_is_named() -> None:
    """`compare` says which entry of which quantity differs."""
    at, frozen = frozen_values.read("chains")["five links"][0]
    moved = frozen["mass"].copy()
    moved[3, 4] += 1e-6 * np.abs(moved).max()
    (problem,) = frozen_values.compare({"mass": moved, "residual": frozen["residual"]}, frozen, 1e-10, 5)
    assert problem.startswith("mass[3, 4]: ")
    assert problem.endswith("1.0e-06 of its scale")
    assert len(at.y) == len(moved)


def _power(system: Any, at: State) -> tuple[float, float]:
    """Power of drives, dampers, friction and of what is out of balance [W]; and the sum of their terms' moduli."""
    mechanism, state = system.mechanism, system.state(at.t, at.y, at.v)
    parts = [float(x) for x in at.v * system.residual(at.t, at.y, at.v, at.a)]
    moving = [*zip(mechanism.joints, state.angles, state.rates, strict=True)]
    if isinstance(system, ClosedChain):
        efforts = [reaction.effort for reaction in system.reactions(at.t, at.y, at.v)]
        for k, loop in enumerate(mechanism.loops):
            if loop.freedom is not None:
                moving.append((loop.freedom, *system.loop_motion(at.t, at.y, at.v, k)))
                efforts.append(system.loop_effort(at.t, at.y, at.v, k))
    else:
        efforts = [reaction.effort for reaction in system.reactions_at(at.t, at.y, at.v, at.a)]
    for (joint, angle, rate), effort in zip(moving, efforts, strict=True):
        parts.append(effort * rate)
        if joint.drive.prescribed:  # its effort is that of the motor alone
            parts.append(joint.forces.force(angle, rate) * rate)
        parts.append(joint.forces.stiffness * (angle - joint.forces.rest) * rate)  # a spring stores it
    damping = np.concatenate([link.damping for link in mechanism.links])
    bend = at.v[len(at.v) - len(damping) :]
    parts += [-float(x) for x in damping * bend**2]
    return sum(parts), float(np.abs(parts).sum())


@pytest.mark.parametrize(("table", "case"), CONSERVED)
def test_energy_changes_by_the_power_of_all_forces(
    table: str, case: str, tables: dict[str, Any], tmp_path: Path
) -> None:
    """d(T + V)/dt by central differences along a motion with these accelerations (Richardson, of order 6)."""
    system = TABLES[table].build(tmp_path, case)

    def energy(at: State, h: float) -> float:
        y, v = at.y + h * at.v + h * h / 2 * at.a, at.v + h * at.a
        return float(system.energy(at.t + h, y, v).total)

    for at, _ in _read(tables, table, case):
        ways = [(energy(at, h) - energy(at, -h)) / (2 * h) for h in (4e-5, 2e-5, 1e-5)]
        better = [(4 * fine - coarse) / 3 for coarse, fine in pairwise(ways)]
        change = (16 * better[1] - better[0]) / 15
        power, size = _power(system, at)
        assert change == pytest.approx(power, abs=1e-9 * size)


@pytest.mark.parametrize(("table", "case"), CLOSED)
def test_energy_of_loops_changes_by_the_power_of_all_forces(
    table: str, case: str, tables: dict[str, Any], tmp_path: Path
) -> None:
    """Reactions of loops do no work beside that of motors: the energy of the chain, which changes by the power of what
    is out of balance in it (above), and of springs and rotors in closing joints, by the efforts that runs report.
    """
    system = TABLES[table].build(tmp_path, case)
    for at, frozen in _read(tables, table, case):
        here = frozen_values.closed(at, frozen)
        a, multipliers, found = system.accelerations(here.t, here.y, here.v)
        here = replace(here, a=a)
        change, size = _power(system.bare, here)
        # closing by a square of conditions leaves rates open, and every further one moves them by as much
        left = multipliers * found.rate
        change += float(left.sum())
        for loop, moves, acts in zip(system.mechanism.loops, found.moves, found.efforts, strict=True):
            if (free := loop.freedom) is not None:
                turning = float(moves[free.freedom.row, system.bare.free] @ here.a) + acts.turning
                pull = free.forces.stiffness * (acts.coordinate - free.forces.rest) + free.rotor_inertia * turning
                change += pull * acts.rate
        assert change == pytest.approx(_power(system, here)[0], abs=1e-9 * size + 10 * np.abs(left).sum())


@pytest.mark.parametrize(("table", "case"), TREES)
def test_the_mass_matrix_is_the_curvature_of_kinetic_energy(
    table: str, case: str, tables: dict[str, Any], tmp_path: Path
) -> None:
    """uᵀ M w = ∂²T/∂v² along random u and w; T is quadratic in v, so that differences are exact."""
    system = TABLES[table].build(tmp_path, case)
    rng = np.random.default_rng(7)
    for at, _ in _read(tables, table, case):
        mass = system.mass_matrix(at.t, at.y)
        for u, w in rng.standard_normal((4, 2, system.size)):
            kinetic = [[a * b * system.energy(at.t, at.y, a * u + b * w).kinetic / 4 for a in (1, -1)] for b in (1, -1)]
            size = np.abs(u) @ np.abs(mass) @ np.abs(w)
            assert np.sum(kinetic) == pytest.approx(u @ mass @ w, abs=1e-12 * size)
