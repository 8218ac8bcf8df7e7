"""Whether disturbances of a static start grow as soon as the joints are released."""

from __future__ import annotations

import numpy as np

from erls.equations.stability import start_stability
from erls.equations.substructures import solved
from erls.run.watches.base import NOTHING, Begun, Finding, Plan, Watch

_DOUBLED = float(np.log(2.0))  # growth over the run, from which on it is told


class GrowingDisturbances(Watch):
    """Looks at small motions about a static start near an equilibrium, by their rightmost root."""

    @staticmethod
    def concerns(plan: Plan) -> bool:
        """Static starts."""
        return plan.mechanism.static_start

    def begins(self, begun: Begun) -> Finding:
        """A disturbance that at least doubles within the run."""
        found = start_stability(solved(begun.formulation))
        if found is None or found.root is None or not found.near_equilibrium:
            return NOTHING
        return Finding(growth_warnings(found.root, begun.duration))


def growth_warnings(root: complex, duration: float) -> list[str]:
    """At most one: of the rightmost root [1/s] and the duration of the run [s]."""
    rate = root.real
    if not rate * duration > _DOUBLED:
        return []
    swings = f", swinging at {abs(root.imag) / (2 * np.pi):.3g} Hz" if root.imag else ""
    decades = rate * duration / np.log(10.0)
    return [
        f"the static start is unstable with the joints released: disturbances grow e-fold in {1 / rate:.3g} s "
        f"(root {rate:.4g} 1/s{swings}), 10^{decades:.1f} times within the run unless they grow large: whatever is not "
        "exactly in balance, down to rounding, decides how it moves; start it off the equilibrium on purpose (an "
        "initial position or rate), hold it by a drive or a spring, or end the run before"
    ]
