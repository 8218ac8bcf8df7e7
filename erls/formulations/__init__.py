"""Formulations of the equations of motion, and their registry."""

from __future__ import annotations

from collections.abc import Callable

from erls.formulations.base import Formulation, TreeFormulation
from erls.formulations.closed_chain import ClosedChain
from erls.formulations.closed_run import loop_integrator
from erls.formulations.erls import Erls
from erls.formulations.ffr import Ffr
from erls.formulations.ffr.absolute import absolute_generalized_alpha
from erls.integrators import INTEGRATORS
from erls.integrators.base import Integrator
from erls.mechanism.chain import Mechanism
from erls.scene import Simulation

FORMULATIONS: dict[str, Callable[[Mechanism, Simulation], TreeFormulation]] = {
    "erls": lambda mechanism, settings: Erls(mechanism, settings.gauge),
    "ffr": lambda mechanism, settings: Ffr(mechanism, settings.body_frame),
}


def formulate(mechanism: Mechanism, settings: Simulation) -> Formulation:
    """Equations of motion of a mechanism; of its chain, tied by its loops."""
    tree = FORMULATIONS[settings.formulation](mechanism, settings)
    return ClosedChain(tree) if mechanism.loops else tree


def integrator(mechanism: Mechanism, settings: Simulation) -> Integrator:
    """The integrator that the settings name, for chains, for loops, or for absolute coordinates."""
    if settings.coordinates == "absolute":
        return absolute_generalized_alpha
    return loop_integrator(settings.integrator) if mechanism.loops else INTEGRATORS[settings.integrator]


__all__ = ["FORMULATIONS", "Formulation", "formulate", "integrator"]
