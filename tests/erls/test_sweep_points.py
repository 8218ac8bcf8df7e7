"""Points of sweeps, and the quantities that are asked of their runs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from sweep_cases import GRID, SCENE, SHORT

import erls
from erls.errors import Cause, SceneError
from erls.studies.sweep.chunks import Chunks
from erls.studies.sweep.evaluate import Task
from erls.studies.sweep.points import SAMPLERS, Grid, points_of, sampled
from erls.studies.sweep.quantities import quantity, values_of

# ----- points


def test_grids_list_all_combinations() -> None:
    """The last key changes fastest; lists, even values, tables in brackets, words."""
    found = points_of(["a.b=0:1:3", "c=[1, 2],x,3"])
    assert found.keys == ("a.b", "c")
    assert [found.row(k) for k in range(len(found))][:4] == [(0.0, [1, 2]), (0.0, "x"), (0.0, 3), (0.5, [1, 2])]
    assert len(found) == 9


@pytest.mark.parametrize("method", SAMPLERS)
def test_samples_fill_their_ranges(method: str) -> None:
    """The same points for the same seed, others for another; each tenth of a range is met."""
    found = points_of(["a=1:2", "b=-1e-3:0"], f"{method}:200", seed=3)
    rows = np.array([found.row(k) for k in range(len(found))])
    assert (rows == points_of(["a=1:2", "b=-1e-3:0"], f"{method}:200", seed=3).rows).all()
    assert (rows != sampled({"a": (1, 2), "b": (-1e-3, 0)}, method, 200, 4).rows).all(axis=1).any()
    for column, low, high in ((0, 1.0, 2.0), (1, -1e-3, 0.0)):
        counts = np.histogram(rows[:, column], 10, (low, high))[0]
        assert counts.sum() == 200
        assert counts.min() >= 5


@pytest.mark.parametrize(
    ("vary", "sample", "words"),
    [
        ([], "", "nothing is varied"),
        (["a"], "", "KEY=A:B:N"),
        (["a=1:2:x"], "", "KEY=A:B:N"),
        (["a=1:2:0"], "", "1 to 10000000 values"),
        (["a=nan:2:3"], "", "KEY=A:B:N"),
        (["a=1:2:20000000"], "", "1 to 10000000 values"),
        (["a=1:2"], "sobol", "METHOD:COUNT"),
        (["a=1:2"], "halton:9", "METHOD:COUNT"),
        (["a=1:2:3"], "sobol:8", "KEY=A:B with a sample"),
        (["a=1:2:3", "a=4,5"], "", "varied once"),
        (["a=0:1:10000", "b=0:1:10000"], "", "1 to 10000000"),
        (["a=1:2"], "sobol:0", "1 to 10000000"),
    ],
)
def test_bad_points_are_named(vary: list[str], sample: str, words: str) -> None:
    """Before anything is run."""
    with pytest.raises(SceneError, match=words):
        points_of(vary, sample)


def test_tables_give_points(tmp_path: Path) -> None:
    """Heads are keys; numbers, words and lists as --set reads them; faults name the line."""
    file = tmp_path / "p.csv"
    file.write_text('a,b.c\n1,"[1, 2]"\n-2.5,word\n\n', encoding="utf-8")
    found = points_of([], table=file)
    assert [found.row(k) for k in range(2)] == [(1, [1, 2]), (-2.5, "word")]
    for text, words in (("a,a\n1,2\n", "each once"), ("a,b\n1\n", "line 2 has 1 cells"), ("", "head"), ("a\n", "1 to")):
        file.write_text(text, encoding="utf-8")
        with pytest.raises(SceneError, match=words):
            points_of([], table=file)
    with pytest.raises(SceneError, match="is not a file") as refused:  # nor is a pipe, which would never end
        points_of([], table=tmp_path)
    assert refused.value.cause == Cause.NOT_READABLE


# ----- quantities


def test_quantities_are_what_runs_answer() -> None:
    """At times and over them; the table's columns serve what has no answer of its own."""
    run = erls.simulate(erls.load_scene(SCENE, SHORT))
    t = np.linspace(0, run.end, 1001)
    table = run.columns(t)
    asked = {
        "tip.y@0.004": run.position("tip", 0.004)[1],
        "point.tip.z@end": run.position("tip", run.end)[2],
        "joint.shoulder.rate@end": run.joint_rate("shoulder", run.end),
        "range(shoulder.moment.y)": np.ptp(table["shoulder.moment.y [N m]"]),
        "rms(energy.kinetic)": np.sqrt(np.mean(table["energy.kinetic [J]"] ** 2)),
        "mean(tip.x)": table["tip.x [m]"].mean(),
        "min(tip.distance)": 0.0,
        "error": run.accuracy.total,
        "knots": len(run.times),
    }
    found = values_of(run, [quantity(text) for text in asked])
    np.testing.assert_allclose(found, list(asked.values()), rtol=1e-12, atol=1e-15)
    assert [quantity(text).unit(run) for text in asked] == ["m", "m", "rad/s", "N m", "J", "m", "m", "m", "1"]


@pytest.mark.parametrize("text", ["tip.z", "tip.z@", "tip.z@-1", "tip.z@x", "median(tip.z)", "@1", ""])
def test_quantities_that_say_no_time_are_refused(text: str) -> None:
    """With a form that would do."""
    with pytest.raises(SceneError, match=r"tip\.z@end"):
        quantity(text)


def test_quantities_that_do_not_exist_end_a_sweep_at_once() -> None:
    """Not after a thousand failures."""
    with pytest.raises(SceneError, match=r"tipp\.z"):
        erls.sweep(SCENE, GRID, ["max(tipp.z)"], overrides=SHORT)


def test_points_with_the_same_links_go_to_one_worker() -> None:
    """Chunks end where links change, none is twice as long as asked for, and every point is in one of them."""
    height = "links.l.model.sections.leg.height"
    points = Grid({height: (0.009, 0.01, 0.011), "joints.shoulder.initial.position_deg": tuple(map(float, range(25)))})
    task = Task(Path("scene.toml"), (), points.keys, [], ("tip.z@end",), False)
    for size, most in ((1, 1), (16, 31), (10, 19)):
        tasks = Chunks(task, points, range(3, 75), size)
        chunks = [[number for number, _ in part.rows] for part in tasks]
        assert [number for chunk in chunks for number in chunk] == list(range(3, 75))
        assert max(map(len, chunks)) <= most
    chunks = [[values[0] for _, values in part.rows] for part in Chunks(task, points, range(75), 16)]
    assert [set(chunk) for chunk in chunks] == [{0.009}, {0.01}, {0.011}]
    assert len(Chunks(task, points, [], 16)) == 0
