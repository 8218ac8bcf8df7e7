"""What links of a URDF file look like: volumes of shapes, meshes from where they may lie, pictures that move."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

import erls
from erls.cli.main import main
from erls.errors import SceneError
from erls.importers.visuals import place_of
from erls.maths.so3 import Array, fixed_axes
from erls.run.chain.run import ChainRun
from erls.scene.made import save_scene
from erls.view.figures import figure_of
from erls.view.run_page import _carried, run_page
from fe_import.errors import FEImportError
from fe_import.mesh.surfaces import read_surface, stl_bytes, thinned
from fe_import.model import Surface

TETRAHEDRON = Surface(
    np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]), np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
)
OBJ = """# a unit square pyramid: one face of four, one counted from the end, texture coordinates of another number
v 0 0 0
v 1 0 0
v 1 1 0 0.5 0.5 0.5
v 0 1 0
v 0.5 0.5 1
vt 0 0
f 4/1 3/1 2/1 1/1
f 1 2 5
f 2 3 5
f 3 4 5
f -2 -5 -1
"""
INERTIA = '<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/>'
SIDES = 32  # of round shapes
ROUND = SIDES / 2 * np.sin(2 * np.pi / SIDES)  # area of the polygon over r²
_AT = np.pi / 2 * np.linspace(-1, 1, SIDES // 2 + 1)
_R = np.cos(_AT)
BALL = ROUND / 3 * float((np.diff(np.sin(_AT)) * (_R[1:] ** 2 + _R[1:] * _R[:-1] + _R[:-1] ** 2)).sum())
"""Frusta between rings, of radius 1."""


def robot(folder: Path, arm: str, hand: str = "", base: str = "") -> Path:
    """A pendulum of an arm and a hand, with what they look like, in a package."""
    (folder / "bot/urdf").mkdir(parents=True)
    (folder / "bot/meshes").mkdir()
    (folder / "bot/meshes/tetrahedron.STL").write_bytes(stl_bytes(TETRAHEDRON, "solid as others say"))
    (folder / "bot/meshes/pyramid.obj").write_text(OBJ, encoding="utf-8")
    inertial = f'<inertial><origin xyz="0 0 -0.2"/><mass value="1"/>{INERTIA}</inertial>'
    text = f"""<robot name="bot"><link name="base">{base}</link>
    <link name="arm">{arm}{inertial}</link><link name="hand">{hand}{inertial}</link>
    <joint name="shoulder" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/></joint>
    <joint name="elbow" type="revolute"><origin xyz="0 0 -0.5" rpy="0.3 0 0.2"/><parent link="arm"/>
    <child link="hand"/><axis xyz="0 1 0"/></joint></robot>"""
    path = folder / "bot/urdf/bot.urdf"
    path.write_text(text, encoding="utf-8")
    return path


def visual(geometry: str, origin: str = "", tag: str = "visual") -> str:
    """An element."""
    return f"<{tag}>{origin}<geometry>{geometry}</geometry></{tag}>"


def mesh(name: str, more: str = "") -> str:
    """Geometry."""
    return f'<mesh filename="{name}"{more}/>'


def volume(surface: Surface) -> tuple[float, Array]:
    """Of a closed surface that turns outwards, and its centre: the divergence theorem."""
    a, b, c = (surface.points[surface.triangles[:, k]] for k in range(3))
    each = np.einsum("ti,ti->t", a, np.cross(b, c)) / 6
    return float(each.sum()), np.asarray(each @ (a + b + c) / 4 / each.sum())


def made(path: Path, *options: str, name: str = "scene.toml") -> tuple[Path, dict[str, Any]]:
    """The scene of a robot, and the tables of its links."""
    target = path.parents[2] / name
    assert main(["import", str(path), "-o", str(target), *options]) == 0
    return target, {link["name"]: link for link in tomllib.loads(target.read_text(encoding="utf-8"))["links"]}


TURN = '<origin xyz="1 2 3" rpy="0.3 -0.4 1.1"/>'
SHAPES = {
    "box": ('<box size="1 2 3"/>', 6.0, (0, 0, 0)),
    "cylinder": ('<cylinder radius="0.5" length="3"/>', ROUND * 0.25 * 3, (0, 0, 0)),
    "sphere": ('<sphere radius="0.5"/>', 0.5**3 * BALL, (0, 0, 0)),
    "stl": (mesh("package://bot/meshes/tetrahedron.STL", ' scale="1 2 -3"'), 1.0, (0.25, 0.5, -0.75)),
    "obj": (mesh("../meshes/pyramid.obj", ' scale="2 2 2"'), 8 / 3, (1, 1, 0.5)),
}


@pytest.mark.parametrize("kind", SHAPES)
def test_shapes_have_their_volume_where_the_file_puts_it(kind: str, tmp_path: Path) -> None:
    """Turned outwards, mirrored ones too; to single precision of the file."""
    geometry, expected, centre = SHAPES[kind]
    scene, links = made(robot(tmp_path, visual(geometry, TURN)))
    assert links["arm"]["rigid"]["surface"] == "scene_meshes/arm.stl"
    assert "surface" not in links["hand"]["rigid"]
    found, at = volume(read_surface(scene.parent / links["arm"]["rigid"]["surface"]))
    assert found == pytest.approx(expected, rel=1e-5)
    place = fixed_axes(0.3, -0.4, 1.1) @ np.array(centre, dtype=float) + (1, 2, 3)
    np.testing.assert_allclose(at, place, atol=1e-5)


def test_what_cannot_be_drawn_is_told_and_the_rest_is_drawn(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """By name and reason; contact shapes stand in where nothing else is left."""
    (tmp_path / "secret.stl").write_bytes(stl_bytes(TETRAHEDRON, ""))
    bad = {
        "../../secret.stl": "outside",
        str(tmp_path / "secret.stl"): "outside",
        "package://../secret.stl": "no name of a package",
        "package://other/a.stl": "no folder 'other'",
        "package://bot/../secret.stl": "outside",
        "package://bot/meshes/none.stl": "no such file",
        "arm.dae": ".dae is not read",
        "../meshes/empty.obj": "no triangles",
        "../meshes/far.obj": "not in the file",
        "../meshes/text.obj": "line 1 is no corner",
        "../meshes/cut.stl": "cut off",
        "../meshes/nan.obj": "not finite",
        "../meshes": "without ending",
        "x" * 5000 + ".stl": "",
    }
    shapes = "".join(visual(mesh(name)) for name in bad)
    shapes += visual('<box size="0 1 1"/>') + visual('<capsule radius="1"/>') + visual('<sphere radius="big"/>')
    contact = visual('<box size="1 1 1"/>', tag="collision")
    lost = visual('<sphere radius="1e-4"/>', '<origin xyz="1e5 1e5 1e5"/>')  # a point, in single precision
    path = robot(tmp_path, shapes + contact, lost, visual("<box/>"))
    meshes = path.parents[1] / "meshes"
    (meshes / "empty.obj").write_text("v 0 0 0\n", encoding="utf-8")
    (meshes / "far.obj").write_text(f"v 0 0 0\nf 1 2 {10**30}\n", encoding="utf-8")
    (meshes / "text.obj").write_text("v a b c\n", encoding="utf-8")
    (meshes / "nan.obj").write_text("v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", encoding="utf-8")
    (meshes / "cut.stl").write_bytes(stl_bytes(TETRAHEDRON, "")[:-7])
    scene, links = made(path, "--json")
    told = json.loads(capsys.readouterr().out)["told"]
    for name, reason in bad.items():
        assert any(name in text and reason in text and "'arm'" in text for text in told), (name, told)
    for words in ("a box without size", "no geometry of mesh", "not a finite number", "drawn by its shapes"):
        assert any(words in text for text in told), words
    assert any("'hand': not drawn: no triangles" in text for text in told)
    assert "surface" not in links["hand"]["rigid"]
    assert volume(read_surface(scene.parent / links["arm"]["rigid"]["surface"]))[0] == pytest.approx(1.0)


def test_packages_are_found_above_the_file(tmp_path: Path) -> None:
    """As the folder that holds it, or beside that; links of the file system do not lead out."""
    path = robot(tmp_path, "")
    (tmp_path / "other/a").mkdir(parents=True)
    assert place_of("package://other/a/m.stl", path) == (tmp_path / "other/a/m.stl").resolve()
    assert place_of("package://bot/meshes/m.stl", path) == (tmp_path / "bot/meshes/m.stl").resolve()
    (path.parent / "out.stl").symlink_to("/dev/zero")
    with pytest.raises(ValueError, match="outside"):
        place_of("out.stl", path)


def test_surfaces_move_with_their_links(tmp_path: Path) -> None:
    """A corner at a named point goes where that goes, at rest and magnified, behind a flexible link; a run that was
    loaded draws the same; pages place all corners by four; what is drawn changes no motion.
    """
    # a triangle whose first corner is the frame of the hand
    arm, hand = visual('<box size="0.1 0.1 1"/>'), visual(mesh("package://bot/meshes/tetrahedron.STL"))
    path = robot(tmp_path, arm, hand)
    scene, links = made(path, "--flexible", "arm=tube:0.04")
    assert "rigid" not in links["arm"]
    assert "what link 'arm' looks like is left out" in scene.read_text(encoding="utf-8")
    settings = ["simulation.duration=0.02", "joints.shoulder.initial={rate=2.0}"]
    run = erls.simulate(erls.load_chain(scene, settings), verdict=False)
    assert isinstance(run, ChainRun)
    erls.save_run(tmp_path / "r.run.h5", run)
    again = erls.load_run(tmp_path / "r.run.h5")
    times = [0.0, 0.01, 0.02]
    poses = figure_of(run).poses(times)
    meshes = [pose.meshes(50.0)[1] for pose in poses]
    others = [pose.meshes(50.0)[1] for pose in figure_of(again).poses(times)]
    for k, (own, read) in enumerate(zip(meshes, others, strict=True)):
        assert np.array_equal(own.points, read.points)
        node = poses[k].nodes(1.0)[1]
        corner = node[np.abs(node[1:] - node[0]).sum(axis=1).argmin() + 1]
        np.testing.assert_allclose(corner, run.position("hand", times[k]), atol=1e-7)  # single precision of the file
        (kind, triangles), *_ = own.cells
        assert (kind, own.rigid) == ("triangle", True)
        assert triangles.min() >= 1  # no node of the link
    assert max(float(np.abs(m.displacement).max()) for m in meshes) > 0
    nodes = np.unique(meshes[0].cells[0][1])
    four, weights = _carried(meshes[0].points, nodes)
    np.testing.assert_allclose(weights @ meshes[2].points[four], meshes[2].points[nodes], atol=1e-12)
    np.testing.assert_allclose(weights @ meshes[2].displacement[four], meshes[2].displacement[nodes], atol=1e-12)
    assert '"weights":' in run_page(again)
    surfaces = [part.surface for part in figure_of(again).poses([0.0])[0].parts(1.0, 0.01)]
    assert surfaces[1].n_cells == 4
    bare = erls.load_chain(scene, [*settings, "links.hand.rigid.surface="])
    assert np.array_equal(erls.simulate(bare, verdict=False).solution.y, run.solution.y)


def test_scenes_without_surfaces_hold_none(tmp_path: Path) -> None:
    """Nothing in the run file, nothing beside the scene."""
    scene, _ = made(robot(tmp_path, ""))
    assert [p.name for p in scene.parent.iterdir() if p.name != "bot"] == ["scene.toml"]
    run = erls.simulate(erls.load_chain(scene, ["simulation.duration=1e-3"]), verdict=False)
    erls.save_run(tmp_path / "r.run.h5", run)
    found: list[str] = []
    with h5py.File(tmp_path / "r.run.h5") as file:
        file.visit(found.append)
    assert any("pictures/triangles" in name for name in found)
    assert not any("surface" in name for name in found)


def sphere(count: int) -> Surface:
    """Of radius 1, with 4 (count - 1)² triangles or so."""
    u, v = np.meshgrid(np.linspace(0, 2 * np.pi, 2 * count - 1), np.linspace(0, np.pi, count), indexing="ij")
    points = np.stack([np.cos(u) * np.sin(v), np.sin(u) * np.sin(v), np.cos(v)], axis=-1).reshape(-1, 3)
    k = (np.arange(2 * count - 2)[:, None] * count + np.arange(count - 1)).ravel()
    triangles = np.concatenate([np.stack([k, k + 1, k + count], 1), np.stack([k + 1, k + count + 1, k + count], 1)])
    return Surface(points, triangles)


def test_large_meshes_are_thinned_by_the_import_and_refused_in_scenes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Thinned: no more than asked for, at most a cell of the grid away; refused with field and limit."""
    large = sphere(80)
    fewer = thinned(large, 2000)
    assert 1000 < len(fewer.triangles) <= 2000
    assert np.abs(np.linalg.norm(fewer.points, axis=1) - 1).max() < 0.02  # (cell width)²/8, cells of 0.1 across
    path = robot(tmp_path, visual(mesh("../meshes/large.stl")))
    (path.parents[1] / "meshes/large.stl").write_bytes(stl_bytes(large, ""))
    scene, _ = made(path)
    assert "triangles are thinned to" in capsys.readouterr().err
    assert len(read_surface(scene.parent / "scene_meshes/arm.stl").triangles) <= 5000
    (scene.parent / "scene_meshes/arm.stl").write_bytes(stl_bytes(large, ""))
    with pytest.raises(FEImportError, match="more triangles") as refused:
        erls.simulate(erls.load_chain(scene))
    assert refused.value.limit == 20_000
    (scene.parent / "scene_meshes/arm.stl").unlink()
    with pytest.raises(FEImportError, match=r"links\[0\]\.rigid\.surface"):
        erls.simulate(erls.load_chain(scene))


def test_nothing_else_is_replaced_and_scenes_that_move_keep_theirs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A file of the user stops the import before anything is written; what the import wrote is replaced by it."""
    path = robot(tmp_path, visual('<box size="1 1 1"/>'), visual('<box size="1 1 1"/>'))
    (tmp_path / "scene_meshes").mkdir()
    own = tmp_path / "scene_meshes/hand.stl"
    own.write_bytes(stl_bytes(TETRAHEDRON, "mine"))
    assert main(["import", str(path), "-o", str(tmp_path / "scene.toml")]) == 2
    assert "hand.stl" in capsys.readouterr().err
    assert [p.name for p in (tmp_path / "scene_meshes").iterdir()] == ["hand.stl"]
    assert not (tmp_path / "scene.toml").exists()
    own.unlink()
    for _ in range(2):
        scene, _ = made(path)
    (tmp_path / "elsewhere").mkdir()
    save_scene(tmp_path / "elsewhere/copy.toml", erls.load_chain(scene))
    moved = tomllib.loads((tmp_path / "elsewhere/copy.toml").read_text(encoding="utf-8"))
    assert moved["links"][0]["rigid"]["surface"] == "../scene_meshes/arm.stl"
    with pytest.raises(SceneError, match="file that is read"):
        save_scene(own, erls.load_chain(scene), force=True)
