"""Links in substructures: the same for small deflections, one link for whoever asks, and what is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import scenes

import erls
from erls.errors import SceneError
from erls.run.chain.link_loads import link_loads
from erls.scene.build import build_mechanism
from fe_import.description.link import load_link
from fe_import.errors import Cause, FEImportError
from fe_import.models.substructures import split_link

RANKING = {"driving": ["root.ry"], "observed": ["tip.uz"], "count": 2}


def l_scene(folder: Path, pieces: int, **changes: Any) -> Path:
    """The steel L, which hangs in pieces; recovery everywhere."""
    frame_link(folder)
    links = [{"name": "l", "model": "link.toml", "substructures": pieces}]
    simulation = {"duration": 0.02, "step": 5e-4, "formulation": "ffr"}
    return scenes.l_scene(folder, links=links, **scenes.merged({"simulation": simulation}, changes))


def frame_link(folder: Path, elements: int = 3, **changes: Any) -> Path:
    recovery: dict[str, Any] = {"recovery": {"all": True}}
    return scenes.l_link(folder, elements, **scenes.merged(recovery, changes))


def test_pieces_carry_everything_once(tmp_path: Path) -> None:
    """Mass properties of all pieces together are those of the link; elements are cut where the cuts fall."""
    path = branched(tmp_path)
    whole = erls_model(path)
    for count in (2, 3, 4, 7):
        pieces = [erls_model(p) for p in split_link(load_link(path), count, "root", "tip", "here")]
        together = sum(p.invariants.rigid_mass_matrix for p in pieces)
        np.testing.assert_allclose(together, whole.invariants.rigid_mass_matrix, rtol=1e-10, atol=1e-12)
        assert [p.interface_nodes[1].name for p in pieces[:-1]] == [p.interface_nodes[0].name for p in pieces[1:]]
        assert set().union(*(p.node_names for p in pieces)) >= set(whole.node_names)
        lengths = [load_path(p) for p in pieces]
        np.testing.assert_allclose(lengths, sum(lengths) / count, rtol=1e-9)


def erls_model(link: Any) -> Any:
    from fe_import.reduce import reduce_link

    return reduce_link(link)


def load_path(model: Any) -> float:
    """Length between interfaces 0 and 1 along the only path of line elements."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import dijkstra

    lengths = np.linalg.norm(np.diff(model.nodes[model.lines], axis=1)[:, 0], axis=1)
    graph = coo_array((lengths, model.lines.T), shape=(len(model.nodes),) * 2)
    start, end = (i.node for i in model.interface_nodes[:2])
    return float(dijkstra(graph, directed=False, indices=start)[end])


def branched(folder: Path, ring: bool = False) -> Path:
    """The L with a side arm in the middle of its first leg, a mass at its end, another on the elbow."""
    data = scenes.merged(scenes.L_LINK, {})
    frame = data["frame"]
    nodes = {**frame["nodes"], "middle": [0.25, 0.0, 0.0], "side": [0.25, -0.1, 0.05]}
    bar = {"material": "m", "section": "s"}
    pairs = [("root", "middle", 3), ("middle", "elbow", 2), ("elbow", "tip", 4), ("side", "middle", 2)]
    pairs += [("side", "root", 2)] if ring else []
    members = [{"from": a, "to": b, "elements": n, **bar} for a, b, n in pairs]
    masses = [{"node": "side", "mass": 0.2, "inertia": [1e-4, 2e-4, 3e-4]}, {"node": "elbow", "mass": 0.1}]
    interfaces = [*data["interfaces"], {"name": "extra", "node": "side"}]
    reduction = {"method": "none"}
    full = {**data, "frame": {**frame, "nodes": nodes, "members": members}, "masses": masses}
    return scenes.write_toml(folder / "branched.toml", {**full, "interfaces": interfaces, "reduction": reduction})


def test_split_in_full_is_the_same_link_for_small_deflections(tmp_path: Path) -> None:
    """With all dofs kept, two pieces and one differ in second order only: 1e-8 m at deflections of 1e-5 m, and
    reactions, energy, section forces and nearest modal coordinates agree likewise.
    """
    runs = []
    for pieces in (1, 3):
        folder = tmp_path / str(pieces)
        folder.mkdir()
        path = l_scene(folder, pieces, gravity=[0.0, 0.0, -0.5])
        runs.append(erls.simulate(erls.load_scene(path, ['links.l.reduction={ method = "none" }']), verdict=False))
    one, many = runs
    t = np.linspace(0, 0.02, 5)
    deflection = np.abs(one.elastic_coordinates("l", t)).max()
    for point in ("tip", "elbow"):
        np.testing.assert_allclose(many.position(point, t), one.position(point, t), atol=2e-9)
    np.testing.assert_allclose(
        many.elastic_coordinates("l", t), one.elastic_coordinates("l", t), atol=2e-3 * deflection
    )
    np.testing.assert_allclose(many.joint_angle("shoulder", t), one.joint_angle("shoulder", t), atol=1e-8)
    for a, b in zip(many.reaction("shoulder", t), one.reaction("shoulder", t), strict=True):
        np.testing.assert_allclose(a, b, atol=2e-3 * np.abs(b).max())
    np.testing.assert_allclose(many.energy(t).kinetic, one.energy(t).kinetic, rtol=1e-4, atol=1e-12)
    forces = [erls.section_forces(run, "l", t[1:]) for run in runs]
    np.testing.assert_allclose(forces[1], forces[0], atol=5e-3 * np.abs(forces[0]).max())


def test_energy_is_conserved(tmp_path: Path) -> None:
    """To the integrator's error, of second order in the step: undamped, half the step leaves a quarter of the drift."""
    path, drift = l_scene(tmp_path, 2, simulation={"duration": 0.008}), []
    for step in (1e-4, 5e-5):
        run = erls.simulate(
            erls.load_scene(path, [f"simulation.step={step}", "simulation.spectral_radius=1"]), verdict=False
        )
        drift.append(np.ptp(run.energy(run.times).total) / run.energy(run.times).kinetic.max())
    assert drift[0] < 5e-9
    assert drift[1] < 0.4 * drift[0]


def test_run_file_holds_the_pieces(tmp_path: Path) -> None:
    run = erls.simulate(l_scene(tmp_path, 2), verdict=False)
    erls.save_run(tmp_path / "run.h5", run)
    (tmp_path / "link.toml").unlink()
    again = erls.load_run(tmp_path / "run.h5")
    t = np.linspace(0, run.end, 7)
    assert again.link_names == ("l",)
    assert again.joint_names == ("shoulder",)
    np.testing.assert_array_equal(again.position("tip", t), run.position("tip", t))
    np.testing.assert_array_equal(erls.section_forces(again, "l", t), erls.section_forces(run, "l", t))
    assert again.formulation.describe()["substructures"] == {"l": 2}
    with h5py.File(tmp_path / "run.h5", "r+") as file:
        file["substructures/count"][...] = 3
    with pytest.raises((SceneError, FEImportError)):
        erls.load_run(tmp_path / "run.h5")


def test_payloads_and_points_sit_on_their_pieces(tmp_path: Path) -> None:
    """A payload on an inner node weighs on the reactions as it does on the whole link."""
    runs = []
    for pieces in (1, 2):
        folder = tmp_path / str(pieces)
        folder.mkdir()
        changes = {"payloads": [{"point": "elbow", "mass": 0.5, "offset": [0.0, 0.02, 0.0], "inertia": [1e-4] * 3}]}
        held = {"type": "motion", "motion": {"shape": "waypoints", "times": [0.0, 1.0], "values": [0.0, 0.0]}}
        joint = {"name": "shoulder", "dh": scenes.L_SCENE["joints"][0]["dh"], "drive": held}
        changes |= {"joints": [joint], "initial": {"deformation": "static"}}
        runs.append(erls.simulate(l_scene(folder, pieces, **changes), verdict=False))
    for a, b in zip(runs[1].reaction("shoulder", 0.01), runs[0].reaction("shoulder", 0.01), strict=True):
        np.testing.assert_allclose(a, b, atol=1e-3 * np.abs(b).max())
    weight = runs[1].reaction("shoulder", 0.01)[0][2]
    assert weight == pytest.approx(9.81 * (2.34 + 0.5), rel=1e-6)
    solved = runs[1].formulation.inner.mechanism.links
    assert [len(link.payloads) for link in solved] == [1, 0]
    assert link_loads(runs[1].instants([0.01]), 0).interfaces.shape == (1, 12)


def test_every_link_of_a_spatial_chain_in_pieces(tmp_path: Path) -> None:
    """Full models in one piece and in two, tangent frames and mean axes: apart by second order, the deflection times
    the angle that it adds to a joint.
    """
    path = scenes.three_links(tmp_path, "prescribed", simulation={"duration": 0.03, "formulation": "ffr"})
    full = [f'links.{name}.reduction={{ method = "none" }}' for name in "abc"]
    split = [f"links.{name}.substructures=2" for name in "abc"]
    mean, rigid = ['simulation.body_frame="mean-axis"'], [f"links.{name}.flexible=false" for name in "abc"]
    one, many, middle, stiff = (
        erls.simulate(erls.load_scene(path, [*full, *more]), verdict=False) for more in ([], split, split + mean, rigid)
    )
    t = np.linspace(0, 0.03, 6)
    deflection = np.abs(one.position("end", t) - stiff.position("end", t)).max()
    turn = np.abs(one.joint_angle("j3", t) - stiff.joint_angle("j3", t)).max()
    assert deflection > 5e-4
    for other in (many, middle):
        assert other.joint_names == one.joint_names
        assert np.abs(other.position("end", t) - one.position("end", t)).max() < turn * deflection
        assert np.abs(other.joint_angle("j3", t) - one.joint_angle("j3", t)).max() < turn**2


@pytest.mark.parametrize(
    ("change", "value", "where"),
    [
        ({"formulation": "erls"}, 2, "links[0].substructures"),
        ({}, 0, "links[0].substructures"),
        ({}, 5000, "links[0].substructures"),
    ],
    ids=["erls", "none", "too many"],
)
def test_refused(tmp_path: Path, change: dict[str, Any], value: int, where: str) -> None:
    path = l_scene(tmp_path, value, simulation=change)
    with pytest.raises((SceneError, FEImportError)) as caught:
        erls.simulate(path, verdict=False)
    assert caught.value.cause == Cause.BAD_FIELD
    assert str(caught.value.where).endswith(where)
    assert caught.value.remedy


def test_a_rigid_link_has_no_pieces(tmp_path: Path) -> None:
    rigid = {"mass": 1.0, "points": {"root": [0.0, 0.0, 0.0], "tip": [0.5, 0.5, 0.0], "elbow": [0.5, 0.0, 0.0]}}
    path = l_scene(tmp_path, 1)
    data = scenes.read_toml(path)
    data["links"] = [{"name": "l", "rigid": rigid, "substructures": 2}]
    with pytest.raises(SceneError, match="made of beams"):
        erls.load_scene(scenes.write_toml(path, data))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"reduction": {"selection": "ranking", "ranking": RANKING}}, "ranking"),
        ({"damping": {"ratios": [0.01, 0.02]}}, "ratios"),
    ],
)
def test_options_of_the_whole_link_are_refused(tmp_path: Path, change: dict[str, Any], message: str) -> None:
    path = frame_link(tmp_path, **change)
    with pytest.raises(FEImportError, match=message):
        split_link(load_link(path), 2, "root", "tip", "here")


def test_a_ring_across_a_cut_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FEImportError, match="bridge a cut"):
        split_link(load_link(branched(tmp_path, ring=True)), 8, "root", "tip", "here")


def test_solids_are_refused() -> None:
    link = load_link(scenes.ROOT / "data/l_shape/links/solid.toml")
    with pytest.raises(FEImportError, match="made of beams"):
        split_link(link, 2, "root", "tip", "here")


def test_damping_ratios_of_pieces_warn(tmp_path: Path) -> None:
    frame_link(tmp_path, damping={"ratio": 0.02})
    links = [{"name": "l", "model": "link.toml", "substructures": 2}]
    path = scenes.l_scene(tmp_path, links=links, simulation={"duration": 0.001, "formulation": "ffr"})
    assert any("damped less" in w for w in erls.simulate(path, verdict=False).warnings)
    frame_link(tmp_path, damping={"rayleigh": {"beta": 1e-5}})
    assert not any("damped less" in w for w in erls.simulate(path, verdict=False).warnings)


def test_absolute_coordinates_hold_the_welds(tmp_path: Path) -> None:
    """Frames tied by multipliers: the same motion as in joint angles, within the integrator's error."""
    path = l_scene(tmp_path, 2, simulation={"duration": 0.01})
    one, other = (
        erls.simulate(erls.load_scene(path, more), verdict=False) for more in ([], ["simulation.coordinates=absolute"])
    )
    t = np.linspace(0, 0.01, 5)
    np.testing.assert_allclose(other.position("tip", t), one.position("tip", t), atol=1e-7)


def test_pieces_that_do_not_make_up_the_link_are_refused(tmp_path: Path) -> None:
    """A run file that was put together from others."""
    scene = erls.load_scene(l_scene(tmp_path, 3))
    link = load_link(tmp_path / "link.toml")
    pieces = [erls_model(p) for p in split_link(link, 3, "root", "tip", "here")]
    for faulty in (pieces[:2], [*pieces[:2], erls_model(branched(tmp_path))]):
        with pytest.raises(FEImportError) as caught:
            build_mechanism(scene, models=[erls_model(link)], pieces=[faulty])
        assert caught.value.cause == Cause.MODAL_FILE
