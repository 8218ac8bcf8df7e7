"""Motion of geometrically exact beams against the public package's trajectories, with one iteration matrix."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from erls.equations.nodal.assembly import NodalSystem
from erls.equations.nodal.beam import Beams, lumped, straight
from erls.equations.nodal.joints import GROUND, Joint
from erls.equations.nodal.rigid_body import RigidBodies
from erls.equations.nodal.section import BeamSection, beam_section
from erls.integrate.base import hermite
from erls.integrate.constrained import ConstrainedOptions, ConstrainedSolution
from erls.integrate.lie_generalized_alpha import lie_generalized_alpha
from erls.maths.se3 import pose
from erls.maths.so3 import Array, rotation_x

WEIGHT = np.array([0, 0, -9.81])
UP = np.array([0.0, 0.0, 1.0])
DATA = Path(__file__).parents[1] / "data" / "l_shape_nonlinear_beam.csv"


def _l_shape(elements: int, lump: bool = False) -> NodalSystem:
    """Steel, 10 mm in the plane of the L, 30 mm across; axis along y through the first node."""
    e, density, g = 2e11, 7800.0, 2e11 / 2.66
    area, across, inside = 3e-4, 0.01 * 0.03**3 / 12, 0.03 * 0.01**3 / 12
    section = beam_section(
        e * area, (5 / 6 * g * area,) * 2, g * 7.8995079e-9, (e * across, e * inside),
        density * area, (density * across, density * inside),
    )  # fmt: skip
    leg = np.arange(1, elements + 1) / (2 * elements)
    points = np.zeros((2 * elements + 1, 3))
    points[1 : elements + 1, 0], points[elements + 1 :, 0] = leg, 0.5
    points[elements + 1 :, 1] = leg
    poses = np.array([pose(position=x) for x in points])
    beams = [straight((k, k + 1), points[k], points[k + 1], section, UP) for k in range(2 * elements)]
    axis = pose(rotation_x(-np.pi / 2))
    hinge = Joint("shoulder", "revolute", GROUND, 0, axis, axis)
    if not lump:
        return NodalSystem(poses, [Beams(beams, poses, WEIGHT)], [hinge])
    light = BeamSection(section.stiffness, np.zeros((6, 6)))
    massless = [straight((k, k + 1), points[k], points[k + 1], light, UP) for k in range(2 * elements)]
    return NodalSystem(poses, [Beams(massless, poses, WEIGHT), RigidBodies(lumped(beams, poses), WEIGHT)], [hinge])


def _swing(system: NodalSystem, end: float, step: float, matrix: str = "auto") -> ConstrainedSolution:
    options = ConstrainedOptions(step=step, iteration_matrix=matrix)
    found = lie_generalized_alpha(system, (0, end), system.start, np.zeros(system.size), options)
    assert found.failure is None
    return found


def _distance(found: ConstrainedSolution) -> float:
    """Largest distance of the tip from the reference [m]."""
    text = DATA.read_text(encoding="utf-8")
    names = [line for line in text.splitlines() if line.startswith("#")][-1].lstrip("# ").split(",")
    table = dict(zip(names, np.loadtxt(DATA, delimiter=",").T, strict=True))
    times = table["t"][table["t"] <= found.t[-1]]
    exact = np.stack([table[f"steel_tall_{axis}"][: len(times)] for axis in "xyz"], axis=1)
    places, _ = hermite(found.t, found.y[:, -12:-9], found.v[:, -12:-9], found.a[:, -12:-9], times)
    return float(np.linalg.norm(places - exact, axis=1).max())


def test_l_pendulum_against_the_public_package() -> None:
    """Over 0.12 s at 0.5 ms: second order in the elements, 4e-5 m with four of them on each leg."""
    coarse, fine = (_distance(_swing(_l_shape(n), 0.12, 5e-4)) for n in (2, 4))
    assert fine <= 4e-5
    assert np.log2(coarse / fine) == pytest.approx(2.0, abs=0.2)


def test_one_matrix_serves_the_whole_swing() -> None:
    """Frozen: one factorization beside that of the first accelerations, and the same motion to 1e-8 m."""
    frozen, fresh = (_swing(_l_shape(4), 0.1, 1e-3, m) for m in ("frozen", "update"))
    assert frozen.work.factorizations == 2
    assert fresh.work.factorizations > 100
    np.testing.assert_allclose(frozen.y, fresh.y, atol=1e-8)


def test_energy_of_the_swing() -> None:
    """ρ∞ = 1 damps nothing; the energy swings by what the elastic vibrations that the step misses hold."""
    system = _l_shape(2)
    options = ConstrainedOptions(step=5e-4, spectral_radius=1.0)
    energies: list[float] = []
    found = lie_generalized_alpha(system, (0, 0.06), system.start, np.zeros(system.size), options)
    assert found.failure is None
    for y, v in zip(found.y, found.v, strict=True):
        poses, twists = _state(y, v)
        energies.append(sum(system.energy(0.0, system.at(poses), twists)))
    exchanged = 2.34 * 9.81 * 0.015
    assert np.ptp(energies) < 1e-3 * exchanged


def _state(y: Array, v: Array) -> tuple[Array, Array]:
    place, rate = y.reshape(-1, 12), v.reshape(-1, 12)
    turn, turning = (x[:, 3:].reshape(-1, 3, 3) for x in (place, rate))
    poses = np.array([pose(r, x) for r, x in zip(turn, place[:, :3], strict=True)])
    spin = np.swapaxes(turn, 1, 2) @ turning
    omega = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)
    slide = (np.swapaxes(turn, 1, 2) @ rate[:, :3, None])[:, :, 0]
    return poses, np.concatenate([slide, omega], axis=1).ravel()


def test_lumped_and_consistent_masses_agree_in_the_limit() -> None:
    """Tips at 0.1 s with 2, 4 and 8 elements a leg: the difference falls with the square of their length."""
    gaps = []
    for elements in (2, 4, 8):
        tips = [_swing(_l_shape(elements, lump), 0.1, 2e-3).y[-1, -12:-9] for lump in (False, True)]
        gaps.append(np.linalg.norm(tips[0] - tips[1]))
    assert gaps[0] > 1e-4
    np.testing.assert_allclose(np.log2(np.divide(gaps[:-1], gaps[1:])), 2.0, atol=0.3)
