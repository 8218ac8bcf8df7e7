"""Whether the mass matrix of a run kept its sign: without the square of the deformation in it, it may not.

The kinetic energy of a link is a square, of which `inertia_first_order` is the mixed term and `inertia_second_order`
the last one. Without the latter, large deflections make a joint's inertia negative. Implicit steps may pass over that
without failing, and then show nonsense; or they fail, and name something else.
"""

from __future__ import annotations

import numpy as np

from erls.equations.formulation import Formulation
from erls.equations.substructures import solved
from erls.errors import Cause, SimulationError
from erls.integrate.base import Solution
from erls.run.watches.base import Ended, Finding, Plan, Watch

_LOOKS = 60
_ROUNDING = 1e-12
_VANISHED = 1e-6  # of what it was at the start: what explicit steps, ever smaller ones, do not pass
_VANISHING = 1e-3  # of the same: what a run ends at whose next step has met an indefinite matrix


class IndefiniteMass(Watch):
    """Looks at the mass matrix along the run."""

    @staticmethod
    def concerns(plan: Plan) -> bool:
        """Modal models with half of the kinetic energy of their deformation."""
        effects = plan.mechanism.effects
        return plan.modal and "inertia_first_order" in effects and "inertia_second_order" not in effects

    def after(self, ended: Ended) -> Finding:
        """SINGULAR_MASS, whatever else the run failed with."""
        return Finding(failure=indefinite_mass(ended.run.formulation, ended.run.solution))


def indefinite_mass(formulation: Formulation, solution: Solution) -> SimulationError | None:
    """What is wrong when the mass matrix is indefinite at any of some states of a run, or at its last one.

    Parameters
    ----------
    formulation : Formulation
    solution : Solution
        A run, which may have failed.

    Returns
    -------
    SimulationError or None
        SINGULAR_MASS.
    """
    system = solved(formulation)
    if not system.size:
        return None
    if solution.failure is not None and solution.failure.cause == Cause.INTERRUPTED:
        return None
    met = solution.failure is not None and solution.failure.cause == Cause.SINGULAR_MASS
    share = _VANISHING if met else _VANISHED if solution.failure is not None else 0.0
    first = 0.0
    for k in np.unique(np.linspace(0, len(solution.t) - 1, _LOOKS).astype(int)):
        mass = system.mass_matrix(float(solution.t[k]), solution.y[k])  # type: ignore[attr-defined]
        if not np.isfinite(mass).all():
            continue
        scale = 1 / np.sqrt(np.abs(np.diag(mass)))
        lowest = float(np.linalg.eigvalsh(scale[:, None] * mass * scale)[0])
        first = first or lowest
        ends = bool(share) and k == len(solution.t) - 1
        if lowest < (share * first if ends else -_ROUNDING):
            is_now = "is indefinite" if lowest <= 0 else "is about to turn indefinite"
            return SimulationError(
                Cause.SINGULAR_MASS,
                f"the mass matrix {is_now}: with 'inertia_first_order' but not 'inertia_second_order' the kinetic "
                "energy lacks the square of the deformation",
                where=f"t = {solution.t[k]:.6g} s",
                value=f"least eigenvalue {lowest:.3g}, scaled to a unit diagonal",
                limit="above 0" if lowest <= 0 else f"above {share * first:.3g}, as it was {first:.3g} at the start",
                remedy="keep 'inertia_second_order', or leave out both",
            )
    return None
