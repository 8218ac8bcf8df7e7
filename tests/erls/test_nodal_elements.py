"""Elements and joints of nodal systems: against frozen values and energy; derivatives by complex steps."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import nodal_cases
import nodal_tables
import numpy as np
import pytest
from nodal_tables import CASES, TIME

from erls.equations.consistency import consistent_velocity
from erls.equations.nodal import outputs, sums
from erls.equations.nodal.assembly import NodalSystem
from erls.equations.nodal.layout import Flat
from erls.equations.nodal.nodes import Nodes, numbers_of
from erls.maths import motion_maps as motions
from erls.maths.jit import any_scalar, plain
from erls.maths.saddle import dense
from erls.maths.so3 import Array

H, E = 1e-30, 1e-5  # complex steps, and those of central differences


@pytest.fixture(scope="module")
def frozen() -> dict[str, dict[str, Array]]:
    """What was read."""
    return nodal_tables.read()


@pytest.mark.parametrize("case", CASES)
def test_values_are_those_of_the_table(case: str, frozen: dict[str, dict[str, Array]]) -> None:
    """Residual, matrices, conditions, energies, joints, and what a run keeps, to 1e-12 of the largest entry."""
    found = nodal_tables.evaluate(CASES[case]())
    assert found.keys() == frozen[case].keys()
    for name, values in found.items():
        expected = frozen[case][name]
        np.testing.assert_allclose(values, expected, rtol=0, atol=1e-12 * np.abs(expected).max(initial=0.0))


class Complex:
    """A system at a configuration with complex numbers, compiled or plain."""

    def __init__(self, system: NodalSystem, q: Nodes, of: Callable[[Any], Any]) -> None:
        self._move, self._forces, self._energies = of(sums.move), of(sums.forces), of(outputs.energies)
        known = system.flat
        flat = Flat(known.reals.astype(complex), known.integers, known.scratch.astype(complex), 0)
        sample = system.samples(np.array([TIME]))[0]
        flat.scratch[: len(sample)] = sample
        self.model, self._work = flat.model(), flat.work()
        self._memory, self._start = (flat.reals, flat.integers, flat.scratch), numbers_of(q).astype(complex)

    def _at(self, increment: Array, v: Array, a: Array, multipliers: Array) -> Any:
        work = self._work
        work.increment[:], work.v[:], work.a[:], work.multipliers[:] = increment, v, a, multipliers
        self._move(*self._memory, self._start)
        return work

    def forces(self, *motion: Array) -> Array:
        """(n + m,) residual with the forces of the joints, and violations."""
        work = self._at(*motion)
        self._forces(*self._memory, self._start)
        return np.concatenate([work.force + work.reaction, work.violation])

    def energies(self, *motion: Array) -> Array:
        """(5,)"""
        self._at(*motion)
        out = np.zeros(5, dtype=complex)
        self._energies(*self._memory, out)
        return out


def _somewhere(case: str) -> tuple[NodalSystem, Nodes, list[Array]]:
    """A system, a configuration off its start, and increment (none), velocity, acceleration, multipliers."""
    system = CASES[case]()
    increment, v, a, multipliers = nodal_cases.state(system)
    return system, system.compose(system.start, increment), [0 * increment, v, a, multipliers]


@pytest.mark.parametrize("case", CASES)
def test_complex_steps_through_the_residual(case: str) -> None:
    """By state, velocity, acceleration, multipliers and each real constant: against central differences, and against
    mass matrix, gradients of the conditions and exact tangents. Compiled for complex numbers on demand.
    """
    system, q, motion = _somewhere(case)
    complex_one, n = Complex(system, q, any_scalar), system.size

    def check(with_change: Callable[[complex], Array], scale: float) -> Array:
        slope: Array = with_change(1j * H).imag / H
        difference = (with_change(E * scale) - with_change(-E * scale)).real / (2 * E * scale)
        np.testing.assert_allclose(slope, difference, rtol=0, atol=1e-6 * max(1.0, np.abs(slope).max(initial=0.0)))
        return slope

    jacobians = []
    for k, values in enumerate(motion):
        columns = []
        for i in range(len(values)):
            changed = [x.astype(complex) for x in motion]

            def moved(step: complex, k: int = k, i: int = i, changed: list[Array] = changed) -> Array:
                changed[k][i] = motion[k][i] + step
                return complex_one.forces(*changed)

            columns.append(check(moved, 1.0))
        jacobians.append(np.array(columns).reshape(len(values), n + system.constraints).T)
    gradient, mass = dense(system.constraint_matrix(TIME, q)), dense(system.mass_matrix(TIME, q))
    if system.local and case != "springs SE(3)":  # whose dampers iterations alone know
        for found, jacobian in zip(system.exact_stiffness_and_damping(TIME, q, *motion[1:]), jacobians, strict=False):
            largest = np.abs(jacobian).max()
            np.testing.assert_allclose(dense(found), jacobian[:n], rtol=0, atol=1e-14 * largest)
    np.testing.assert_allclose(jacobians[0][n:], gradient, rtol=0, atol=1e-12 * np.abs(gradient).max(initial=1.0))
    np.testing.assert_allclose(jacobians[2][:n], mass, rtol=0, atol=1e-12 * np.abs(mass).max())
    np.testing.assert_allclose(jacobians[3][:n], gradient.T, rtol=0, atol=1e-12 * np.abs(gradient).max(initial=1.0))

    for name, constants in complex_one.model._asdict().items():
        if name == "metres" or not isinstance(constants, np.ndarray) or constants.dtype != complex:
            continue
        for i in np.flatnonzero(np.isfinite(constants.real) & ((name != "pitches") | (constants.real != 0))):
            kept = constants.flat[i]

            def made(step: complex, i: int = int(i), constants: Array = constants, kept: complex = kept) -> Array:
                constants.flat[i] = kept + step
                found = complex_one.forces(*motion)
                constants.flat[i] = kept
                return found

            check(made, max(1.0, abs(kept)))


def _closed(system: NodalSystem) -> Nodes:
    """A chain with its joints closed, at prescribed coordinates where there are any."""
    poses = system.start.poses.copy()
    for k, joint in enumerate(system.rows.joints):
        twist = np.zeros(6)
        twist[2 if joint.type == "prismatic" else 5] = joint.motion(TIME)[0] if joint.motion else 0.2 * k
        inner = np.eye(4) if joint.inner < 0 else poses[joint.inner]
        poses[joint.outer] = inner @ joint.inner_frame @ motions.exp(twist) @ np.linalg.inv(joint.outer_frame)
    assert np.abs(system.constraint(TIME, system.at(poses))).max() < 1e-14
    return system.at(poses)


@pytest.mark.parametrize("case", CASES)
def test_energy_changes_by_the_power_of_all_forces(case: str) -> None:
    """d(T + V)/dt by a complex step: power of the residual, of drives, dampers and friction; without loads and dampers
    of springs, nor weight of beams, whose sections here are not those of any body. Forces in joints are along free
    directions where the joints are closed.
    """
    system, q, (_, v, a, multipliers) = _somewhere(case)
    for law in (system.model.springs[:, 7], system.model.windings[:, 4], system.model.loads, system.model.gravity[0]):
        law[:] = 0.0
    if "actuators" in case:
        q = _closed(system)
        v = consistent_velocity(system, TIME, q, v)
    complex_one = Complex(system, q, plain)
    change = complex_one.energies(1j * H * v, v + 1j * H * a, a, multipliers).imag.sum() / H
    acting = system.in_joints(TIME, q, v, a)
    law = system.model.actuators
    springs = law[:, 1] * (acting[:, 0] - law[:, 2])
    parts = [*(v * system.residual(TIME, q, v, a)), *((acting[:, 3] + springs) * acting[:, 1])]
    assert change == pytest.approx(sum(parts), abs=1e-12 * np.abs(parts).sum())


@pytest.mark.parametrize("case", CASES)
def test_the_mass_matrix_is_the_curvature_of_kinetic_energy(case: str) -> None:
    """uᵀ M w = ∂²T/∂v² along random u and w, T being quadratic in v; and M is symmetric."""
    system, q, _ = _somewhere(case)
    mass = dense(system.mass_matrix(TIME, q))
    np.testing.assert_allclose(mass, mass.T, rtol=0, atol=1e-14 * np.abs(mass).max())
    for u, w in np.random.default_rng(7).standard_normal((4, 2, system.size)):
        kinetic = [[b * c * system.energies(q, b * u + c * w)[0] / 4 for b in (1, -1)] for c in (1, -1)]
        assert np.sum(kinetic) == pytest.approx(u @ mass @ w, abs=1e-12 * (np.abs(u) @ np.abs(mass) @ np.abs(w)))


@pytest.mark.parametrize("case", CASES)
def test_plain_complex_numbers_give_the_real_parts(case: str) -> None:
    """The same source without the compiler."""
    system, q, motion = _somewhere(case)
    complex_one = Complex(system, q, plain)
    found = complex_one.forces(*motion)
    work = system.residual(TIME, q, motion[1], motion[2]), dense(system.constraint_matrix(TIME, q))
    expected = np.concatenate([work[0] + work[1].T @ motion[3], system.constraint(TIME, q)])
    np.testing.assert_allclose(found.real, expected, rtol=0, atol=1e-12 * np.abs(expected).max())
    assert not found.imag.any()
