"""Links of shells beside closed forms, CalculiX, solids and beams; their stress; faults that are told."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from calculix import NEEDS_CALCULIX
from link_files import write_toml
from shell_brackets import calculix_bracket, deck_bracket, shell_bracket, solid_bracket
from shell_meshes import ShellGrid, shell_grid, write_deck

from fe_import.description.link import load_link
from fe_import.elements.shell_stress import ShellStress
from fe_import.errors import FEImportError
from fe_import.modal.model import ModalModel
from fe_import.model import FEModel
from fe_import.models.model import build_model
from fe_import.reduce import reduce_link

ALU = {"youngs_modulus": 70e9, "poissons_ratio": 0.33, "density": 2700.0}
ENDS = [{"name": "hub", "face": "ROOT"}, {"name": "hand", "face": "TIP"}]


def link(folder: Path, grid: ShellGrid, shell: dict[str, Any] | None = None, **tables: Any) -> Path:
    """A link of the mesh, 5 mm of aluminium unless told otherwise."""
    write_deck(folder / "mesh.inp", grid)
    made = {"material": "m", "thickness": 0.005} if shell is None else shell
    data = {"materials": {"m": ALU}, "shell": {"mesh": "mesh.inp", **made}, "interfaces": ENDS, **tables}
    return write_toml(folder / "link.toml", data)


def strip(kind: str = "quad4", nx: int = 20, width: float = 0.03) -> ShellGrid:
    """Half a metre along x."""
    return shell_grid(nx, 4, lambda a, b: (0.5 * a, width * (b - 0.5), 0.0), kind)


@pytest.mark.parametrize("kind", ["quad4", "tri3"])
def test_a_strip_is_a_beam(tmp_path: Path, kind: str) -> None:
    """Without contraction across: mass properties to rounding, the first three free bending frequencies to 0.5 %."""
    material = {**ALU, "poissons_ratio": 0.0}
    path = link(tmp_path, strip(kind, 40), {"material": "m", "thickness": 0.002}, materials={"m": material},
                reduction={"fixed_interface_modes": 12})  # fmt: skip
    model = reduce_link(path)
    assert all(check.ok for check in model.health)
    assert model.mass_properties.mass == pytest.approx(0.5 * 0.03 * 0.002 * 2700, rel=1e-12)
    radius = 0.002 / 12**0.5 * (70e9 / 2700) ** 0.5 / (2 * np.pi)
    exact = [radius * (x / 0.5) ** 2 for x in (4.730041, 7.853205)]  # rigid ends of no length: only the free beam
    assert model.frequencies_hz[6] == pytest.approx(exact[0], rel=5e-3)
    assert any(abs(f / exact[1] - 1) < 5e-3 for f in model.frequencies_hz[7:10])


def test_second_order_fields_are_those_of_beams(tmp_path: Path) -> None:
    """A strip without contraction across beside Timoshenko beams: axial field of the tip in bending to 2 %."""
    material = {**ALU, "poissons_ratio": 0.0}
    options = {"fixed_interface_modes": 6, "elastic_modes": 4}
    shell = {"material": "m", "thickness": 0.002}
    shells = reduce_link(link(tmp_path, strip(nx=60), shell, materials={"m": material}, reduction=options))
    beam = {
        "materials": {"m": material}, "sections": {"s": {"shape": "rectangular", "width": 0.03, "height": 0.002}},
        "frame": {"nodes": {"a": [0.0, 0.0, 0.0], "b": [0.5, 0.0, 0.0]},
                  "members": [{"from": "a", "to": "b", "elements": 20, "material": "m", "section": "s"}]},
        "interfaces": [{"name": "hub", "node": "a"}, {"name": "hand", "node": "b"}], "reduction": options,
    }  # fmt: skip
    beams = reduce_link(write_toml(tmp_path / "beam.toml", beam))
    assert shells.second_order is not None
    assert beams.second_order is not None
    np.testing.assert_allclose(shells.frequencies_hz[6:10], beams.frequencies_hz[6:10], rtol=0.01)
    found = [tip_drop(model) for model in (shells, beams)]
    np.testing.assert_allclose(found[0], found[1], rtol=0.02)


def tip_drop(model: ModalModel) -> np.ndarray:
    """Axial second-order displacement of the hand in the first two modes, whose tip moves by one."""
    field = model.second_order
    assert field is not None
    node = next(i.node for i in model.interface_nodes if i.name == "hand")
    place = int(np.searchsorted(field.nodes, node))
    found = []
    pair = 0
    count = model.elastic_modes
    for mode in range(2):
        shape = [model.translation_shapes[i.node][:, 6 + mode] for i in model.interface_nodes]
        turn = [model.node_shape(i.node)[1] for i in model.interface_nodes]
        assert turn[0] is not None
        relative = shape[1] - shape[0] - np.cross(turn[0][:, 6 + mode], [0.5, 0.0, 0.0])
        found.append(field.translation[place, 0, pair] / relative[2] ** 2)
        pair += count - mode
    return np.array(found)


@NEEDS_CALCULIX
def test_frequencies_of_a_bracket_are_those_of_calculix(tmp_path: Path) -> None:
    """Quadratic shells (S8R) of CalculiX on the same mesh, with nodes in the middle of the sides: six to 2 %, from the
    very deck that it reads, too.
    """
    judge = calculix_bracket(tmp_path, 2)
    np.testing.assert_allclose(shell_bracket(tmp_path, 2), judge, rtol=0.02)
    np.testing.assert_allclose(deck_bracket(tmp_path), judge, rtol=0.02)


def test_frequencies_of_a_bracket_are_those_of_a_solid(tmp_path: Path) -> None:
    """Hexahedra of 20 nodes about the same middle surface, thickness a twentieth of the width: six to 3 %."""
    np.testing.assert_allclose(shell_bracket(tmp_path, 2), solid_bracket(tmp_path, 3), rtol=0.03)


def test_stress_of_a_cantilever(tmp_path: Path) -> None:
    """M z / I on top and bottom, 0 in the middle, 3/2 of the mean shear there; also in millimetres and tonnes."""
    grid = strip(nx=40)
    scaled = ShellGrid(grid.nodes * 1e3, grid.elements, grid.kind, grid.at)
    other = {"youngs_modulus": 70e3, "poissons_ratio": 0.0, "density": 2.7e-9}
    for folder, mesh, material, size, units in (
        ("si", grid, {**ALU, "poissons_ratio": 0.0}, 0.005, {}),
        ("mm", scaled, other, 5.0, {"length": "mm", "mass": "t"}),
    ):
        (tmp_path / folder).mkdir()
        shell = {"material": "m", "thickness": size}
        model = build_model(load_link(link(tmp_path / folder, mesh, shell, materials={"m": material}, units=units)))
        moved = clamped(model, np.array([0.0, 0.0, 10.0]))
        stress = model.stress
        assert isinstance(stress, ShellStress)
        node = int(np.argmin(np.abs(model.nodes - [0.25, 0.0, 0.0]).sum(axis=1)))
        sites = np.flatnonzero(stress.site_nodes == node)
        bottom, middle, top = stress.evaluate(moved[:, None], model.dof_map, sites)[:, :, 0]
        bending = 10 * 0.25 * 0.0025 / (0.03 * 0.005**3 / 12)
        assert top[0] == pytest.approx(-bending, rel=0.01)
        assert bottom[0] == pytest.approx(bending, rel=0.01)
        assert abs(middle[0]) < 1e-6 * bending
        assert middle[5] == pytest.approx(1.5 * 10 / (0.03 * 0.005), rel=0.02)
        assert abs(top[5]) < 1e-9 * bending


def clamped(model: FEModel, force: np.ndarray) -> np.ndarray:
    """Displacements over all nodal components, the hub at rest, a force on the hand."""
    hub, hand = (i.node for i in model.interface_nodes)
    _, stiffness = model.reduced_matrices()
    free = ~np.isin(model.independent, model.dof_map[hub])
    load = np.zeros(len(model.independent))
    for component in range(3):
        load[np.flatnonzero(model.independent == model.dof_map[hand, component])] = force[component]
    found = np.zeros(len(load))
    found[free] = np.linalg.solve(stiffness[free][:, free].toarray(), load[free])
    assert model.coupling is not None
    return np.asarray(model.coupling @ found)


def test_shells_stiffen_a_solid(tmp_path: Path) -> None:
    """A plate of hexahedra between two skins of shells with offsets is the plate of three layers: 1 %."""
    nx, ny, core, skin = 20, 2, 0.01, 0.002
    flat = shell_grid(nx, ny, lambda a, b: (0.5 * a, 0.05 * b, 0.0), "quad4")
    nodes = np.vstack([flat.nodes, flat.nodes + np.array([0, 0, core])])
    top = len(flat.nodes)
    lines = ["*NODE", *(f"{k + 1}, {x:.12g}, {y:.12g}, {z:.12g}" for k, (x, y, z) in enumerate(nodes.tolist()))]
    lines.append("*ELEMENT, TYPE=C3D8, ELSET=CORE")
    count = len(flat.elements)
    for k, row in enumerate(flat.elements.tolist()):
        lines.append(", ".join(map(str, [k + 1, *(n + 1 for n in row), *(n + top + 1 for n in row)])))
    lines.append("*ELEMENT, TYPE=S4, ELSET=SKINS")
    for k, row in enumerate(flat.elements.tolist()):
        lines.append(", ".join(map(str, [count + k + 1, *(n + top + 1 for n in row)])))
        lines.append(", ".join(map(str, [2 * count + k + 1, *(n + 1 for n in reversed(row))])))
    for name, row in (("ROOT", flat.at[0]), ("TIP", flat.at[-1])):
        lines += [f"*NSET, NSET={name}", *(f"{n + 1}," for n in [*row, *(row + top)])]
    (tmp_path / "mesh.inp").write_text("\n".join(lines) + "\n")
    material = {**ALU, "poissons_ratio": 0.0}
    region = {"set": "SKINS", "material": "m", "thickness": skin, "offset": skin / 2}
    data = {"materials": {"m": material}, "solid": {"mesh": "mesh.inp", "material": "m"}, "interfaces": ENDS,
            "shell": {"regions": [region]}, "recovery": {"all": True}}  # fmt: skip
    both = reduce_link(write_toml(tmp_path / "both.toml", data))
    assert all(check.ok for check in both.health)
    thick = core + 2 * skin
    assert both.mass_properties.mass == pytest.approx(0.5 * 0.05 * thick * 2700, rel=1e-9)
    model = build_model(load_link(tmp_path / "both.toml"))
    moved = clamped(model, np.array([0.0, 0.0, 1.0]))
    hand = model.dof_map[model.interface_nodes[1].node, 2]
    exact = 0.5**3 / (3 * 70e9 * 0.05 * thick**3 / 12) + 0.5 / (5 / 6 * 35e9 * 0.05 * thick)
    assert moved[hand] == pytest.approx(exact, rel=0.01)
    assert both.recovery is not None
    assert len(both.recovery.nodes) == len(nodes) + 3 * len(nodes)


def test_layers_need_a_direction_and_follow_it(tmp_path: Path) -> None:
    """Fibres along the strip make it stiff in bending as E1 does, across as E2: frequencies by √E to 1 %."""
    fibres = {"youngs_modulus": 140e9, "transverse_modulus": 10e9, "poissons_ratio": 0.0, "shear_modulus": 5e9,
              "density": 1600.0}  # fmt: skip
    found = []
    for angle in (0.0, 90.0):
        layers = [{"material": "f", "thickness": 5e-4, "angle": angle}] * 4
        shell = {"layers": layers, "direction": [1.0, 0.0, 0.0]}
        model = reduce_link(link(tmp_path, strip("quad4", 40), shell, materials={"f": fibres}))
        found.append(model.frequencies_hz[6])
    radius = 0.002 / 12**0.5 * (1 / 1600) ** 0.5 / (2 * np.pi) * (4.730041 / 0.5) ** 2
    np.testing.assert_allclose(found, [radius * 140e9**0.5, radius * 10e9**0.5], rtol=0.01)


FAULTS: list[tuple[dict[str, Any], str]] = [
    ({"shell": {"mesh": "mesh.inp", "material": "m"}}, "shell.thickness: a thickness must be positive"),
    ({"shell": {"mesh": "mesh.inp", "material": "m", "thickness": -1.0}}, "a thickness must be positive"),
    ({"shell": {"mesh": "mesh.inp", "material": "x", "thickness": 1e-3}}, "shell.material"),
    ({"shell": {"mesh": "", "material": "m", "thickness": 1e-3}}, "shells need a mesh"),
    ({"shell": {"mesh": "no.inp", "material": "m", "thickness": 1e-3}}, "no such mesh file"),
    ({"shell": {"mesh": "mesh.inp", "material": "m", "thickness": 1e-3, "drilling": 0.0}}, "shell.drilling"),
    ({"shell": {"mesh": "mesh.inp", "material": "m", "layers": [{"material": "m", "thickness": 1.0}]}},
     "either 'layers' or 'material'"),
    ({"shell": {"mesh": "mesh.inp", "regions": [{"set": "PLATES", "material": "m", "thickness": 1e-3}]}}, "PLATE"),
    ({"shell": {"mesh": "mesh.inp", "regions": [{"set": "HALF", "material": "m", "thickness": 1e-3}]}},
     "shells are of no region"),
    ({"shell": {"mesh": "mesh.inp", "layers": [{"material": "f", "thickness": 1e-3}]}}, "need a direction"),
    ({"shell": {"mesh": "mesh.inp", "layers": [{"material": "f", "thickness": 1e-3}], "direction": [0.0, 0.0, 1.0]}},
     "stands on the surface"),
    ({"solid": {"mesh": "mesh.inp", "material": "m"}}, "no solid elements|would lack shells"),
    ({"interfaces": [{"name": "a", "face": "ROOT", "coupling": "averaged"}]}, "have no area"),
    ({"interfaces": [{"name": "a", "face": "NOSET"}]}, "NOSET"),
]  # fmt: skip


@pytest.mark.parametrize(("change", "told"), FAULTS)
def test_faults_are_named(tmp_path: Path, change: dict[str, Any], told: str) -> None:
    """One message each."""
    grid = strip(nx=4)
    deck = write_deck(tmp_path / "mesh.inp", grid)
    deck.write_text(deck.read_text() + "*ELSET, ELSET=HALF\n1, 2, 3\n")
    fibres = {"youngs_modulus": 1e11, "transverse_modulus": 1e10, "poissons_ratio": 0.3, "shear_modulus": 5e9,
              "density": 1600.0}  # fmt: skip
    data = {"materials": {"m": ALU, "f": fibres}, "interfaces": ENDS, **change}
    if "solid" not in data and "shell" not in data:
        data["shell"] = {"mesh": "mesh.inp", "material": "m", "thickness": 1e-3}
    if "solid" in data:
        del data["materials"]["f"]
    with pytest.raises(FEImportError, match=told):
        reduce_link(write_toml(tmp_path / "link.toml", data))


def test_meshes_of_shells_are_checked(tmp_path: Path) -> None:
    """Shells without area, twice the same, apart, turned inside out at a corner."""
    grid = strip(nx=4)
    for elements, nodes, told in (
        (np.vstack([grid.elements, grid.elements[:1, [1, 2, 3, 0]]]), grid.nodes, "two shells have the same corners"),
        (grid.elements[[0, 1, 2, 3, 12, 13, 14, 15]], grid.nodes, "parts that no element edge joins"),
        (np.vstack([grid.elements[:-1], grid.elements[-1:, [0, 2, 1, 3]]]), grid.nodes, "a corner that turns back"),
    ):
        folder = tmp_path / told[:4]
        folder.mkdir(exist_ok=True)
        with pytest.raises(FEImportError, match=told):
            reduce_link(link(folder, ShellGrid(nodes, elements, "quad4", grid.at)))


@pytest.mark.parametrize("kind", ["quad4", "tri3"])
def test_surfaces_of_second_order_are_cut(tmp_path: Path, kind: str) -> None:
    """S8R and S6 are the link of a mesh twice as fine, with their sets; a node that is not there is told."""
    grid = strip(kind, nx=6)
    fine = reduce_link(link(tmp_path, grid))
    at = np.array([grid.at[a : a + 3, b : b + 3].ravel() for a in (0, 2, 4) for b in (0, 2)])
    rows = at[:, [0, 6, 8, 2, 3, 7, 5, 1]] if kind == "quad4" else at[:, [[0, 6, 8, 3, 7, 4], [0, 8, 2, 4, 5, 1]]]
    elements = rows.reshape(-1, 8 if kind == "quad4" else 6)
    head, _, tail = (tmp_path / "mesh.inp").read_text().partition("*ELEMENT")
    lines = [", ".join(map(str, [k + 1, *(row + 1)])) for k, row in enumerate(elements)]
    own = [f"*ELEMENT, TYPE={'S8R' if kind == 'quad4' else 'S6'}, ELSET=PLATE", *lines, "*NSET"]
    deck = head + "\n".join(own) + tail.partition("*NSET")[2]
    (tmp_path / "mesh.inp").write_text(deck)
    region = {"set": "PLATE", "material": "m", "thickness": 0.005}
    data = {"materials": {"m": ALU}, "shell": {"mesh": "mesh.inp", "regions": [region]}, "interfaces": ENDS}
    cut = reduce_link(write_toml(tmp_path / "cut.toml", data))
    np.testing.assert_allclose(cut.frequencies_hz[6:], fine.frequencies_hz[6:], rtol=1e-8)
    (tmp_path / "mesh.inp").write_text(deck.replace(lines[-1], lines[-1] + "99"))
    with pytest.raises(FEImportError, match=r"node"):
        reduce_link(tmp_path / "cut.toml")


def test_decks_bring_their_sections(tmp_path: Path) -> None:
    """*SHELL SECTION, offsets in shares of the thickness; PSHELL with MAT1: the same link as with what they state."""
    grid = strip(nx=6)
    stated = reduce_link(link(tmp_path, grid, {"material": "m", "thickness": 0.004, "offset": 0.002}))
    deck = tmp_path / "mesh.inp"
    deck.write_text(deck.read_text() + "\n".join([
        "*MATERIAL, NAME=ALU", "*ELASTIC", "70e9, .33", "*DENSITY", "2700.,",
        "*SHELL SECTION, ELSET=PLATE, MATERIAL=ALU, OFFSET=SNEG", ".004, 5", "",
    ]))  # fmt: skip
    own = reduce_link(write_toml(tmp_path / "own.toml", {"shell": {"mesh": "mesh.inp"}, "interfaces": ENDS}))
    np.testing.assert_allclose(own.frequencies_hz[6:], stated.frequencies_hz[6:], rtol=1e-9)
    np.testing.assert_allclose(own.mass_properties.centre_of_mass, stated.mass_properties.centre_of_mass, atol=1e-12)
    with pytest.raises(FEImportError, match=r"no solid elements|shells"):
        reduce_link(write_toml(tmp_path / "s.toml", {"solid": {"mesh": "mesh.inp"}, "interfaces": ENDS}))
    lines = ["BEGIN BULK", "MAT1,1,70.+9,,.33,2700.", "PSHELL,7,1,.004,1,,1"]
    lines += [f"GRID,{k + 1},,{x:.9f},{y:.9f},{z:.9f}" for k, (x, y, z) in enumerate(grid.nodes.tolist())]
    lines += [f"CQUAD4,{k + 1},7," + ",".join(str(n + 1) for n in row) for k, row in enumerate(grid.elements.tolist())]
    lines += [f"SET1,{s}," + ",".join(str(n + 1) for n in row) for s, row in ((1, grid.at[0]), (2, grid.at[-1]))]
    (tmp_path / "mesh.bdf").write_text("\n".join([*lines, "ENDDATA", ""]))
    ends = [{"name": "hub", "face": "SET:1"}, {"name": "hand", "face": "SET:2"}]
    nastran = reduce_link(write_toml(tmp_path / "n.toml", {"shell": {"mesh": "mesh.bdf"}, "interfaces": ends}))
    middle = reduce_link(link(tmp_path, grid, {"material": "m", "thickness": 0.004}))
    np.testing.assert_allclose(nastran.frequencies_hz[6:], middle.frequencies_hz[6:], rtol=1e-7)
    spoils = ("PSHELL,7,1,.004", "no plate of one material"), ("PSHELL,7,1,.004,1,,1,,2.5", "nonstructural")
    for spoilt, told in spoils:
        (tmp_path / "mesh.bdf").write_text("\n".join([*lines, "ENDDATA", ""]).replace("PSHELL,7,1,.004,1,,1", spoilt))
        with pytest.raises(FEImportError, match=told):
            reduce_link(tmp_path / "n.toml")
