"""What a run says of its own error against the distance that is known, and what it warns of."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scenes

import erls
from erls.maths.rotation_maps import exp
from erls.mechanism.links import Link
from erls.run.deflection.errors import link_errors
from erls.run.deflection.estimate import LeftOut, changes
from erls.run.deflection.lines import Lines, assumed, lines
from erls.run.deflection.motion import Bending
from erls.run.deflection.orders import orders
from erls.run.watches.deflection_range import deflection_errors, deflection_warnings

DATA = scenes.ROOT / "data"


@pytest.mark.parametrize(
    ("scene", "known", "others"),
    [
        ("l_shape/steel_flat.toml", 3.2e-5, 2.4e-5),
        ("l_shape/steel_tall.toml", 1.5e-4, 1.1e-5),
        ("l_shape/aluminium.toml", 3.9e-4, 3.0e-5),
        ("l_shape/steel_soft.toml", 6.6e-4, 0.0),
        ("robot/two_link.toml", 3.0e-4, 2.0e-5),
    ],
)
def test_estimate_against_known_errors(
    monkeypatch: pytest.MonkeyPatch, scene: str, known: float, others: float
) -> None:
    """Distance of a converged linear modal model from exact beams (docs/studies.md), of which ``others`` remain with
    all effects, being no error of linear links: the estimate is right within a factor of 2.5, and none is worth a
    warning. It asks for no second-order data; of links taken as straight beams between their interfaces, as the L is
    not, it is the same within a factor of 3.
    """
    run = erls.simulate(erls.load_scene(DATA / scene, [scenes.LINEAR]), verdict=False)
    estimate = link_errors(run).total
    assert estimate is not None
    assert (known - others) / 2.5 < estimate < 2.5 * (known + others)
    assert not deflection_warnings(run)
    monkeypatch.setattr("erls.mechanism.links.link_second_order", lambda link: None)
    for link in run.formulation.mechanism.links:
        vars(link).pop("second_order", None)
        vars(link).pop("_known")
    assert link_errors(run).total == estimate
    monkeypatch.setattr("erls.run.deflection.lines._of_beams", lambda link, nodes: None)
    for link in run.formulation.mechanism.links:
        vars(link).pop("_known")
    found = link_errors(run)
    assert all(one.assumed for one in found.links.values())
    assert found.total is not None
    assert estimate / 3 < found.total < 3 * estimate


def test_a_bound_spares_looking_at_every_node() -> None:
    """Second-order displacements, of few nodes by forms of their own, of many by the field, are the same, and no
    larger than the bound, at coordinates far beyond the range, too.
    """
    scene = erls.load_scene(DATA / "l_shape/steel_tall.toml", ["simulation.duration=0.01"])
    (link,) = erls.simulate(scene, verdict=False).formulation.mechanism.links
    data, shapes = link.second_order, link.model.translation_shapes
    assert data is not None
    q = 0.1 * np.random.default_rng(0).normal(size=(20, link.model.modes))
    nodes = np.arange(len(link.model.nodes))
    every = data.displacements(nodes, q)
    few = data.displacements(nodes[-2:], q)
    np.testing.assert_allclose(few, every[:, -2:], atol=1e-13 * abs(every).max())
    moved = np.linalg.norm((q @ (shapes - shapes[link.inboard.node]).swapaxes(1, 2)).swapaxes(0, 1), axis=2).max(axis=1)
    assert (np.linalg.norm(every, axis=2).max(axis=1) <= data.bound(q, moved)).all()


def column(folder: Path, **frame: object) -> Link:
    """A straight beam of 1 m along x, 10 x 10 mm."""
    section = {"shape": "rectangular", "width": 0.01, "height": 0.01}
    nodes = {"root": [0.0, 0.0, 0.0], "tip": [1.0, 0.0, 0.0]}
    member = {"from": "root", "to": "tip", "elements": 16, "material": "m", "section": "s"}
    path = scenes.l_link(folder)
    data = {**scenes.read_toml(path), "sections": {"s": section}, "reduction": {"fixed_interface_modes": 8}}
    scenes.write_toml(path, {**data, "frame": {"nodes": nodes, "members": [member], **frame}})
    return scenes.mechanism(scenes.l_scene(folder, points=[{"name": "tip", "link": "l", "node": "tip"}])).links[0]


def bent(link: Link, line: Lines, q: np.ndarray, push: np.ndarray) -> Bending:
    """The link at rest, the same at two times, with a force on its far end and one against it on the near end."""
    forces, turns = np.zeros((2, len(line.places), 3)), np.tile(line.rotation @ q, (2, 1, 1))
    forces[:, line.nodes[link.model.interface_nodes[1].node]] = push
    moved, none = np.tile(line.translation @ q, (2, 1, 1)), np.zeros_like(forces)
    return Bending(
        link=link,
        lines=line,
        times=np.array([0.0, 1.0]),
        moved=moved,
        turns=turns,
        rates=none,
        turn_rates=none,
        dragged=none,
        forces=forces,
        moments=none,
        masses=line.shares,
        strain=np.full(2, float(q[6:] ** 2 @ link.stiffness)),
        axes=np.tile(np.eye(3), (2, 1, 1)),
        places=line.places + moved,
        carried=[],
        floating=True,
    )


def test_a_loaded_column_is_near_its_buckling_load(tmp_path: Path) -> None:
    """A pinned column in its first sine under half of Euler's load π²EI/L²: r = -1/2 within the 1.5 % of its modes,
    shear included, and of its 8 to 16 stations; ½∫w'²dx = π² a² / 4L.
    """
    link = column(tmp_path)
    model, amplitude = link.model, 1e-3
    shape = amplitude * np.sin(np.pi * model.nodes[:, 0])
    slope = amplitude * np.pi * np.cos(np.pi * model.nodes[:, 0])
    rows = np.concatenate([model.translation_shapes[:, 2], model.rotation_shapes[:, 1]])
    q = np.linalg.lstsq(rows, np.concatenate([shape, -slope]), rcond=1e-10)[0]
    line = lines(link, [model.interface_nodes[1].node])
    euler = np.pi**2 * 2e11 * 0.01**4 / 12
    for share in (0.5, 1.0):
        state = bent(link, line, q, np.array([-share * euler, 0.0, 0.0]))
        found = orders(line, state.turns)
        change, _ = changes(state, found, LeftOut(loads=True, places=True, turns=False))
        assert change[0] == pytest.approx(share, rel=0.015)
        assert found.second[0, -1, 0] == pytest.approx(-(np.pi**2) * amplitude**2 / 4, rel=0.01)


def test_orders_of_a_cantilever_under_an_end_load(tmp_path: Path) -> None:
    """w = δ(3x² - x³)/2: its tip comes nearer by ∫w'²dx/2 = 0.6 δ²/L, and ∫(w'³)dx/6 = 9/35 δ³/4L² below what the first
    order says, along its members and as an assumed beam; 1 % for the sums over stations.
    """
    link = column(tmp_path, theory="euler-bernoulli")
    model, x = link.model, link.model.nodes[:, 0]
    rows = np.concatenate([*model.translation_shapes.transpose(1, 0, 2), *model.rotation_shapes.transpose(1, 0, 2)])
    none, deflection = np.zeros(len(x)), 0.01
    curve, slope = deflection * (3 * x**2 - x**3) / 2, deflection * (6 * x - 3 * x**2) / 2
    q = np.linalg.lstsq(rows, np.concatenate([none, curve, none, none, none, slope]), rcond=1e-10)[0]
    tip = model.interface_nodes[1].node
    s = np.linspace(0.0, 1.0, 2001)
    third = -float(np.trapezoid((deflection * (6 * s - 3 * s**2) / 2) ** 3, s)) / 6
    for line in (lines(link, [tip]), assumed(link, [tip])):
        found = orders(line, (line.rotation @ q)[None])
        station = line.nodes[tip]
        np.testing.assert_allclose(found.second[0, station], [-0.6 * deflection**2, 0.0, 0.0], rtol=0.01, atol=1e-12)
        np.testing.assert_allclose(found.third[0, station], [0.0, third, 0.0], rtol=0.02, atol=1e-12)


def test_orders_of_a_line_that_bends_in_space() -> None:
    """Against the product of the turns of 400 segments: with P(ε) the place of the end, even and odd parts in ε."""
    segments = 400
    s = (np.arange(segments) + 0.5) / segments
    kappa = np.stack([np.sin(3 * s), 1.0 - s, np.cos(5 * s)], axis=1) / segments
    along = np.where(s[:, None] < 0.5, [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]) / segments  # an L

    def end(size: float) -> np.ndarray:
        place, turn = np.zeros(3), np.eye(3)
        for bend, step in zip(size * kappa, along, strict=True):
            place = place + turn @ exp(bend / 2) @ step
            turn = turn @ exp(bend)
        return place

    size = 0.2
    even = (end(size) + end(-size)) / 2 - end(0.0)
    odd, half = ((end(x) - end(-x)) / 2 for x in (size, size / 2))
    third = (odd - 2 * half) / 0.75
    theta = size * np.concatenate([np.zeros((1, 3)), np.cumsum(kappa, axis=0)])
    places = np.concatenate([np.zeros((1, 3)), np.cumsum(along, axis=0)])
    shapes = np.zeros((segments + 1, 3, 0))
    line = Lines(
        places=places,
        parents=np.arange(segments),
        segments=along,
        outward=np.tril(np.ones((segments + 1, segments)), -1),
        shares=np.ones(segments + 1),
        translation=shapes,
        rotation=shapes,
        nodes={},
        beams=True,
    )
    found = orders(line, theta[None])
    # what is left is of the fourth and fifth order, a share size²; segments count with their square, 1e-5
    np.testing.assert_allclose(found.second[0, -1], even, atol=size**2 * np.abs(even).max())
    np.testing.assert_allclose(found.third[0, -1], third, atol=size**2 * np.abs(third).max())


def test_third_order_is_left_with_stiffening() -> None:
    """Never 0: with second-order kinematics 1 to 10 % of what linear links leave out, at slopes of 0.04."""
    told = []
    for effects in ("all", "linear"):
        found = link_errors(
            erls.simulate(
                erls.load_scene(DATA / "robot/three_link.toml", [f"simulation.effects={effects}"]), verdict=False
            )
        )
        assert found.total is not None
        told.append(found.total)
    assert 0.01 * told[1] < told[0] < 0.1 * told[1]


def test_a_link_that_knows_no_second_order_is_told_of(tmp_path: Path) -> None:
    """A soft ring: the estimate is there, the warning says why no effect mends it; stiffening changes nothing."""
    pairs = (("root", "elbow"), ("elbow", "tip"), ("root", "tip"))
    members = [{"from": a, "to": b, "elements": 2, "material": "m", "section": "s"} for a, b in pairs]
    path = scenes.l_link(tmp_path)
    data = scenes.merged(scenes.read_toml(path), {"frame": {"members": members}})
    data["materials"]["m"]["youngs_modulus"] = 5e7
    scenes.write_toml(path, data)
    told = []
    for effects in ("all", "all,geometric_stiffening"):
        scene = scenes.l_scene(tmp_path, simulation={"duration": 0.1, "step": 1e-3, "effects": effects})
        run = erls.simulate(scene, verdict=False)
        assert deflection_errors(run)["l"].second
        told.append(deflection_warnings(run))
    assert len(told[0]) == 1
    assert "second-order displacements are not available: members form a ring" in told[0][0]
    assert told[1] == told[0]
