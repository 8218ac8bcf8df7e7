"""Geometric stiffening and foreshortening: spin-up, columns, turning beams, nonlinear beams, agreement, energy."""

from __future__ import annotations

import contextlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scenes
import scipy.linalg as la

import erls
from erls.equations.erls.formulation import Erls
from erls.equations.erls.paper.dense_chain import DenseChain
from erls.equations.ffr.constrained import ConstrainedFfr
from erls.equations.ffr.formulation import Ffr
from erls.errors import SimulationError
from erls.mechanism.chain import Mechanism
from erls.mechanism.effects import ALL
from erls.mechanism.links import Link, Payload, payload_invariants
from erls.mechanism.second_order import link_second_order
from erls.run.chain.places import node_positions
from erls.run.chain.run import ChainRun
from erls.run.watches.spin_stability import critical_speed
from erls.scene.build import build_mechanism
from fe_import import load_link, reduce_link

DATA = scenes.ROOT / "data"
STIFF = 'simulation.effects=["all", "geometric_stiffening", "foreshortening"]'
EXPLICIT = ('simulation.integrator="dop853"', "simulation.rtol=1e-11", "simulation.step=0.1")


def _in_turning_axes(run: ChainRun, times: Any) -> np.ndarray:
    """Tip of the spin-up beam along and across its root's direction, less its length."""
    x, y, _ = run.position("tip", times).T
    angle = run.joint_angle("hub", times)
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.stack([cosine * x + sine * y - 10.0, cosine * y - sine * x], axis=-1)


@pytest.mark.parametrize("formulation", ["erls", "ffr"])
def test_spin_up_beam(formulation: str) -> None:
    """Against geometrically exact beams: lag within 0.5 %, stretch within 1 %, trajectory within 2e-3 m (third order in
    a deflection of 0.57 m on 10 m).
    """
    run = erls.simulate(erls.load_scene(DATA / "spin_up/beam.toml", [f"simulation.formulation={formulation}"]))
    assert not run.warnings
    times = np.linspace(6.0, 7.5, 301)
    lag = _in_turning_axes(run, times)[:, 1]
    assert lag.min() == pytest.approx(-0.57384, rel=5e-3)
    assert times[lag.argmin()] == pytest.approx(6.76, abs=0.05)
    assert _in_turning_axes(run, 20.0)[0] == pytest.approx(5.145e-4, rel=1e-2)
    expected = [-0.15128, -0.46848, -0.55910, -0.36284, -0.11268, 0.00126]
    found = _in_turning_axes(run, [2.5, 5.0, 7.5, 10.0, 12.5, 15.0])
    np.testing.assert_allclose(found[:, 1], expected, atol=2e-3)
    np.testing.assert_allclose(found[1:4, 0], [-0.012655, -0.017743, -0.007073], atol=2e-4)


@pytest.mark.parametrize("formulation", ["erls", "ffr"])
def test_lost_stability_is_told_before_the_start(formulation: str) -> None:
    """Without stiffening: the speed is the lowest bending frequency of the beam at rest, 3.516 √(EI/ρA) / L²."""
    changes = [f"simulation.formulation={formulation}", scenes.LINEAR, "simulation.duration=2.0"]
    changes.append("joints.hub.drive.motion.duration=2.0")
    told: list[str] = []
    scene = erls.load_scene(DATA / "spin_up/beam.toml", changes)
    with contextlib.suppress(SimulationError):  # without bound, it may end early
        erls.simulate(scene, tell=told.append)
    warned = [text for text in told if "loses stability" in text]
    assert len(warned) == 1
    assert "turn on the effect 'geometric_stiffening'" in warned[0]
    assert told.index(warned[0]) <= 1  # before anything is computed
    speed = float(warned[0].split("at ")[1].split(" rad/s")[0])
    assert speed == pytest.approx(3.5160 * np.sqrt(1.4e4 / 1.2) / 100, rel=5e-3)


def _spinning(name: str, rate: float, folder: Path) -> Mechanism:
    """A thin straight cantilever, held or turning about z at a constant rate, with a mass at its tip or without.

    1 m, EI = 1, ρA = 1 in the plane and across it; extension and shear are stiff.
    """
    section = {"shape": "constants", "area": 1.0, "inertia_y": 1e-6, "inertia_z": 1e-6, "torsion_constant": 2e-6}
    data = scenes.merged(
        scenes.ARM_LINK,
        {
            "units": {"unusual": True},
            "materials": {"m": {"youngs_modulus": 1e6, "density": 1.0}},
            "sections": {"s": section},
            "frame": {"nodes": {"root": [0.0, 0.0, 0.0], "tip": [1.0, 0.0, 0.0]}, "theory": "euler-bernoulli"},
            "reduction": {"fixed_interface_modes": 40, "elastic_modes": None},
        },
    )
    data["sections"]["s"] = section
    data["frame"]["members"] = [{**data["frame"]["members"][0], "elements": 16}]
    del data["reduction"]["elastic_modes"]
    scenes.write_toml(folder / "beam.toml", data)
    drive = {"type": "motion", "motion": {"shape": "spin_up", "rate": rate, "duration": 1.0}}
    scene = {
        "simulation": {"duration": 1.0, "effects": ["all", "geometric_stiffening"]},
        "gravity": [0.0, 0.0, 0.0],
        "joints": [{"name": "hub", "dh": {"convention": "standard"}, "drive": drive if rate else held()}],
        "links": [{"name": "beam", "model": "beam.toml"}],
        "points": [{"name": "tip", "link": "beam", "node": "tip"}],
    }
    return scenes.mechanism(scenes.write_toml(folder / f"{name}.toml", scene))


def held() -> dict[str, Any]:
    """A joint that stays."""
    return {"type": "motion", "motion": {"shape": "polynomial", "from": 0.0, "to": 0.0, "duration": 1.0}}


def _stiffness(equations: Erls | Ffr, time: float, y: np.ndarray) -> np.ndarray:
    """Derivative of the forces at rest by the elastic coordinates."""
    zero = np.zeros(equations.size)
    columns = []
    for k in range(equations.size):
        step = np.zeros(equations.size)
        step[k] = 1e-4 / np.sqrt(equations.stiffness[k])
        columns.append(
            (equations.residual(time, y + step, zero, zero) - equations.residual(time, y - step, zero, zero))
            / (2 * step[k])
        )
    slope = np.stack(columns, axis=1)
    return np.asarray((slope + slope.T) / 2)


@pytest.mark.parametrize(("tip_mass", "load"), [(1e3, np.pi**2 / 4), (0.0, 7.8373)])
@pytest.mark.parametrize("kind", [Erls, Ffr])
def test_columns_buckle(tmp_path: Path, kind: type, tip_mass: float, load: float) -> None:
    """A standing column loses its stiffness under a tip load of π² EI / 4 L², or under its own weight of 7.837 EI / L²
    (Greenhill), within 1 %.
    """
    mechanism = _spinning("column", 0.0, tmp_path)
    link = mechanism.links[0]
    if tip_mass:
        tip = link.model.interface("tip")
        assert tip is not None
        body = (tip.node, np.zeros(3), tip_mass, np.zeros((3, 3)))
        extra = payload_invariants(link.model, *body)
        link = replace(link, invariants=link.invariants + extra, payloads=(Payload(*body),))
    g = load / (tip_mass or 1.0)
    weighted = replace(mechanism, links=(link,), gravity=np.array([-g, 0.0, 0.0]))
    bare, pressed = (_stiffness(kind(m), 0.0, np.zeros(kind(m).size)) for m in (mechanism, weighted))
    factors = 1 / la.eigvalsh(bare - pressed, bare)
    assert factors[factors > 0].min() == pytest.approx(1.0, rel=1e-2)


@pytest.mark.parametrize("kind", [Erls, Ffr])
def test_frequencies_of_turning_beams(tmp_path: Path, kind: type) -> None:
    """Across the plane of rotation, in units of √(EI / ρA L⁴), within 0.5 %; in the plane ω² is less by Ω².

    A. D. Wright et al., J. Appl. Mech. 49 (1982) 197-202.
    """
    table = {3.0: (4.7973, 23.3203, 62.9850), 6.0: (7.3604, 26.8091, 66.6839), 12.0: (13.1702, 37.6031, 79.6145)}
    for rate, expected in table.items():
        equations = kind(_spinning("turning", rate, tmp_path))
        slope = _stiffness(equations, 5.0, np.zeros(equations.size))
        squared = la.eigh(slope, equations.mass_matrix(5.0, np.zeros(equations.size)), eigvals_only=True)
        wanted = np.sort([w**2 - shift for w in expected for shift in (0.0, rate**2)])
        np.testing.assert_allclose(np.sqrt(squared[:6]), np.sqrt(wanted), rtol=5e-3)


def _table(name: str) -> dict[str, np.ndarray]:
    path = Path(__file__).parents[1] / "data" / f"{name}.csv"
    text = path.read_text(encoding="utf-8")
    columns = [line for line in text.splitlines() if line.startswith("#")][-1].lstrip("# ").split(",")
    return dict(zip(columns, np.loadtxt(path, delimiter=",").T, strict=True))


def test_l_pendulum_comes_near_nonlinear_beams() -> None:
    """Steel tall, tip over 1 s: 5.8e-5 m away without stiffening, below a quarter of it with it and foreshortening.

    Over 2 s, at half the step: 1.5e-4 without, 8.5e-6 m with both; aluminium 3.9e-4 and 2.9e-5.
    """
    case = "steel_tall"
    table = _table("l_shape_nonlinear_beam")
    at = table["t"] <= 1.0
    expected = np.stack([table[f"{case}_{axis}"][at] for axis in "xyz"], axis=1)
    found = []
    for changes in ([scenes.LINEAR], ["simulation.formulation=ffr"]):
        run = erls.simulate(erls.load_scene(DATA / f"l_shape/{case}.toml", ["simulation.duration=1.0", *changes]))
        found.append(float(np.linalg.norm(run.position("tip", table["t"][at]) - expected, axis=1).max()))
    assert found[0] > 5e-5
    assert found[1] < found[0] / 4


@pytest.fixture(scope="module")
def chain(tmp_path_factory: pytest.TempPathFactory) -> Mechanism:
    """Three flexible links with a payload that turns, all effects."""
    payload = {"point": "end", "mass": 0.3, "offset": [0.02, 0.0, 0.01], "inertia": [1e-3, 2e-3, 3e-3]}
    folder = tmp_path_factory.mktemp("chain")
    return replace(scenes.mechanism(scenes.three_links(folder, "mixed", payloads=[payload])), effects=ALL)


def test_formulations_agree_to_third_order(chain: Mechanism) -> None:
    """Place of the end, kinetic energy and weight of ERLS and of FFR with either frame at the same joint and elastic
    coordinates: differences fall with the third power of the deflection, to a seventh at half of it.
    """
    equations = [DenseChain(chain, "joint-angle"), Ffr(chain, "mean-axis"), Ffr(chain)]
    rng = np.random.default_rng(1)
    n, f = equations[0].size, len(equations[0].free_joints)
    elastic = np.concatenate([np.zeros(f), 0.5 * rng.normal(size=n - f) / np.sqrt(equations[0].stiffness)])
    joints, rates = np.zeros((2, n))
    joints[:f], rates[:f] = rng.normal(size=(2, f))
    far: list[np.ndarray] = []
    for size in (1.0, 0.5):
        found = []
        for one in equations:
            y, v = joints + size * elastic, rates + 3 * size * elastic
            end = node_positions(one.mechanism, one.state(0.0, y, v), 2)[-1]
            energy = one.energy(0.0, y, v)
            found.append(np.array([*end, energy.kinetic, energy.gravity]))
        apart = np.abs(np.array(found[:2]) - found[2])
        far.append(np.stack([np.linalg.norm(apart[:, :3], axis=1), apart[:, 3], apart[:, 4]]))
    assert (far[0] > 6.0 * far[1]).all()
    assert far[1][0].max() < 1e-6


def test_one_link_in_either_formulation(tmp_path: Path) -> None:
    """For one link in its tangent frame ERLS and FFR are the same equations, to rounding; absolute coordinates, too."""
    mechanism = replace(scenes.mechanism(scenes.l_scene(scenes.l_link(tmp_path, 3).parent)), effects=ALL)
    one, other = DenseChain(mechanism, "joint-angle"), Ffr(mechanism)
    rng = np.random.default_rng(0)
    y, v, a = rng.normal(size=(3, one.size)) * np.concatenate([[1.0], 0.3 / np.sqrt(one.stiffness)])
    expected = one.residual(0.0, y, v, a)
    np.testing.assert_allclose(other.residual(0.0, y, v, a), expected, atol=1e-10 * np.abs(expected).max())
    energies = [system.energy(0.0, y, v).total for system in (one, other)]
    assert energies[1] == pytest.approx(energies[0], rel=1e-12)
    absolute = ConstrainedFfr(other)
    energy = absolute.energy(0.0, *absolute.configuration(0.0, y, v))
    assert energy.total == pytest.approx(energies[0], rel=1e-12)


@pytest.mark.parametrize(
    "build",
    [
        lambda m: Erls(replace(m, effects=ALL - {"modal_inertia"})),
        lambda m: DenseChain(m, "joint-angle"),
        lambda m: DenseChain(m, "minimum-norm"),
        Ffr,
        lambda m: Ffr(m, "mean-axis"),
    ],
    ids=["recursion", "joint-angle", "minimum-norm", "tangent", "mean-axis"],
)
def test_power_balance_and_mass_matrix(chain: Mechanism, build: Any) -> None:
    """At a random state: M is what the residual takes of accelerations and gives the kinetic energy, and the energy's
    rate vanishes (1e-7 of what it is made of: differences of energies over 1e-6 s).
    """
    equations = build(chain)
    rng = np.random.default_rng(4)
    n, f = equations.size, len(equations.free_joints)
    y, v = rng.normal(size=(2, n))
    y[f:] *= 0.2 / np.sqrt(equations.stiffness)
    v[f:] *= 0.05
    a = equations.acceleration(0.0, y, v)
    mass, other = equations.mass_matrix(0.0, y), rng.normal(size=n)
    taken = equations.residual(0.0, y, v, other) - equations.residual(0.0, y, v, 0 * other)
    np.testing.assert_allclose(mass @ other, taken, atol=1e-11 * np.abs(taken).max())
    assert np.linalg.eigvalsh(mass).min() > 0
    energy = equations.energy(0.0, y, v)
    assert 0.5 * v @ mass @ v == pytest.approx(energy.kinetic, rel=1e-12)

    def at(t: float) -> float:
        return float(equations.energy(t, y + t * v + t * t / 2 * a, v + t * a).total)

    h = 1e-6
    rate = (8 * (at(h) - at(-h)) - at(2 * h) + at(-2 * h)) / (12 * h)
    power = np.abs(v) @ np.abs(mass @ a)
    assert abs(rate) < 1e-7 * power + 1e-9 * energy.kinetic / h


@pytest.mark.parametrize("formulation", ["erls", "ffr"])
def test_energy_is_conserved(tmp_path: Path, formulation: str) -> None:
    """Two soft links swinging freely over 0.008 s at rtol 1e-11: drift below 1e-9 of the kinetic energy."""
    scenes.arm_link(
        tmp_path,
        sections={"s": {"width": 0.012, "height": 0.008}},
        reduction={"fixed_interface_modes": 2, "elastic_modes": 2},
    )
    joints = [
        {"name": n, "dh": {"convention": "standard", "a": 0.5, "alpha_deg": 90.0}, "initial": {"rate_deg": 200.0}}
        for n in ("a", "b")
    ]
    links = [{"name": n, "model": "arm.toml", "mesh_pose": {"frame": "joint"}} for n in ("upper", "lower")]
    data = {"simulation": {"duration": 0.008}, "joints": joints, "links": links}
    path = scenes.write_toml(tmp_path / "swing.toml", data)
    run = erls.simulate(erls.load_scene(path, [STIFF, f"simulation.formulation={formulation}", *EXPLICIT]))
    energy = run.energy(np.linspace(0.0, 0.008, 9))
    assert run.conservative
    assert np.ptp(energy.total) < 1e-9 * np.max(energy.kinetic)


def test_inboard_interface_is_free_to_choose(tmp_path: Path) -> None:
    """A field counted from one interface, used from the other, is the field counted from that one."""
    made = []
    for inboard in ("root", "tip"):
        model = reduce_link(load_link(scenes.arm_link(tmp_path, reduction={"inboard": inboard})))
        tip = model.interface("tip")
        assert tip is not None
        stiffness = np.diag(model.stiffness)[6:]
        link = Link("arm", model, model.invariants, tip, stiffness, np.zeros_like(stiffness))
        found = link_second_order(link)
        assert found is not None
        made.append((found, model))
    (here, model), (there, _) = made
    np.testing.assert_allclose(here.momentum, there.momentum, atol=1e-9 * np.abs(there.momentum).max())
    np.testing.assert_allclose(here.modal, there.modal, atol=1e-9 * np.abs(there.modal).max())
    spins = [one.spin + one.spin.swapaxes(0, 1) for one in (here, there)]  # what the energy sees
    np.testing.assert_allclose(spins[0], spins[1], atol=1e-9 * np.abs(there.spin).max())
    q = 0.01 * np.random.default_rng(0).normal(size=model.modes)
    every = np.arange(len(model.nodes))
    moved = here.displacements(every, q)
    np.testing.assert_allclose(moved, there.displacements(every, q), atol=1e-9 * np.abs(moved).max())
    for node in every:
        np.testing.assert_allclose(0.5 * here.node(node)[:3] @ q @ q, moved[node], atol=1e-9 * np.abs(moved).max())


def test_what_has_no_second_order_data_is_told(tmp_path: Path) -> None:
    """Where a link forms a ring: a warning that says why; where links are to be linear, nothing."""
    members = [
        {"from": a, "to": b, "elements": 2, "material": "m", "section": "s"}
        for a, b in (("root", "elbow"), ("elbow", "tip"), ("root", "tip"))
    ]
    data = scenes.merged(scenes.L_LINK, {"frame": {"members": members}})
    scenes.write_toml(tmp_path / "link.toml", data)
    path = scenes.l_scene(tmp_path, simulation={"duration": 1e-3})
    assert any("members form a ring" in w for w in erls.simulate(path).warnings)
    assert not any("ring" in w for w in erls.simulate(erls.load_scene(path, [scenes.LINEAR])).warnings)


def test_links_are_linear_where_asked(tmp_path: Path) -> None:
    """`linear` leaves all second-order effects out; critical speeds are those of the axis asked about."""
    mechanism = _spinning("turning", 3.0, tmp_path)
    link = mechanism.links[0]
    assert critical_speed(link, np.array([0.0, 0.0, 1.0])) == pytest.approx(3.5160, rel=1e-3)
    assert critical_speed(link, np.array([1.0, 0.0, 0.0])) == pytest.approx(3.5160, rel=1e-3)
    bare = build_mechanism(erls.load_scene(tmp_path / "turning.toml", [scenes.LINEAR])).mechanism
    assert ALL - bare.effects == {"geometric_stiffening", "foreshortening", "modal_inertia"}
