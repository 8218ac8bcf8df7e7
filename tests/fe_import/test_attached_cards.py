"""Bars, springs, bushes and equations of bulk data: closed forms, and the same link said with other cards."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from link_files import SOLID, dense, merged, write_toml
from solid_meshes import BAR, bulk

from fe_import.description.link import load_link
from fe_import.elements.attachments import AttachedBeam
from fe_import.elements.elasticity import orthotropic_moduli, turned_moduli
from fe_import.elements.frame import FrameElement, local_axes
from fe_import.elements.sections import SectionConstants
from fe_import.elements.solid import SolidMaterial, assemble_solid
from fe_import.errors import Cause, FEImportError
from fe_import.mesh.read import read_mesh
from fe_import.model import FEModel
from fe_import.models.attached_beams import beam_matrices
from fe_import.models.model import build_model

E, G, RHO = 7e10, 2.5e10, 2700.0
MAT1 = "MAT1,1,7.+10,2.5+10,,2700."
ROOT, TIP = np.array([1.0, 0.5, 0.5]), np.array([1.8, 1.1, 0.5])
ALL = [10 * k + 7 for k in range(len(BAR.nodes))]
TURNED = ["CORD2R,4,,1.,0.,0.,1.,2.,1.", ",3.,1.,0."]


def rbe2(number: int, reference: int, nodes: list[int]) -> list[str]:
    fields = [str(number), str(reference), "123456", *map(str, nodes)]
    return [("RBE2," if at == 0 else ",") + ",".join(fields[at : at + 8]) for at in range(0, len(fields), 8)]


def grid(number: int, position: np.ndarray, system: str = "") -> str:
    return f"GRID,{number},,{','.join(repr(float(x)) for x in position)},{system}"


def link(folder: Path, *cards: str, solid_material: str = "m") -> FEModel:
    """Cards beside a bar of solids that is rigid; interfaces on the grid points 901, its reference, and 902."""
    sets = ["SET1,1,901", "SET1,2,902"]
    text = bulk(BAR, *rbe2(900, 901, ALL), *sets, *cards).replace("MAT1,1,7.+10,,.33,2700.", MAT1)
    (folder / "bar.bdf").write_text(text)
    interfaces = [{"name": "hub", "node": "SET:1"}, {"name": "hand", "node": "SET:2"}]
    table = merged(SOLID, {"solid": {"mesh": "bar.bdf"}, "interfaces": interfaces})
    return build_model(load_link(write_toml(folder / "link.toml", table)))


def stiffness_of(model: FEModel) -> np.ndarray:
    """(12, 12) over the two interfaces, all else condensed."""
    _, k, _ = dense(model)
    own = np.searchsorted(model.independent, model.interface_dofs)
    other = np.setdiff1d(np.arange(len(k)), own)
    inner = np.linalg.solve(k[np.ix_(other, other)], k[np.ix_(other, own)]) if len(other) else np.zeros((0, 12))
    return k[np.ix_(own, own)] - k[np.ix_(own, other)] @ inner


POINTS = [grid(901, ROOT), grid(902, TIP)]
CBAR = "CBAR,910,3,901,902,0.,0.2,1."


def test_a_bar(tmp_path):
    """A cantilever: stretch, bending in planes 1 and 2 with its factors of shear, twist; closed forms to 1e-9."""
    pbar = ["PBAR,3,1,2.-4,3.-9,2.-9,4.-9,0.7", ",", ",0.8,0.6"]
    model = link(tmp_path, *POINTS, CBAR, *pbar)
    length = float(np.linalg.norm(TIP - ROOT))
    axes = np.kron(np.eye(2), local_axes(ROOT, TIP, np.cross(TIP - ROOT, [0, 0.2, 1.0])))
    found = np.diag(axes @ np.linalg.inv(stiffness_of(model)[6:, 6:]) @ axes.T)
    bend = [length**3 / 3 / (E * i) + length / (G * k * 2e-4) for i, k in ((3e-9, 0.8), (2e-9, 0.6))]
    expected = [length / (E * 2e-4), *bend, length / (G * 4e-9), length / (E * 2e-9), length / (E * 3e-9)]
    np.testing.assert_allclose(found, expected, rtol=1e-9)
    rigid = model.rigid_body_modes()[:, 1]
    assert rigid @ model.mass @ rigid == pytest.approx(2700 + (RHO * 2e-4 + 0.7) * length, rel=1e-12)


PBEAM = "PBEAM,3,1,2.-4,6.66666666666667-9,1.66666666666667-9,,4.573-9"
SAME = {  # one section in several words
    "bar": (["PBAR,3,1,2.-4,6.66666666666667-9,1.66666666666667-9,4.573-9", ",", ",.833333333333,.833333333333"], 1e-4),
    "profile": (["PBARL,3,1,,BAR", ",.01,.02"], 1e-4),
    "beam": ([PBEAM, ",", ",.833333333333,.833333333333"], 1e-4),
    "beam with stations": ([PBEAM, ",YES,1.,2.-4", ",", ",.8333333333,.8333333333"], 1e-4),
    "profile of a beam": (["PBEAML,3,1,,BAR", ",.01,.02"], 1e-4),
}


@pytest.mark.parametrize("name", SAME)
def test_properties(tmp_path, name):
    """A bar of 0.01 along z by 0.02 along y, as constants and as a profile: to the four digits of its torsion."""
    cards, tolerance = SAME[name]
    card = CBAR.replace("CBAR", "CBEAM") if "beam" in name else CBAR
    found = stiffness_of(link(tmp_path, *POINTS, card, *cards))
    (tmp_path / "same").mkdir()
    expected = stiffness_of(link(tmp_path / "same", *POINTS, CBAR, *SAME["profile"][0]))
    np.testing.assert_allclose(found, expected, rtol=0, atol=tolerance * np.abs(expected[3:6, 3:6]).max())


@pytest.mark.parametrize(
    ("profile", "area", "plane_1"),
    [
        ("ROD,,,,,.01", np.pi * 1e-4, np.pi / 4 * 1e-8),
        ("TUBE,,,,,.01,.008", np.pi * 0.36e-4, np.pi / 4 * (1e-8 - 0.008**4)),
        ("TUBE2,,,,,.01,.002", np.pi * 0.36e-4, np.pi / 4 * (1e-8 - 0.008**4)),
        ("BOX,,,,,.02,.03,.002,.001", 0.02 * 0.03 - 0.018 * 0.026, (0.02 * 0.03**3 - 0.018 * 0.026**3) / 12),
    ],
)
def test_profiles(tmp_path, profile, area, plane_1):
    kind, _, sizes = profile.partition(",,,,,")
    model = link(tmp_path, *POINTS, CBAR, f"PBARL,3,1,,{kind}", f",{sizes}")
    length = float(np.linalg.norm(TIP - ROOT))
    axes = np.kron(np.eye(2), local_axes(ROOT, TIP, np.cross(TIP - ROOT, [0, 0.2, 1.0])))
    found = np.diag(axes @ np.linalg.inv(stiffness_of(model)[6:, 6:]) @ axes.T)
    np.testing.assert_allclose(found[[0, 5]], [length / (E * area), length / (E * plane_1)], rtol=1e-9)


PBARL = ["PBARL,3,1,,BAR", ",.01,.02"]


def test_offsets_and_systems(tmp_path):
    """Offsets and orientation in the grid points' own axes: as a bar between points that follow rigidly, to 1e-9."""
    turned = [*TURNED, grid(901, ROOT, "4"), grid(902, TIP, "4")]
    model = link(tmp_path, *turned, CBAR, ",,,.1,.2,-.1,.05,-.3,.2", *PBARL)
    z = np.array([0.0, 2, 1]) / np.sqrt(5)
    y = np.cross(z, [2.0, 1, 0])
    y /= np.linalg.norm(y)
    axes = np.stack([np.cross(y, z), y, z], axis=1)
    ends = ROOT + axes @ [0.1, 0.2, -0.1], TIP + axes @ [0.05, -0.3, 0.2]
    toward = axes @ [0, 0.2, 1.0]
    cards = [*POINTS, grid(903, ends[0]), grid(904, ends[1]), *rbe2(920, 901, [903]), *rbe2(921, 902, [904])]
    bar = "CBAR,910,3,903,904," + ",".join(repr(float(v)) for v in toward)
    (tmp_path / "same").mkdir()
    expected = link(tmp_path / "same", *cards, bar, *PBARL)
    k = stiffness_of(expected)
    np.testing.assert_allclose(stiffness_of(model), k, rtol=0, atol=1e-9 * np.abs(k).max())
    total = [m.rigid_body_modes().T @ m.mass @ m.rigid_body_modes() for m in (model, expected)]
    np.testing.assert_allclose(total[0], total[1], rtol=0, atol=1e-11 * np.abs(total[1]).max())


def test_a_pinned_end():
    """The far end pinned in bending: 3 E I / L³ (1 + Φ / 4)⁻¹ is left of 12 E I / L³ (1 + Φ)⁻¹; rigid motion passes."""
    section = SectionConstants(2e-4, 2e-9, 3e-9, 4e-9, 0.8, 0.6)
    element = FrameElement((0, 1), np.eye(3), 0.5, section, E, G, RHO)
    mass, stiffness = beam_matrices(AttachedBeam("CBAR", "", element, np.zeros((2, 3)), (10, 11)))
    phi = 12 * E * 3e-9 / (0.8 * G * 2e-4 * 0.25)
    assert stiffness[1, 1] == pytest.approx(3 * E * 3e-9 / 0.125 / (1 + phi / 4), rel=1e-9)
    assert not stiffness[10:].any()
    across = np.tile([0, 1.0, 0, 0, 0, 0], 2)
    turn = np.zeros(12)
    turn[[5, 7, 11]] = 1, 0.5, 1
    assert np.abs(stiffness @ np.stack([across, turn], axis=1)).max() < 1e-9 * stiffness[1, 1]
    assert across @ mass @ across == pytest.approx(RHO * 2e-4 * 0.5, rel=1e-12)
    assert turn @ mass @ turn == pytest.approx(RHO * 2e-4 * 0.125 / 3 + RHO * 3e-9 * 0.5, rel=1e-9)


def test_springs(tmp_path):
    """CELAS1 and CELAS2 along turned axes, CBUSH in a system and along its line, at the quarter: energies as stated."""
    at = ROOT + np.array([0.0, 0.0, 0.0])
    cards = [*TURNED, grid(901, ROOT, "4"), grid(902, at, "4")]
    cards += ["CELAS2,910,1000.,901,2,902,2", "PELAS,5,1.,,,6,2000.", "CELAS1,911,6,901,6,902,6"]
    cards += ["CBUSH,912,7,901,902,,,,4", "PBUSH,7,K,10.,20.,30.,40.,50.,60."]
    k = stiffness_of(link(tmp_path, *cards))
    z = np.array([0.0, 2, 1]) / np.sqrt(5)
    y = np.cross(z, [2.0, 1, 0])
    y /= np.linalg.norm(y)
    axes = np.kron(np.eye(2), np.stack([np.cross(y, z), y, z], axis=1))
    expected = np.diag([10.0, 1020, 30, 40, 50, 2060])
    np.testing.assert_allclose(axes.T @ k[6:, 6:] @ axes, expected, rtol=0, atol=1e-9)
    np.testing.assert_allclose(k[:6, 6:], -k[6:, 6:], rtol=0, atol=1e-9)


def test_a_bush_with_length(tmp_path):
    """Its springs act at a quarter of the line: a force across bends both ends by the arms."""
    cards = [*POINTS, "CBUSH,912,7,901,902,0.,0.,1.,,,.25", "PBUSH,7,K,10.,20.,30.,40.,50.,60."]
    cards[2] = "CBUSH,912,7,901,902,0.,0.,1.,,+\n+,.25"
    k = stiffness_of(link(tmp_path, *cards))
    length = float(np.linalg.norm(TIP - ROOT))
    axes = np.kron(np.eye(2), local_axes(ROOT, TIP, np.cross(TIP - ROOT, [0, 0, 1.0])))
    found = axes @ np.linalg.inv(k[6:, 6:]) @ axes.T
    arm = 0.75 * length
    expected = [1 / 10, 1 / 20 + arm**2 / 60, 1 / 30 + arm**2 / 50, 1 / 40, 1 / 50, 1 / 60]
    np.testing.assert_allclose(np.diag(found), expected, rtol=1e-9)


def test_a_rigid_bar_and_equations(tmp_path):
    """RBAR is RBE2; six MPC in turned axes say the same, of the set that the case selects."""
    far = grid(903, TIP)
    beam = ["CBAR,910,3,903,902,1.,0.,0.2", *PBARL]
    at_tip = grid(902, TIP + np.array([0.0, 0.0, 0.4]))
    ways = {
        "rbe2": rbe2(920, 901, [903]),
        "rbar": ["RBAR,920,901,903,123456"],
        "reversed": ["RBAR,920,903,901,,123456,123456"],
    }
    expected = None
    for name, cards in ways.items():
        (tmp_path / name).mkdir()
        k = stiffness_of(link(tmp_path / name, grid(901, ROOT), at_tip, far, *beam, *cards))
        expected = k if expected is None else expected
        np.testing.assert_allclose(k, expected, rtol=0, atol=1e-9 * np.abs(expected).max())
    arm = TIP - ROOT
    x, y, z = arm
    turned = {1: [(5, -z), (6, y)], 2: [(6, -x), (4, z)], 3: [(4, -y), (5, x)], 4: [], 5: [], 6: []}
    cards = []
    for c, terms in turned.items():
        given = [(903, c, 1.0), (901, c, -1.0), *((901, k, v) for k, v in terms if v)]
        for sid in (8, 9):
            words = ["MPC", str(sid)]
            for place, (node, component, value) in enumerate(given):
                words += [str(node), str(component), repr(float(value if sid == 8 else 7.0))]
                words += ["", ""] if place % 2 else []
            cards.append(",".join(words[:8]))
            cards += ["," + ",".join(words[at : at + 8]) for at in range(9, len(words), 8)]
    (tmp_path / "mpc").mkdir()
    text = [grid(901, ROOT), at_tip, far, *beam, *cards]
    with pytest.raises(FEImportError, match="CBAR on a node that nothing joins to the mesh"):  # no case selects any
        link(tmp_path / "mpc", *text)
    path = tmp_path / "mpc" / "bar.bdf"
    cases = path.read_text()
    path.write_text(cases.replace("BEGIN BULK\n", ""))
    with pytest.raises(FEImportError, match="several sets, and no case control"):
        read_mesh(path)
    path.write_text("MPC = 8\n" + cases)
    model = build_model(load_link(tmp_path / "mpc" / "link.toml"))
    np.testing.assert_allclose(stiffness_of(model), expected, rtol=0, atol=1e-9 * np.abs(expected).max())


def test_systems_by_grid_points(tmp_path):
    """CORD1R through grid points, two on a card, is the CORD2R through their positions."""
    ways = [TURNED, [*TURNED, "CORD1R,8,911,912,913,5,911,912,913"]]
    points = [grid(911, np.array([1.0, 0, 0])), grid(912, np.array([1.0, 2, 1])), grid(913, np.array([3.0, 1, 0]))]
    found = []
    for k, cards in enumerate(ways):
        system = "58"[k] if k else "4"
        (tmp_path / str(k)).mkdir()
        ends = [grid(901, ROOT), f"GRID,902,{system},.8,.6,.5,{system}"]
        found.append(stiffness_of(link(tmp_path / str(k), *points, *cards, *ends, CBAR, *PBARL)))
    np.testing.assert_allclose(found[1], found[0], rtol=0, atol=1e-9 * np.abs(found[0]).max())


FAULTS = {
    "taper": (["PBEAM,3,1,2.-4,6.-9,1.-9,,4.-9", ",YES,1.,1.-4"], "a beam that tapers"),
    "product": (["PBAR,3,1,2.-4,6.-9,1.-9,4.-9", ",", ",.8,.8,1.-9"], "a product of inertia"),
    "no torsion": (["PBAR,3,1,2.-4,6.-9,1.-9"], "torsion constant of PBAR must be positive"),
    "profile": (["PBARL,3,1,,HAT", ",.01,.02,.03,.04"], "a profile HAT"),
    "no property": (["PBAR,4,1,2.-4,6.-9,1.-9,4.-9", "PSHELL,3,1,.1"], "property 3 is not there"),
    "material": (["PBAR,3,9,2.-4,6.-9,1.-9,4.-9"], "material 9 is no MAT1"),
    "defaults": (["PBAR,3,1,2.-4,6.-9,1.-9,4.-9", "BAROR,,3"], "defaults on a BAROR"),
    "loose": (["PBAR,3,1,2.-4,6.-9,1.-9,4.-9", "pins,4,4"], "its releases leave a beam that moves"),
    "offsets": (["PBAR,3,1,2.-4,6.-9,1.-9,4.-9", "GGO"], "offsets that are not GGG"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_bars_that_cannot_be_used(tmp_path, name):
    cards, words = FAULTS[name]
    bar = CBAR.replace("CBAR", "CBEAM") if name == "taper" else CBAR
    if name == "offsets":
        bar += "," + cards[-1]
    cards = [bar, *([",4,4"] if name == "loose" else []), *(c for c in cards if c[0] in "PB,")]
    with pytest.raises(FEImportError) as caught:
        link(tmp_path, *POINTS, *cards)
    assert caught.value.cause is Cause.NOT_USED
    assert words in str(caught.value)


def test_a_node_without_moments(tmp_path):
    """Pinned about y where nothing else holds the node: refused with its place."""
    cards = [*POINTS, CBAR, ",,5", *PBARL]
    with pytest.raises(FEImportError, match=r"nothing resists a turn of this node.*\(1.8, 1.1, 0.5\)") as caught:
        link(tmp_path, *cards)
    assert caught.value.cause is Cause.MESH


def test_a_bush_between_solids(tmp_path):
    """Against turning, between two nodes of solids: nothing holds these against turning together."""
    first, second = BAR.node_sets["x1"][:2].tolist()
    direction = (BAR.nodes[second] - BAR.nodes[first]) / np.linalg.norm(BAR.nodes[second] - BAR.nodes[first])
    bush = f"CBUSH,912,7,{10 * first + 7},{10 * second + 7},1.,0.,0.,"
    cards = ["PSOLID,2,1", "MAT1,1,7.+10,,.3,2700."]
    with pytest.raises(FEImportError, match="CBUSH: they turn freely about the 2 nodes") as caught:
        solid(tmp_path, *cards, bush, "PBUSH,7,K,10.,20.,30.,40.,50.,60.")
    assert caught.value.cause is Cause.MESH
    added = (solid(tmp_path, *cards, bush, "PBUSH,7,K,1.+6").stiffness - solid(tmp_path, *cards).stiffness).toarray()
    rows = 3 * np.array([[first], [second]]) + np.arange(3)
    expected = np.zeros_like(added)
    block = 1e6 * np.outer(direction, direction)
    expected[np.ix_(rows.ravel(), rows.ravel())] = np.block([[block, -block], [-block, block]])
    np.testing.assert_allclose(added, expected, atol=1e-3)


def test_a_turned_mass(tmp_path):
    """CONM2 in a rectangular system, and with its centre in basic coordinates: the same moments, to rounding."""
    z = np.array([0.0, 2, 1]) / np.sqrt(5)
    y = np.cross(z, [2.0, 1, 0])
    y /= np.linalg.norm(y)
    axes = np.stack([np.cross(y, z), y, z], axis=1)
    inertia = axes @ np.diag([0.01, 0.02, 0.025]) @ axes.T
    centre = BAR.nodes[0] + axes @ [0.1, 0.2, 0.3]
    rows = [inertia[0, 0], -inertia[1, 0], inertia[1, 1], -inertia[2, 0], -inertia[2, 1], inertia[2, 2]]
    basic = ["CONM2,91,7,-1,1.5," + ",".join(repr(float(v)) for v in centre)]
    basic += ["," + ",".join(repr(float(v)) for v in rows)]
    turned = [*TURNED, "CONM2,91,7,4,1.5,.1,.2,.3", ",.01,,.02,,,.025"]
    found = []
    for cards in (basic, turned):
        (tmp_path / "bar.bdf").write_text(bulk(BAR, *cards))
        (item,) = read_mesh(tmp_path / "bar.bdf").attachments
        found.append(item)
    np.testing.assert_allclose(found[0].offset, found[1].offset, atol=1e-15)
    np.testing.assert_allclose(found[0].inertia, found[1].inertia, atol=1e-15)


ORTHO = ["MAT11,5,1.4+11,1.+10,8.+9,.3,.25,.4,5.+9", ",4.+9,3.+9,1600."]
WOOD = orthotropic_moduli((1.4e11, 1e10, 8e9), (0.3, 0.25, 0.4), (5e9, 4e9, 3e9))
MAT9 = "MAT9,5," + ",".join(repr(float(WOOD[i, j])) for i in range(6) for j in range(i, 6)) + ",1600."


def solid(folder: Path, *cards: str) -> FEModel:
    """The bar of solids with the materials of its file."""
    text = bulk(BAR, "SET1,5," + ",".join(str(10 * n + 7) for n in BAR.node_sets["x0"]), *cards)
    (folder / "bar.bdf").write_text(text.replace("PSOLID,2,1\nMAT1,1,7.+10,,.33,2700.\n", ""))
    hub = {"name": "hub", "face": "SET:5"}
    table = merged(SOLID, {"solid": {"mesh": "bar.bdf", "material": ""}, "interfaces": [hub]})
    return build_model(load_link(write_toml(folder / "link.toml", table)))


def wrapped(card: str) -> list[str]:
    name, *fields = card.split(",")
    return [(name if at == 0 else "") + "," + ",".join(fields[at : at + 8]) for at in range(0, len(fields), 8)]


def test_materials_of_bulk_data(tmp_path):
    """MAT1 with E and G, MAT9 and MAT11 in a rectangular and a cylindrical system: as the same solids from here."""
    found = solid(tmp_path, "PSOLID,2,1", "MAT1,1,7.+10,2.8+10,,2700.")
    mesh = found.stress.mesh
    expected = assemble_solid(mesh, [SolidMaterial(7e10, 0.25, 2700.0)])
    count = expected[0].shape[0]
    for matrix, same in zip((found.mass, found.stiffness), expected, strict=True):
        assert abs(matrix[:count, :count] - same).max() <= 1e-12 * abs(same).max()
    assert found.materials == {"MAT1:1": (7e10, pytest.approx(0.25), 2700.0)}
    assert {"PSOLID", "MAT1"}.isdisjoint(found.left_out)
    cylinder = ["CORD2C,6,,0.5,-2.,0.,0.5,-2.,1.", ",1.5,-2.,0."]
    z = np.array([0.0, 2, 1]) / np.sqrt(5)
    y = np.cross(z, [2.0, 1, 0])
    y /= np.linalg.norm(y)
    axes = {4: np.tile(np.stack([np.cross(y, z), y, z], axis=1), (mesh.count, 1, 1))}
    outward = mesh.centres(np.arange(mesh.count)) * [1, 1, 0] - [0.5, -2, 0]
    outward /= np.linalg.norm(outward, axis=1)[:, None]
    up = np.tile([0.0, 0, 1], (mesh.count, 1))
    axes[6] = np.stack([outward, np.cross(up, outward), up], axis=2)
    for cards, system in ((ORTHO, 4), (wrapped(MAT9), 4), (ORTHO, 6)):
        model = solid(tmp_path, f"PSOLID,2,5,{system}", *cards, *TURNED, *cylinder)
        wood = SolidMaterial(1.0, 0.0, 1600.0, None, turned_moduli(WOOD, axes[system]))
        mesh = model.stress.mesh
        mass, stiffness = assemble_solid(mesh, [wood])
        assert abs(model.stiffness[:count, :count] - stiffness).max() <= 1e-11 * abs(stiffness).max()
        assert abs(model.mass[:count, :count] - mass).max() <= 1e-12 * abs(mass).max()


MATERIAL_FAULTS = {
    "no property": ([], "property 2 is not there"),
    "of shells": (["PSOLID,2,5", "MAT8,5,1.+10,1.+10,.3,1.+9"], "is no MAT1, MAT9 or MAT11"),
    "no system": (["PSOLID,2,5", *ORTHO], "lacks the coordinate system of its material (CORDM)"),
    "disagree": (["PSOLID,2,1", "MAT1,1,7.+10,2.8+10,.33,2700."], "not those of an isotropic solid"),
    "one constant": (["PSOLID,2,1", "MAT1,1,7.+10,,,2700."], "lacks two of E, G"),
    "not definite": (["PSOLID,2,5,0", "MAT9,5,1.,2."], "not positive definite"),
}


@pytest.mark.parametrize("name", MATERIAL_FAULTS)
def test_materials_that_cannot_be_used(tmp_path, name):
    cards, words = MATERIAL_FAULTS[name]
    with pytest.raises(FEImportError, match="the materials of the mesh file cannot be used") as caught:
        solid(tmp_path, *cards)
    assert words in str(caught.value)
