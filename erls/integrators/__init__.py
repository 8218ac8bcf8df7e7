"""The registry of integrators; `erls.integrators.base` states the contract for the next member."""

from __future__ import annotations

from erls.integrators.automatic import automatic
from erls.integrators.base import Integrator

# the underscores keep the modules of those names reachable
from erls.integrators.generalized_alpha import generalized_alpha as _generalized_alpha
from erls.integrators.lobatto import lobatto as _lobatto
from erls.integrators.scipy_ivp import scipy_method

INTEGRATORS: dict[str, Integrator] = {
    "generalized_alpha": _generalized_alpha,
    "lobatto": _lobatto,
    "auto": automatic,
    "rk45": scipy_method("rk45"),
    "dop853": scipy_method("dop853"),
    "radau": scipy_method("radau"),
    "bdf": scipy_method("bdf"),
    "lsoda": scipy_method("lsoda"),
}

FIXED_STEP = "generalized_alpha"
"""The one for steps that the user gives, and for coordinates that conditions tie."""

KERNELS: dict[str, str] = {
    "generalized_alpha": "erls.kernels.stepping.generalized_alpha",
    "lobatto": "erls.kernels.stepping.lobatto",
    "auto": "erls.kernels.stepping.lobatto",
}
"""Modules with the compiled loops of integrators that have one."""

DESCRIPTIONS: dict[str, str] = {
    "generalized_alpha": "implicit, order 2, fixed steps, numerical damping of unresolved modes",
    "lobatto": "implicit, order 6, adaptive to `tolerance`, no numerical damping: for accuracy at low cost",
    "auto": "lobatto for stiff and for compiled systems, dop853 for soft ones; says which",
    "rk45": "explicit, order 5, adaptive: for soft mechanisms and moderate accuracy",
    "dop853": "explicit, order 8, adaptive: for soft mechanisms and references",
    "radau": "implicit, order 5, adaptive, damps unresolved modes: for references of stiff mechanisms",
    "bdf": "implicit, order 1 to 5, adaptive; poor at undamped vibration",
    "lsoda": "switches between explicit Adams and implicit BDF, adaptive",
}
