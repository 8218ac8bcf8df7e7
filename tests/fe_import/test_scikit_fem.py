"""Links from scikit-fem in Python: its own assembly beside ours, and the same link from a mesh file."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import skfem
from link_files import SOLID, merged, write_toml
from skfem.models.elasticity import lame_parameters, linear_elasticity
from solid_meshes import box

from fe_import import link_from_skfem, read_modal_file, reduce_link, write_modal_file
from fe_import.errors import Cause, FEImportError
from fe_import.mesh.skfem_meshes import solid_mesh

ALU = {"youngs_modulus": 7e10, "poissons_ratio": 0.33, "density": 2700.0}
AXES = np.linspace(0, 0.3, 4), np.linspace(0, 0.02, 2), np.linspace(0, 0.03, 2)
ENDS = {"hub": lambda x: x[0] == 0.0, "hand": lambda x: x[0] == 0.3}
BOTH = {"hub": "hub", "hand": "hand"}


def bar(kind: Any) -> Any:
    return kind.init_tensor(*AXES).with_boundaries(ENDS)


@pytest.mark.parametrize(
    ("kind", "element", "solid"),
    [
        (skfem.MeshTet, skfem.ElementTetP1, {}),
        (skfem.MeshTet, skfem.ElementTetP2, {"raise_order": True}),
        (skfem.MeshHex, skfem.ElementHex1, {"hex8": "compatible"}),
        (skfem.MeshHex, skfem.ElementHexS2, {"raise_order": True}),
    ],
)
def test_both_ways(kind, element, solid):
    """A basis with scikit-fem's matrices, and its mesh with our elements: the same frequencies, to 1e-8."""
    mesh = bar(kind)
    basis = skfem.Basis(mesh, skfem.ElementVector(element()), intorder=8)
    theirs = link_from_skfem(basis, BOTH, material=ALU)
    ours = link_from_skfem(mesh, BOTH, material=ALU, options={"solid": {**solid, "mesh_error": 1e3}})
    np.testing.assert_allclose(theirs.frequencies_hz[6:14], ours.frequencies_hz[6:14], rtol=1e-8)
    assert all(check.ok for model in (ours, theirs) for check in model.health)
    assert ours.second_order is not None
    assert theirs.provenance["source: program"] == "scikit-fem"
    assert ours.provenance["sha256"] != theirs.provenance["sha256"]


def test_matrices_of_ones_own():
    """A basis that we have no element for, matrices from any forms, facets instead of names; options as in a file."""
    mesh = bar(skfem.MeshHex)
    basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementHex2()))
    stiffness = linear_elasticity(*lame_parameters(7e10, 0.33)).assemble(basis)
    mass = skfem.BilinearForm(lambda u, v, w: 2700.0 * skfem.helpers.dot(u, v)).assemble(basis)
    tip = {"face": mesh.facets_satisfying(ENDS["hand"]), "coupling": "averaged", "position": [0.31, 0.01, 0.015]}
    options = {"reduction": {"elastic_modes": 8}, "damping": {"ratio": 0.01}}
    interfaces = {"hub": "hub", "hand": tip}
    modal = link_from_skfem(basis, interfaces, stiffness=stiffness, mass=mass, name="arm", options=options)
    same = link_from_skfem(basis, interfaces, material=ALU, name="arm", options=options)
    np.testing.assert_allclose(modal.frequencies_hz[6:], same.frequencies_hz[6:], rtol=1e-10)
    assert modal.elastic_modes == 8
    assert modal.name == "arm"
    assert [i.name for i in modal.interface_nodes] == ["hub", "hand"]
    np.testing.assert_allclose(modal.interface_nodes[0].position, [0, 0.01, 0.015], atol=1e-15)
    np.testing.assert_allclose(modal.interface_nodes[1].position, [0.31, 0.01, 0.015])
    np.testing.assert_allclose(modal.damping_ratios[6:], 0.01)


@pytest.mark.parametrize("kind", [skfem.MeshTet2, skfem.MeshHex2, skfem.MeshWedge1])
def test_the_same_from_a_file(tmp_path, kind):
    """Quadratic tetrahedra, hexahedra of 27 nodes and wedges: frequencies of the mesh written by meshio, to 1e-9."""
    if kind is skfem.MeshWedge1:
        ours = box("wedge6", (3, 1, 1), (0.3, 0.02, 0.03))
        mesh = kind(ours.nodes.T, ours.only.elements[:, ours.only.element.skfem_order].T)
    else:
        mesh = kind.from_mesh({skfem.MeshTet2: skfem.MeshTet, skfem.MeshHex2: skfem.MeshHex}[kind].init_tensor(*AXES))
    facets = {name: mesh.facets_satisfying(test) for name, test in ENDS.items()}
    modal = link_from_skfem(mesh, facets, material=ALU, options={"solid": {"mesh_error": 1e3}})
    found = solid_mesh(mesh.with_boundaries(facets), "")
    sets = {name: np.flatnonzero(found.nodes[:, 0] == x) for name, x in (("x0", 0.0), ("x1", 0.3))}
    for name, own in zip(("hub", "hand"), sets.values(), strict=True):
        np.testing.assert_array_equal(found.node_sets[name], own)
    lines = ["*NODE", *(f"{k + 1}, " + ", ".join(map(repr, map(float, p))) for k, p in enumerate(found.nodes))]
    if found.only.type != "hex27":  # decks number its middle nodes in another order
        lines.append(f"*ELEMENT, TYPE=C3D{found.only.element.size}, ELSET=all")
        lines += [", ".join(map(str, [k + 1, *(e + 1)])) for k, e in enumerate(found.only.elements)]
        lines += [line for name, own in sets.items() for line in (f"*NSET, NSET={name}", *(f"{n + 1}," for n in own))]
        (tmp_path / "box.inp").write_text("\n".join(lines) + "\n")
        same = reduce_link(write_toml(tmp_path / "link.toml", merged(SOLID, {})))
        np.testing.assert_allclose(modal.frequencies_hz[6:14], same.frequencies_hz[6:14], rtol=1e-9)
    else:
        assert modal.mass_properties.mass == pytest.approx(0.3 * 0.02 * 0.03 * 2700, rel=1e-12)
    path = tmp_path / "bar.modal.h5"
    write_modal_file(path, modal)
    assert read_modal_file(path).elastic_modes == modal.elastic_modes


PLANE = skfem.MeshTri.init_tensor(*AXES[:2])
HEX = bar(skfem.MeshHex)
BASIS = skfem.Basis(HEX, skfem.ElementVector(skfem.ElementHex1()))
K = linear_elasticity(*lame_parameters(7e10, 0.33)).assemble(BASIS)
M = skfem.BilinearForm(lambda u, v, w: 2700.0 * skfem.helpers.dot(u, v)).assemble(BASIS)
FAULTS = {
    "plane": (PLANE, BOTH, {"material": ALU}, Cause.BAD_FIELD, "in three dimensions"),
    "no mesh": ("bar.msh", BOTH, {"material": ALU}, Cause.BAD_FIELD, "in three dimensions"),
    "no material": (HEX, BOTH, {}, Cause.BAD_FIELD, "a material is needed"),
    "no mass": (BASIS, BOTH, {"stiffness": K}, Cause.BAD_FIELD, "matrices come in pairs"),
    "matrices of a mesh": (HEX, BOTH, {"stiffness": K, "mass": K}, Cause.BAD_FIELD, "matrices come in pairs"),
    "scalar": (skfem.Basis(HEX, skfem.ElementHex1()), BOTH, {"material": ALU}, Cause.EXPORT, "is no displacement"),
    "boundary": (HEX, {"hub": "hubb"}, {"material": ALU}, Cause.BAD_REFERENCE, "did you mean 'hub'"),
    "facets": (HEX, {"hub": [0, 999]}, {"material": ALU}, Cause.INTERFACE, "indices of facets"),
    "field": (HEX, {"hub": {"face": "hub", "couplin": "rigid"}}, {"material": ALU}, Cause.UNKNOWN_FIELD, "couplin"),
    "constant": (HEX, BOTH, {"material": {**ALU, "poissons_ratio": 0.6}}, Cause.BAD_FIELD, "Poisson"),
    "constant of a basis": (BASIS, BOTH, {"material": {**ALU, "density": -1.0}}, Cause.BAD_FIELD, "density must be"),
    "held": (BASIS, BOTH, {"stiffness": K + 1e12 * M, "mass": M}, Cause.GROUNDED, "link_from_skfem"),
    "size": (BASIS, BOTH, {"stiffness": K[:9, :9], "mass": K[:9, :9]}, Cause.EXPORT, "more dofs than"),
    "option": (HEX, BOTH, {"material": ALU, "options": {"reductoin": {}}}, Cause.UNKNOWN_FIELD, "reductoin"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_what_is_refused(name):
    source, interfaces, further, cause, words = FAULTS[name]
    with pytest.raises(FEImportError) as caught:
        link_from_skfem(source, interfaces, **further)
    assert caught.value.cause is cause
    assert words in str(caught.value)
