"""The shipped scenes against nonlinear beams, published rows, natural frequencies, and conservation of energy."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scenes
import scipy.linalg as la

import erls
import erls.scene.build
from erls.equations.erls.formulation import Erls
from erls.run.chain.run import ChainRun

DATA = scenes.ROOT / "data"
EULER = {"theory": "euler-bernoulli"}


def _table(name: str) -> dict[str, np.ndarray]:
    path = Path(__file__).parents[1] / "data" / f"{name}.csv"
    lines = [line for line in path.read_text(encoding="utf-8").splitlines() if line.startswith("#")]
    columns = lines[-1].lstrip("# ").split(",")
    values = np.loadtxt(path, delimiter=",")
    return dict(zip(columns, values.T, strict=True))


def _distance(run: ChainRun, point: str, table: dict[str, np.ndarray], prefix: str) -> float:
    expected = np.stack([table[f"{prefix}_{axis}"] for axis in "xyz"], axis=1)
    return float(np.linalg.norm(run.position(point, table["t"]) - expected, axis=1).max())


@pytest.fixture(scope="module")
def runs() -> dict[str, ChainRun]:
    """The shipped L scenes, as they are; made when first asked for."""
    return {}


def _shipped(runs: dict[str, ChainRun], name: str, *changes: str) -> ChainRun:
    key = " ".join((name, *changes))
    if key not in runs:
        runs[key] = erls.simulate(erls.load_scene(DATA / name, changes), verdict=False)
    return runs[key]


@pytest.mark.parametrize(("case", "limit"), [("steel_flat", 2.5e-5), ("steel_tall", 1.5e-5), ("aluminium", 3.5e-5)])
def test_l_pendulum_against_nonlinear_beam(runs: dict[str, ChainRun], case: str, limit: float) -> None:
    """Tip over 2 s, by the defaults. Converged linear links stay within 3.2e-5, 1.5e-4, 3.9e-4 m."""
    run = _shipped(runs, f"l_shape/{case}.toml")
    assert run.end == 2.0
    assert _distance(run, "tip", _table("l_shape_nonlinear_beam"), case) <= limit


ROBOT = [
    ('simulation.gauge="joint-angle"', 7e-5),
    ('simulation.formulation="ffr"', 7e-5),
    # counted from a rigid chain, second-order displacements leave out what is of third order
    ('simulation.gauge="minimum-norm"', 1e-4),
    (scenes.LINEAR, 5e-4),
]


@pytest.mark.parametrize(("change", "limit"), ROBOT)
def test_robot_against_nonlinear_beam(runs: dict[str, ChainRun], change: str, limit: float) -> None:
    """Ends of both links over 1.5 s; converged linear links stay within 3.0e-4 m."""
    run = _shipped(runs, "robot/two_link.toml", change)
    table = _table("two_link_nonlinear_beam")
    assert _distance(run, "end2", table, "end2") <= limit
    assert _distance(run, "end1", table, "end1") <= limit


def test_three_links_against_nodal_beams(runs: dict[str, ChainRun]) -> None:
    """End of the third link over 1.5 s within 8e-5 m, and ERLS where FFR is, by the tolerance of both runs."""
    found = [_shipped(runs, "robot/three_link.toml", f"simulation.formulation={name}") for name in ("erls", "ffr")]
    table = _table("three_link_nodal_beam")
    for run in found:
        assert _distance(run, "end3", table, "end3") <= 8e-5
    one, other = (run.position("end3", table["t"]) for run in found)
    assert np.linalg.norm(one - other, axis=1).max() <= 5e-5


def test_table_3_with_fitted_material(runs: dict[str, ChainRun]) -> None:
    """The printed row 18 at 0.5 s within 6e-4 m and 0.08 deg (the fit's own accuracy), θ being the coordinate."""
    run = _shipped(runs, "l_shape/table3_fit.toml")
    assert np.degrees(run.joint_coordinate("shoulder", 0.5)) == pytest.approx(113.50, abs=0.08)
    np.testing.assert_allclose(run.position("elbow", 0.5), [-0.1970, -0.0637, -0.4596], atol=6e-4)
    np.testing.assert_allclose(run.position("tip", 0.5), [-0.2626, 0.4362, -0.5955], atol=6e-4)
    assert any("small displacements" in w for w in run.warnings)


def test_natural_frequencies_of_test_3() -> None:
    """Joint free, hub inertia, elbow mass: in plane and out of plane within 0.5 %."""
    scene = erls.load_scene(DATA / "l_shape/torque.toml", ['joints.0.drive={type="free"}'])
    equations = Erls(erls.scene.build.build_mechanism(scene).mechanism)
    y, v = equations.initial_state()
    stiffness, _ = equations.stiffness_and_damping(0.0, y, v)
    squared = la.eigh(stiffness, equations.mass_matrix(0.0, y), eigvals_only=True)
    found = np.sqrt(np.maximum(squared, 0)) / (2 * np.pi)
    assert found[0] < 1e-3
    expected = sorted([8.44, 23.16, 118.4, 173.8, 12.28, 31.0, 120.3, 151.9])
    np.testing.assert_allclose(found[1:9], expected, rtol=5e-3)


@pytest.mark.parametrize(
    ("modes", "angle", "elbow_y", "tip_z"),
    [
        (7, 128.1653, -0.515e-3, -0.395565),
        (8, 128.0981, -0.917e-3, -0.396249),
        (12, 128.0549, -1.266e-3, -0.396827),
        (18, 127.9995, -1.704e-3, -0.397509),
        (30, 127.9828, -1.832e-3, -0.397693),
    ],
)
def test_mode_counts_of_the_reference_table(
    tmp_path: Path, modes: int, angle: float, elbow_y: float, tip_z: float
) -> None:
    """Steel tall, Euler-Bernoulli, 4 elements, polar torsion, N modes at 0.5 s.

    The table rounds to 5e-7 m and 5e-5 deg; generalized-α at 0.025 ms adds up to 1.1e-4 deg (30 modes; Radau at rtol
    1e-5 gives the printed digits, ten times slower).
    """
    scenes.l_link(
        tmp_path,
        2,
        frame={**EULER, "torsion": "polar"},
        reduction={"fixed_interface_modes": 18, "elastic_modes": modes - 6},
    )
    run = erls.simulate(
        scenes.l_scene(tmp_path, simulation={"duration": 0.5, "step": 2.5e-5, "effects": "linear"}), verdict=False
    )
    assert np.degrees(run.joint_angle("shoulder", 0.5)) == pytest.approx(angle, abs=2e-4)
    assert run.position("elbow", 0.5)[1] == pytest.approx(elbow_y, abs=2e-6)
    assert run.position("tip", 0.5)[2] == pytest.approx(tip_z, abs=2e-6)


def test_gauges_agree_to_second_order(tmp_path: Path) -> None:
    """Joint-angle against minimum-norm gauge, steel tall, 18 modes N, 2 s: tip within 5e-5 m (2.7e-5 expected)."""
    scenes.l_link(
        tmp_path, 2, frame={**EULER, "torsion": "polar"}, reduction={"fixed_interface_modes": 18, "elastic_modes": 12}
    )
    times = np.linspace(0, 2, 401)
    tips = []
    for gauge in ("joint-angle", "minimum-norm"):
        run = erls.simulate(
            scenes.l_scene(tmp_path, simulation={"step": 2e-4, "gauge": gauge, "effects": "linear"}), verdict=False
        )
        tips.append(run.position("tip", times))
    distance = np.linalg.norm(tips[0] - tips[1], axis=1).max()
    assert 1e-6 < distance <= 5e-5


def _soft_two_links(folder: Path, mass: str, gauge: str) -> Path:
    """Two flexible links swinging freely, soft enough for an explicit method."""
    scenes.arm_link(
        folder,
        frame={"mass": mass},
        sections={"s": {"width": 0.012, "height": 0.008}},
        reduction={"fixed_interface_modes": 2, "elastic_modes": 2},
    )
    joints = [
        {"name": n, "dh": {"convention": "standard", "a": 0.5, "alpha_deg": angle}}
        for n, angle in (("shoulder", 90.0), ("elbow_joint", 0.0))
    ]
    links = [{"name": n, "model": "arm.toml", "mesh_pose": {"frame": "joint"}} for n in ("upper", "lower")]
    data: dict[str, Any] = {
        "simulation": {
            "duration": 0.5, "integrator": "dop853", "rtol": 1e-8, "gauge": gauge
        },
        "base": {"rotation_deg": [-90.0, 0.0, 0.0]},
        "joints": joints,
        "links": links,
    }  # fmt: skip
    return scenes.write_toml(folder / "swing.toml", data)


@pytest.mark.parametrize("gauge", ["joint-angle", "minimum-norm"])
@pytest.mark.parametrize("mass", ["lumped", "consistent"])
@pytest.mark.parametrize("links", [1, 2])
def test_free_swing_conserves_energy(tmp_path: Path, links: int, mass: str, gauge: str) -> None:
    """Explicit reference integrator at rtol 1e-8 over 0.5 s: drift at most 2.5e-8 J (of kinetic energies of 10 J)."""
    if links == 1:
        scenes.l_link(tmp_path, 2, frame={**EULER, "mass": mass}, reduction={"elastic_modes": 4})
        simulation = {"duration": 0.5, "integrator": "dop853", "rtol": 1e-8, "step": 0.1, "gauge": gauge}
        scene = scenes.l_scene(tmp_path, simulation=simulation)
    else:
        scene = _soft_two_links(tmp_path, mass, gauge)
    run = erls.simulate(scene, verdict=False)
    assert run.conservative
    assert np.ptp(run.energy(run.times[::5]).total) <= 2.5e-8
    assert np.max(run.energy(np.linspace(0.0, 0.5, 26)).kinetic) > 1.0


def test_consistent_frame_mass_does_not_commute_with_rotations(tmp_path: Path) -> None:
    """Why the equations start from the kinetic energy: UᵀM A_a U is skew only when M commutes with A_a.

    It does for nodal point masses (to rounding), it does not for the consistent mass of a frame.
    """
    from fe_import import reduce_link

    symmetric = {}
    for mass, rotary_inertia in (("lumped", False), ("consistent", True)):
        frame = {"mass": mass, "rotary_inertia": rotary_inertia}
        x = reduce_link(scenes.l_link(tmp_path, 2, frame=frame, reduction={"elastic_modes": 3})).invariants.X
        symmetric[mass] = np.abs(x + x.transpose(0, 2, 1)).max() / np.abs(x).max()
    assert symmetric["lumped"] < 1e-12
    assert symmetric["consistent"] > 1e-6


def test_solid_and_frame_agree(runs: dict[str, ChainRun]) -> None:
    """The flat L as 100 hexahedra and as beams: six clamped frequencies within 3 %, tip accordingly.

    The static sag of the tip is about 17 mm; 3 % of frequency is 6 % of flexibility, so the tips stay within 2 mm.
    """
    from fe_import import reduce_link

    clamped = []
    for name in ("solid", "steel_flat"):
        model = reduce_link(DATA / f"l_shape/links/{name}.toml")
        root = model.interface("root")
        assert root is not None
        held = la.null_space(np.vstack(model.node_shape(root.node)))
        squared = la.eigh(held.T @ model.stiffness @ held, held.T @ model.invariants.m @ held, eigvals_only=True)
        clamped.append(np.sqrt(squared[:6]) / (2 * np.pi))
    np.testing.assert_allclose(clamped[0], clamped[1], rtol=0.03)
    times = np.linspace(0, 2, 201)
    solid, frame = (_shipped(runs, f"l_shape/{name}.toml").position("tip", times) for name in ("solid", "steel_flat"))
    assert np.linalg.norm(solid - frame, axis=1).max() < 2e-3


def test_unreduced_model_equals_craig_bampton_with_all_modes(tmp_path: Path) -> None:
    """ERLS-FEM (method none) and Craig-Bampton with every mode are the same model: tips within integration error.

    Same step, same damping of unresolved modes; 1e-7 m is the Newton tolerance over 1000 steps.
    """
    tips = []
    for reduction in ({"method": "none"}, {"method": "craig-bampton", "fixed_interface_modes": 18}):
        scenes.l_link(tmp_path, 2, reduction=reduction)
        run = erls.simulate(scenes.l_scene(tmp_path, simulation={"duration": 0.5, "step": 1e-3}), verdict=False)
        assert sum(link.elastic_modes for link in run.formulation.mechanism.links) == 24
        tips.append(run.position("tip", np.linspace(0, 0.5, 51)))
    np.testing.assert_allclose(tips[0], tips[1], atol=1e-7)
