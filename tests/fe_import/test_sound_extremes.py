"""Links at the edge of what double precision holds: slender, of two very different materials, with repeated modes.

They are sound, so every method must finish; what rounding has spoilt is refused by that name.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scipy.linalg as la
from link_files import FRAME, SOLID, merged, write_toml
from solid_meshes import box
from test_seeded_faults import deck

from fe_import.description.link import LinkFile, load_link
from fe_import.errors import FEImportError
from fe_import.modal.model import ModalModel
from fe_import.models.model import build_model
from fe_import.reduce import reduce_link
from fe_import.reduction.free_body import free_body
from fe_import.solver.sparse import lowest_modes

FREE_FREE = 22.3733  # (β l)² of the first bending mode of a free beam
E, RHO = 7e10, 2700.0


def bar(folder: Path, slenderness: float, elements: int, method: str) -> LinkFile:
    """A square bar of 1 m in hex20 elements."""
    text = deck(box("hex20", (elements, 1, 1), (1.0, 1 / slenderness, 1 / slenderness)))
    (folder / "box.inp").write_text(text, encoding="utf-8")
    return load_link(write_toml(folder / "l.toml", merged(SOLID, {"reduction": {"method": method}})))


def beam(folder: Path, slenderness: float, elements: int) -> LinkFile:
    """The same in beams, twice as high as wide."""
    nodes = {"root": [0.0, 0.0, 0.0], "elbow": [0.5, 0.0, 0.0], "tip": [1.0, 0.0, 0.0]}
    members = [{**m, "elements": elements // 2} for m in FRAME["frame"]["members"]]
    section = {"width": 1 / slenderness, "height": 2 / slenderness}
    changes = {"frame": {"nodes": nodes, "members": members}, "sections": {"s": section}}
    return load_link(write_toml(folder / "l.toml", merged(FRAME, changes)))


def bending(slenderness: float) -> float:
    """First frequency of the thin free beam [Hz]."""
    return FREE_FREE / (2 * np.pi) * float(np.sqrt(E / RHO / 12)) / slenderness


def rounding(model: ModalModel) -> float:
    return next(check.value for check in model.health if check.name.startswith("rounding"))


@pytest.mark.parametrize("method", ["craig-bampton", "craig-chang"])
@pytest.mark.parametrize(("slenderness", "elements"), [(300.0, 60), (1000.0, 60), (3000.0, 60)])
def test_slender_solids(tmp_path: Path, slenderness: float, elements: int, method: str) -> None:
    """Within a tenth of what rounding may make up, and what the basis and the mesh leave, of the beam's frequency."""
    model = reduce_link(bar(tmp_path, slenderness, elements, method))
    share = rounding(model)
    first, second = model.frequencies_hz[6:8]
    assert abs(first / bending(slenderness) - 1) < 0.1 * share + 6e-4  # 3e-4 by the basis, 1e-4 by the mesh
    assert abs(second / first - 1) < 0.1 * share + 1e-6  # a square section has pairs
    assert share == pytest.approx(1e-3 * (slenderness / 1000) ** 4, rel=0.5)


def test_too_slender_solids(tmp_path: Path) -> None:
    """10 000 with 60 elements: not a digit is left, so the link is refused for that, not as a mechanism."""
    with pytest.raises(FEImportError, match=r"rounding in the stiffness.*too slender for its elements.*use beams"):
        reduce_link(bar(tmp_path, 10_000.0, 60, "craig-bampton"))
    with pytest.raises(FEImportError, match="or the link is too slender for its elements"):
        reduce_link(bar(tmp_path, 10_000.0, 20, "craig-chang"))


@pytest.mark.parametrize(("slenderness", "elements"), [(1000.0, 20), (10_000.0, 20), (10_000.0, 200)])
def test_slender_frames(tmp_path: Path, slenderness: float, elements: int) -> None:
    model = reduce_link(beam(tmp_path, slenderness, elements))
    first = model.frequencies_hz[6:8] / bending(slenderness)
    np.testing.assert_allclose(first, [1, 2], atol=3e-4 + 0.1 * rounding(model))  # of a basis of 12 clamped modes
    assert rounding(model) < 1e-3


@pytest.mark.parametrize("method", ["craig-bampton", "craig-chang"])
@pytest.mark.parametrize("coupling", ["rigid", "averaged"])
def test_two_materials(tmp_path: Path, method: str, coupling: str) -> None:
    """Half of steel, half a million times softer, against LAPACK on the whole matrices."""
    mesh = box("hex20", (8, 1, 1), (1.0, 0.1, 0.1))
    middle = mesh.nodes[mesh.only.elements].mean(axis=1)[:, 0] < 0.5
    sets = [f"*ELSET, ELSET={name}\n" + "".join(f"{k + 1},\n" for k in np.flatnonzero(own))
            for name, own in (("A", middle), ("B", ~middle))]  # fmt: skip
    (tmp_path / "box.inp").write_text(deck(mesh) + "".join(sets), encoding="utf-8")
    steel = {"youngs_modulus": 2e11, "poissons_ratio": 0.3, "density": 7850.0}
    changes = {
        "materials": {"s": steel, "m": {**steel, "youngs_modulus": 2e5, "density": 1000.0}},
        "solid": {"material": "", "regions": [{"set": "A", "material": "s"}, {"set": "B", "material": "m"}]},
        "interfaces": [{"name": n, "face": f, "coupling": coupling} for n, f in (("hub", "x0"), ("hand", "x1"))],
        "reduction": {"method": method},
    }
    link = load_link(write_toml(tmp_path / "l.toml", merged(SOLID, changes)))
    model = reduce_link(link)
    mass, stiffness = (m.toarray() for m in build_model(link).reduced_matrices())
    exact = np.sqrt(la.eigh(stiffness, mass, eigvals_only=True)[6:10]) / (2 * np.pi)
    np.testing.assert_allclose(model.frequencies_hz[6:10], exact, rtol=2e-3 if method == "craig-bampton" else 1e-6)
    assert all(check.ok for check in model.health)


def test_repeated_pairs(tmp_path: Path) -> None:
    """A star of twelve equal arms: groups of ten and eleven equal frequencies, all found, free and clamped."""
    angles = 2 * np.pi * np.arange(12) / 12
    nodes = {"root": [0.0, 0.0, 0.0], **{f"a{k}": [np.cos(a), np.sin(a), 0.0] for k, a in enumerate(angles)}}
    arm = {**FRAME["frame"]["members"][0], "from": "root", "elements": 9, "local_z": [0.0, 0.0, 1.0]}
    frame = {"nodes": nodes, "members": [{**arm, "to": f"a{k}"} for k in range(12)]}
    changes = {
        "interfaces": [{"name": "hub", "node": "root"}],
        "sections": {"s": {"shape": "circular", "diameter": 0.02}},
    }
    table = {**FRAME, "frame": frame, "sections": {"s": {"shape": "circular", "diameter": 0.02}}}
    link = load_link(write_toml(tmp_path / "l.toml", {**table, **changes}))
    model = build_model(link)
    mass, stiffness = model.reduced_matrices()
    exact = np.sqrt(la.eigh(stiffness.toarray(), mass.toarray(), eigvals_only=True)[6:36]) / (2 * np.pi)
    np.testing.assert_allclose(free_body(model, "star").modes(30)[0] / (2 * np.pi), exact, rtol=1e-7)
    rest = np.setdiff1d(np.arange(mass.shape[0]), model.interface_dofs)
    clamped_mass, clamped = mass[rest][:, rest].tocsc(), stiffness[rest][:, rest].tocsc()
    omega, _ = lowest_modes(clamped, clamped_mass, 48, "star")
    exact = np.sqrt(la.eigh(clamped.toarray(), clamped_mass.toarray(), eigvals_only=True)[:48])
    np.testing.assert_allclose(omega, exact, rtol=1e-8)
    assert (np.diff(exact)[:23] < 1e-6 * exact[0]).all()  # twenty-four equal ones: two directions of twelve arms
