"""Integrators by name (`erls.scene.integrators`), loaded when they are asked for."""

from __future__ import annotations

from importlib import import_module
from typing import cast

from erls.integrate.base import Integrator
from erls.scene.integrators import INTEGRATORS


def integrator_named(name: str) -> Integrator:
    """The function of a registered integrator."""
    entry = INTEGRATORS[name]
    return cast(Integrator, getattr(import_module(entry.module), entry.function))
