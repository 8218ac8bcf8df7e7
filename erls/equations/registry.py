"""Formulations of the equations of motion, and the systems that a mechanism makes of them: their registries.

A formulation is one line in `TREES`, or, where its coordinates are not independent, in `FORMULATIONS`. What a mechanism
holds beyond a tree of links (links in pieces, loops, modes that follow statically) is put around a tree's equations by
a kind of system: one line in `SYSTEMS`, and one in `erls.integrate.choice.INTEGRATIONS`, which says how it is solved.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from erls.equations.formulation import Formulation, TreeFormulation
from erls.equations.loops.closed_chain import ClosedChain
from erls.equations.loops.closed_start import ClosedStart, closed_start
from erls.equations.substructures import Substructured
from erls.mechanism.chain import Mechanism
from erls.mechanism.substructures import is_split, split
from erls.mechanism.without_effects import with_rigid
from erls.scene.settings import Simulation


def _erls(mechanism: Mechanism, settings: Simulation) -> TreeFormulation:
    if settings.gauge == "minimum-norm":
        from erls.equations.erls.paper.dense_chain import DenseChain  # here: a run imports what it needs

        return DenseChain(mechanism, settings.gauge)
    from erls.equations.erls.formulation import Erls

    return Erls(mechanism)


def _ffr(mechanism: Mechanism, settings: Simulation) -> TreeFormulation:
    from erls.equations.ffr.formulation import Ffr

    return Ffr(mechanism, settings.body_frame)


def _nodal(mechanism: Mechanism, settings: Simulation) -> Formulation:
    from erls.equations.nodal.equations import Nodal
    from erls.equations.nodal.parts import BeamRules

    rules = BeamRules(settings.residual_bending_flexibility, settings.inertia_interpolation == "linear")
    start = closed_start_of(mechanism) if mechanism.loops else None
    return Nodal(mechanism, settings.elements_per_member, start, rules=rules)


def share(formulation: Formulation, known: Formulation) -> None:
    """Have a formulation take over what another one has made, as far as they are alike and of a kind that can."""
    take = getattr(formulation, "share", None)
    if take is not None and type(formulation) is type(known):
        take(known)


def closed_start_of(mechanism: Mechanism) -> ClosedStart:
    """Of the same mechanism with rigid links."""
    from erls.equations.erls.formulation import Erls

    rigid = with_rigid(mechanism, {link.name for link in mechanism.links})
    return closed_start(ClosedChain(Erls(rigid)))


TREES: dict[str, Callable[[Mechanism, Simulation], TreeFormulation]] = {
    "erls": _erls,
    "ffr": _ffr,
}
"""In independent coordinates, on modal models."""

FORMULATIONS: dict[str, Callable[[Mechanism, Simulation], Formulation]] = {
    **TREES,
    "nodal": _nodal,
}


class System(NamedTuple):
    """A kind of system: whether a mechanism, as the settings say, is one, and what makes its equations."""

    applies: Callable[[Mechanism, Simulation], bool]
    formulate: Callable[[Mechanism, Simulation], Formulation]


def _plain(mechanism: Mechanism, settings: Simulation) -> Formulation:
    return FORMULATIONS[settings.formulation](mechanism, settings)


def _pieces(mechanism: Mechanism, settings: Simulation) -> Formulation:
    parts = split(mechanism)
    return Substructured(formulate(parts.pieces, settings), parts)


def _tied(mechanism: Mechanism, settings: Simulation) -> Formulation:
    return ClosedChain(TREES[settings.formulation](mechanism, settings))


def _quasi_static(mechanism: Mechanism, settings: Simulation) -> Formulation:
    from erls.equations.quasi_static.formulation import quasi_static

    build = TREES[settings.formulation]
    return quasi_static(lambda given: build(given, settings), mechanism, settings.duration)


SYSTEMS: dict[str, System] = {
    "nodal": System(lambda mechanism, settings: settings.formulation not in TREES, _plain),
    "pieces": System(lambda mechanism, settings: is_split(mechanism), _pieces),
    "loops": System(lambda mechanism, settings: bool(mechanism.loops), _tied),
    "quasi-static": System(lambda mechanism, settings: mechanism.bandwidth is not None, _quasi_static),
    "absolute": System(lambda mechanism, settings: settings.coordinates == "absolute", _plain),
    "tree": System(lambda mechanism, settings: True, _plain),
}
"""The first that applies is the one: frames of nodes hold pieces and loops themselves, pieces may be tied by loops."""


def system_of(mechanism: Mechanism, settings: Simulation) -> str:
    """The kind of system that a mechanism is, as the settings say: a key of `SYSTEMS`."""
    return next(name for name, system in SYSTEMS.items() if system.applies(mechanism, settings))


def formulate(mechanism: Mechanism, settings: Simulation) -> Formulation:
    """Equations of motion of a mechanism; of its chain, tied by its loops; of the pieces of links that are split; with
    modes above a bandwidth that follow statically.
    """
    return SYSTEMS[system_of(mechanism, settings)].formulate(mechanism, settings)
