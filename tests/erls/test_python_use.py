"""What Python offers beside numbers: names, texts, pickles, tables of other packages, plots."""

from __future__ import annotations

import importlib.metadata
import os
import pickle
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pytest
from body_scenes_data import STRIP, body_scene
from matplotlib.figure import Figure
from PIL import Image
from scenes import ROOT

import erls
import fe_import
from erls.errors import Cause, SceneError, SimulationError
from erls.run.bodies.mode import mode_of
from erls.run.record import Run
from erls.run.tables import quantities

matplotlib.use("Agg")

TIMES = [0.0, 0.004, 0.01]
SHORT = ["simulation.duration=0.01"]
SCENES = {
    "chain": ("data/robot/two_link.toml", SHORT),
    "loop": ("data/four_bar/rigid.toml", SHORT),
    "bodies in motion": ("data/heavy_top/slow.toml", ["simulation.duration=0.01"]),
    "bodies at rest": ("data/statics/roll_up.toml", []),
}


@pytest.fixture(scope="module")
def runs() -> dict[str, Run]:
    """Short runs of each kind, without what they state of their error."""
    return {kind: erls.simulate(erls.load_scene(*scene), verdict=kind == "chain") for kind, scene in SCENES.items()}


@pytest.mark.parametrize("package", [erls, fe_import])
def test_public_names_are_told_and_there(package: Any) -> None:
    """Editors ask for them before anything is imported."""
    assert package.__all__ == dir(package)
    assert all(callable(getattr(package, name)) for name in package.__all__)
    with pytest.raises(AttributeError, match="simulat"):
        package.simulat  # noqa: B018


def test_the_version_is_that_of_the_installation() -> None:
    """Or it says that there is none."""
    assert erls.__version__ == importlib.metadata.version("erls")


@pytest.mark.parametrize("kind", SCENES)
def test_runs_and_scenes_are_pickled(kind: str, runs: dict[str, Run]) -> None:
    """Bit for bit, as files hold them; for joblib, Dask and multiprocessing."""
    run = runs[kind]
    again = pickle.loads(pickle.dumps(run))
    times = run.spread(4)
    assert type(again) is type(run)
    for name in run.point_names:
        assert (again.position(name, times) == run.position(name, times)).all()
    assert again.stated() == run.stated()
    assert pickle.loads(pickle.dumps(run.scene)) == run.scene


def test_a_mode_is_pickled(tmp_path: Path) -> None:
    """It is drawn from an equilibrium, which is what is sent."""
    mode = mode_of(erls.simulate(body_scene(tmp_path, STRIP, simulation={"type": "frequencies", "count": 1})), 1)
    again = pickle.loads(pickle.dumps(mode))
    assert again.title == mode.title
    name = mode.point_names[0]
    assert (again.position(name, [0.0, 0.3]) == mode.position(name, [0.0, 0.3])).all()


def test_what_a_failed_run_holds_is_pickled() -> None:
    """With its cause."""
    scene = erls.load_scene("data/robot/two_link.toml", ["simulation.duration=0.02"])

    def stop(t: float, duration: float) -> None:
        if t > 0.01:
            raise KeyboardInterrupt

    with pytest.raises(SimulationError) as failed:
        erls.simulate(scene, progress=stop, verdict=False)
    again = pickle.loads(pickle.dumps(failed.value.run))
    assert again.failure.cause == Cause.INTERRUPTED
    assert "interrupted" in repr(again)


@pytest.mark.parametrize("kind", SCENES)
def test_texts_are_short(kind: str, runs: dict[str, Run]) -> None:
    """A name, how far it went and what it states, instead of all numbers."""
    run = runs[kind]
    assert run.title in repr(run)
    assert len(repr(run)) < 200
    assert len(repr(run.scene)) < 200
    assert run.axis.text(f"{run.start:.6g} to {run.end:.6g}") in repr(run)
    if run.accuracy is not None and run.trust is not None:
        assert f"at most {run.accuracy.total:.1e} m" in repr(run)
        assert run.trust.verdict in repr(run)


def test_pages_of_notebooks_show_no_markup_of_scenes(runs: dict[str, Run]) -> None:
    """A scene's name is somebody's text."""
    scene = erls.load_scene("data/robot/two_link.toml", [*SHORT, "name='<script>'"])
    html = erls.simulate(scene, verdict=False)._repr_html_()
    assert "<script>" not in html
    assert "&lt;script&gt;" in html


@pytest.mark.parametrize("kind", ["chain", "bodies at rest"])
def test_tables_of_other_packages_hold_the_columns(kind: str, runs: dict[str, Run]) -> None:
    """The same numbers and units as the CSV table."""
    run = runs[kind]
    times = run.spread(3)
    table = run.columns(times)
    frame, data = run.to_pandas(times), run.to_xarray(times)
    axis, *heads = table
    assert frame.index.name == axis
    assert list(frame.columns) == heads
    assert (frame.to_numpy() == np.column_stack([table[head] for head in heads])).all()
    name = run.point_names[-1]
    assert data[name].dims == (axis.partition(" [")[0], "axis")
    assert data[name].attrs["units"] == "m"
    assert (data[name].to_numpy() == run.position(name, times)).all()
    stored = sum(part.values.reshape(len(times), -1).shape[1] for _, part in quantities(table))
    assert stored == len(table)
    assert len(run.to_pandas()) == len(run.spread(1001))


def test_plots_show_what_is_asked(runs: dict[str, Run]) -> None:
    """Vectors by their parts, patterns, places of points unless asked."""
    run = runs["chain"]
    axes = Figure().subplots()
    assert run.plot("end2", "elbow_joint.*", times=TIMES, axes=axes) is axes
    lines = {line.get_label(): line.get_ydata() for line in axes.get_lines()}
    assert (lines["end2.z [m]"] == run.position("end2", TIMES)[:, 2]).all()
    assert (lines["elbow_joint.effort [N m]"] == run.to_pandas(TIMES)["elbow_joint.effort [N m]"].to_numpy()).all()
    assert not any(label.startswith("shoulder") for label in lines)
    plain = run.plot(axes=Figure().subplots())
    assert [line.get_label() for line in plain.get_lines()][::3] == [f"{name}.x [m]" for name in run.point_names]
    with pytest.raises(SceneError, match=r"elbo.*end2") as refused:
        run.plot("elbo", axes=axes)
    assert refused.value.cause == Cause.BAD_REFERENCE


def test_points_move(runs: dict[str, Run], tmp_path: Path) -> None:
    """A picture for each time, at the speed that is asked; each shows where points are, and their ways."""
    run = runs["chain"]
    moving = run.animate("end*", times=TIMES, speed=0.1)
    moving.save(tmp_path / "run.gif", writer="pillow")
    with Image.open(tmp_path / "run.gif") as film:
        assert film.n_frames == len(TIMES)
    assert moving._interval == pytest.approx(1e3 * TIMES[-1] / 2 / 0.1)
    (axes,) = moving._fig.axes
    way, *_, mark = axes.get_lines()
    places = run.position(mark.get_label(), TIMES)
    assert (np.stack(mark.get_data_3d(), axis=1) == places[-1:]).all()
    assert (np.stack(way.get_data_3d(), axis=1) == run.position(run.point_names[0], TIMES)).all()
    assert f"{TIMES[-1]:.4g} s" in axes.get_title()
    with pytest.raises(SceneError, match=r"elbo.*end1"):
        run.animate("elbo")
    with pytest.raises(SceneError, match="no times"):
        run.animate(times=[])
    with pytest.raises(SceneError, match="speed is positive"):
        run.animate(speed=0.0)


@pytest.mark.parametrize(
    ("name", "method", "extra"),
    [
        ("pandas", "to_pandas", "tables"),
        ("xarray", "to_xarray", "tables"),
        ("matplotlib", "plot", "plot"),
        ("matplotlib", "animate", "plot"),
    ],
)
def test_a_package_that_is_not_there_is_named(
    name: str, method: str, extra: str, runs: dict[str, Run], monkeypatch: pytest.MonkeyPatch
) -> None:
    """With what installs it."""
    monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(SceneError, match=rf"{name}.*erls\[{extra}\]"):
        getattr(runs["chain"], method)()


LIGHT = """
import sys
from erls.cli.main import main
from erls.files.optional import EXTRAS
for name in EXTRAS:
    sys.modules[name] = None
scene = "data/robot/two_link.toml"
for arguments in (
    ["simulate", scene, "-o", "r.run.h5", "--set", "simulation.duration=0.01"],
    ["view", "r.run.h5", "-o", "r.csv"],
    ["view", "r.run.h5", "-o", "r.png"],
    ["view", "r.run.h5", "-o", "r.html"],
    ["linearize", "data/robot/flexible_joint.toml"],
):
    print("exit code", main(arguments), flush=True)
"""


def test_the_light_installation_does_without_extras(tmp_path: Path) -> None:
    """It simulates and writes tables; pictures name what brings them."""
    program = LIGHT.replace("data/", f"{ROOT}/data/")
    found = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(ROOT)}, text=True,
        capture_output=True, check=True,
    )  # fmt: skip
    assert re.findall(r"exit code (\d)", found.stdout) == ["0", "0", "2", "0", "0"]
    assert found.stderr.count("pip install 'erls[view]'") == 1
    assert (tmp_path / "r.html").stat().st_size > 1e6
