"""The integrators that a scene can name: the registry, with where each is defined, so that naming one loads nothing.

`erls.integrate.base` states the contract for the next member; `erls.integrate.registry` loads them.
"""

from __future__ import annotations

from typing import NamedTuple


class Entry(NamedTuple):
    """An integrator: its module and function, what it is, the module of its compiled loop where it has one, and whether
    its steps follow ``tolerance``, whatever ``step`` says.
    """

    module: str
    function: str
    description: str
    kernels: str | None = None
    follows_tolerance: bool = False


_ALPHA, _LOBATTO, _SCIPY = "erls.integrate.generalized_alpha", "erls.integrate.lobatto", "erls.integrate.scipy_ivp"
_ALPHA_LOOP, _LOBATTO_LOOP = "erls.integrate.stepping.generalized_alpha", "erls.integrate.stepping.lobatto"

INTEGRATORS: dict[str, Entry] = {
    "generalized_alpha": Entry(
        _ALPHA,
        "generalized_alpha",
        "implicit, order 2, fixed steps, numerical damping of unresolved modes",
        _ALPHA_LOOP,
    ),
    "lobatto": Entry(
        _LOBATTO,
        "lobatto",
        "implicit, order 6, adaptive to `tolerance`, no numerical damping: for accuracy at low cost",
        _LOBATTO_LOOP,
        follows_tolerance=True,
    ),
    "auto": Entry(
        "erls.integrate.automatic",
        "automatic",
        "lobatto for stiff and for compiled systems, dop853 for soft ones; says which",
        _LOBATTO_LOOP,
        follows_tolerance=True,
    ),
    "rk45": Entry(_SCIPY, "rk45", "explicit, order 5, adaptive: for soft mechanisms and moderate accuracy"),
    "dop853": Entry(_SCIPY, "dop853", "explicit, order 8, adaptive: for soft mechanisms and references"),
    "radau": Entry(
        _SCIPY, "radau", "implicit, order 5, adaptive, damps unresolved modes: for references of stiff mechanisms"
    ),
    "bdf": Entry(_SCIPY, "bdf", "implicit, order 1 to 5, adaptive; poor at undamped vibration"),
    "lsoda": Entry(_SCIPY, "lsoda", "switches between explicit Adams and implicit BDF, adaptive"),
}

FIXED_STEP = "generalized_alpha"
"""The one for steps that the user gives, and for coordinates that conditions tie."""

MATRICES = ("auto", "update", "frozen")
STARTS = ("zero", "last")
"""Settings of iterations with constraints, see `erls.integrate.constrained.ConstrainedOptions`."""
