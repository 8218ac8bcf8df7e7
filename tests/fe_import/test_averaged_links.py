"""Links whose interfaces are averaged faces, as descriptions state them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from link_files import clamped_flexibility, frame_link, solid_link, write_box

from fe_import.errors import FEImportError
from fe_import.modal.model import ModalModel
from fe_import.reduce import reduce_link
from fe_import.reduction import REDUCTIONS

METHODS = sorted(set(REDUCTIONS) - {"none", "mode-displacement"})  # the latter fails its static check


def face_link(folder: Path, coupling: str, **reduction: object) -> ModalModel:
    interfaces = [{"name": n, "face": f, "coupling": coupling} for n, f in (("hub", "x0"), ("hand", "x1"))]
    return reduce_link(solid_link(folder, interfaces=interfaces, reduction=reduction))


@pytest.mark.parametrize("method", METHODS)
def test_links_with_averaged_faces(tmp_path: Path, method):
    """A described link: the choice and its weights are in the modal file; it is softer than with rigid faces.

    Bar of 0.3 x 0.02 x 0.03 m with one element across: 0.5 to 20 % in every direction.
    """
    flexibility = []
    for coupling in ("rigid", "averaged"):
        modal = face_link(tmp_path, coupling, method=method)
        assert all(c.ok for c in modal.health)
        for one in modal.interface_nodes:
            assert one.coupling == coupling
            assert one.weights.sum() == pytest.approx(1, rel=1e-12)
            expected = {3 / 76, 16 / 76} if coupling == "averaged" else {1 / 8}
            assert set(one.weights.round(12)) == {round(w, 12) for w in expected}
        flexibility.append(np.diag(clamped_flexibility(modal)))
    more = flexibility[1] / flexibility[0]
    assert ((more > 1.005) & (more < 1.2)).all()


def test_all_dofs_of_a_link_with_averaged_faces(tmp_path: Path):
    """Without reduction: the frequencies of a basis of constraint modes and all fixed-interface modes (1e-8)."""
    whole = face_link(tmp_path, "averaged", method="none")
    every = int(whole.provenance["dofs"]) - 12
    reduced = face_link(tmp_path, "averaged", fixed_interface_modes=every)
    np.testing.assert_allclose(reduced.frequencies_hz[6:30], whole.frequencies_hz[6:30], rtol=1e-8)


def test_averaged_faces_in_other_units(tmp_path: Path):
    """A bar in mm and t is the same link (1e-7: condition of its stiffness)."""
    interfaces = [{"name": n, "face": f, "coupling": "averaged"} for n, f in (("hub", "x0"), ("hand", "x1"))]
    metres = reduce_link(solid_link(tmp_path, interfaces=interfaces))
    steel = {"youngs_modulus": 7e4, "density": 2.7e-9}
    changes = {"interfaces": interfaces, "materials": {"m": steel}, "units": {"length": "mm", "mass": "t"}}
    link = solid_link(tmp_path, **changes)
    write_box(tmp_path / "box.inp", 1000.0)
    millimetres = reduce_link(link)
    np.testing.assert_allclose(millimetres.frequencies_hz[6:], metres.frequencies_hz[6:], rtol=1e-7)
    np.testing.assert_allclose(clamped_flexibility(millimetres), clamped_flexibility(metres), rtol=1e-6, atol=1e-9)


HUB = {"name": "hub", "face": "x0"}


DESCRIPTIONS = {
    "weights of a rigid face": (solid_link, {**HUB, "weights": "area"}, "interfaces[0].weights", "only averages"),
    "unknown weights": (
        solid_link,
        {**HUB, "coupling": "averaged", "weights": "mass"},
        "interfaces[0].weights",
        "area",
    ),
    "unknown coupling": (solid_link, {**HUB, "coupling": "average"}, "interfaces[0].coupling", "'averaged'"),
    "average of a node": (
        frame_link,
        {"name": "hub", "node": "root", "coupling": "averaged"},
        "interfaces[0].coupling",
        "remove the field",
    ),
}


@pytest.mark.parametrize("fault", DESCRIPTIONS)
def test_faulty_descriptions(tmp_path: Path, fault):
    make, interface, place, words = DESCRIPTIONS[fault]
    with pytest.raises(FEImportError, match=words) as caught:
        reduce_link(make(tmp_path, interfaces=[interface]))
    assert caught.value.where == f"{tmp_path / 'link.toml'}: {place}"
