"""Mean forces of vibrations on slow joints: P. L. Kapitza's pendulum, and scenes that start suddenly."""

from __future__ import annotations

import csv
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import scenes
from random_references import limited_run
from random_scenes import random_scene

from erls.accuracy import slow_answer
from erls.accuracy.mean_vibration_forces import _PHASES_SUDDEN, mean_forces
from erls.accuracy.modes import modes_error
from erls.scene.read import load_chain
from fe_import import load_link, reduce_link
from fe_import.modal.file import write_modal_file

STORED = Path(__file__).resolve().parents[1] / "data" / "random_scenes.csv"

SUPPORT, BOB, LENGTH, STIFFNESS, LOAD = 3.0, 0.2, 0.5, 4e6, 40.0
"""kg, kg, m, N/m, N: a point on a spring along y, which a load pulls from the start on, and a pendulum on it."""
BOTH = np.arange(2)  # coordinates that vibrate


def springs(count: int) -> Any:
    """Links that are nothing but a spring each."""
    model = SimpleNamespace(thermal=None)
    link = SimpleNamespace(stiffness=np.array([STIFFNESS]), elastic_modes=1, model=model)
    return SimpleNamespace(links=[link] * count)


def on_a_spring(angle: float, damping: float = 0.0) -> tuple[Any, Any]:
    """Equations of a pendulum, at an angle from the vertical, on a support that a spring holds; what `mean_forces` asks
    of them, and forces out of balance. Coordinates: angle, height of the support.
    """
    coupling = BOB * LENGTH

    def forces(t: Any, y: Any, v: Any, a: Any) -> Any:
        sine, cosine = np.sin(y[:, 0]), np.cos(y[:, 0])
        turning = BOB * LENGTH**2 * a[:, 0] - coupling * sine * a[:, 1]
        lifting = (SUPPORT + BOB) * a[:, 1] - coupling * (sine * a[:, 0] + cosine * v[:, 0] ** 2)
        return np.stack([turning, lifting + STIFFNESS * y[:, 1] + damping * v[:, 1] - LOAD], axis=1)

    shared = -coupling * np.sin(angle)
    mass = np.array([[BOB * LENGTH**2, shared], [shared, SUPPORT + BOB]])
    equations = SimpleNamespace(
        mechanism=springs(1),
        free_joints=[0],
        stiffness_and_damping=lambda t, y, v: (np.diag([0.0, STIFFNESS]), np.diag([0.0, damping])),
        mass_matrix=lambda t, y: mass,
    )
    return equations, forces


@pytest.mark.parametrize("degrees", [20.0, 60.0, 90.0, 150.0])
def test_a_support_that_shakes_turns_a_pendulum_as_kapitza_says(degrees: float) -> None:
    """Sov. Phys. JETP 21 (1951): the mean moment is m A² ω² sin φ cos φ / 2, towards the direction of shaking. To the
    cube of the angle A sin φ / L by which the pendulum shakes, 1e-5: 2e-10 of the largest.
    """
    angle = np.radians(degrees)
    equations, forces = on_a_spring(angle)
    edges, start = np.array([0.0, 1.0]), np.array([angle, 0.0])
    found = mean_forces(equations, forces, 0.0, start, np.zeros(2), BOTH, np.zeros(2), edges)
    amplitude, square = LOAD / STIFFNESS, STIFFNESS / (SUPPORT + BOB * np.cos(angle) ** 2)
    largest = BOB * amplitude**2 * square / 2
    assert found[0, 0] == pytest.approx(largest * np.sin(angle) * np.cos(angle), rel=0, abs=1e-8 * largest)


@pytest.mark.parametrize("coupling", [0.0, 1e-13, 1e-12, 1e-11])
def test_equal_supports_shake_each_its_pendulum(coupling: float) -> None:
    """Two of them, under a load and half of it: modes of a pair of equal frequencies are what rounding, or a spring of
    no strength between the supports, makes them; what each does to its pendulum is not.
    """
    angle = 0.7
    one, forces_of_one = on_a_spring(angle)
    own, half = [0, 2], [1, 3]  # angles first
    mass, stiffness = np.zeros((4, 4)), np.diag([0.0, 0.0, STIFFNESS, STIFFNESS])
    for places in (own, half):
        mass[np.ix_(places, places)] = one.mass_matrix(0.0, None)
    stiffness[2:, 2:] += coupling * STIFFNESS * np.array([[1.0, -1.0], [-1.0, 1.0]])
    equations = SimpleNamespace(
        mechanism=springs(2),
        free_joints=[0, 1],
        stiffness_and_damping=lambda t, y, v: (stiffness, np.zeros((4, 4))),
        mass_matrix=lambda t, y: mass,
    )

    def forces(t: Any, y: Any, v: Any, a: Any) -> Any:
        result = np.zeros_like(y)
        for places in (own, half):
            result[:, places] = forces_of_one(t, y[:, places], v[:, places], a[:, places])
        result[:, 3] += LOAD / 2
        return result

    start, none, edges = np.array([angle, angle, 0.0, 0.0]), np.zeros(4), np.array([0.0, 1.0])
    alone = mean_forces(one, forces_of_one, 0.0, np.array([angle, 0.0]), np.zeros(2), BOTH, np.zeros(2), edges)[0, 0]
    found = mean_forces(equations, forces, 0.0, start, none, np.arange(4), none, edges)
    assert found[0] == pytest.approx([alone, alone / 4], rel=1e-6)


def test_it_dies_out_with_the_energy_of_the_vibration() -> None:
    """Means of exp(-2 ζ ω t) over stretches that are longer and shorter than it lasts; damping of either kind."""
    angle, rate = 0.7, 30.0  # 2 ζ ω, 1/s
    modal = SUPPORT + BOB * np.cos(angle) ** 2  # kg that move with the support
    edges, start = np.array([0.0, 1e-3, 0.1, 2.0]), np.array([angle, 0.0])
    none, more = np.zeros(2), np.array([0.0, rate * modal])
    undamped, other = on_a_spring(angle), on_a_spring(angle, rate * modal)
    steady = mean_forces(*undamped, 0.0, start, none, BOTH, none, edges)[0, 0]
    means = np.diff(-np.exp(-rate * edges) / rate) / np.diff(edges)
    for equations, damping in ((undamped, more), (other, none)):
        found = mean_forces(*equations, 0.0, start, none, BOTH, damping, edges)
        assert found[:, 0] == pytest.approx(steady * means, rel=1e-9)


def test_coordinates_that_do_not_vibrate_set_nothing_off() -> None:
    """The pendulum alone, its support held where it is; without elastic coordinates nothing vibrates."""
    start = np.array([0.7, 0.0])
    found = mean_forces(*on_a_spring(0.7), 0.0, start, np.zeros(2), BOTH[:1], np.zeros(2), np.array([0.0, 1.0]))
    assert np.array_equal(found, np.zeros((1, 1)))


def test_joints_on_their_springs_count_as_no_vibration_of_links() -> None:
    """The same spring, which holds a joint: what it is off by is drift, and counted there."""
    equations, forces = on_a_spring(0.7)
    link = SimpleNamespace(stiffness=np.zeros(1), elastic_modes=1, model=SimpleNamespace(thermal=None))
    equations.mechanism = SimpleNamespace(links=[link])
    start, none = np.array([0.7, 0.0]), np.zeros(2)
    assert not mean_forces(equations, forces, 0.0, start, none, BOTH, none, np.array([0.0, 1.0])).any()


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_friction_in_a_joint_that_shakes_is_less_than_it_was(share: float) -> None:
    """Coulomb's, of a joint that turns at a share of the rate at which it shakes: 2/π asin(share) of it is left, as
    dither is known to do (G. Zames, N. A. Shneydor, IEEE Trans. Autom. Control 21, 1976). It jumps: to 2 of 32 phases.
    """
    angle, friction = np.pi / 2, 1e-3
    equations, forces = on_a_spring(angle)
    square = STIFFNESS / (SUPPORT + BOB * np.cos(angle) ** 2)
    rate = share * LOAD / STIFFNESS * np.sqrt(square) / LENGTH  # the bob stays where it is, the support passes it

    def rubbed(t: Any, y: Any, v: Any, a: Any) -> Any:
        result = forces(t, y, v, a)
        result[:, 0] += friction * np.sign(v[:, 0])
        return result

    start, v, none, edges = np.array([angle, 0.0]), np.array([rate, 0.0]), np.zeros(2), np.array([0.0, 1.0])
    smooth = mean_forces(equations, forces, 0.0, start, v, BOTH, none, edges, _PHASES_SUDDEN)[0, 0]
    found = mean_forces(equations, rubbed, 0.0, start, v, BOTH, none, edges, _PHASES_SUDDEN)[0, 0] - smooth
    left = 1 + found / friction
    assert left == pytest.approx(2 / np.pi * np.arcsin(share), abs=2 / _PHASES_SUDDEN)


def as_modal_files(path: Path) -> Path:
    """A scene whose links are read from what reductions wrote."""
    data = scenes.read_toml(path)
    for link in data["links"]:
        file = f"{link['name']}.modal.h5"
        write_modal_file(path.with_name(file), reduce_link(load_link(path.with_name(link.pop("model")))))
        link["modal_file"] = file
    return scenes.write_toml(path.with_name("from_files.toml"), data)


@pytest.mark.parametrize(
    ("seed", "lacking", "filed"), [(1087, 1.0, False), (1590, 1.0, False), (1412, 1.6, False), (1087, 1.0, True)]
)
def test_joints_that_drift_for_vibrations_of_the_start_are_told(
    seed: int, lacking: float, filed: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Random scenes that start suddenly, their vibrations of other modes than those kept: against runs with all modes.
    1412 starts with links bent as they are at rest, and lets them go. A modal file is judged by the highest third of
    its modes, which may count for more than what it left out. Without these forces the estimate is too low, or nearly.
    """
    with STORED.open(encoding="utf-8", newline="") as stream:
        actual = next(float(row["modes"].split()[-1]) for row in csv.DictReader(stream) if row["seed"] == str(seed))
    path = random_scene(seed).write(tmp_path)
    run = limited_run(load_chain(as_modal_files(path) if filed else path))
    error = modes_error(run).error
    assert error is not None
    assert actual <= error <= (100 if filed else 20) * actual
    monkeypatch.setattr(slow_answer, "mean_vibration_forces", lambda *_: 0.0)
    less = modes_error(run).error
    assert less is not None
    assert less < lacking * actual
