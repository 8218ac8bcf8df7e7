"""Pictures and films: written whole, in the right place, without a display."""

import itertools
import os
import subprocess
import sys
from pathlib import Path

import contact_scenes
import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image, ImageSequence
from scenes import ROOT, write_toml

import erls
from erls.errors import Cause, SceneError, SimulationError
from erls.files.results import claim
from erls.view import film, picture, show, write_view
from erls.view.camera import Box, Camera, Walls
from erls.view.chain import closing_places, joint_places
from erls.view.checks import surveyed
from erls.view.figures import figure_of
from erls.view.marks import LONGEST
from erls.view.shapes import chains, joints_surface, load_surface
from erls.view.stage import Motion
from erls.view.window import Window

SIZE = (400, 250)


def simulated(scene, *changes):
    return erls.simulate(erls.load_scene(ROOT / "data" / scene, ["simulation.duration=0.05", *changes]), verdict=False)


@pytest.fixture(scope="module")
def pendulum():
    return simulated("l_shape/steel_tall.toml")


@pytest.fixture(scope="module")
def robot():
    return simulated("robot/two_link.toml")


def pixels(path):
    with Image.open(path) as image:
        return np.asarray(image.convert("RGB")).astype(int)


def coloured(image):
    """Where the picture is neither white nor grey."""
    return np.ptp(image, axis=2) > 60


def test_picture_shows_the_link_at_its_tip(pendulum, tmp_path):
    path = tmp_path / "l.png"
    size = (800, 500)
    picture(pendulum, path, size=size)
    image = pixels(path)
    assert image.shape == (500, 800, 3)
    assert 0.5 < (image.min(axis=2) > 250).mean() < 0.98
    figure = figure_of(pendulum)
    poses = figure.poses(np.linspace(0, 0.05, 6))
    camera = Camera.fitting(Motion.of(figure, 1.0, poses).box, np.array([0, 0, -9.81]), size)
    for name in ("tip", "elbow"):
        x, y = camera.project(pendulum.position(name, 0.05)).round().astype(int)
        assert coloured(image)[y - 2 : y + 3, x - 2 : x + 3].mean() > 0.5
    halfway = (pendulum.position("tip", 0.05) + pendulum.position("elbow", 0.05)) / 2
    x, y = camera.project(halfway).round().astype(int)
    assert coloured(image)[y - 2 : y + 3, x - 2 : x + 3].mean() > 0.5
    assert not coloured(image)[y + 15 : y + 20, x - 2 : x + 3].any()  # beside the link there is nothing


def test_same_run_same_picture(pendulum, tmp_path):
    for name in ("a.png", "b.png"):
        picture(pendulum, tmp_path / name, [0.02], size=SIZE)
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    claim(tmp_path / "a.png", ".png", [])  # known for a result, which the next may replace


@pytest.mark.parametrize("scene", ["robot/two_link.toml", "l_shape/solid.toml"])
@pytest.mark.parametrize("changes", [[], ["points=[]"], ["links.0.flexible=false", "gravity=[0, 3, 0]"]])
def test_any_mechanism_makes_a_picture(scene, changes, tmp_path):
    run = simulated(scene, "simulation.duration=0.002", *changes)
    picture(run, tmp_path / "a.JPG", [0.0, 0.002], magnification=20, size=SIZE)
    assert coloured(pixels(tmp_path / "a.JPG")).sum() > 200


def test_magnification_changes_the_picture(robot, tmp_path):
    for factor in (1, 50):
        picture(robot, tmp_path / f"{factor}.png", [0.05], magnification=factor, size=SIZE)
    assert (pixels(tmp_path / "1.png") != pixels(tmp_path / "50.png")).any(axis=2).mean() > 0.02


@pytest.mark.parametrize("magnification", [0.0, 1.0, 30.0])
@pytest.mark.parametrize("formulation", ["erls", "nodal"])
def test_paths_of_all_times_are_those_of_each(formulation, magnification):
    figure = figure_of(simulated("robot/two_link.toml", f"simulation.formulation={formulation}"))
    times = figure.run.spread(7)
    each = [pose.points(magnification) for pose in figure.poses(times)]
    for k, path in enumerate(figure.paths(times, magnification)):
        np.testing.assert_allclose(path, [points[k] for points in each], rtol=0, atol=1e-14)


def test_no_display_needed(tmp_path):
    """Nor asked: there is none of this name; all other pictures are made without any."""
    code = (
        f"import erls, erls.view\n"
        f"s = erls.load_scene({str(ROOT / 'data/l_shape/steel_tall.toml')!r}, ['simulation.duration=0.002'])\n"
        f"erls.view.picture(erls.simulate(s), {str(tmp_path / 'a.png')!r}, [0.0], size=(200, 150))\n"
    )
    environment = {k: v for k, v in os.environ.items() if k != "WAYLAND_DISPLAY"}
    environment |= {"PYTHONPATH": str(ROOT), "DISPLAY": ":77"}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert coloured(pixels(tmp_path / "a.png")).any()


def test_import_is_light():
    code = "import sys, erls.view; print(sorted({'pyvista', 'vtk', 'PIL', 'matplotlib', 'meshio'} & set(sys.modules)))"
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_film_has_every_frame(robot, tmp_path):
    told = []
    film(robot, tmp_path / "a.mp4", fps=20, speed=0.25, size=(401, 251), progress=lambda *a: told.append(a))
    decode = [imageio_ffmpeg.get_ffmpeg_exe(), "-i", str(tmp_path / "a.mp4")]
    done = subprocess.run([*decode, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"], capture_output=True, check=True)
    frames = np.frombuffer(done.stdout, np.uint8).reshape(-1, 250, 400, 3).astype(int)
    claim(tmp_path / "a.mp4", ".mp4", [])
    assert b"400x250" in done.stderr
    assert b"20 fps" in done.stderr
    assert told == [(k, 5) for k in range(1, 6)]
    assert len(frames) == 5
    assert all(np.abs(a - b).max() > 60 for a, b in itertools.pairwise(frames))


def test_gif(pendulum, tmp_path):
    film(pendulum, tmp_path / "a.gif", fps=10, speed=0.25, size=SIZE)
    with Image.open(tmp_path / "a.gif") as image:
        durations = [f.info["duration"] for f in ImageSequence.Iterator(image)]
        assert image.size == SIZE
    assert durations == [100, 100, 100]
    claim(tmp_path / "a.gif", ".gif", [])


@pytest.mark.parametrize("name", ["a.mp4", "a.gif"])
def test_interrupted_film_leaves_the_old_one(pendulum, name, tmp_path):
    (tmp_path / name).write_text("old")

    def interrupt(done, total):
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        film(pendulum, tmp_path / name, fps=20, speed=0.25, size=SIZE, progress=interrupt)
    assert [p.name for p in tmp_path.iterdir()] == [name]
    assert (tmp_path / name).read_text() == "old"


def test_encoder_that_fails(pendulum, tmp_path, monkeypatch):
    monkeypatch.setenv("IMAGEIO_FFMPEG_EXE", "/bin/false")
    with pytest.raises(SimulationError) as caught:
        film(pendulum, tmp_path / "a.mp4", size=SIZE)
    assert caught.value.cause == Cause.NO_PICTURE
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("name", "options", "cause", "where"),
    [
        ("a.vtu", {}, Cause.BAD_FIELD, "-o"),
        ("a", {}, Cause.BAD_FIELD, "-o"),
        ("nowhere/a.png", {}, Cause.NOT_WRITABLE, "nowhere"),
        ("nowhere/a.mp4", {}, Cause.NOT_WRITABLE, "nowhere"),
        ("nowhere/a.pvd", {}, Cause.NOT_WRITABLE, "nowhere"),
        ("nowhere/a.csv", {}, Cause.NOT_WRITABLE, "nowhere"),
        ("a.png", {"times": [9.0]}, Cause.TIME_OUT_OF_RANGE, "t"),
        ("a.png", {"magnification": float("nan")}, Cause.BAD_FIELD, "magnification"),
        ("a.png", {"magnification": 1e200}, Cause.BAD_FIELD, "magnification"),
        ("a.csv", {"magnification": 2.0}, Cause.BAD_FIELD, "magnification"),
        ("a.pvd", {"magnification": float("inf")}, Cause.BAD_FIELD, "magnification"),
        ("a.mp4", {"times": [0.01]}, Cause.BAD_FIELD, "times"),
        ("a.mp4", {"fps": 0}, Cause.BAD_FIELD, "fps"),
        ("a.gif", {"fps": 60}, Cause.BAD_FIELD, "fps"),
        ("a.mp4", {"speed": 0.0}, Cause.BAD_FIELD, "speed"),
        ("a.mp4", {"speed": 1e-9}, Cause.BAD_FIELD, "speed"),
    ],
)
def test_refused(pendulum, name, options, cause, where, tmp_path):
    with pytest.raises(SceneError) as caught:
        write_view(pendulum, tmp_path / name, **options)
    assert caught.value.cause == cause
    assert where in caught.value.where
    assert caught.value.remedy
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("draw", [picture, film])
def test_refused_name_and_size(draw, pendulum, tmp_path):
    for name, size in (("a.txt", SIZE), ("a.png" if draw is picture else "a.gif", (10, 10))):
        with pytest.raises(SceneError) as caught:
            draw(pendulum, tmp_path / name, size=size)
        assert caught.value.cause == Cause.BAD_FIELD


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="elsewhere there is always a display")
@pytest.mark.parametrize("display", ["", ":77"])
def test_window_needs_a_display(display, pendulum, monkeypatch):
    monkeypatch.setenv("DISPLAY", display)
    with pytest.raises(SimulationError) as caught:
        show(pendulum)
    assert caught.value.cause == Cause.NO_PICTURE
    assert "-o PICTURE.png" in caught.value.remedy


def test_window_follows_its_slider(robot, monkeypatch):
    monkeypatch.setattr("pyvista.OFF_SCREEN", True)
    with Window(figure_of(robot), surveyed(figure_of(robot), 1.0, None), 1.0, SIZE) as window:
        shown = []
        monkeypatch.setattr(window.plotter, "show", lambda **_: shown.append(window.image().astype(int)))
        window.interact("two links")
        window.show_time(0.05)
        shown.append(window.image().astype(int))
    assert np.abs(shown[1] - shown[0]).max() > 60


def test_camera_fits_the_box():
    points = np.random.default_rng(1).normal(size=(20, 3)) * [3, 0.1, 1]
    for gravity in ([0, 0, -9.81], [0, 9.81, 0], [-9.81, 0, 0], [0, 0, 0]):
        box = Box.around(points)
        camera = Camera.fitting(box, np.array(gravity, dtype=float), (800, 500))
        seen = camera.project(box.corners)
        assert (seen > 0).all()
        assert (seen < [800, 500]).all()
        np.testing.assert_allclose(camera.lift(*camera.project(camera.focal)), camera.focal)
        assert camera.up @ gravity <= 0
        np.testing.assert_allclose(np.cross(camera.right, camera.up), camera.towards, atol=1e-15)
        titles = [t.text for t in Walls(box, camera).ticks() if t.title]
        assert titles == ["x [m]", "y [m]", "z [m]"]


def test_chains_end_at_corners_and_branches():
    nodes = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 1, 0], [2, 2, 0], [1, 0, 1.0]])
    lines = np.array([[1, 0], [1, 2], [3, 2], [3, 4], [1, 5]])
    found = {tuple(min(c, c[::-1])) for c in chains(nodes, lines)}
    assert found == {(0, 1), (1, 2), (1, 5), (2, 3, 4)}
    angle = np.linspace(0, 2 * np.pi, 40, endpoint=False)
    ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    (loop,) = chains(ring, np.stack([np.arange(40), (np.arange(40) + 1) % 40], axis=1))
    assert (loop[0], len(loop)) == (loop[-1], 41)


def test_both_sides_of_a_joint_meet(robot):
    (state,) = robot.states([0.05])
    for place in joint_places(robot.formulation.mechanism, state, 1.0):
        np.testing.assert_allclose(place.inner[:3, 3], place.outer[:3, 3], atol=1e-6)
        np.testing.assert_allclose(place.inner[:3, 2], place.outer[:3, 2], atol=1e-4)
        np.testing.assert_allclose(place.outer_node, place.outer[:3, 3], atol=1e-9)


def test_closing_joints_and_planes_are_drawn(tmp_path: Path) -> None:
    """A joint that closes a loop with a plate where it stands on the ground, both its ends at one place to what loops
    stay open by; a piece of the plane that a point may touch, below that point.
    """
    scene = erls.load_scene(ROOT / "data/five_bar/parallel_robot.toml", ["simulation.duration=0.02"])
    run = erls.simulate(scene, verdict=False)
    figure = figure_of(run)
    (loop,) = (loop for loop in run.formulation.mechanism.loops if loop.holds_frames)
    (end,) = (end for end in (loop.inner, loop.outer) if end.link is None)
    assert any(np.array_equal(place, end.frame[:3, 3]) for place in figure.fixed())
    assert len(figure.ground(np.array([0.0, -1.0, 0.0]), 0.01)) == 2
    (state,) = run.states([0.02])
    (place,) = closing_places(run.formulation.mechanism, state, 1.0)
    assert place.type == "revolute"
    np.testing.assert_allclose(place.inner[:3, 3], place.outer[:3, 3], atol=1e-9)
    for bodies in ([], [place]):
        drawn = joints_surface([*joint_places(run.formulation.mechanism, state, 1.0), *bodies], 0.01)
        near = np.linalg.norm(np.asarray(drawn.points) - end.frame[:3, 3], axis=1).min() < 0.05
        assert near == bool(bodies)
    ball = erls.simulate(contact_scenes.falling(tmp_path, 0.5, 0.3, 0.0, 9.81), verdict=False)
    _, plane = figure_of(ball).ground(np.array([0.0, -1.0, 0.0]), 0.01)
    np.testing.assert_allclose(np.asarray(plane.points)[:, 2], 0.0, atol=1e-12)
    np.testing.assert_allclose(np.asarray(plane.points).mean(axis=0), 0.0, atol=1e-12)


def test_loads_are_arrows_and_sensors_have_places(tmp_path: Path) -> None:
    """Loads point as they act, outside of their link and as long as they are large; a follower turns with its link, a
    force on all mass begins at its middle. Sensors sit on their points and joints.
    """
    fades = {"shape": "trapezoid", "start": 0.0, "rise": 0.0, "hold": 0.0, "fall": 0.1, "value": 1.0}
    push = {"point": "tip", "force": [-3.0, 0.0, 0.0], "axes": "link", "factor": [fades]}
    turning = {"point": "tip", "moment": [0.0, 0.0, 2.0]}
    blown = {"link": "l", "force_per_mass": [0.0, 0.0, -6.0]}
    drive = {"type": "motion", "motion": {"shape": "polynomial", "from": 0.0, "to": 1.0, "duration": 0.1}}
    sensors = [{"name": "imu", "type": "accelerometer", "point": "tip"}]
    sensors += [{"name": "encoder", "type": "joint_angle", "joint": "j"}]
    joints = [{"name": "j", "dh": {"convention": "standard", "a": 1.0}, "drive": drive}]
    body = {"mass": 0.25, "centre_of_mass": [-0.5, 0.0, 0.0], "inertia": [1e-3] * 3}
    links = [{"name": "l", "rigid": {**body, "points": {"root": [-1.0, 0.0, 0.0], "tip": [0.0, 0.0, 0.0]}}}]
    points = [{"name": "tip", "link": "l", "node": "tip"}]
    data = {"joints": joints, "links": links, "points": points, "loads": [push, turning, blown], "sensors": sensors}
    scene = write_toml(tmp_path / "s.toml", {**data, "simulation": {"duration": 0.1, "step": 1e-3}})
    first, middle = figure_of(erls.simulate(scene, verdict=False)).poses([0.0, 0.05])
    tip = middle.points(1.0)[0]
    np.testing.assert_allclose(tip, [np.cos(0.5), np.sin(0.5), 0.0], atol=1e-9)
    outside, turned, pull = middle.loads(1.0)
    np.testing.assert_allclose(outside.along, -0.5 * LONGEST * tip, atol=1e-9)  # half of the largest, that at the start
    np.testing.assert_allclose(outside.place + outside.along, tip, atol=1e-9)
    np.testing.assert_allclose(turned.along, [0.0, 0.0, LONGEST], atol=1e-9)
    np.testing.assert_allclose(pull.place, tip / 2, atol=1e-9)
    np.testing.assert_allclose(pull.along, [0.0, 0.0, -0.5 * LONGEST], atol=1e-9)  # 1.5 N
    assert [load.turns for load in (outside, turned, pull)] == [False, True, False]
    assert np.linalg.norm(first.loads(1.0)[0].along) == pytest.approx(LONGEST)
    np.testing.assert_allclose(middle.sensors(1.0)["imu"], tip)
    np.testing.assert_allclose(middle.sensors(1.0)["encoder"], 0.0, atol=1e-12)
    assert len(load_surface(turned).points) > len(load_surface(pull).points)  # two heads
