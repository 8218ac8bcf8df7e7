"""Derivatives of modal models by numbers of their link descriptions.

Reductions at a few values of a number, in coordinates whose shapes are held (`fe_import.modal.held_shapes`), are smooth
in it, and differences of fourth order right to about 1e-9. The number of modes holds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fe_import.description.link import LinkFile, load_link, with_numbers
from fe_import.description.numbers import number_in, tables_of
from fe_import.errors import Cause, FEImportError
from fe_import.modal.equal_frequencies import KEPT_WHOLE
from fe_import.modal.held_shapes import arrays_in, nearest_shapes
from fe_import.modal.model import ModalModel
from fe_import.model import Array
from fe_import.reduce import reduce_link

Stencil = tuple[tuple[int, float], ...]
"""Steps and weights of a difference."""

STENCILS: tuple[Stencil, ...] = (
    ((-2, 1 / 12), (-1, -2 / 3), (1, 2 / 3), (2, -1 / 12)),
    ((0, -25 / 12), (1, 4.0), (2, -3.0), (3, 4 / 3), (4, -1 / 4)),
    ((0, 25 / 12), (-1, -4.0), (-2, 3.0), (-3, -4 / 3), (-4, 1 / 4)),
)
"""Of fourth order: central, and to one side where the other is refused (a negative mass)."""

STEP = 1e-3
"""Of the size of a parameter: rounding takes 1e-13 of what is differenced, the fifth derivative 1e-13 of itself."""

_SMOOTH = 1e-3  # of stiffness per size of the parameter: what differences of steps in the ratio two may be apart by
_TURNED = 0.01  # by which shapes may lose of their size: the space of modes turns by less than a seventh
_CHOOSES = "it chooses modes, which change by jumps"


@dataclass(frozen=True)
class ModalDerivatives:
    """A modal model, and derivatives of its arrays by a number of its description.

    Attributes
    ----------
    model : ModalModel
    key : str
    value : float
        At which they are taken.
    arrays : dict of str to array
        Derivatives in coordinates whose shapes are held, by the names of `fe_import.modal.held_shapes.arrays_in`.
    """

    model: ModalModel
    key: str
    value: float
    arrays: dict[str, Array]


def modal_derivatives(link: LinkFile | Path | str, key: str, size: float | None = None) -> ModalDerivatives:
    """Derivatives of every array of a modal model by a number of the description of its link.

    Parameters
    ----------
    link : LinkFile, Path or str
        A description that asks for the orthonormal form.
    key : str
        Dotted: ``sections.bar.width``, ``materials.steel.density``, ``frame.nodes.tip.0``.
    size : float, optional
        A change that is large; the number itself unless given.

    Raises
    ------
    FEImportError
        No such number; a value beside it is refused; the modes that are kept are cut between equal frequencies.

    Examples
    --------
    >>> from fe_import import modal_derivatives
    >>> found = modal_derivatives("data/robot/links/arm.toml", "materials.aluminium.youngs_modulus")
    >>> stiffness = found.model.stiffness[6:, 6:]
    >>> bool(abs(7e10 * found.arrays["stiffness"][6:, 6:] - stiffness).max() < 1e-9 * stiffness.max())
    True
    """
    given = link if isinstance(link, LinkFile) else load_link(link)
    value = number_at(given, key)
    if given.description.reduction.form != "orthonormal":
        message, remedy = "derivatives are those of orthonormal form", "reduce with form = 'orthonormal'"
        raise FEImportError(Cause.BAD_FIELD, message, where=f"{given.path}: reduction.form", remedy=remedy)
    step = STEP * (size or abs(value) or 1.0)
    model = reduce_link(given)
    problems = []
    for stencil in STENCILS:
        try:
            models = [reduce_link(with_numbers(given, {key: value + at * step})) if at else model for at, _ in stencil]
        except FEImportError as problem:
            problems.append(problem)
            continue
        turns = held(models, model, f"{given.path}: {key}")
        parts = [arrays_in(own, turn) for own, turn in zip(models, turns, strict=True)]
        weights = [weight / step for _, weight in stencil]
        arrays = {
            name: np.asarray(sum(w * part[name] for w, part in zip(weights, parts, strict=True))) for name in parts[0]
        }
        return ModalDerivatives(model, key, value, arrays)
    raise problems[0]


def held(models: Sequence[ModalModel], base: ModalModel, where: str) -> list[Array]:
    """(m, m) T of reductions at the values of one of `STENCILS`, of which the shapes of another one are held.

    Raises
    ------
    FEImportError
        MODE_COUNT: other numbers of modes, or modes that do not change smoothly: they are cut between neighbours whose
        frequencies change places. Names these. BAD_FIELD: the steps of differences are no small changes.
    """
    named = base.provenance.get(KEPT_WHOLE, "") or f"the last one kept has {base.frequencies_hz[-1]:.6g} Hz"
    remedy = "ask for a number of elastic modes that leaves a gap of frequency behind the last one"
    for model in models:
        if model.modes != base.modes:
            raise FEImportError(
                Cause.MODE_COUNT,
                f"the number of modes changes beside this value, as modes of equal frequency part or meet: {named}",
                where=where,
                value=model.elastic_modes,
                limit=f"{base.elastic_modes} elastic modes",
                remedy=remedy,
            )
    turns = [nearest_shapes(model, base) for model in models]
    lost = [float(np.abs(np.linalg.svd(turn, compute_uv=False) - 1).max()) for turn in turns]
    if not max(lost) <= _TURNED:
        raise FEImportError(
            Cause.BAD_FIELD,
            "modes beside this value are those of another link: the steps of differences are too large",
            where=where,
            value=f"shapes lose {max(lost):.2g} of their size",
            limit=_TURNED,
            remedy="tell about how large a change of the parameter is large, if its value is zero; "
            "or ask for a number of elastic modes that leaves a gap of frequency behind the last one",
        )
    if len(models) == len(STENCILS[0]) and base.elastic_modes:
        near = [(turn.T @ model.stiffness @ turn)[6:, 6:] for model, turn in zip(models, turns, strict=True)]
        fine, coarse = near[2] - near[1], (near[3] - near[0]) / 2
        scale = np.sqrt(np.outer(np.diag(base.stiffness)[6:], np.diag(base.stiffness)[6:]))
        if not np.abs((fine - coarse) / scale).max() <= _SMOOTH * STEP:
            raise FEImportError(
                Cause.MODE_COUNT,
                "the modes that are kept do not change smoothly: they are cut between neighbours of nearly equal "
                f"frequency, which change places: {named}",
                where=where,
                value=f"{base.elastic_modes} elastic modes",
                remedy=remedy,
            )
    return turns


def number_at(link: LinkFile, key: str) -> float:
    """The number of a description that a dotted key names.

    Raises
    ------
    FEImportError
        There is none, or it chooses modes.
    """
    where = f"{link.path}: {key}"
    if key.split(".")[0] == "reduction":
        message = f"nothing can be differentiated by a field of reduction: {_CHOOSES}"
        raise FEImportError(Cause.BAD_FIELD, message, where=where, value=key, remedy="name another field")
    return number_in(tables_of(link.description), key, where, FEImportError)
