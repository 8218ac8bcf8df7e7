"""The estimated error of meshes of shells, against fine meshes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import meshio
import numpy as np
import pytest
import scipy.sparse.linalg as sla
from shell_benchmarks import on_blade
from shell_meshes import ShellGrid, plate, shell_grid

from fe_import.description.link import load_link
from fe_import.elements.shell import ShellBlock
from fe_import.elements.shell_elements import SHELL_ELEMENTS
from fe_import.elements.shell_recovery import energy_of_error
from fe_import.elements.shell_stress import ShellPart, ShellStress, shell_stress
from fe_import.health.mesh_error import frequency_errors
from fe_import.reduce import reduce_link

ROOT = Path(__file__).parents[2]
Place = Callable[[float, float], tuple[float, float, float]]


def on_cylinder(a: float, b: float) -> tuple[float, float, float]:
    """Half a pipe."""
    return np.sin(np.pi * b), np.cos(np.pi * b), 2 * a


def on_fold(a: float, b: float) -> tuple[float, float, float]:
    return min(a, 0.5), 0.5 * b, max(a - 0.5, 0.0)


BODIES: dict[str, tuple[Place, float, tuple[float, float]]] = {  # places, thickness; least and most per true error
    "plate": (lambda a, b: (a, b, 0.0), 0.001, (1.0, 2.0)),
    "strip": (lambda a, b: (a, 0.2 * b, 0.0), 0.002, (1.0, 1.8)),
    "cylinder": (on_cylinder, 0.02, (1.0, 3.2)),
    "twisted": (lambda a, b: tuple(np.array(on_blade(a, b)) / 12), 0.02, (0.7, 2.4)),  # type: ignore[dict-item]
    "fold": (on_fold, 0.005, (1.5, 5.0)),  # to the safe side
}


def of_grid(grid: ShellGrid, thickness: float) -> tuple[np.ndarray, np.ndarray, ShellStress]:
    """The first three elastic circular frequencies of the free surface, their shapes, and its elements."""
    make = plate(2.1e11, 0.3, thickness, 7850.0)
    mass, stiffness = grid.matrices(make)
    shift = 1e4  # nearer to the rigid motions, rounding moves the frequencies of a twisted blade by a percent
    squares, shapes = sla.eigsh(stiffness, 9, mass, sigma=-shift, which="LM")
    order, count = np.argsort(squares)[6:], len(grid.elements)
    moduli, moments = np.tile(make.stiffness(), (count, 1, 1)), np.tile(make.moments(), (count, 1))
    block = ShellBlock(SHELL_ELEMENTS[grid.kind], grid.elements, moduli, moments)
    source = shell_stress(grid.nodes, [ShellPart(block, np.arange(count), make, 0.01)], {}, {})
    return np.sqrt(squares[order]), shapes[:, order], source


@cache
def fine(body: str) -> np.ndarray:
    place, thickness, _ = BODIES[body]
    return of_grid(shell_grid(48, 48, place, "quad4"), thickness)[0]


def estimated(grid: ShellGrid, thickness: float) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies, and their estimated errors."""
    omega, shapes, source = of_grid(grid, thickness)
    error, energy = energy_of_error(source, shapes, np.arange(len(shapes)).reshape(-1, 6))
    np.testing.assert_allclose(energy, omega**2 / 2, rtol=0.03)  # but for what resists rotation about the normal
    return omega, frequency_errors(error, energy)


@pytest.mark.parametrize("kind", ["quad4", "tri3"])
@pytest.mark.parametrize("body", BODIES)
def test_estimate_of_the_error(body: str, kind: str) -> None:
    """The worst of three frequencies, in shares of the true worst error, which is 1 to 20 percent."""
    place, thickness, (least, most) = BODIES[body]
    omega, errors = estimated(shell_grid(8, 8, place, kind), thickness)
    true = float((omega / fine(body) - 1).max())
    assert 0.01 < true < 0.2
    assert least < errors.max() / true < most


def test_normals_do_not_matter() -> None:
    """Elements turned over at random: the same estimate."""
    grid = shell_grid(8, 8, on_cylinder, "quad4")
    over = np.random.default_rng(3).random(len(grid.elements)) < 0.5
    turned = replace(grid, elements=np.where(over[:, None], grid.elements[:, ::-1], grid.elements))
    np.testing.assert_allclose(estimated(turned, 0.02)[1], estimated(grid, 0.02)[1], rtol=1e-6)


def test_units_do_not_matter(tmp_path: Path) -> None:
    """The bracket in metres and in millimetres; refined meshes say 0.9 percent."""
    text = (ROOT / "data/shells/links/bracket.toml").read_text(encoding="utf-8").replace("../meshes/", "")
    mesh = meshio.read(ROOT / "data/shells/meshes/bracket.msh")
    units = '[units]\nlength = "mm"\nmass = "t"\n[materials'
    millimetres = {"0.0025": "2.5", "7e10": "7e4", "2700.0": "2.7e-9", "[materials": units}
    found = []
    for scale, changes in ((1.0, {}), (1e3, millimetres)):
        meshio.write(tmp_path / "bracket.msh", replaced(mesh, scale), file_format="gmsh22", binary=False)
        for old, new in changes.items():
            assert old in text
            text = text.replace(old, new)
        (tmp_path / "bracket.toml").write_text(text, encoding="utf-8")
        model = reduce_link(tmp_path / "bracket.toml")
        found.append(next(c.value for c in model.health if c.name.startswith("error of the first frequencies")))
    assert 0.009 < found[0] < 0.02
    assert found[1] == pytest.approx(found[0], rel=1e-6)


def replaced(mesh: meshio.Mesh, scale: float) -> meshio.Mesh:
    """Its points farther apart."""
    data = {key: mesh.cell_data[key] for key in ("gmsh:physical", "gmsh:geometrical")}
    return meshio.Mesh(mesh.points * scale, mesh.cells, cell_data=data, field_data=mesh.field_data)


def test_coarse_shells_fail_the_check() -> None:
    """The check of the report, by the limit that is asked for."""
    bracket = ROOT / "data/shells/links/bracket.toml"
    for limit, ok in ((0.005, False), (0.05, True)):
        model = reduce_link(load_link(bracket, changes={"shell.mesh_error": limit}))
        check = next(c for c in model.health if c.name.startswith("error of the first frequencies"))
        assert check.ok is ok
