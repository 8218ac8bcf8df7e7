"""Links made in Python: the same as from files; what does not belong together is named."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
import scipy.sparse as sp

from fe_import import link_from_matrices, load_link, make_link, reduce_link
from fe_import.description.records import Frame, Interface, Material, Member
from fe_import.elements.sections import Rectangular
from fe_import.errors import Cause, FEImportError
from fe_import.models.model import build_model

ARM = Path(__file__).parents[2] / "data/robot/links/arm.toml"
TABLES: dict[str, Any] = {
    "materials": {"alu": Material(youngs_modulus=7e10, poissons_ratio=0.33, density=2700.0)},
    "sections": {"bar": Rectangular(width=0.01, height=0.02)},
    "frame": Frame(
        nodes={"root": (0.0, 0.0, 0.0), "tip": (0.4, 0.0, 0.0)},
        members=[Member(start="root", end="tip", material="alu", section="bar", elements=4)],
    ),
    "interfaces": [Interface(name="root", node="root"), {"name": "tip", "node": "tip"}],
    "reduction": {"elastic_modes": np.int64(8)},
}


def test_tables_and_records_are_a_link(tmp_path: Path) -> None:
    """As the same text in a file is, to the last bit; a link of a file made again is that of the file."""
    path = tmp_path / "arm.toml"
    path.write_text(
        "[materials.alu]\nyoungs_modulus = 7e10\npoissons_ratio = 0.33\ndensity = 2700.0\n"
        '[sections.bar]\nshape = "rectangular"\nwidth = 0.01\nheight = 0.02\n'
        "[frame.nodes]\nroot = [0.0, 0.0, 0.0]\ntip = [0.4, 0.0, 0.0]\n"
        '[[frame.members]]\nfrom = "root"\nto = "tip"\nmaterial = "alu"\nsection = "bar"\nelements = 4\n'
        '[[interfaces]]\nname = "root"\nnode = "root"\n[[interfaces]]\nname = "tip"\nnode = "tip"\n'
        "[reduction]\nelastic_modes = 8\n",
        encoding="utf-8",
    )
    made, read = make_link("arm", **TABLES), load_link(path)
    assert made.description == read.description
    assert made.content_hash() == read.content_hash()
    assert (reduce_link(made).frequencies_hz == reduce_link(read).frequencies_hz).all()


def test_arrays_are_a_link() -> None:
    """Matrices of a frame, with rotations, give its frequencies, static answers and mass; other values another link.

    To 1e-9: rounding of the largest stiffness (1e8 N/m along) in the lowest frequency.
    """
    link = load_link(ARM)
    whole, model = reduce_link(link), build_model(link)
    seats = {i.name: i.node for i in model.interface_nodes}
    options = {"reduction": msgspec.to_builtins(link.description.reduction)}
    given = (model.stiffness, model.mass.toarray(), model.nodes, seats)
    found = link_from_matrices(*given, dof_map=model.dof_map, options=options)
    np.testing.assert_allclose(found.frequencies_hz[6:], whole.frequencies_hz[6:], rtol=1e-9)
    assert found.mass_properties.mass == pytest.approx(whole.mass_properties.mass, rel=1e-12)
    assert [i.name for i in found.interface_nodes] == ["root", "tip"]
    assert all(check.ok for check in found.health)
    other = link_from_matrices(2 * given[0], *given[1:], dof_map=model.dof_map, options=options)
    np.testing.assert_allclose(other.frequencies_hz[6:], np.sqrt(2) * found.frequencies_hz[6:], rtol=1e-9)
    assert other.provenance["sha256"] != found.provenance["sha256"]


K, PLACES = np.eye(12), np.arange(12.0).reshape(4, 3)
FAULTS: dict[str, tuple[dict[str, Any], str]] = {
    "places": ({"nodes": np.zeros((4, 2))}, r"nodes.*\(n, 3\)"),
    "square": ({"mass": np.eye(9)}, "stiffness and mass are square"),
    "numbers": ({"stiffness": 1.0}, "stiffness and mass are square"),
    "rows": ({"nodes": np.zeros((5, 3))}, "neither three nor six rows"),
    "map": ({"dof_map": np.zeros((4, 6), int)}, "each row of the matrices once"),
    "map of numbers": ({"dof_map": np.zeros((4, 6))}, "each row of the matrices once"),
    "no node": ({"interfaces": {"root": [0, 4]}}, "interfaces.root.*numbers of nodes"),
    "none": ({"interfaces": {"root": []}}, "interfaces.root.*numbers of nodes"),
    "ragged": ({"nodes": [[0.0, 0.0, 0.0], [1.0]]}, "nodes: no array of numbers"),
    "ragged interface": ({"interfaces": {"root": [[0], [1, 2]]}}, "interfaces.root: no array of numbers"),
    "text": ({"stiffness": np.full((12, 12), "k")}, "stiffness: no array of real numbers"),
    "complex": ({"mass": sp.eye_array(12) * 1j}, "mass: no array of real numbers"),
    "twice": ({"interfaces": {"root": {"nodes": [0, 1, 2], "face": "x0"}}}, "interfaces.root.face"),
    "options": ({"options": {"interfaces": []}}, "options.interfaces: the arguments say this"),
    "field": ({"interfaces": {"root": {"nodes": [0, 1, 2], "couplin": "rigid"}}}, "couplin"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_faults_are_named(name: str) -> None:
    """The argument, its value and a remedy."""
    changes, words = FAULTS[name]
    good = {"stiffness": K, "mass": sp.eye_array(12), "nodes": PLACES, "interfaces": {"root": [0, 1, 2]}}
    with pytest.raises(FEImportError, match=rf"link_from_matrices.*{words}"):
        link_from_matrices(**{**good, **changes})


def test_a_table_that_is_misspelt() -> None:
    """Is refused as in a file."""
    with pytest.raises(FEImportError, match=r"make_link: arm.*fraem") as refused:
        make_link("arm", **{**TABLES, "fraem": {}})
    assert refused.value.cause == Cause.UNKNOWN_FIELD
