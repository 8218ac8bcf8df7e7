"""Formulations of the equations of motion, and their registry."""

from __future__ import annotations

from collections.abc import Callable

from erls.formulations.base import Formulation
from erls.formulations.erls import Erls
from erls.mechanism.chain import Mechanism

FORMULATIONS: dict[str, Callable[[Mechanism, str], Formulation]] = {"erls": Erls}

__all__ = ["FORMULATIONS", "Formulation"]
