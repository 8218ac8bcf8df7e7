"""What a run says against itself: the error that its own warnings foretell."""

from __future__ import annotations

import numpy as np

from erls.equations.quasi_static.formulation import QuasiStatic
from erls.run.chain.run import ChainRun
from erls.run.watches.deflection_range import NOTABLE, deflection_errors
from erls.run.watches.spin_stability import UNSTABLE
from erls.run.watches.static_following import static_error


def foretold_error(run: ChainRun, linear: bool) -> float:
    """Largest error [m] that a run warns of; infinite when a link loses stability, 0 when nothing is known.

    Parameters
    ----------
    run : ChainRun
    linear : bool
        Whether its judge shares what links lose by being linear in their own frames: estimates of that count then even
        where they are too small for a warning.
    """
    if any(UNSTABLE in text for text in run.warnings):
        return float("inf")
    links = {link.name: link.model.nodes for link in run.formulation.mechanism.links}
    found = [0.0]
    for name, deflection in deflection_errors(run).items():
        if linear or deflection.error > NOTABLE * float(np.linalg.norm(np.ptp(links[name], axis=0))):
            found.append(deflection.error)
    if run.certificate is not None and not run.certificate.ok:
        found.append(run.certificate.error)
    settings = run.scene.record.simulation
    if isinstance(run.formulation, QuasiStatic):
        static = static_error(run.formulation, run.solution)
        if static is not None and static.error > settings.effects_tolerance:
            found.append(static.error)
    return max(found)
