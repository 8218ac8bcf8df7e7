"""Families of links: interpolation, promised bounds at places that gave nothing, members, files, refusals."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.linalg as la
from link_files import FRAME, SOLID, merged, write_box, write_toml

from erls.cli.main import main
from fe_import.description.link import LinkFile, load_link, with_numbers
from fe_import.errors import FEImportError
from fe_import.modal.check import validate
from fe_import.modal.file import read_modal_file
from fe_import.models.model import build_model
from fe_import.parametric.file import read_parametric_file, write_parametric_file
from fe_import.parametric.held import exact_figures
from fe_import.parametric.interpolation import NotSmooth, interpolated, leja_points
from fe_import.parametric.model import ParametricModel
from fe_import.parametric.reduce import reduce_parametric
from fe_import.reduce import reduce_link

BOX = np.array([1.0, -2.0]), np.array([3.0, 5.0])
HEIGHT, MODULUS, LENGTH = (0.016, 0.024), (5e10, 9e10), (0.27, 0.33)


def table(**changes: Any) -> dict[str, Any]:
    """Two slender legs of two elements: height, modulus and where the second leg ends."""
    members = [{**m, "elements": 2} for m in FRAME["frame"]["members"]]
    nodes = {"root": [0.0, 0.0, 0.0], "elbow": [0.3, 0.0, 0.0], "tip": [0.3, 0.3, 0.0]}
    parameters = {
        "height": {"keys": ["sections.s.height"], "lower": HEIGHT[0], "upper": HEIGHT[1]},
        "modulus": {"keys": ["materials.m.youngs_modulus"], "lower": MODULUS[0], "upper": MODULUS[1]},
        "reach": {"keys": {"frame.nodes.tip.1": 1.0}, "lower": LENGTH[0], "upper": LENGTH[1]},
    }
    own = {"frame": {"nodes": nodes, "members": members}, "parameters": parameters, "reduction": {"elastic_modes": 8}}
    return merged(merged(FRAME, own), changes)


@pytest.fixture(scope="module")
def family(tmp_path_factory: pytest.TempPathFactory) -> ParametricModel:
    return reduce_parametric(write_toml(tmp_path_factory.mktemp("family") / "l.toml", table()), places=12)


def drawn(family: ParametricModel, count: int) -> list[dict[str, float]]:
    rng = np.random.default_rng(2024)
    bounds = family.grid.lower, family.grid.upper
    return [dict(zip(family.names, rng.uniform(*bounds).tolist(), strict=True)) for _ in range(count)]


def described(family: ParametricModel, values: dict[str, float]) -> LinkFile:
    """The description of a member."""
    height, modulus, reach = (values[name] for name in ("height", "modulus", "reach"))
    keys = ("sections.s.height", "materials.m.youngs_modulus", "frame.nodes.tip.1")
    return with_numbers(family.link, dict(zip(keys, (height, modulus, reach), strict=True)))


def test_polynomials_are_met_with_a_sample_for_each_term() -> None:
    """x³ + 2 x y and y² need the terms up to their degrees, a sample each, and those beyond, which vanish."""

    def sample(place: np.ndarray) -> dict[str, np.ndarray]:
        x, y = place
        return {"a": np.array([x**3 + 2 * x * y, y**2]), "b": np.array([[1.0 + x]])}

    def size(left: dict[str, np.ndarray], _: dict[str, np.ndarray]) -> float:
        return max(float(np.abs(part).max()) for part in left.values())

    found = interpolated(sample, size, *BOX, 1e-9, 30)
    assert found.count <= 13
    for place in np.random.default_rng(0).uniform(*BOX, (5, 2)):
        for name, values in sample(place).items():
            np.testing.assert_allclose(found.values(place)[name], values, rtol=1e-11, atol=1e-10)
        x, y = place
        np.testing.assert_allclose(found.slopes(place, 0)["a"], [3 * x**2 + 2 * y, 0.0], rtol=1e-10, atol=1e-9)
        np.testing.assert_allclose(found.slopes(place, 1)["a"], [2 * x, 2 * y], rtol=1e-10, atol=1e-9)
    with pytest.raises(NotSmooth):
        interpolated(sample, size, *BOX, 1e-9, 5)


def test_points_of_leja_lie_apart() -> None:
    """Their Lebesgue constant, which enlarges errors of samples, grows no faster than their number."""
    points, x = np.array(leja_points(13)), np.linspace(-1, 1, 501)
    assert len(set(points)) == 13
    basis = [np.prod([(x - b) / (a - b) for b in points if b != a], axis=0) for a in points]
    assert np.abs(basis).sum(axis=0).max() < 13


def test_bounds_hold_where_nothing_was_sampled(family: ParametricModel) -> None:
    """First ten frequencies, held at the root, and the flexibility of the tip, against the whole model."""
    assert max(family.bound.frequencies, family.bound.flexibility) <= 1e-3
    for values in drawn(family, 12):
        exact = exact_figures(build_model(described(family, values)), 0)
        frequencies, flexibility = exact.errors(family.figures(values))
        assert frequencies <= family.bound.frequencies
        assert flexibility <= family.bound.flexibility


def test_meshes_that_are_stretched(tmp_path: Path) -> None:
    """Nodes, and what follows rigid interfaces, move with the thickness: the arms of a face grow. Averages of faces
    that are moved have other dofs, and are refused.
    """
    write_box(tmp_path / "box.inp", kind="hex8", along=2)
    thick = {"keys": ["solid.stretch.0.factors.0"], "lower": 0.8, "upper": 1.2}
    solid = {"stretch": [{"axis": "z", "factors": [1.0], "about": 0.015}]}
    own = {"solid": solid, "parameters": {"thick": thick}, "reduction": {"elastic_modes": 8}}
    found = reduce_parametric(write_toml(tmp_path / "l.toml", merged(SOLID, own)), places=4)
    averaged = {"interfaces": [{**i, "coupling": "averaged"} for i in SOLID["interfaces"]]}
    with pytest.raises(FEImportError, match=r'use coupling = "rigid"'):
        reduce_parametric(write_toml(tmp_path / "a.toml", merged(merged(SOLID, own), averaged)))
    for factor in (0.83, 1.17):
        alone = with_numbers(found.link, {"solid.stretch.0.factors.0": factor})
        errors = exact_figures(build_model(alone), 0).errors(found.figures({"thick": factor}))
        assert errors[0] <= found.bound.frequencies
        assert errors[1] <= found.bound.flexibility
        member = found.at({"thick": factor})
        validate(member, "member")
        np.testing.assert_allclose(member.nodes, reduce_link(alone).nodes, atol=1e-12)
    step = 1e-5
    near = [found.figures({"thick": 1.1 + at * step}).omega for at in (-1, 1)]
    slope = (near[1] - near[0]) / (2 * step)
    np.testing.assert_allclose(found.slopes({"thick": 1.1}, "thick")[0], slope, atol=1e-6 * np.abs(slope).max())


def test_frequencies_go_with_the_root_of_the_modulus(family: ParametricModel) -> None:
    """Whatever the height: terms of both together are left out only where they are small."""
    soft, stiff = (family.figures({"modulus": e, "height": 0.018}).omega for e in MODULUS)
    np.testing.assert_allclose(stiff / soft, np.sqrt(MODULUS[1] / MODULUS[0]), rtol=family.bound.frequencies)


def test_slopes_are_those_of_differences(family: ParametricModel) -> None:
    values = drawn(family, 1)[0]
    for name in family.names:
        step = 1e-5 * values[name]
        near = [family.figures({**values, name: values[name] + at * step}).omega for at in (-1, 1)]
        slope, arrays = family.slopes(values, name)
        np.testing.assert_allclose(slope, (near[1] - near[0]) / (2 * step), rtol=1e-4, atol=1e-6 * abs(slope).max())
        assert {"stiffness", "mass"} <= arrays.keys()


def test_members_are_modal_models(family: ParametricModel) -> None:
    """Consistent, with the nodes and the mass of their own values, and the first free modes of that link."""
    values = drawn(family, 1)[0]
    member = family.at(values)
    validate(member, "member")
    assert member.elastic_modes == 8
    alone = reduce_link(described(family, values))
    np.testing.assert_allclose(member.nodes, alone.nodes, atol=1e-12)
    mass, stiffness = (m.toarray() for m in build_model(described(family, values)).reduced_matrices())
    exact = np.sqrt(la.eigh(stiffness, mass, eigvals_only=True)[6:12]) / (2 * np.pi)
    np.testing.assert_allclose(member.frequencies_hz[6:12], exact, rtol=1e-3)
    own, other = member.mass_properties, alone.mass_properties
    np.testing.assert_allclose(own.inertia, other.inertia, rtol=1e-6, atol=1e-9)
    assert own.mass == pytest.approx(other.mass, rel=1e-9)


def test_files_give_families_back(family: ParametricModel, tmp_path: Path) -> None:
    path = tmp_path / "l.family.h5"
    write_parametric_file(path, family)
    again, values = read_parametric_file(path), drawn(family, 1)[0]
    assert again.bound == family.bound
    assert again.names == family.names
    found, kept = (one.at(values).frequencies_hz for one in (again, family))
    np.testing.assert_allclose(found, kept, rtol=1e-12)  # arrays lie otherwise in memory
    damaged = path.read_bytes()
    path.write_bytes(damaged[: len(damaged) // 2])
    with pytest.raises(FEImportError):
        read_parametric_file(path)


def test_commands(family: ParametricModel, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A family from a description, a member of it, and what stands in the file."""
    made = tmp_path / "l.family.h5"
    write_parametric_file(made, family)
    out = str(tmp_path / "m.modal.h5")
    assert main(["reduce", str(made), "--set", "height=0.017", "-o", out]) == 0
    np.testing.assert_allclose(read_modal_file(out).frequencies_hz, family.at({"height": 0.017}).frequencies_hz)
    assert main(["info", str(made)]) == 0
    assert "height" in capsys.readouterr().out
    for arguments, said in (
        (["--set", "height=0.5"], "out of the range"),
        (["--set", "hight=0.017"], "did you mean 'height'?"),
        (["--set", "height"], "not of the form NAME=NUMBER"),
        (["--modes", "3"], "a family is as it was made"),
    ):
        other = tmp_path / "none.h5"
        assert main(["reduce", str(made), *arguments, "-o", str(other)]) == 2
        assert said in capsys.readouterr().err
        assert not other.exists()


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"parameters": {"height": {"keys": ["sections.s.hight"]}}}, "this field is not given"),
        ({"parameters": {"height": {"keys": ["sections.t.height"]}}}, "this field is not given"),
        ({"parameters": {"height": {"keys": ["reduction.elastic_modes"]}}}, "no model depends on this field"),
        ({"parameters": {"height": {"keys": []}}}, "no field follows it"),
        ({"parameters": {"height": {"keys": {"sections.s.height": 0.0}}}}, "a factor is a number other than 0"),
        ({"parameters": {"height": {"lower": 0.03}}}, "from a smaller to a larger number"),
        ({"parameters": {"height": {"keys": ["frame.nodes.tip.1"]}}}, "the field follows height already"),
        ({"parameters": {"height": {"lower": -0.01}}}, "sections.s.height"),
        (
            {"temperature_change": 1.0, "materials": {"m": {"thermal_expansion": 2e-5}}},
            "the expanded shape of a family is not known",
        ),
    ],
)
def test_refusals(tmp_path: Path, changes: dict[str, Any], said: str) -> None:
    with pytest.raises(FEImportError, match=said):
        reduce_parametric(write_toml(tmp_path / "l.toml", table(**changes)))


def test_families_need_parameters(tmp_path: Path) -> None:
    with pytest.raises(FEImportError, match="a family of links needs parameters"):
        reduce_parametric(load_link(write_toml(tmp_path / "l.toml", FRAME)))
