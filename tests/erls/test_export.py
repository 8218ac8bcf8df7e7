"""Exports: what is read back is the run."""

import csv
import xml.etree.ElementTree as ET

import meshio
import numpy as np
import pytest
from scenes import ROOT

import erls
from erls.errors import Cause, SceneError
from erls.run.chain.places import node_positions
from erls.view.export import export_csv, export_paraview


@pytest.fixture(scope="module", params=["robot/two_link.toml", "l_shape/solid.toml"])
def run(request):
    return erls.simulate(erls.load_scene(ROOT / "data" / request.param, ["simulation.duration=0.05"]))


def datasets(path):
    return [d.attrib for d in ET.parse(path).getroot().iter("DataSet")]


@pytest.mark.parametrize("magnification", [1.0, 20.0])
def test_paraview(run, magnification, tmp_path):
    times = [0.0, 0.02, 0.05]
    export_paraview(run, tmp_path / "out.pvd", times, magnification)
    listed = datasets(tmp_path / "out.pvd")
    links = run.formulation.mechanism.links
    assert sorted({float(d["timestep"]) for d in listed}) == times
    assert [d["name"] for d in listed[: len(links)]] == list(run.link_names)
    assert len(listed) == len(times) * len(links)
    states = dict(zip(times, run.states(times), strict=True))
    for d in listed:
        mesh, k, state = meshio.read(tmp_path / d["file"]), int(d["part"]), states[float(d["timestep"])]
        expected = node_positions(run.formulation.mechanism, state, k, magnification=magnification)
        np.testing.assert_allclose(mesh.points, expected, rtol=0, atol=1e-12)
        rigid = node_positions(run.formulation.mechanism, state, k, magnification=0.0)
        moved = expected - rigid
        np.testing.assert_allclose(magnification * mesh.point_data["displacement"], moved, rtol=0, atol=1e-12)
        assert (mesh.point_data["link"] == k + 1).all()
        for kind, cells in (("line", links[k].model.lines), ("triangle", links[k].model.triangles)):
            if len(cells):
                np.testing.assert_array_equal(mesh.cells_dict[kind], cells)


def test_paraview_holds_the_named_points(run, tmp_path):
    export_paraview(run, tmp_path / "out.pvd", [0.05])
    listed = datasets(tmp_path / "out.pvd")
    for point in run.formulation.mechanism.points:
        mesh = meshio.read(tmp_path / listed[point.link]["file"])
        np.testing.assert_allclose(mesh.points[point.node], run.position(point.name, 0.05), rtol=0, atol=1e-12)


def test_earlier_export_is_replaced_but_nothing_else(run, tmp_path):
    told = []
    export_paraview(run, tmp_path / "out.pvd", [0.0, 0.01])
    export_paraview(run, tmp_path / "out.pvd", [0.0], progress=lambda *a: told.append(a))
    links = len(run.link_names)
    assert told == [(1, 1)]
    assert len(list((tmp_path / "out_files").iterdir())) == links
    assert sorted(p.name for p in tmp_path.iterdir()) == ["out.pvd", "out_files"]
    (tmp_path / "out_files" / "thesis.txt").write_text("precious")
    with pytest.raises(SceneError, match="thesis"):
        export_paraview(run, tmp_path / "out.pvd")
    assert (tmp_path / "out_files" / "thesis.txt").exists()


def test_interrupted_export_leaves_the_old_one(run, tmp_path):
    export_paraview(run, tmp_path / "out.pvd", [0.0])
    before = {p: p.read_bytes() for p in tmp_path.rglob("*") if p.is_file()}

    def interrupt(done, total):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        export_paraview(run, tmp_path / "out.pvd", progress=interrupt)
    assert {p: p.read_bytes() for p in tmp_path.rglob("*") if p.is_file()} == before


def test_csv(run, tmp_path):
    times = np.array([0.0, 0.013, 0.05])
    export_csv(run, tmp_path / "out.csv", times)
    with (tmp_path / "out.csv").open(newline="") as file:
        header, *rows = csv.reader(file)
    columns = dict(zip(header, np.array(rows, dtype=float).T, strict=True))
    np.testing.assert_array_equal(columns["t [s]"], times)
    for name in run.point_names:
        for axis, k in zip("xyz", range(3), strict=True):
            np.testing.assert_array_equal(columns[f"{name}.{axis} [m]"], run.position(name, times)[:, k])
    for name in run.joint_names:
        np.testing.assert_array_equal(columns[f"{name}.coordinate [rad]"], run.joint_coordinate(name, times))
        np.testing.assert_array_equal(columns[f"{name}.angle [rad]"], run.joint_angle(name, times))
        np.testing.assert_array_equal(columns[f"{name}.rate [rad/s]"], run.joint_rate(name, times))
        np.testing.assert_array_equal(columns[f"{name}.effort [N m]"], run.joint_effort(name, times))
        force, moment = run.reaction(name, times)
        for axis, k in zip("xyz", range(3), strict=True):
            np.testing.assert_array_equal(columns[f"{name}.force.{axis} [N]"], force[:, k])
            np.testing.assert_array_equal(columns[f"{name}.moment.{axis} [N m]"], moment[:, k])
    energy = run.energy(times)
    for kind in ("kinetic", "elastic", "gravity", "springs", "total"):
        np.testing.assert_array_equal(columns[f"energy.{kind} [J]"], getattr(energy, kind))
    assert len(columns) == 1 + 3 * len(run.point_names) + 10 * len(run.joint_names) + 5


def test_default_times(run, tmp_path):
    export_paraview(run, tmp_path / "out.pvd")
    assert len({d["timestep"] for d in datasets(tmp_path / "out.pvd")}) == 101
    export_csv(run, tmp_path / "out.csv")
    data = np.loadtxt(tmp_path / "out.csv", delimiter=",", skiprows=1)
    np.testing.assert_array_equal(data[:, 0], np.linspace(0, 0.05, 1001))


@pytest.mark.parametrize("export", [export_csv, export_paraview])
def test_refused(export, run, tmp_path):
    with pytest.raises(SceneError) as caught:
        export(run, tmp_path / "missing" / "out")
    assert caught.value.cause == Cause.NOT_WRITABLE
    with pytest.raises(SceneError) as caught:
        export(run, tmp_path / "out", [1.0])
    assert caught.value.cause == Cause.TIME_OUT_OF_RANGE
    assert not list(tmp_path.iterdir())
