"""Links that expand with temperature, in motion and at rest: closed forms, and the formulations against each other."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import chain_cases
import numpy as np
import pytest
import scenes
from body_scenes_data import body_scene
from numpy.typing import NDArray

import erls
from erls.equations.erls.formulation import Erls
from erls.equations.erls.paper.dense_chain import DenseChain
from erls.equations.ffr.constrained import ConstrainedFfr
from erls.equations.ffr.formulation import Ffr
from erls.equations.nodal.beam import Beams
from erls.errors import SceneError, SimulationError
from erls.mechanism.thermal import elastic_rest
from erls.mechanism.without_effects import present, without
from erls.run.bodies.rest import BodyRest
from erls.run.chain.run import ChainRun
from fe_import.errors import FEImportError

Array = NDArray[np.float64]
ALPHA, CHANGE = 23e-6, 40.0
STRAIN = ALPHA * CHANGE
LENGTH, AXIAL = 0.5, 7e10 * 0.01 * 0.02  # E A of `scenes.arm_link`
PULL = AXIAL * STRAIN
STRAIGHT = {"frame": {"nodes": {"root": [0.0, 0.0, 0.0], "tip": [LENGTH, 0.0, 0.0]}}}
COEFFICIENT = {"materials": {"m": {"thermal_expansion": ALPHA}}}
WARM: dict[str, Any] = {**COEFFICIENT, "temperature_change": CHANGE, "recovery": {"all": True}}
STIFFENED = {"effects": ["all", "geometric_stiffening", "foreshortening"]}
FORMULATIONS: dict[str, dict[str, Any]] = {
    "erls": {},
    "stiffened": STIFFENED,
    "minimum-norm": {"gauge": "minimum-norm"},
    "following statically": {"bandwidth": 1.0},
    "ffr": {"formulation": "ffr"},
    "mean-axis": {"formulation": "ffr", "body_frame": "mean-axis"},
    "ffr stiffened": {"formulation": "ffr", **STIFFENED},
    "absolute": {"formulation": "ffr", "coordinates": "absolute"},
    "nodal": {"formulation": "nodal"},
}
HELD = {"type": "motion", "motion": {"shape": "sine", "amplitude": 0.0, "frequency_hz": 1.0}}


def two_arms(folder: Path, simulation: dict[str, Any], driven: bool = True, **changes: Any) -> Path:
    """Two straight arms in a row on parallel axes, without weight, at rest at the start."""
    joints: list[dict[str, Any]] = [
        {"name": name, "dh": {"convention": "standard", "a": LENGTH}, **({"drive": HELD} if driven else {})}
        for name in ("j0", "j1")
    ]
    data = {
        "gravity": [0.0, 0.0, 0.0],
        "simulation": {"duration": 2e-3, "step": 5e-4, **simulation},
        "initial": {"deformation": "static"},
        "joints": joints,
        "links": [{"name": n, "model": "arm.toml", "mesh_pose": {"frame": "joint"}} for n in ("a", "b")],
        "points": [{"name": "elbow", "link": "a", "node": "tip"}, {"name": "end", "link": "b", "node": "tip"}],
    }
    return scenes.write_toml(folder / "arms.toml", scenes.merged(data, changes))


def made(path: Path, changes: tuple[str, ...] = ()) -> ChainRun:
    """A run of a chain."""
    run = erls.simulate(erls.load_scene(path, changes), verdict=False)
    assert isinstance(run, ChainRun)
    return run


@pytest.mark.parametrize("name", FORMULATIONS)
def test_a_free_bar_expands_without_stress(tmp_path: Path, name: str) -> None:
    """Static start of a chain: every length grows by α ΔT, no section feels a force, and nothing moves from there."""
    scenes.arm_link(tmp_path, **STRAIGHT, **WARM)
    run = made(two_arms(tmp_path, FORMULATIONS[name]))
    for t in (0.0, run.end):
        for point, count in (("elbow", 1), ("end", 2)):
            grown = run.position(point, t) - [count * LENGTH, 0.0, 0.0]
            np.testing.assert_allclose(grown, [count * STRAIN * LENGTH, 0.0, 0.0], atol=1e-8 * STRAIN)
        for corrected in (True, False):
            found = erls.section_forces(run, "b", t, static_correction=corrected)
            np.testing.assert_allclose(found, 0.0, atol=2e-6 * PULL)
    energy = run.energy([0.0, run.end])
    np.testing.assert_allclose([energy.kinetic, energy.elastic], 0.0, atol=1e-9 * PULL * STRAIN * LENGTH)


@pytest.mark.parametrize("name", ["erls", "minimum-norm", "ffr", "mean-axis", "stiffened"])
def test_a_bar_held_at_both_ends_is_pressed(tmp_path: Path, name: str) -> None:
    """Two arms whose tip is fixed to the ground: N = -E A α ΔT in every section and in the clamp; nothing moves."""
    scenes.arm_link(tmp_path, **STRAIGHT, **WARM)
    clamp = {"name": "clamp", "type": "fixed", "link": "b", "node": "tip"}
    run = made(two_arms(tmp_path, FORMULATIONS[name], driven=False, loops=[clamp]))
    for t in (0.0, run.end):
        np.testing.assert_allclose(run.position("end", t), [2 * LENGTH, 0.0, 0.0], atol=1e-7 * STRAIN)
        for link in ("a", "b"):
            for corrected in (True, False):
                found = erls.section_forces(run, link, t, static_correction=corrected)
                expected = np.tile([-PULL, 0.0, 0.0, 0.0, 0.0, 0.0], (len(found), 1))
                np.testing.assert_allclose(found, expected, atol=1e-5 * PULL)
        force, moment = run.loop_reaction("clamp", t)
        np.testing.assert_allclose(np.abs(force), [PULL, 0.0, 0.0], atol=1e-5 * PULL)
        np.testing.assert_allclose(moment, 0.0, atol=1e-5 * PULL * LENGTH)


def column(change: float, **simulation: Any) -> dict[str, Any]:
    """A column along x whose ends cannot move but turn, warmed."""
    hinge = {"type": "revolute", "axis": [0, 1, 0]}
    return {
        "gravity": [0.0, 0.0, 0.0],
        "simulation": simulation,
        "materials": {
            "m": {"youngs_modulus": 1e9, "poissons_ratio": 0.0, "density": 1000.0, "thermal_expansion": ALPHA}
        },
        "sections": {
            "s": {"shape": "constants", "area": 1e-3, "inertia_y": 1e-8, "inertia_z": 2e-7, "torsion_constant": 1e-8,
                  "shear_factor_y": 1.0, "shear_factor_z": 1.0}
        },
        "nodes": {"root": [0.0, 0.0, 0.0], "top": [2.0, 0.0, 0.0]},
        "beams": [
            {"name": "c", "from": "root", "to": "top", "elements": 16, "material": "m", "section": "s",
             "temperature_change": change}
        ],
        "connections": [{"name": n, "node": n, **hinge} for n in ("root", "top")],
    }  # fmt: skip


@pytest.mark.parametrize("share", [-1.0, 0.5, 0.9])
def test_warmth_softens_a_held_column(tmp_path: Path, share: float) -> None:
    """ω² = (π/L)⁴ EI/(ρA) (1 - ΔT/ΔT_E): pressed by E A α ΔT, the column buckles where that is Euler's load, at
    α ΔT_E = π² I/(A L²). Extrapolated from 8 and 16 elements, whose errors are of second order: within 1e-3.
    """
    scene = column(share * np.pi**2 * 1e-8 / (1e-3 * 4.0) / ALPHA, type="frequencies", count=1)
    squares = []
    for elements in (8, 16):
        scene["beams"][0]["elements"] = elements
        found = erls.simulate(body_scene(tmp_path, scene), verdict=False)
        assert isinstance(found, BodyRest)
        squares.append((2 * np.pi * found.summary()["modes"][0]["frequency_hz"]) ** 2)
    expected = (np.pi / 2.0) ** 4 * 1e9 * 1e-8 * (1 - share)
    assert (4 * squares[1] - squares[0]) / 3 == pytest.approx(expected, rel=1e-3)


def test_strains_of_beams_are_those_of_stress(tmp_path: Path) -> None:
    """Held: γ = -α ΔT in every element, no curvature; free to slide at one end: none."""
    held = column(CHANGE, type="statics")
    free = {**held, "connections": [{"name": "root", "node": "root", "type": "fixed"}]}
    for scene, expected in ((held, -STRAIN), (free, 0.0)):
        rest = erls.simulate(body_scene(tmp_path, scene), verdict=False)
        assert isinstance(rest, BodyRest)
        beams = next(e for e in rest.assembly.system.elements if isinstance(e, Beams))
        strains = beams.strains(rest.statics.path[-1].q.bent)
        np.testing.assert_allclose(strains, np.tile([expected, 0, 0, 0, 0, 0], (16, 1)), atol=1e-11)


BIMETAL = scenes.ROOT / "data" / "thermal" / "bimetal.toml"
CURVATURE = 0.2189873  # of S. Timoshenko (1925), see data/thermal/links/bimetal.toml


@pytest.mark.parametrize("name", [n for n in FORMULATIONS if "stiffened" not in n])
def test_the_shipped_bimetal_bends_as_timoshenko_says(name: str) -> None:
    """Tip at -κL²/2 and its slope κL within 1 %; the strips carry N = ±F that bend them, however the run was made."""
    settings = [f"simulation.{key}={value}" for key, value in FORMULATIONS[name].items()]
    run = made(BIMETAL, ("gravity=[0.0, 0.0, 0.0]", "simulation.duration=1e-3", *settings))
    tip = run.position("tip", 0.0)
    assert tip[2] == pytest.approx(-CURVATURE * 0.2**2 / 2, rel=0.01)
    assert abs(tip[1]) < 1e-9
    if name == "nodal":  # coordinates nearest to exact beams take what a bow shortens for strain
        return
    forces = erls.section_forces(run, "arm", 0.0)
    steel, aluminium = forces[0], forces[2]
    stiff = 2.1e11 * 0.01 * 1e-3**3 / 12, 7e10 * 0.01 * 2e-3**3 / 12  # E I of each strip
    np.testing.assert_allclose([steel[4], aluminium[4]], CURVATURE * np.array(stiff), rtol=0.01)
    assert steel[0] * 1.5e-3 == pytest.approx(sum(stiff) * CURVATURE, rel=0.01)
    assert aluminium[0] == pytest.approx(-steel[0], rel=1e-6)


SWING = {"shape": "polynomial", "from_deg": 0.0, "to_deg": 0.1, "duration": 0.05, "degree": 5}


def swung(folder: Path, simulation: dict[str, Any], **changes: Any) -> ChainRun:
    """An arm on a motor and an L behind it on a free joint, without weight; ``changes`` of the L."""
    scenes.l_link(folder, 2, **{**WARM, **changes})
    scenes.arm_link(folder, **WARM)
    data = {
        "gravity": [0.0, 0.0, 0.0],
        "simulation": {"duration": 0.05, "step": 5e-4, **simulation},
        "initial": {"deformation": "static"},
        "base": {"rotation_deg": [-90.0, 0.0, 0.0]},
        "joints": [
            {"name": "j0", "dh": {"convention": "standard"}, "drive": {"type": "motion", "motion": SWING}},
            {"name": "j1", "dh": {"convention": "standard", "a": 0.5, "d": 0.0}},
        ],
        "links": [
            {"name": n, "model": f"{m}.toml", "mesh_pose": {"frame": "joint"}} for n, m in (("a", "arm"), ("l", "link"))
        ],
        "points": [{"name": "tip", "link": "l", "node": "tip"}],
    }
    return made(scenes.write_toml(folder / "swung.toml", data))


def test_formulations_agree_in_motion(tmp_path: Path) -> None:
    """A small swing of warm links from their static start: what warmth changes, 0.65 mm, is the same to 1e-3 of it.

    What is left is of second order: expansion times deflection, which linear links do not know.
    """
    t = np.linspace(0.0, 0.05, 26)
    warm, cold = (
        {
            name: swung(tmp_path, FORMULATIONS[name], **extra).position("tip", t)
            for name in ("erls", "minimum-norm", "ffr", "mean-axis", "nodal", "stiffened")
        }
        for extra in ({}, {"temperature_change": 0.0})
    )
    change = {name: warm[name] - cold[name] for name in warm}
    largest = float(np.linalg.norm(change["nodal"], axis=1).max())
    assert largest > 0.9 * STRAIN * np.hypot(0.5, 0.5)
    for name, found in change.items():
        off = np.linalg.norm(found - change["nodal"], axis=1).max()
        assert off < 1e-3 * largest, (name, off / largest)


@pytest.mark.parametrize("name", ["erls", "stiffened", "ffr", "mean-axis", "nodal"])
def test_sudden_warmth_conserves_energy(tmp_path: Path, name: str) -> None:
    """A chain that is warmed all at once vibrates about its new length.

    What is off falls with the square of the step: 8e-3 of the energy at 10 us in ERLS, 7e-4 at 2.5 us.
    """
    scenes.arm_link(tmp_path, **WARM)
    settings = {**FORMULATIONS[name], "duration": 1e-3, "step": 1e-5 if name == "nodal" else 2.5e-6}
    run = made(two_arms(tmp_path, {**settings, "spectral_radius": 1.0}, driven=False, initial={"deformation": "zero"}))
    energy = run.energy(np.linspace(0.0, run.end, 21))
    assert energy.kinetic.max() > 0.1 * energy.elastic[0]
    np.testing.assert_allclose(energy.total, energy.total[0], atol=1e-3 * energy.elastic[0])


KINDS = {
    "erls": Erls,
    "minimum-norm": lambda m: DenseChain(m, "minimum-norm"),
    "ffr": Ffr,
    "mean-axis": lambda m: Ffr(m, "mean-axis"),
}


@pytest.mark.parametrize("stiffened", [False, True])
@pytest.mark.parametrize("name", KINDS)
def test_stiffness_acts_about_the_expanded_link(tmp_path: Path, name: str, stiffened: bool) -> None:
    """Warm links have Γ (q - q₀) for Γ q, in the energy ½ Γ (q - q₀)² for ½ Γ q², and nothing else differs.

    What has no temperature keeps every digit.
    """
    cold = chain_cases.mechanism(tmp_path, "axes that part")
    if stiffened:
        cold = replace(cold, effects=cold.effects | {"geometric_stiffening", "foreshortening"})
    warm = chain_cases.warm(cold)
    systems = [KINDS[name](m) for m in (cold, warm, without(warm, {"thermal_expansion"}))]
    at = chain_cases.states(systems[0], "axes that part")[0]
    found = [s.residual(at.t, at.y, at.v, at.a) for s in systems]
    rest = np.concatenate([elastic_rest(link) for link in warm.links])
    stiffness = np.concatenate([link.stiffness for link in warm.links])
    pushed = found[0].copy()
    pushed[-len(rest) :] -= stiffness * rest
    np.testing.assert_allclose(found[1], pushed, atol=1e-12 * np.abs(pushed).max())
    np.testing.assert_array_equal(found[2], found[0])
    energies = [s.energy(at.t, at.y, at.v) for s in systems]
    q = at.y[-len(rest) :]
    assert energies[1].elastic == pytest.approx(float(stiffness @ (q - rest) ** 2 / 2), rel=1e-12)
    for part in ("kinetic", "gravity", "springs"):
        assert getattr(energies[1], part) == getattr(energies[0], part)
    assert energies[2] == energies[0]
    assert "thermal_expansion" in present(warm)
    assert "thermal_expansion" not in present(cold)


def test_absolute_coordinates_hold_it_too(tmp_path: Path) -> None:
    """Energy of the judge in absolute coordinates, against that of `Ffr`; forces are those of the free bar."""
    warm = chain_cases.warm(chain_cases.mechanism(tmp_path, "axes that part"))
    reduced = Ffr(warm)
    absolute = ConstrainedFfr(reduced)
    at = chain_cases.states(reduced, "axes that part")[0]
    q, v = absolute.configuration(at.t, at.y, at.v)
    assert absolute.energy(at.t, q, v).elastic == pytest.approx(reduced.energy(at.t, at.y, at.v).elastic, rel=1e-12)


def test_substructures_expand_together(tmp_path: Path) -> None:
    """Pieces carry the change of the scene as the whole link does."""
    members = [{**scenes.ARM_LINK["frame"]["members"][0], "elements": 4}]
    scenes.arm_link(tmp_path, **scenes.merged(STRAIGHT, {"frame": {"members": members}}), **COEFFICIENT)
    path = two_arms(tmp_path, {"formulation": "ffr"})
    run = made(path, ("links.a.substructures=2", f"links.a.temperature_change={CHANGE}"))
    np.testing.assert_allclose(run.position("end", 0.0), [2 * LENGTH + STRAIN * LENGTH, 0, 0], atol=1e-8 * STRAIN)


def test_the_scene_sets_the_temperature(tmp_path: Path) -> None:
    """Where materials say how they expand; kept in run files; left out by its effect; rigid links keep their shape."""
    scenes.arm_link(tmp_path, **STRAIGHT, **COEFFICIENT, recovery={"all": True})
    path = two_arms(tmp_path, {})
    run = made(path, ("links.b.temperature_change=100",))
    erls.save_run(tmp_path / "run.h5", run)
    for found in (run, erls.load_run(tmp_path / "run.h5")):
        np.testing.assert_allclose(found.position("end", 0.0), [2 * LENGTH + 100 * ALPHA * LENGTH, 0, 0], atol=1e-12)
    for off in ("effects=-thermal_expansion", "links.b.flexible=false"):
        run = made(path, ("links.b.temperature_change=100", off))
        erls.save_run(tmp_path / "run.h5", run)
        for found in (run, erls.load_run(tmp_path / "run.h5")):
            np.testing.assert_allclose(found.position("end", 0.0), [2 * LENGTH, 0, 0], atol=1e-12)


def test_temperatures_that_cannot_be(tmp_path: Path) -> None:
    """Too hot, without a coefficient, of a rigid link, of a file that holds no expansion."""
    from fe_import.modal.file import write_modal_file
    from fe_import.reduce import reduce_link

    scenes.arm_link(tmp_path, **STRAIGHT)
    path = two_arms(tmp_path, {})
    write_modal_file(tmp_path / "arm.modal.h5", reduce_link(tmp_path / "arm.toml"))
    rigid = "links.0={name='a', rigid={mass=1, points={root=[0,0,0], tip=[0.5,0,0]}}, temperature_change=3.0}"
    stored = "links.0={name='a', modal_file='arm.modal.h5', temperature_change=3.0}"
    for change, place, says in (
        ("links.a.temperature_change=5000", "links[0].temperature_change", "no solid is that hot"),
        ("links.a.temperature_change=5", "materials.m.thermal_expansion", "needs the expansion of the materials"),
        (rigid, "links[0].temperature_change", "a rigid link does not deform"),
        (stored, "links[0].temperature_change", "holds no thermal expansion"),
    ):
        with pytest.raises((SceneError, SimulationError, FEImportError), match=says) as caught:
            made(path, (change,))
        assert place in caught.value.where
        assert caught.value.remedy
    unknown = column(CHANGE, type="statics")
    del unknown["materials"]["m"]["thermal_expansion"]
    with pytest.raises(SceneError, match="needs the expansion of the materials"):
        erls.simulate(body_scene(tmp_path, unknown), verdict=False)
