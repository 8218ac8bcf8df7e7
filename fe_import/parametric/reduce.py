"""From a link description with parameters to a family of reduced links."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import scipy.linalg as la

from fe_import.description.link import LinkFile, load_link
from fe_import.errors import Cause, FEImportError
from fe_import.model import Array, FEModel, IntArray
from fe_import.parametric.basis import CommonBasis, training_places
from fe_import.parametric.held import reduced_figures
from fe_import.parametric.interpolation import Arrays, Interpolant, NotSmooth, interpolated
from fe_import.parametric.model import ACCURACY, Bound, ParametricModel
from fe_import.parametric.samples import Samples
from fe_import.reduce import reduce_link
from fe_import.reduction.base import expanded
from fe_import.solver.watch import say, telling

_SURPLUS = ACCURACY / 50  # of squared frequencies, of what the next samples may change
_BASIS = ACCURACY / 10  # of figures, of what the basis may leave at its training places
_MOST_TERMS = 600
_ROUNDS = 4
_MARGIN = 3.0  # of the bound, over the largest error that is found
_LEAST = 2 * (_BASIS + _SURPLUS)  # of the bound: what the basis and its matrices may leave is no less promised


def reduce_parametric(
    link: LinkFile | Path | str, tell: Callable[[str], None] | None = None, places: int = 64
) -> ParametricModel:
    """Reduce a family of links on one basis, for all values of the parameters of its description.

    Parameters
    ----------
    link : LinkFile, Path or str
        A description with ``[parameters]``.
    tell : callable, optional
        Gets messages on the way.
    places : int
        At how many that gave nothing to it the family is set beside the whole model, besides the corners.

    Raises
    ------
    FEImportError
        As `fe_import.reduce_link`; no parameters; a model that has none of the promised figures; the family is not
        within `ACCURACY` at places that gave nothing to it.
    """
    given = link if isinstance(link, LinkFile) else load_link(link)
    _refuse(given)
    with telling(tell):
        return _family(given, places)


def _refuse(link: LinkFile) -> None:
    where, description = str(link.path), link.description
    options = description.reduction
    for wrong, field, message, remedy in (
        (not description.parameters, "parameters", "a family of links needs parameters", "add [parameters.NAME]"),
        (options.method == "none", "reduction.method", "a family of links has a basis", "choose another method"),
        (options.form != "orthonormal", "reduction.form", "a family is one of orthonormal modes", "remove the field"),
        (description.matrices is not None, "matrices", "exported matrices have no parameters", "reduce them alone"),
        (
            description.temperature_change is not None,
            "temperature_change",
            "the expanded shape of a family is not known",
            "remove it, or reduce each link alone",
        ),
    ):
        if wrong:
            raise FEImportError(Cause.BAD_FIELD, message, where=f"{where}: {field}", remedy=remedy)


def _family(link: LinkFile, count: int) -> ParametricModel:
    samples = Samples(link)
    lower, upper = samples.bounds
    middle = reduce_link(samples.described((lower + upper) / 2))
    names = [i.name for i in middle.interface_nodes]
    inboard = names.index(link.description.reduction.inboard) if link.description.reduction.inboard else 0
    places, rng = training_places(lower, upper), np.random.default_rng(1)
    basis = CommonBasis(samples, inboard)
    error = 0.0
    for _ in range(_ROUNDS):
        basis.enrich(places, _BASIS)
        elastic = _modes_of_the_middle(samples.middle, basis.fields)
        moving = _moving(samples, places)
        grid = _interpolated(samples, elastic, moving)
        translation, rotation = _nodal(samples.middle, expanded(samples.middle, elastic))
        family = ParametricModel(
            link, middle, translation, rotation, _rows(samples.middle, moving), grid, Bound(0.0, 0.0, 0)
        )
        fresh = rng.uniform(lower, upper, (count, len(lower)))
        errors = np.array([_errors(family, basis, place) for place in np.concatenate([fresh, places])])
        error = float(errors.max())
        say(f"family of {elastic.shape[1]} fields, {grid.count} samples: off by {error:.1e} at most")
        if _MARGIN * error <= ACCURACY:
            frequencies, flexibility = np.maximum(_MARGIN * errors.max(axis=0), _LEAST).tolist()
            bound = Bound(frequencies, flexibility, count)
            return ParametricModel(link, middle, translation, rotation, family.moving, grid, bound)
        places = np.concatenate([places, fresh])
    raise FEImportError(
        Cause.BAD_FIELD,
        "no family of links is within its accuracy in these ranges",
        where=f"{link.path}: parameters",
        value=error,
        limit=ACCURACY / _MARGIN,
        remedy="narrow the ranges",
    )


def _errors(family: ParametricModel, basis: CommonBasis, place: Array) -> tuple[float, float]:
    arrays = family.grid.values(place)
    found = reduced_figures(arrays["mass"], arrays["stiffness"], family.interfaces(arrays), family.inboard)
    return basis.figures(place).errors(found)


def _modes_of_the_middle(model: FEModel, fields: Array) -> Array:
    """(f, k) the same span as mass-orthonormal modes of the free link in the middle."""
    mass, stiffness = model.reduced_matrices()
    _, ways = la.eigh(fields.T @ (mass @ fields), fields.T @ (stiffness @ fields))
    fields = fields @ ways[:, ::-1]
    return np.asarray(fields / np.sqrt(np.einsum("fk,fk->k", fields, mass @ fields)))


def _moving(samples: Samples, places: Array) -> IntArray:
    """Dofs that follow others in a way that depends on the parameters."""
    middle = samples.middle
    if middle.coupling is None:
        return np.zeros(0, dtype=np.int64)
    rows = np.zeros(middle.coupling.shape[0], dtype=bool)
    for place in places:
        off = abs(samples.model(place).coupling - middle.coupling)
        rows |= off.max(axis=1).toarray().ravel() > 1e-12 * abs(middle.coupling).max()
    return np.flatnonzero(rows)


def _rows(model: FEModel, dofs: IntArray) -> IntArray:
    """Rows of displacements of all nodes, then rotations of those that have them, of some dofs."""
    turning = model.dof_map[:, 3] >= 0
    order = np.concatenate([model.dof_map[:, :3].ravel(), model.dof_map[turning, 3:].ravel()])
    place = np.empty(len(order), dtype=np.int64)
    place[order] = np.arange(len(order))
    return place[dofs]


def _nodal(model: FEModel, fields: Array) -> tuple[Array, Array]:
    turning = model.dof_map[:, 3] >= 0
    return fields[model.dof_map[:, :3]], fields[model.dof_map[turning, 3:]]


def _interpolated(samples: Samples, elastic: Array, moving: IntArray) -> Interpolant:
    lower, upper = samples.bounds
    first = samples.arrays((lower + upper) / 2, elastic, moving)
    # fields scaled to the same energy, and the same mass, in the middle
    scales = {name: 1 / np.sqrt(np.diag(first[name])) for name in ("stiffness", "mass")}
    scales |= {"X": scales["mass"], "Z": scales["mass"]}
    scaled = {name: np.outer(s, s) for name, s in scales.items()}
    reach = float(np.abs(np.ptp(first["nodes"], axis=0)).max())

    def sample(place: Array) -> Arrays:
        found = samples.arrays(place, elastic, moving)
        return {name: part * scaled[name] if name in scaled else part for name, part in found.items()}

    def size(left: Arrays, found: Arrays) -> float:
        """By how much any squared frequency may be off, as a share; places of nodes, as a share of the link's size."""
        ratios = [la.eigh(left[name], found[name], eigvals_only=True) for name in ("stiffness", "mass")]
        return max(*(float(np.abs(r).max()) for r in ratios), float(np.abs(left["nodes"]).max(initial=0.0)) / reach)

    try:
        grid = interpolated(sample, size, lower, upper, _SURPLUS, _MOST_TERMS)
    except NotSmooth as problem:
        raise FEImportError(
            Cause.BAD_FIELD,
            f"{_MOST_TERMS} samples do not suffice for these ranges",
            where=f"{samples.link.path}: parameters",
            value=problem.left,
            limit=_SURPLUS,
            remedy="narrow the ranges, or have fewer parameters",
        ) from None
    parts = {name: part / scaled[name] if name in scaled else part for name, part in grid.parts.items()}
    for name in [*(["nodes"] if _constant(grid, "nodes") else []), *([] if len(moving) else ["moving"])]:
        del parts[name]
    return replace(grid, parts=parts)


def _constant(grid: Interpolant, name: str) -> bool:
    """Whether an array is the same everywhere."""
    change = np.tensordot(grid.mixing, grid.parts[name], 1)
    return bool(np.abs(change[1:]).max(initial=0.0) <= 1e-9 * np.abs(change[0]).max(initial=0.0))
