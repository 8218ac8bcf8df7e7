"""Formulations of the equations of motion, and their registry."""

from __future__ import annotations

from collections.abc import Callable

from erls.formulations.base import Formulation
from erls.formulations.erls import Erls
from erls.formulations.ffr import Ffr
from erls.mechanism.chain import Mechanism
from erls.scene import Simulation

FORMULATIONS: dict[str, Callable[[Mechanism, Simulation], Formulation]] = {
    "erls": lambda mechanism, settings: Erls(mechanism, settings.gauge),
    "ffr": lambda mechanism, settings: Ffr(mechanism, settings.body_frame),
}

__all__ = ["FORMULATIONS", "Formulation"]
