"""Optimization: closed forms, methods beside each other, derivatives, published figures, faults, interrupts."""

from __future__ import annotations

import json
import shutil
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import erls
from erls.cli.main import main
from erls.errors import Cause, SceneError
from erls.optimization import dynamics as running
from erls.optimization.aggregates import Aggregates
from erls.optimization.confirm import simulated
from erls.optimization.dynamics import Dynamics
from erls.optimization.equivalent_loads import FrozenLoads
from erls.optimization.evaluation import aggregate, beside
from erls.optimization.gradients import differences
from erls.optimization.memory import Memory
from erls.optimization.problem import load_problem
from erls.optimization.records import Settings
from erls.optimization.result import Analysis, summary

DATA = Path(__file__).parents[2] / "data" / "optimization"
CANTILEVER, ROBOT = DATA / "cantilever.toml", DATA / "app2.toml"
SHORT, BRIEF = (f'set=["simulation.duration={t}"]' for t in ("0.06", "0.002"))


def exact_cantilever() -> tuple[float, float, float]:
    """Heights and mass, as the problem file derives them."""
    force, length, modulus, width, density, sag = 10.0, 0.5, 2e11, 0.005, 7850.0, 5e-3
    a = force * length**3 / (3 * modulus * width / 12)
    far = (a * (7**0.25 + 1) / sag) ** (1 / 3)
    return 7**0.25 * far, far, density * width * length * far * (7**0.25 + 1)


@pytest.mark.parametrize("optimizer", ["scp", "slsqp", "trust-constr"])
def test_cantilever(optimizer: str) -> None:
    """All methods come to the closed form; large displacements take 2e-5 of the sag."""
    methods = "" if optimizer == "scp" else 'settings.methods=["esl-system"]'
    changes = [c for c in (methods, f'settings.optimizer="{optimizer}"', BRIEF) if c]
    found = erls.optimize(CANTILEVER, changes=changes, confirm=False)
    near, far, mass = exact_cantilever()
    assert len(found.outcomes) == (3 if optimizer == "scp" else 1)
    for outcome in found.outcomes:
        assert outcome.status == "converged"
        assert outcome.mass == pytest.approx(mass, rel=5e-5 if optimizer == "scp" else 5e-4)
        assert outcome.x == pytest.approx([near, far], rel=1e-3)
        assert outcome.residual < 1e-3
        (active,) = outcome.active
        assert active.name == "sag"
        assert active.multiplier == pytest.approx(mass / 3, rel=1e-3)  # mass ~ limit^(-1/3)


def test_two_link_robot_by_equivalent_static_loads() -> None:
    """Second application of the slides: 1.411 kg is published; its model gives 1.4102 kg and these diameters."""
    found = erls.optimize(ROBOT, changes=['settings.methods=["esl-system"]'], confirm=False)
    (outcome,) = found.outcomes
    assert outcome.status == "converged"
    assert outcome.analyses <= 6
    assert outcome.mass == pytest.approx(1.4102, rel=5e-4)
    assert outcome.mass == pytest.approx(found.problem.record.published["esl-component"].objective, rel=3e-3)
    assert outcome.x == pytest.approx(np.array([47.84, 34.52, 42.10, 30.08]) * 1e-3, abs=2e-5)
    assert outcome.mass == pytest.approx(229.02 * float(outcome.x @ outcome.x), rel=1e-4)
    assert outcome.history[-1].violation <= 5e-4


@pytest.fixture(scope="module")
def robot() -> Dynamics:
    """The beginning of the robot's motion, deflections of both kinds and stress."""
    constraints = (
        'constraints=[{type="deflection", name="tip", point="tip", limit=1e-3, samples=7},'
        '{type="deflection", name="links", limit=1e-3, samples=5, terms=[{point="A", frame="link", components="y"},'
        '{point="tip", frame="link", components="xy"}]}, {type="stress", name="stress", limit=5e6, samples=4}]'
    )
    problem = load_problem(ROBOT, [SHORT, constraints])
    return Dynamics(problem, Memory(problem))


X = np.array([0.048, 0.035, 0.042, 0.03])


def test_derivatives_of_runs(robot: Dynamics) -> None:
    """Against differences of runs, whose own error is that of their step."""
    found = robot.differentiate(robot.evaluate(X))
    assert robot.gradient == "sensitivities"
    design, limits = robot.designs.at(X), robot.limits(robot.designs.at(X))

    def asked(run: object) -> np.ndarray:
        motion = robot.motion_of(run)  # type: ignore[arg-type]
        at = robot.limits_at(np.array([s.record.links[0].changes["sections"]["near"]["outer_diameter"] if k == 0 else
                                       s.record.links[k // 2].changes["sections"]["near" if k % 2 == 0 else "far"]
                                       ["outer_diameter"] for k in range(4) for s in (run.scene,)]))  # type: ignore[attr-defined]  # fmt: skip
        return np.concatenate([limit.exact(motion).ravel() for limit in at])

    assert len(limits) == 3
    expected = differences(robot.designs, design, asked)
    exact = np.concatenate([j.reshape(-1, 4) for j in found.jacobians])
    sizes = np.cumsum([0, *(c.size for c in found.components)])
    for first, end in pairwise(sizes.tolist()):
        assert exact[first:end] == pytest.approx(expected[first:end], abs=1e-5 * np.abs(exact[first:end]).max())


def test_aggregates_backward_over_the_run() -> None:
    """A diameter, a ratio that six tubes share and a gain, against differences of runs: 1e-5 of the largest."""
    keys = ", ".join(f'"links.hand.model.sections.s{k}.diameter_ratio"' for k in range(1, 7))
    variables = (
        'variables=[{name="d", keys=["links.hand.model.sections.s5.outer_diameter"], lower=0.02, upper=0.06},'
        f'{{name="ratio", keys=[{keys}], lower=0.6, upper=0.9}},'
        '{name="gain", keys=["joints.wrist.drive.proportional_gain"], lower=2e3, upper=2e4, power=-1}]'
    )
    short = 'set=["simulation.duration=0.03"]'
    samples = [f"constraints.{k}.samples=4" for k in (0, 1)]
    problem = load_problem(DATA / "three_link.toml", [short, variables, *samples])
    dynamics = Dynamics(problem, Memory(problem))
    seen = Aggregates(dynamics)
    found = seen.differentiate(seen.evaluate(problem.start))
    assert dynamics.gradient == "adjoint"
    assert [c.shape for c in found.components] == [(1, 1), (18, 1)]
    for above, below, step in beside(problem.start, problem.upper - problem.lower, 1e-4):
        v = int(np.flatnonzero(above != below)[0])
        sides = (seen.evaluate(x).components for x in (above, below))
        for more, less, exact in zip(*sides, found.jacobians, strict=True):
            expected = (more - less) / (2 * step)
            assert exact[..., v] == pytest.approx(expected, abs=1e-5 * np.abs(expected).max())


@pytest.mark.parametrize("whole", [True, False])
def test_derivatives_under_static_loads(robot: Dynamics, whole: bool) -> None:
    """Against differences; at the design of the run the response is that of the run."""
    found, motion = robot.analysed(X)
    loads = FrozenLoads(robot, X, motion, whole)
    same = loads.evaluate(X)
    for own, other in zip(same.components, found.components, strict=True):
        assert own == pytest.approx(other, abs=1e-12 * np.abs(other).max())
    away = 1.1 * X
    exact, h = loads.differentiate(loads.evaluate(away)).jacobians, 1e-7
    for v, way in enumerate(np.eye(4)):
        above, below = (loads.evaluate(away + s * h * way).components for s in (1, -1))
        for own, a, b in zip(exact, above, below, strict=True):
            assert own[..., v] == pytest.approx((a - b) / (2 * h), abs=1e-6 * np.abs(own).max())


def test_open_chains_need_no_multipliers(robot: Dynamics) -> None:
    """Equivalent loads of a link bear themselves: the mechanism as a whole and its links alone come to the same."""
    _, motion = robot.analysed(X)
    one, other = (FrozenLoads(robot, X, motion, whole).evaluate(1.2 * X) for whole in (True, False))
    for a, b in zip(one.components, other.components, strict=True):
        assert a == pytest.approx(b, abs=1e-9 * np.abs(b).max())


def test_stress_of_a_cantilever() -> None:
    """M h/2 / I at the root, by the run as under its loads."""
    changes = [
        'constraints=[{type="stress", name="root", limit=1e8, samples=2}]',
        BRIEF,
        'settings.methods=["integrated", "esl-system"]',
    ]
    found = erls.optimize(CANTILEVER, changes=changes, confirm=False)
    modulus_of_section = [10.0 * arm / 1e8 for arm in (1.0, 0.5)]  # W = F x / σ at the thick end of each segment
    heights = np.sqrt(6 * np.array(modulus_of_section) / 0.005)
    for outcome in found.outcomes:
        assert outcome.status == "converged"
        assert outcome.x == pytest.approx(heights, rel=1e-3)  # the arm of the force is 8e-4 shorter as the beam bends
        assert [a.name for a in outcome.active] == ["root", "root"]


def test_smallest_deflection_of_a_given_mass_bound() -> None:
    """Objectives may be what constraints measure: with all else at its bounds the tip deflects least."""
    changes = [
        'objective=[{quantity="deflection", of="sag", over_time="peak"}]',
        "variables.0.upper=0.03",
        "variables.1.upper=0.02",
        BRIEF,
        'settings.methods=["esl-system"]',
        'constraints=[{type="deflection", name="sag", point="tip", samples=2}]',
    ]
    (outcome,) = erls.optimize(CANTILEVER, changes=changes, confirm=False).outcomes
    assert outcome.status == "converged"
    assert outcome.x == pytest.approx([0.03, 0.02])
    assert {a.row for a in outcome.active} == {-2}
    sag = 10 * 0.5**3 / (3 * 2e11 * 0.005 / 12) * (7 / 0.03**3 + 1 / 0.02**3)
    assert outcome.objective == pytest.approx(sag, rel=1e-3)


def test_no_step_passes_a_limit() -> None:
    """Of samples some steps may; where every step is one, none does."""
    changes = ['settings.methods=["esl-system"]', 'constraints.0.samples="every-step"', SHORT]
    found = erls.optimize(ROBOT, changes=changes, confirm=False)
    assert found.best.status == "converged"
    assert simulated(found.problem, found.best.x, lambda text: None).violation <= 5e-4


def test_aggregate_is_on_the_safe_side() -> None:
    shares, groups = np.array([0.3, 0.99, 1.0]), np.array([1, 0, 0])
    values, slopes = aggregate(shares, groups)
    assert values[1] == pytest.approx(0.3)
    assert 1.0 <= values[0] <= 1.0 + np.log(2) / 200
    h = 1e-6
    for k, way in enumerate(np.eye(3)):
        rate = (aggregate(shares + h * way, groups)[0] - aggregate(shares - h * way, groups)[0]) / (2 * h)
        assert slopes[:, k] == pytest.approx(rate, abs=1e-6)


def test_aggregated_times_come_near() -> None:
    changes = ['settings.methods=["esl-system"]', 'constraints.0.times="aggregate"', "constraints.0.samples=3"]
    (outcome,) = erls.optimize(CANTILEVER, changes=changes, confirm=False).outcomes
    _, _, mass = exact_cantilever()
    assert outcome.status == "converged"
    assert mass < outcome.mass < mass * 1.003  # ln 3 / 200 of the limit, a third of it in the mass


def test_infeasible(capsys: pytest.CaptureFixture[str]) -> None:
    """The thickest cantilever sinks too far: named, with the best design, exit code 4."""
    changes = ["--set", "constraints.0.limit=1e-5", "--set", BRIEF]
    changes += ["--set", 'settings.methods=["integrated", "esl-system"]']
    assert main(["optimize", str(CANTILEVER), "--json", *changes]) == 4
    methods = json.loads(capsys.readouterr().out)["methods"]
    for method in methods.values():
        assert method["status"] == "infeasible"
        assert "no design within the bounds" in method["reason"]
        assert method["violation"] > 1
        assert list(method["variables"].values()) == pytest.approx([0.06, 0.06], rel=1e-6)


def test_budget() -> None:
    changes = ['settings.methods=["integrated", "esl-system"]', "settings.most_analyses=1"]
    found = erls.optimize(CANTILEVER, changes=changes, confirm=False)
    assert [outcome.status for outcome in found.outcomes] == ["budget", "budget"]
    assert [outcome.analyses for outcome in found.outcomes] == [1, 1]
    assert found.best.x == pytest.approx(found.problem.start)


def test_interrupted_and_resumed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What was analysed stays, and is not run again."""
    state, ran = tmp_path / "state.npz", []
    run_of = running.run_of
    monkeypatch.setattr(running, "run_of", lambda design, *tell: (ran.append(design.x), run_of(design, *tell))[1])

    def stop(method: str, count: int, analysis: Analysis) -> None:
        if count == 2:
            raise KeyboardInterrupt

    given = {"changes": ['settings.methods=["esl-system"]'], "state": state, "confirm": False}
    whole = erls.optimize(CANTILEVER, changes=given["changes"], confirm=False)
    ran.clear()
    (cut,) = erls.optimize(CANTILEVER, progress=stop, **given).outcomes
    assert cut.status == "interrupted"
    assert len(cut.history) == len(ran) == 2
    again = erls.optimize(CANTILEVER, resume=True, **given)
    assert len(ran) == len(again.outcomes[0].history)
    assert np.array_equal(again.outcomes[0].x, whole.outcomes[0].x)
    with pytest.raises(SceneError, match="another problem") as refusal:
        erls.optimize(CANTILEVER, resume=True, **{**given, "changes": ["variables.0.upper=0.05"]})
    assert refusal.value.cause is Cause.CHANGED
    state.write_bytes(b"PK\x03\x04 nothing")
    with pytest.raises(SceneError, match="no record of an optimization"):
        erls.optimize(CANTILEVER, resume=True, **given)
    state.unlink()
    with pytest.raises(SceneError, match="no such file"):
        erls.optimize(CANTILEVER, resume=True, **given)


def test_pictures_are_true_to_scale() -> None:
    """Heights and width of the sections, and the sag."""
    problem = load_problem(CANTILEVER, [BRIEF])
    (arm,) = simulated(problem, np.array([0.03, 0.02]), lambda text: None).shapes
    near, far = (arm.rest[0][np.isclose(arm.rest[0, :, 0], x)] for x in (0.0, 1.0))
    assert np.ptp(near, axis=0) == pytest.approx([0, 0.005, 0.03], abs=1e-12)
    assert np.ptp(far, axis=0) == pytest.approx([0, 0.005, 0.02], abs=1e-12)
    sag = 10 * 0.5**3 / (3 * 2e11 * 0.005 / 12) * (7 / 0.03**3 + 1 / 0.02**3)
    assert arm.moved[0, :, 2].min() == pytest.approx(-sag, rel=1e-3)
    assert len(arm.triangles) == 2 * (2 * 4 + 2 * 2)  # two prisms of four sides


def test_links_without_a_shape_hide_no_other() -> None:
    """Constants alone say nothing of how large a section is: that link is drawn by its lines, and no stress of it can
    be limited; the other one has both.
    """
    constants = (
        'links.forearm.model.sections.bare={shape="constants", area=1e-3, inertia_y=1e-7, inertia_z=1e-7,'
        'torsion_constant=2e-7, shear_factor_y=0.5, shear_factor_z=0.5}'
    )
    stress = 'constraints=[{type="stress", name="s", limit=5e6, samples=2, links=["upper_arm"]}]'
    key = "links.upper_arm.model.sections.near.outer_diameter"
    first = f'variables=[{{name="d1", keys=["{key}"], lower=0.02, upper=0.06}}]'
    bare = [f'links.forearm.model.frame.members.{k}.section="bare"' for k in (0, 1)]
    scene = ", ".join(f"'{change}'" for change in ("simulation.duration=0.002", constants, *bare))
    changes = [f"set=[{scene}]", stress, first, "published={}"]
    problem = load_problem(DATA / "slide_robot.toml", [*changes, "objective=[]"])
    found = simulated(problem, problem.start, lambda text: None)
    assert found.values["s"] > 0
    upper, fore = found.shapes
    assert len(upper.triangles) == 2 * (2 * 12 + 2 * 10)  # two prisms of twelve sides
    assert fore.lines
    assert not fore.triangles
    other = load_problem(DATA / "slide_robot.toml", [*changes, "objective=[]", 'constraints.0.links=["forearm"]'])
    with pytest.raises(SceneError, match="how large this section is"):
        Dynamics(other, Memory(other))


PUBLISHED = [
    ("app2", 0.9989, 0.9995),
    ("app1", 0.9963, 0.9948),
    ("app1_inertial", 1.0012, 0.9993),
    ("slide_robot", 1.0063, 1.0084),
]


@pytest.mark.parametrize(("name", "loaded", "integrated"), PUBLISHED)
def test_published_designs(name: str, loaded: float, integrated: float) -> None:
    """The largest deflections [mm] over all steps, as an independent program of the papers' elements has them; and the
    stress of the slides, far within its limit.
    """
    problem = load_problem(DATA / f"{name}.toml", ['constraints.0.samples="every-step"'])
    dynamics = Dynamics(problem, Memory(problem))
    for expected, known in zip((loaded, integrated), problem.record.published.values(), strict=True):
        found = dynamics.evaluate(np.array([known.variables[v] for v in problem.names]))
        values = [m.value(c).max() for m, c in zip(dynamics.rules.measures, found.components, strict=True)]
        assert 1e3 * values[0] == pytest.approx(expected, abs=1e-4)
        assert all(stress < 0.15 * 75e6 for stress in values[1:])


def test_a_copy_elsewhere_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """By the name of the option that asked for it."""
    assert main(["optimize", str(CANTILEVER), "--scene", str(tmp_path / "best.toml")]) == 2
    assert "--scene: the copy must lie beside the scene" in capsys.readouterr().err


def test_the_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Table, page, scene of the best design: that has its mass and holds its limit."""
    folder = shutil.copytree(DATA, tmp_path / "optimization")
    copy, page = folder / "best.toml", tmp_path / "page.html"
    changes = ["--set", 'settings.methods=["esl-system"]', "--set", "settings.starts=2", "--set", BRIEF]
    assert main(["optimize", str(folder / CANTILEVER.name), "-o", str(page), "--scene", str(copy), *changes]) == 0
    text = capsys.readouterr().out
    run = erls.simulate(erls.load_scene(copy), verdict=False)
    assert "further starts" in text
    assert "Simulated again, all steps" in text
    assert "sag" in page.read_text()
    assert page.read_text().count('class="view"') == 2  # the start, and the optimum
    assert -run.position("tip", 0.0)[2] == pytest.approx(5e-3, rel=1e-4)
    mass = run.formulation.mechanism.links[0].model.mass_properties.mass
    assert mass == pytest.approx(exact_cantilever()[2], rel=1e-4)


def test_choice_of_a_material(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Masses go as ρ E^(-1/3); known designs of all options are not run again, and the copy has the best of them."""
    folder = shutil.copytree(DATA, tmp_path / "optimization")
    copy, state, page = folder / "chosen.toml", tmp_path / "state.npz", tmp_path / "page.html"
    changes, path = ['settings.methods=["esl-system"]', BRIEF], folder / "material.toml"
    found = erls.optimize(path, changes=changes, confirm=False, state=state)
    told = json.loads(json.dumps(summary(found)))
    assert told["chosen"] == {"material": "aluminium"}
    mass, steel = exact_cantilever()[2], 7850 * 2e11 ** (-1 / 3)
    values = {"steel": (7850, 2e11), "aluminium": (2700, 72e9), "titanium": (4430, 110e9)}
    for one in told["choices"]:
        density, modulus = values[one["options"]["material"]]
        assert one["objective"] == pytest.approx(mass * density * modulus ** (-1 / 3) / steel, rel=5e-5)
    assert told["methods"]["esl-system"]["mass"] == pytest.approx(min(one["mass"] for one in told["choices"]))
    known = {name for name in np.load(state).files if name.endswith(".poses")}
    options = [part for change in changes for part in ("--set", change)]
    again = ["--state", str(state), "--resume", "-o", str(page), "--scene", str(copy)]
    assert main(["optimize", str(path), *again, *options]) == 0
    best = erls.load_scene(copy)
    assert {name for name in np.load(state).files if name.endswith(".poses")} == known
    assert "Choices" in capsys.readouterr().out
    assert "chosen" in page.read_text()
    materials, sections = (best.record.links[0].changes[name] for name in ("materials", "sections"))
    assert materials["steel"] == {"youngs_modulus": 72e9, "density": 2700.0}
    assert [sections[name]["height"] for name in ("near", "far")] == pytest.approx(list(found.best.x))


CHOICES = [
    ('[{name="m", options={a=[]}}]', "nothing to choose", "choices[0].options"),
    ('[{name="m", options={a=[], "b/c"=[]}}]', "a name is one line", "choices[0].options.b/c"),
    ('[{name="m", options={a=[], b=["links.arm.colour=1"]}}]', "unknown field", "colour"),
    ("[" + ", ".join(f'{{name="m{k}", options={{a=[], b=[]}}}}' for k in range(7)) + "]", "too many", "choices"),
]


@pytest.mark.parametrize(("choices", "message", "where"), CHOICES)
def test_faulty_choices(choices: str, message: str, where: str) -> None:
    with pytest.raises(SceneError, match=message) as refusal:
        load_problem(CANTILEVER, [f"choices={choices}"])
    assert where in refusal.value.where


FAULTS = [
    (["variables.0.keys=[\"links.arm.model.sections.near.hight\"]"],
     Cause.BAD_REFERENCE, "no such number", "variables[0].keys"),
    (["variables.0.keys=[]"], Cause.BAD_FIELD, "at least one field", "variables[0].keys"),
    (["variables.1.keys=[\"links.arm.changes.sections.near.height\"]"],
     Cause.BAD_FIELD, "two variables", "variables[1].keys"),
    (["variables.1.keys=[\"links.arm.model.sections.near.height\"]"],
     Cause.BAD_FIELD, "two variables", "variables[1].keys"),
    (["variables.0.keys=[\"simulation.step\"]"], Cause.BAD_REFERENCE, "no such number", "variables[0].keys"),
    (["variables.0.lower=0.1"], Cause.BAD_FIELD, "no room", "variables[0].lower"),
    (["variables.0.lower=-0.1"], Cause.BAD_FIELD, "may be zero", "variables[0].lower"),
    (["variables.0.start=0.1"], Cause.BAD_FIELD, "outside its bounds", "variables[0].start"),
    (["variables.0.lower=0.03"], Cause.BAD_FIELD, "outside the bounds", "variables[0].start"),
    (["variables.0.power=9"], Cause.BAD_FIELD, "not a power", "variables[0].power"),
    (["variables.0.colour=1"], Cause.UNKNOWN_FIELD, "unknown field", "variables[0].colour"),
    (["constraints=[]"], Cause.BAD_FIELD, "nothing must hold", "constraints"),
    (["variables=[]"], Cause.BAD_FIELD, "nothing may change", "variables"),
    (["objective=[{quantity=\"price\"}]"], Cause.BAD_REFERENCE, "unknown name", "objective[0].quantity"),
    (["objective=[{quantity=\"effort\", of=\"sag\"}]"], Cause.BAD_REFERENCE, "unknown name", "objective[0].of"),
    (["objective=[{weight=-1.0}]"], Cause.BAD_FIELD, "not a positive factor", "objective[0].weight"),
    (["constraints.0.limit=0.0"], Cause.BAD_FIELD, "positive", "constraints[0].limit"),
    (["constraints.0.point=\"tap\""], Cause.BAD_REFERENCE, "did you mean 'tip'", "constraints[0].point"),
    (["constraints.0.terms=[{point=\"tip\"}]"], Cause.BAD_FIELD, "exactly one", "constraints[0]"),
    (["constraints=[{type=\"deflection\", name=\"a\", terms=[{point=\"tip\", components=\"xx\"}], limit=1.0}]"],
     Cause.BAD_FIELD, "not components", "constraints[0].terms[0].components"),
    (["constraints=[{type=\"deflection\", name=\"a\", point=\"tip\"}]"],
     Cause.BAD_FIELD, "holds nothing", "constraints[0].limit"),
    (["constraints=[{type=\"colour\", name=\"a\"}]"], Cause.BAD_FIELD, "unknown type", "constraints[0].type"),
    (["constraints=[{type=\"effort\", name=\"a\", joint=\"hip\", limit=1.0}]"],
     Cause.BAD_REFERENCE, "hip", "constraints[0].joint"),
    (["constraints=[{type=\"effort\", name=\"a\", joint=\"clamp\", limit=1.0}]", 'settings.methods=["esl-system"]'],
     Cause.BAD_FIELD, "cannot limit them", "constraints.a"),
    (["constraints.0.samples=1"], Cause.BAD_FIELD, "number of samples", "constraints[0].samples"),
    (["constraints.0.times=\"some\""], Cause.BAD_REFERENCE, "unknown name", "constraints[0].times"),
    (["settings.methods=[\"magic\"]"], Cause.BAD_REFERENCE, "unknown name", "settings.methods[0]"),
    (["settings.methods=[]"], Cause.BAD_FIELD, "no method", "settings.methods"),
    (["settings.optimizer=\"best\""], Cause.BAD_REFERENCE, "unknown name", "settings.optimizer"),
    (["settings.design_tolerance=2.0"], Cause.BAD_FIELD, "not a share", "settings.design_tolerance"),
    (["constraints.0.samples=\"sometimes\""], Cause.BAD_REFERENCE, "unknown name", "constraints[0].samples"),
    (["settings.derivatives=\"none\""], Cause.BAD_REFERENCE, "unknown name", "settings.derivatives"),
    (["settings.derivatives=\"aggregates\""], Cause.BAD_FIELD, "aggregates alone", "constraints[0].times"),
    (["settings.derivatives=\"aggregates\"", "constraints.0.times=\"aggregate\"",
      "objective=[{quantity=\"deflection\", of=\"sag\"}]"],
     Cause.BAD_FIELD, "aggregates alone", "objective[0].quantity"),
    (["settings.starts=0"], Cause.BAD_FIELD, "number of runs", "settings.starts"),
    (["settings.seed=-1"], Cause.BAD_FIELD, "not a seed", "settings.seed"),
    (["published={integrated={objective=1.0, variables={d9=1.0}}}"], Cause.BAD_REFERENCE, "d9", "published.integrated"),
    (["scene=\"nowhere.toml\""], Cause.FILE_NOT_FOUND, "no such file", "nowhere.toml"),
    (['set=["simulation.effects=auto"]'], Cause.BAD_FIELD, "change from design to design", "scene"),
    (['set=["simulation.integrator=dop853", "simulation.formulation=erls", "simulation.duration=0.001",'
      '"simulation.residual_bending_flexibility=false"]'], Cause.BAD_FIELD, "noise", "simulation"),
    (["variables.0.keys=[\"links.arm.model.frame.nodes.tip.0\"]", "variables.0.upper=2.0", "variables.0.start=1.0",
      'settings.methods=["esl-component"]'], Cause.BAD_FIELD, "changes lengths", "variables.near"),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "cause", "message", "where"), FAULTS)
def test_faults(changes: list[str], cause: Cause, message: str, where: str) -> None:
    """One clear message, with its place, before any run."""
    with pytest.raises(SceneError) as refusal:
        erls.optimize(CANTILEVER, changes=changes, confirm=False)
    assert refusal.value.cause.value == cause.value
    assert message in str(refusal.value) or message in refusal.value.remedy
    assert where in refusal.value.where


def test_a_free_joint_has_no_rigid_motion() -> None:
    free = 'set=["joints.clamp.drive={type=\\"free\\"}", "initial.deformation=zero", "simulation.duration=0.002"]'
    with pytest.raises(SceneError, match="moves freely"):
        erls.optimize(CANTILEVER, changes=[free], confirm=False)


def test_summary_is_json() -> None:
    found = erls.optimize(CANTILEVER, changes=['settings.methods=["esl-system"]'], confirm=False)
    told = json.loads(json.dumps(summary(found)))
    assert set(told["methods"]["esl-system"]) >= {
        "objective", "mass", "variables", "violation", "analyses", "outer_iterations", "wall_s", "status",
    }  # fmt: skip
    assert Settings().methods == ("esl-system", "integrated")



def test_energy_of_drives() -> None:
    """∫ |τ θ'| dt of a run that is added up by itself, and its slope in some direction against differences."""
    constraints = 'constraints=[{type="power", name="drives", samples=41}]'
    wanted = 'objective=[{quantity="energy", of="drives"}, {quantity="mass", weight=0.1}]'
    short = 'set=["simulation.duration=0.02"]'
    problem = load_problem(DATA / "slide_robot.toml", [short, constraints, wanted])
    dynamics = Dynamics(problem, Memory(problem))
    found = dynamics.differentiate(dynamics.evaluate(X))
    run = running.run_of(dynamics.designs.at(X))
    times = np.linspace(0, 0.02, 41)
    power = sum(np.abs(run.joint_effort(j, times) * run.joint_rate(j, times)) for j in ("shoulder", "elbow"))
    energy = float(np.trapezoid(power, times))
    assert found.objective == pytest.approx(energy + 0.1 * dynamics.rules.objective.mass(X), rel=1e-12)
    rules = dynamics.rules
    _, slopes = rules.objective.timed(found.components, rules.measures)
    way = X * np.array([1.0, -0.5, 0.7, 0.3])
    exact = float(np.einsum("nq,nqv,v->", slopes[0], found.jacobians[0], way))
    above, below = (
        rules.objective.timed(dynamics.evaluate(X + sign * 1e-4 * way).components, rules.measures)[0]
        for sign in (1, -1)
    )
    assert exact == pytest.approx((above - below) / 2e-4, rel=1e-4)


def test_starts_far_beyond_their_limits() -> None:
    """Loads of the run bring them near first, where derivatives of the motion creep."""
    changes = ["variables.0.start=0.006", "variables.1.start=0.005", 'settings.methods=["integrated"]', BRIEF]
    (outcome,) = erls.optimize(CANTILEVER, changes=changes, confirm=False).outcomes
    assert outcome.history[0].violation > 20
    assert outcome.history[0].inner > 0
    assert outcome.status == "converged"
    assert outcome.mass == pytest.approx(exact_cantilever()[2], rel=5e-5)
