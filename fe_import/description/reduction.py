"""The ``reduction`` table of a link description: its fields, their defaults, and what they must satisfy."""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import Any

import msgspec

from fe_import.errors import Cause, FEImportError
from fe_import.files.toml import choose

MOST_MODES = 100_000  # no machine keeps more; a larger number is a slip
COMPONENTS = ("ux", "uy", "uz", "rx", "ry", "rz")
TRUNCATIONS = ("free-free", "clamped")
FORMS = ("orthonormal", "physical")
SELECTIONS = {  # and the fields that belong to each
    "lowest": ("fixed_interface_modes", "free_modes"),
    "frequency": ("frequency_limit",),
    "effective-mass": ("effective_mass",),
    "ranking": ("ranking",),
}


class Ranking(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """What fixed-interface modes are ranked for.

    Attributes
    ----------
    driving : list of str
        Components of interfaces that are accelerated, as ``"hub.ry"``: ``ux``, ``uy``, ``uz``, ``rx``, ``ry``, ``rz``.
    observed : list of str
        Components of interfaces or named nodes whose motion matters, as ``"tip.uz"``.
    count : int
        Modes to keep.
    """

    driving: list[str]
    observed: list[str]
    count: int


class Reduction(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """How the model is reduced.

    A method first spans a basis, some of it by vibration modes (the candidates, which ``selection`` chooses); the
    basis is then orthonormalized, and ``elastic_modes`` of it are kept.

    Attributes
    ----------
    method : str
        ``craig-bampton``, ``craig-chang``, ``guyan``, ``mode-displacement``, or ``none`` (all nodal dofs kept:
        ERLS-FEM).
    fixed_interface_modes : int, optional
        Modes with clamped interfaces in the Craig-Bampton basis; 12, or all there are if fewer, unless given.
    elastic_modes : int, optional
        Elastic modes kept after orthonormalization; all unless given.
    truncation : str
        Which modes are kept when there are more: the lowest ``free-free`` ones, or the span of the lowest with the
        inboard interface ``clamped`` (converges faster once a joint holds that interface).
    inboard : str
        The interface that ``truncation = "clamped"`` clamps, and that displacements of second order are counted from;
        the first unless given.
    form : str
        ``orthonormal``, or ``physical`` (interface displacements kept as coordinates; for other programs).
    static_correction : bool
        The elastic modes kept span the static response to unit loads at the interfaces and to the inertia of
        rigid-body accelerations, whichever interface holds the link: six per interface. The lowest modes of
        ``truncation`` fill the rest. The Craig-Bampton basis is completed by the static response to that inertia.
        What moves no mass (rotations of lumped masses without rotary inertia) no mode can hold: the health report
        then shows how much of the static flexibility is lost.
    free_modes : int, optional
        Elastic modes of the free link in the bases of ``craig-chang`` and ``mode-displacement``; 12, or all there are
        if fewer, unless given.
    selection : str
        Which candidates (fixed-interface modes, or free modes) enter the basis: the ``lowest`` by count; all below a
        ``frequency``; as many fixed-interface modes as carry an ``effective-mass``; or the first of a ``ranking``.
    frequency_limit : float, optional
        In Hz, of ``selection = "frequency"``.
    effective_mass : float, optional
        Share of the mass that fixed-interface modes can carry at all, to be reached in every rigid-body direction in
        which there is some; 0.9 unless given.
    ranking : Ranking, optional
        Of ``selection = "ranking"``: what the modes are ranked for.
    """

    method: str = "craig-bampton"
    fixed_interface_modes: int | None = None
    elastic_modes: int | None = None
    truncation: str = "free-free"
    inboard: str = ""
    form: str = "orthonormal"
    static_correction: bool = False
    free_modes: int | None = None
    selection: str = "lowest"
    frequency_limit: float | None = None
    effective_mass: float | None = None
    ranking: Ranking | None = None


def _fail(where: str, message: str, value: Any = None, remedy: str = "", limit: Any = None) -> FEImportError:
    return FEImportError(Cause.BAD_FIELD, message, where=where, value=value, limit=limit, remedy=remedy)


def check_reduction_options(options: Reduction, interfaces: Collection[str], where: str) -> None:
    """The conditions that the types cannot state; those of one method are its own.

    Parameters
    ----------
    options : Reduction
    interfaces : collection of str
        Names of the link's interfaces.
    where : str
        File and table, for messages.

    Raises
    ------
    FEImportError
        BAD_FIELD, or BAD_REFERENCE to an interface that is not there.
    """
    for field in ("fixed_interface_modes", "free_modes", "elastic_modes"):
        value = getattr(options, field)
        if value is not None and value < 0:
            raise _fail(f"{where}.{field}", "a mode count cannot be negative", value, "give 0 or more")
        if value is not None and value > MOST_MODES:
            raise _fail(f"{where}.{field}", "too many modes", value, "ask for fewer", MOST_MODES)
    for field, choices in (("truncation", TRUNCATIONS), ("form", FORMS), ("selection", tuple(SELECTIONS))):
        if getattr(options, field) not in choices:
            raise _fail(f"{where}.{field}", "unknown choice", getattr(options, field), "one of " + ", ".join(choices))
    if options.inboard:
        choose(options.inboard, sorted(interfaces), f"{where}.inboard")
    if options.form == "physical":
        _check_physical(options, where)
    _check_selection(options, interfaces, where)


def _check_physical(options: Reduction, where: str) -> None:
    """The physical form keeps the basis as it is."""
    defaults = Reduction()
    for field in ("elastic_modes", "static_correction", "truncation", "inboard"):
        value = getattr(options, field)
        if value != getattr(defaults, field):
            message = "the physical form keeps the interface displacements and all fixed-interface modes"
            raise _fail(f"{where}.{field}", message, value, "remove it, or use form = 'orthonormal'")


def _check_selection(options: Reduction, interfaces: Collection[str], where: str) -> None:
    for selection, fields in SELECTIONS.items():
        for field in fields:
            value = getattr(options, field)
            if value is not None and selection != options.selection:
                message = f"this field belongs to selection = '{selection}'"
                remedy = f"remove it, or use selection = '{selection}'"
                raise _fail(f"{where}.{field}", message, msgspec.to_builtins(value), remedy)
    limit, share = options.frequency_limit, options.effective_mass
    if options.selection == "frequency" and limit is None:
        raise _fail(f"{where}.frequency_limit", "selection = 'frequency' needs a limit", remedy="give it in Hz")
    if limit is not None and not (math.isfinite(limit) and limit > 0):
        raise _fail(f"{where}.frequency_limit", "a frequency limit must be positive", limit, "give it in Hz, above 0")
    if share is not None and not 0 < share < 1:
        raise _fail(f"{where}.effective_mass", "a share of the mass is between 0 and 1", share, "give 0.9, say")
    if options.selection == "ranking":
        _check_ranking(options.ranking, interfaces, f"{where}.ranking")


def _check_ranking(ranking: Ranking | None, interfaces: Collection[str], where: str) -> None:
    if ranking is None:
        raise _fail(where, "selection = 'ranking' needs what to rank for", remedy="give driving, observed and count")
    if not 0 < ranking.count <= MOST_MODES:
        raise _fail(f"{where}.count", "mode count out of range", ranking.count, "give 1 or more", MOST_MODES)
    for field in ("driving", "observed"):
        entries = getattr(ranking, field)
        if not entries:
            raise _fail(f"{where}.{field}", "nothing to rank for", remedy="name a component, as 'hub.ry'")
        for entry in entries:
            name, _, component = entry.rpartition(".")
            if not name:
                raise _fail(
                    f"{where}.{field}", "not a component of a node", entry, "give 'NAME.COMPONENT', as 'hub.ry'"
                )
            choose(component, COMPONENTS, f"{where}.{field}")
            if field == "driving":
                choose(name, sorted(interfaces), f"{where}.{field}")
