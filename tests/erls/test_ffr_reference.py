"""FFR against nonlinear beams, an independent prototype and ERLS; a free body's momentum; every shipped scene."""

from __future__ import annotations

from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scenes
from scipy.integrate import solve_ivp

import erls
from erls.equations.ffr.body_frame import BODY_FRAMES, elastic_basis
from erls.equations.ffr.standard_data import StandardData
from erls.errors import SceneError
from erls.maths.so3 import Array, skew
from erls.run.chain.run import ChainRun

DATA = scenes.ROOT / "data"
SHIPPED = [
    str(p.relative_to(DATA)) for p in scenes.shipped() if "residual_bending" not in p.read_text(encoding="utf-8")
]  # those of nodal elements alone are no scenes of floating frames
HELD = '{ type = "motion", motion = { shape = "polynomial", from = 0.3, to = 0.3, duration = 1.0 } }'
EULER = {"theory": "euler-bernoulli", "torsion": "polar"}


def _table(name: str) -> dict[str, Array]:
    path = Path(__file__).parents[1] / "data" / f"{name}.csv"
    comments = [line for line in path.read_text(encoding="utf-8").splitlines() if line.startswith("#")]
    columns = comments[-1].lstrip("# ").split(",")
    return dict(zip(columns, np.loadtxt(path, delimiter=",").T, strict=True))


def _distance(run: ChainRun, point: str, table: dict[str, Array], prefix: str) -> float:
    rows = table["t"] <= run.end
    expected = np.stack([table[f"{prefix}_{axis}"][rows] for axis in "xyz"], axis=1)
    return float(np.linalg.norm(run.position(point, table["t"][rows]) - expected, axis=1).max())


@pytest.mark.parametrize(
    ("scene", "table", "point", "prefix", "limit"),
    [
        ("l_shape/steel_flat", "l_shape", "tip", "steel_flat", 2.5e-5),
        ("l_shape/steel_tall", "l_shape", "tip", "steel_tall", 1.5e-5),
        ("l_shape/aluminium", "l_shape", "tip", "aluminium", 3.5e-5),
        ("robot/two_link", "two_link", "end2", "end2", 7e-5),
    ],
)
def test_against_nonlinear_beam(scene: str, table: str, point: str, prefix: str, limit: float) -> None:
    """By the defaults; converged linear links stay within 3.2e-5, 1.5e-4, 3.9e-4 and 3.0e-4 m."""
    run = erls.simulate(erls.load_scene(DATA / f"{scene}.toml", ["simulation.formulation=ffr"]), verdict=False)
    assert run.end >= 1.5
    assert _distance(run, point, _table(f"{table}_nonlinear_beam"), prefix) <= limit


def test_against_an_independent_prototype(tmp_path: Path) -> None:
    """Tip of the L with 12 elastic modes over 0.3 s; 2e-6: 1e-6 of the prototype and 1e-6 of the step."""
    scenes.l_link(tmp_path, 2, frame=EULER, reduction={"fixed_interface_modes": 18, "elastic_modes": 12})
    simulation = {"duration": 0.3, "step": 1e-4, "spectral_radius": 1.0, "formulation": "ffr", "effects": "linear"}
    run = erls.simulate(scenes.l_scene(tmp_path, simulation=simulation), verdict=False)
    assert _distance(run, "tip", _table("l_shape_modal_ffr"), "tip") <= 2e-6


def _two_links(folder: Path, stiffer: float, **changes: Any) -> Path:
    """Two aluminium links on crossed axes, released from rest."""
    scenes.arm_link(
        folder,
        frame={"nodes": {"tip": [0.5, 0.0, 0.0]}},
        materials={"m": {"youngs_modulus": 7e10 * stiffer}},
        sections={"s": {"width": 0.01, "height": 0.01}},
        reduction={"fixed_interface_modes": 6, "elastic_modes": 6},
    )
    dh = {"convention": "standard", "a": 0.5, "alpha_deg": 90.0}
    data: dict[str, Any] = {
        "simulation": {"duration": 0.3, "step": 3e-4, "spectral_radius": 1.0},
        "base": {"rotation_deg": [-90.0, 0.0, 0.0]},
        "joints": [{"name": n, "dh": dh} for n in ("shoulder", "elbow")],
        "links": [{"name": n, "model": "arm.toml", "mesh_pose": {"frame": "joint"}} for n in ("upper", "lower")],
        "points": [{"name": "end", "link": "lower", "node": "tip"}],
    }
    return scenes.write_toml(folder / "two.toml", scenes.merged(data, changes))


def test_two_links_swing_as_in_erls(tmp_path: Path) -> None:
    """End of two free aluminium links over 0.3 s: within 3e-5 m (9e-6 with an explicit reference integrator)."""
    times = np.linspace(0, 0.3, 151)
    ends = [
        erls.simulate(_two_links(tmp_path, 1.0, simulation={"formulation": name}), verdict=False).position("end", times)
        for name in ("erls", "ffr")
    ]
    assert np.linalg.norm(np.ptp(ends[0], axis=0)) > 0.3
    assert np.linalg.norm(ends[0] - ends[1], axis=1).max() <= 3e-5


def _held(scene: Path, point: str, joints: list[str]) -> Array:
    """(3,) world position of a point in static equilibrium with the joints held."""
    run = erls.simulate(erls.load_scene(scene, [f"joints.{name}.drive={HELD}" for name in joints]), verdict=False)
    return run.position(point, 0.0)


@pytest.mark.parametrize("links", [1, 2])
def test_formulations_and_frames_differ_in_second_order(tmp_path: Path, links: int) -> None:
    """Static sag of the L and of two links: twice the modulus, half the deflection, a quarter of the distance, 1 %.

    Fields linear in one frame are linear in another to first order only: tips differ by φ x (u - φ x p / 2), φ the
    turn between the frames. One link in its tangent frame is the ERLS link: no distance but rounding.
    """
    variants = [("erls", "tangent"), ("ffr", "tangent"), ("ffr", "mean-axis")]
    distances = []
    for stiffer in (1.0, 2.0):
        ends = []
        for formulation, body_frame in variants:
            changes: dict[str, Any] = {
                "simulation": {
                    "duration": 1e-3,
                    "formulation": formulation,
                    "body_frame": body_frame,
                    "effects": "linear",
                },
                "initial": {"deformation": "static"},
            }
            if links == 1:
                scenes.l_link(tmp_path, 2, frame=EULER, materials={"m": {"youngs_modulus": 2e11 * stiffer}})
                ends.append(_held(scenes.l_scene(tmp_path, **changes), "tip", ["shoulder"]))
            else:
                ends.append(_held(_two_links(tmp_path, stiffer, **changes), "end", ["shoulder", "elbow"]))
        distances.append([np.linalg.norm(ends[k] - ends[0]) for k in (1, 2)])
    for tangent_or_mean, (one, two) in enumerate(zip(*distances, strict=True)):
        if links == 1 and tangent_or_mean == 0:
            assert one <= 1e-13
            continue
        assert 1e-7 < one < 3e-5
        assert one / two == pytest.approx(4.0, rel=0.01)


@pytest.mark.parametrize("body_frame", BODY_FRAMES)
def test_torques_of_the_robot_are_those_of_erls(body_frame: str) -> None:
    """Joint torques of the prescribed motion from static equilibrium, over 0.5 s: within 1e-3 of their peak.

    Released undeformed, links vibrate undamped and slowly drift out of phase instead.
    """
    changes = ["initial.deformation=static", "simulation.duration=0.5", "simulation.step=1e-3"]
    ours = ["simulation.formulation=ffr", f"simulation.body_frame={body_frame}"]
    runs = [
        erls.simulate(erls.load_scene(DATA / "robot/two_link.toml", [*changes, *c]), verdict=False) for c in ([], ours)
    ]
    times = np.linspace(0, 0.5, 101)
    for joint in runs[0].joint_names:
        expected, found = (run.joint_effort(joint, times) for run in runs)
        np.testing.assert_allclose(found, expected, atol=1e-3 * np.abs(expected).max())


@pytest.mark.parametrize("body_frame", BODY_FRAMES)
def test_free_link_keeps_momentum_and_energy(tmp_path: Path, body_frame: str) -> None:
    """A link that nothing holds, tumbling and vibrating: linear and angular momentum to 1e-10, energy to 1e-9.

    Relative to their size; explicit integrator at rtol 1e-11.
    """
    n = 2
    scenes.l_link(tmp_path, 2, reduction={"elastic_modes": n})
    link = scenes.mechanism(scenes.l_scene(tmp_path)).links[0]
    data = StandardData(link.invariants, elastic_basis(link, body_frame))
    rng = np.random.default_rng(3)

    def parts(z: Array) -> tuple[Array, Array, Array, Array, Array]:
        return z[:9].reshape(3, 3), z[9:12], z[12 : 12 + n], z[12 + n : 18 + n], z[18 + n :]

    def rate(t: float, z: Array) -> Array:
        turn, _, eta, twist, eta_rate = parts(z)
        wrench, elastic = data.forces(twist, np.zeros(6), eta, eta_rate, np.zeros(n))
        force = np.concatenate([wrench, elastic + link.stiffness * eta])
        acceleration = np.linalg.solve(data.mass_matrix(eta), -force)
        return np.concatenate([(turn @ skew(twist[3:])).ravel(), turn @ twist[:3], eta_rate, acceleration])

    def kept(z: Array) -> tuple[Array, Array, float]:
        turn, x, eta, twist, eta_rate = parts(z)
        p = data.momentum(twist, eta, eta_rate)
        linear = turn @ p[:3]
        energy = data.kinetic_energy(twist, eta, eta_rate) + 0.5 * link.stiffness @ eta**2
        return linear, turn @ p[3:] + np.cross(x, linear), float(energy)

    placed, bent = [*np.eye(3).ravel(), 0.3, -0.2, 0.1], rng.uniform(-1e-2, 1e-2, n)
    start = np.concatenate([placed, bent, rng.uniform(-10, 10, 6), rng.uniform(-1, 1, n)])
    end = solve_ivp(rate, (0.0, 0.1), start, method="DOP853", rtol=1e-11, atol=1e-12).y[:, -1]
    (p0, l0, e0), (p1, l1, e1) = kept(start), kept(end)
    assert np.linalg.norm(end[9:12] - start[9:12]) > 0.5
    assert np.linalg.norm(p1 - p0) <= 1e-10 * np.linalg.norm(p0)
    assert np.linalg.norm(l1 - l0) <= 1e-10 * np.linalg.norm(l0)
    assert e1 == pytest.approx(e0, rel=1e-9)


@pytest.mark.parametrize(("scene", "body_frame"), list(zip(SHIPPED, cycle(BODY_FRAMES), strict=False)))
def test_every_shipped_scene_runs(tmp_path: Path, scene: str, body_frame: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """All scenes of data/, in either body frame in turn, reported, written and read again; few of the curves in files,
    which have tests of their own.
    """
    monkeypatch.setattr("erls.run.file._OUTPUT_TIMES", 5)
    changes = ["simulation.formulation=ffr", f"simulation.body_frame={body_frame}", "simulation.duration=2e-3"]
    if "[inverse]" in (DATA / scene).read_text(encoding="utf-8"):
        changes.append("inverse.step=5e-4")
    run = erls.simulate(erls.load_scene(DATA / scene, changes))
    assert run.summary()["body_frame"] == body_frame
    point = run.point_names[-1]
    erls.save_run(tmp_path / "run.h5", run)
    again = erls.load_run(tmp_path / "run.h5")
    np.testing.assert_array_equal(again.position(point, 1e-3), run.position(point, 1e-3))


def test_unknown_body_frame_is_refused(tmp_path: Path) -> None:
    """With the field and the known names."""
    scenes.l_link(tmp_path, 2)
    with pytest.raises(SceneError, match="body_frame") as caught:
        erls.load_scene(scenes.l_scene(tmp_path, simulation={"body_frame": "mean axis"}))
    assert "tangent" in str(caught.value)
