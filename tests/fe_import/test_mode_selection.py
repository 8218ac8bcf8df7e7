"""Which modes enter a basis, by count, frequency, effective mass and ranking, with every method; what is refused."""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.linalg as la
from link_files import Array, boundary, dense, frame_link, merged, solid_link, straight_link
from link_table import HAND, HUB, LINKS, held_flexibility, modal_flexibility, nodal_fields, relative

import fe_import.reduction.effective_mass
import fe_import.reduction.selection
from fe_import.description.link import load_link
from fe_import.description.reduction import COMPONENTS, SELECTIONS, Ranking
from fe_import.errors import Cause, FEImportError
from fe_import.modal.model import ModalModel
from fe_import.model import FEModel
from fe_import.models.model import build_model
from fe_import.reduce import reduce_link, reduce_model
from fe_import.reduction import REDUCTIONS
from fe_import.reduction.effective_mass import carried_shares
from fe_import.reduction.fixed_interface import constraint_modes, partition
from fe_import.reduction.ranking import best_ranked
from fe_import.solver.sparse import lowest_modes

ACCEPTED = {
    "craig-bampton": set(SELECTIONS),
    "craig-chang": {"lowest", "frequency"},
    "mode-displacement": {"lowest", "frequency"},
    "guyan": {"lowest"},
    "none": {"lowest"},
}
FIELDS: dict[str, dict[str, Any]] = {
    "lowest": {},
    "frequency": {"frequency_limit": 3000.0},
    "effective-mass": {"effective_mass": 0.5},
    "ranking": {"ranking": {"driving": ["hub.ry", "hub.uz"], "observed": ["hand.uz", "elbow.ux"], "count": 6}},
}


def selected(modal: ModalModel) -> dict[str, Any]:
    return dict(json.loads(modal.provenance.get("selection", "{}")))


# ----- every method with every selection


@pytest.mark.parametrize("selection", SELECTIONS)
@pytest.mark.parametrize("method", sorted(REDUCTIONS))
@pytest.mark.parametrize("name", ["frame", "three interfaces", "averaged"])
def test_every_method_with_every_selection(tmp_path: Path, name: str, method: str, selection: str) -> None:
    """Taken, sound and statically exact (1e-8) where the method is; or refused with field and remedy."""
    options = {"method": method, "selection": selection, **FIELDS[selection]}
    if name == "averaged" and selection == "ranking":
        options = merged(options, {"ranking": {"observed": ["hand.uz"]}})  # a solid has no named elbow
    link = LINKS[name](tmp_path, reduction=options)
    model = build_model(link)
    if selection not in ACCEPTED[method]:
        with pytest.raises(FEImportError) as caught:
            reduce_model(model, link)
        assert caught.value.cause is Cause.BAD_FIELD
        assert caught.value.where.endswith("link.toml: reduction.selection")
        assert caught.value.value == selection
        assert "method = 'craig-" in caught.value.remedy
        return
    modal = reduce_model(model, link)
    assert selected(modal).get("rule", "lowest") == selection
    if method != "mode-displacement":
        assert all(c.ok for c in modal.health), modal.health
        assert relative(modal_flexibility(modal), held_flexibility(model)) < 1e-8


REFUSED: list[tuple[dict[str, Any], str, str]] = [
    ({"free_modes": 3}, "free_modes", "use fixed_interface_modes"),
    ({"method": "craig-chang", "fixed_interface_modes": 3}, "fixed_interface_modes", "use free_modes"),
    ({"method": "mode-displacement", "fixed_interface_modes": 3}, "fixed_interface_modes", "use free_modes"),
    ({"method": "guyan", "fixed_interface_modes": 3}, "fixed_interface_modes", "craig-bampton"),
    ({"method": "guyan", "free_modes": 3}, "free_modes", "craig-chang"),
    ({"method": "none", "fixed_interface_modes": 3}, "fixed_interface_modes", "craig-bampton"),
    ({"method": "none", "free_modes": 3}, "free_modes", "craig-chang"),
    ({"method": "craig-chang", "form": "physical"}, "form", "'craig-bampton' or 'guyan'"),
    ({"method": "mode-displacement", "form": "physical"}, "form", "'craig-bampton' or 'guyan'"),
    ({"method": "mode-displacement", "static_correction": True}, "static_correction", "craig-chang"),
    ({"method": "guyan", "static_correction": True}, "static_correction", "craig-bampton"),
    ({"form": "physical", "static_correction": True}, "static_correction", "orthonormal"),
    ({"selection": "best"}, "selection", "one of lowest, frequency, effective-mass, ranking"),
    ({"free_modes": -1}, "free_modes", "0 or more"),
    ({"frequency_limit": 100.0}, "frequency_limit", "selection = 'frequency'"),
    ({"effective_mass": 0.9}, "effective_mass", "selection = 'effective-mass'"),
    ({"ranking": FIELDS["ranking"]["ranking"]}, "ranking", "selection = 'ranking'"),
    ({"selection": "frequency", "frequency_limit": 9.0, "fixed_interface_modes": 3}, "fixed_interface_modes", "lowest"),
    ({"selection": "frequency"}, "frequency_limit", "Hz"),
    ({"selection": "frequency", "frequency_limit": 0.0}, "frequency_limit", "above 0"),
    ({"selection": "frequency", "frequency_limit": math.inf}, "frequency_limit", "above 0"),
    ({"selection": "effective-mass", "effective_mass": 1.0}, "effective_mass", "0.9"),
    ({"selection": "effective-mass", "effective_mass": math.nan}, "effective_mass", "0.9"),
    ({"selection": "ranking"}, "ranking", "driving, observed and count"),
]


@pytest.mark.parametrize(("options", "field", "words"), REFUSED, ids=lambda o: str(o)[:60])
def test_what_means_nothing_is_refused(tmp_path: Path, options: dict[str, Any], field: str, words: str) -> None:
    with pytest.raises(FEImportError) as caught:
        reduce_link(frame_link(tmp_path, reduction=options))
    assert caught.value.cause is Cause.BAD_FIELD
    assert caught.value.where.endswith(f"link.toml: reduction.{field}")
    assert words in caught.value.remedy


RANKINGS: list[tuple[dict[str, Any], Cause, str, str]] = [
    ({"count": 0}, Cause.BAD_FIELD, ".count", "1 or more"),
    ({"count": 31}, Cause.MODE_COUNT, ".count", "ask for fewer"),
    ({"driving": []}, Cause.BAD_FIELD, ".driving", "'hub.ry'"),
    ({"driving": ["ry"]}, Cause.BAD_FIELD, ".driving", "'NAME.COMPONENT'"),
    ({"driving": ["hub.rx", "hub.y"]}, Cause.BAD_REFERENCE, ".driving", "uy"),
    ({"driving": ["elbow.ry"]}, Cause.BAD_REFERENCE, ".driving", "known: hand, hub"),
    ({"observed": ["hnd.uz"]}, Cause.BAD_REFERENCE, ".observed", "did you mean 'hand'?"),
    ({"observed": ["hub.uz"]}, Cause.BAD_FIELD, "", "another interface"),
]


@pytest.mark.parametrize(("changes", "cause", "field", "words"), RANKINGS, ids=str)
def test_faulty_rankings(tmp_path: Path, changes: dict[str, Any], cause: Cause, field: str, words: str) -> None:
    ranking = {**FIELDS["ranking"]["ranking"], **changes}
    with pytest.raises(FEImportError) as caught:
        reduce_link(frame_link(tmp_path, reduction={"selection": "ranking", "ranking": ranking}))
    assert caught.value.cause is cause
    assert caught.value.where.endswith(f"reduction.ranking{field}")
    assert words in caught.value.remedy


def test_a_solid_node_does_not_turn(tmp_path: Path) -> None:
    ranking = {"driving": ["hub.ry"], "observed": ["middle.rx"], "count": 2}
    nodes = {"nodes": {"middle": [0.1, 0.0, 0.0]}}
    with pytest.raises(FEImportError, match="no rotations") as caught:
        reduce_link(solid_link(tmp_path, solid=nodes, reduction={"selection": "ranking", "ranking": ranking}))
    assert caught.value.cause is Cause.BAD_FIELD


def test_schema_reads_rankings(tmp_path: Path) -> None:
    options = {"selection": "ranking", **FIELDS["ranking"]}
    read = load_link(frame_link(tmp_path, reduction=options).path).description.reduction
    assert read.ranking == Ranking(["hub.ry", "hub.uz"], ["hand.uz", "elbow.ux"], 6)


# ----- frequency


@pytest.mark.parametrize("method", ["craig-bampton", "craig-chang"])
def test_all_modes_below_a_frequency(tmp_path: Path, method: str) -> None:
    """As many as a dense eigenproblem of the full model has below the limit: none, some, more than a first try, all."""
    model = build_model(frame_link(tmp_path))
    mass, stiffness, _ = dense(model)
    if method == "craig-bampton":
        inner = np.setdiff1d(np.arange(len(mass)), boundary(model))
        mass, stiffness = mass[np.ix_(inner, inner)], stiffness[np.ix_(inner, inner)]
    squared = la.eigh(stiffness, mass, eigvals_only=True)
    hertz = np.sqrt(squared[0 if method == "craig-bampton" else 6 :]) / (2 * np.pi)
    for count in (0, 3, 20, len(hertz)):
        limit = float(hertz[count - 1] * 1.0001) if count else float(hertz[0] / 2)
        link = frame_link(tmp_path, reduction={"method": method, "selection": "frequency", "frequency_limit": limit})
        modal = reduce_model(model, link)
        assert selected(modal)["kept"] == count
        if method == "craig-bampton":
            np.testing.assert_allclose(modal.fixed_interface.frequencies_hz, hertz[:count], rtol=1e-8)
        else:
            np.testing.assert_allclose(modal.frequencies_hz[6 : 6 + min(count, 10)], hertz[: min(count, 10)], rtol=1e-8)


@pytest.mark.parametrize(
    ("options", "field", "words"),
    [
        ({"selection": "frequency", "frequency_limit": 1e9}, "frequency_limit", "more than 20 modes lie below"),
        ({"selection": "effective-mass", "effective_mass": 0.999}, "effective_mass", "20 fixed-interface modes carry"),
    ],
)
def test_too_many_candidates(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, options: dict[str, Any], field: str, words: str
) -> None:
    """Past the maximum (here 20) there is an error with what was reached."""
    monkeypatch.setattr(fe_import.reduction.selection, "MOST_CANDIDATES", 20)
    with pytest.raises(FEImportError, match=words) as caught:
        reduce_link(frame_link(tmp_path, reduction=options))
    assert caught.value.cause is Cause.MODE_COUNT
    assert caught.value.where.endswith(f"reduction.{field}")
    assert caught.value.limit == 20
    assert caught.value.remedy


# ----- effective mass


@pytest.mark.parametrize("name", LINKS)
def test_all_modes_carry_all(tmp_path: Path, name: str) -> None:
    """Shares of all fixed-interface modes add up to 1 to 1e-8 wherever there is mass; none exceeds what is left."""
    parts = partition(build_model(LINKS[name](tmp_path)))
    _, modes = lowest_modes(parts.inner_stiffness, parts.inner_mass, len(parts.inner), "x")
    shares = carried_shares(parts)(modes)
    np.testing.assert_allclose(shares.sum(axis=0), 1, atol=1e-8)
    assert (shares >= 0).all()


@pytest.mark.parametrize("name", ["frame", "point masses", "slender", "solid", "three interfaces"])
def test_share_of_the_mass_is_reached_with_as_few_as_can_be(tmp_path: Path, name: str) -> None:
    """0.9 (the default) in all six directions, and not with one mode less."""
    link = LINKS[name](tmp_path, reduction={"selection": "effective-mass"})
    model = build_model(link)
    note = selected(reduce_model(model, link))
    assert note["goal"] == 0.9
    assert min(note["reached"]) >= 0.9
    parts = partition(model)
    _, modes = lowest_modes(parts.inner_stiffness, parts.inner_mass, note["kept"], "x")
    reached = np.cumsum(carried_shares(parts)(modes), axis=0)
    np.testing.assert_allclose(reached[-1], note["reached"], atol=2e-6)
    assert (reached[-2] < 0.9).any()


def test_directions_without_mass_do_not_count(tmp_path: Path) -> None:
    """A straight link of point masses: nothing turns about its line, and the goal holds for the other five."""
    frame = {"mass": "lumped", "rotary_inertia": False}
    ends = [{"node": "tip", "inertia": [1e-5, 1e-5, 1e-5]}]
    link = straight_link(tmp_path, 1.0, 8, frame=frame, masses=ends, reduction={"selection": "effective-mass"})
    note = selected(reduce_link(link))
    assert note["reached"][3] is None
    assert min(x for x in note["reached"] if x is not None) >= 0.9


def test_mass_that_does_not_converge(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    parts = partition(build_model(frame_link(tmp_path)))
    monkeypatch.setattr(fe_import.reduction.effective_mass.spla, "cg", lambda *a, **k: (a[1], 1))
    with pytest.raises(FEImportError, match="did not converge") as caught:
        carried_shares(parts)
    assert caught.value.cause is Cause.EIGENSOLVER


# ----- ranking


def planar(folder: Path, driving: str, observed: str, **reduction: Any) -> tuple[FEModel, ModalModel]:
    """An L in the x-y plane: its modes bend in the plane or out of it, never both."""
    nodes = {"root": [0.0, 0.0, 0.0], "elbow": [0.4, 0.0, 0.0], "tip": [0.4, 0.4, 0.0]}
    options = {"selection": "ranking", "ranking": {"driving": [driving], "observed": [observed], "count": 4}}
    link = frame_link(folder, frame={"nodes": nodes}, reduction=reduction or options)
    model = build_model(link)
    return model, reduce_model(model, link)


@pytest.mark.parametrize(("driving", "observed", "axes"), [("hub.uz", "hand.uz", (2,)), ("hub.rz", "hand.ux", (0, 1))])
def test_modes_that_the_drive_cannot_reach_are_left_out(
    tmp_path: Path, driving: str, observed: str, axes: tuple[int, ...]
) -> None:
    """All four move in the driven plane or direction only, to 1e-9."""
    model, modal = planar(tmp_path, driving, observed)
    note = selected(modal)
    assert len(note["kept"]) == 4
    assert note["kept"] != [1, 2, 3, 4]
    whole = {"driving": [driving], "observed": [observed], "count": 30}
    shares = selected(planar(tmp_path, driving, observed, selection="ranking", ranking=whole)[1])["shares"]
    assert note["reached"] == pytest.approx(sum(sorted(shares)[-4:]), rel=1e-3)
    assert sum(shares) == pytest.approx(1.0, rel=1e-3)
    parts = partition(model)
    omega, modes = lowest_modes(parts.inner_stiffness, parts.inner_mass, 30, "x")
    chosen = [k - 1 for k in note["kept"]]
    np.testing.assert_allclose(omega[chosen] / (2 * np.pi), modal.fixed_interface.frequencies_hz, rtol=1e-10)
    fields = parts.clamped_field(modes[:, chosen])
    still = [k for k in range(3) if k not in axes]
    moved = np.abs(fields[model.dof_map[:, list(axes)].ravel()]).max(axis=0)
    assert (np.abs(fields[model.dof_map[:, still].ravel()]).max(axis=0) < 1e-9 * moved).all()


class Driven:
    """The transfer of a planar L with its hub held and accelerated, with any of its fixed-interface modes.

    1 % modal damping; inner products of impulse responses Σ r_j e^(-ζω_j t) sin(ω'_j t) / ω'_j in closed form.
    """

    def __init__(self, model: FEModel, driving: str, observed: str) -> None:
        parts = partition(model)
        _, modes = lowest_modes(parts.inner_stiffness, parts.inner_mass, 30, "x")
        fields = np.hstack([constraint_modes(parts), parts.clamped_field(modes)])
        self.mass, self.stiffness = (fields.T @ (m @ fields) for m in (parts.mass, parts.stiffness))
        self.drive, self.observe = COMPONENTS.index(driving[4:]), COMPONENTS.index(observed[5:])
        self.exact = self.residues(range(30))
        self.energy = self.product(self.exact, self.exact)

    def residues(self, kept: Iterable[int]) -> tuple[Array, Array]:
        rows = np.array([*range(6, 12), *(12 + k for k in kept)])
        inner = np.ix_(rows, rows)
        follow = -np.linalg.solve(self.stiffness[inner], self.stiffness[rows, self.drive])
        squared, modes = la.eigh(self.stiffness[inner], self.mass[inner])
        drives = -modes.T @ (self.mass[rows, self.drive] + self.mass[inner] @ follow)
        return np.sqrt(squared), modes[self.observe] * drives

    @staticmethod
    def product(one: tuple[Array, Array], two: tuple[Array, Array], zeta: float = 0.01) -> float:
        (a, r), (b, s) = ((w[:, None] if k == 0 else w[None, :], x) for k, (w, x) in enumerate((one, two)))
        decay, da, db = zeta * (a + b), a * math.sqrt(1 - zeta**2), b * math.sqrt(1 - zeta**2)
        slow, fast = decay / (decay**2 + (da - db) ** 2), decay / (decay**2 + (da + db) ** 2)
        return float(r @ ((slow - fast) / (2 * da * db)) @ s)

    def error(self, kept: Iterable[int]) -> float:
        """H2 norm of what the modes miss, per that of the transfer."""
        cut = self.residues(kept)
        rest = self.energy - 2 * self.product(self.exact, cut) + self.product(cut, cut)
        return math.sqrt(max(rest, 0.0) / self.energy)


@pytest.mark.parametrize(("driving", "observed"), [("hub.uz", "hand.uz"), ("hub.rz", "hand.ux")])
def test_four_ranked_modes_are_among_the_best_four(tmp_path: Path, driving: str, observed: str) -> None:
    """Of all 1820 ways to choose four of the lowest 16, at most two have a smaller H2 error; the lowest four have more
    than twice as large a one. The sum over modes that the ranking takes for the H2 norm is right to ζ² = 1e-4."""
    model, modal = planar(tmp_path, driving, observed)
    link = Driven(model, driving, observed)
    omega, residues = link.exact
    assert (residues**2 / (0.04 * omega**3)).sum() == pytest.approx(link.energy, rel=1e-4)
    ranked = link.error(k - 1 for k in selected(modal)["kept"])
    assert sum(link.error(kept) < ranked * (1 - 1e-6) for kept in itertools.combinations(range(16), 4)) <= 2
    assert link.error(range(4)) > 2 * ranked


def test_ranking_among_pairs(tmp_path: Path) -> None:
    """Square section: of each pair of bending modes one moves along the drive, however the solver turned the pair."""
    section = {"s": {"width": 0.02, "height": 0.02}}
    model = build_model(straight_link(tmp_path, 1.0, 12, sections=section, interfaces=[HUB, HAND]))
    parts = partition(model)
    omega, modes = lowest_modes(parts.inner_stiffness, parts.inner_mass, 50, "x")
    for angle in (0.0, 0.4, 1.1):
        turned = modes.copy()
        for k in range(0, 8, 2):  # the lowest modes are bending pairs
            assert omega[k + 1] / omega[k] - 1 < 1e-8
            c, s = math.cos(angle), math.sin(angle)
            turned[:, k : k + 2] = modes[:, k : k + 2] @ np.array([[c, -s], [s, c]])

        def lowest(count: int, given: Array = turned) -> tuple[Array, Array]:
            return omega[:count], given[:, :count]

        ranking = Ranking(["hub.uy"], ["hand.uy"], 3)
        found, best, _ = best_ranked(model, parts, constraint_modes(parts), lowest, ranking, "l")
        np.testing.assert_allclose(found, omega[[0, 2, 4]], rtol=1e-8)
        fields = parts.clamped_field(best)
        sideways = np.abs(fields[model.dof_map[:, 2]]).max(axis=0)
        assert (sideways < 1e-6 * np.abs(fields[model.dof_map[:, 1]]).max(axis=0)).all()


def test_ranked_shapes_are_modes(tmp_path: Path) -> None:
    """Nothing is lost by choosing all: the same reduction as by count, to 1e-9."""
    options = {"selection": "ranking", "ranking": {**FIELDS["ranking"]["ranking"], "count": 30}}
    ranked, counted = (
        reduce_link(frame_link(tmp_path, reduction=o)) for o in (options, {"fixed_interface_modes": 30})
    )
    np.testing.assert_allclose(ranked.frequencies_hz[6:12], counted.frequencies_hz[6:12], rtol=1e-9)
    assert selected(ranked)["reached"] == pytest.approx(1.0)
    model = build_model(frame_link(tmp_path))
    shapes = nodal_fields(model, ranked)
    np.testing.assert_allclose(shapes.T @ (model.mass @ shapes), np.eye(ranked.modes), atol=1e-9)
