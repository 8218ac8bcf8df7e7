"""What ``output_step`` leaves of a run, and whether motion between the stored states can be told from them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from erls.equations.serial.state_series import state_series
from erls.errors import SimulationError
from erls.integrate.base import hermite
from erls.integrate.choice import INTEGRATION_SHARE
from erls.integrate.thinning import output_step
from erls.maths.so3 import Array
from erls.run.chain.places import node_positions
from erls.run.chain.run import ChainRun
from erls.run.watches.base import NOTHING, Ended, Finding, Plan, Watch

IntArray = NDArray[np.int64]

_PLACES = 40
_MARGIN = 2.0  # times what is found at some places: the largest over all times lies above
_ORDER = 64  # halving the distance of knots divides the error of quintic interpolation by as much, once it resolves


class StoredOutput(Watch):
    """Looks at stored states."""

    @staticmethod
    def concerns(plan: Plan) -> bool:
        """Runs that do not store every step."""
        return plan.settings.output_step is not None

    def after(self, ended: Ended) -> Finding:
        """That motion between them is not resolved."""
        return NOTHING if ended.meaningless else Finding(output_warnings(ended.run))


def output_error(run: ChainRun) -> float:
    """Largest distance of points (interfaces, where none are named) from interpolation between stored states [m].

    It is estimated at some of these, from interpolation without them and, over twice the distance, without their
    neighbours; 0 where all steps were kept.
    """
    apart = output_step(run.scene.record.simulation)
    t = run.solution.t
    if apart is None or len(t) < 5:
        return 0.0
    even = np.abs(np.diff(t) - apart) <= 1e-6 * apart
    middles = np.flatnonzero(even[:-3] & even[1:-2] & even[2:-1] & even[3:]) + 2
    if not len(middles):
        return 0.0
    middles = middles[np.unique(np.linspace(0, len(middles) - 1, _PLACES).astype(np.int64))]
    try:
        with np.errstate(all="ignore"):  # a run that failed may hold anything
            stored, near, far = (_places(run, middles, reach) for reach in (0, 1, 2))
    except (SimulationError, np.linalg.LinAlgError):
        return 0.0
    twice, fourfold = (float(np.linalg.norm(x - stored, axis=-1).max(initial=0.0)) for x in (near, far))
    if not 0 < twice < np.inf:
        return 0.0
    shrinks = float(np.clip(twice / fourfold, 1 / _ORDER, 1.0)) if 0 < fourfold < np.inf else 1.0
    return _MARGIN * twice * shrinks


def output_warnings(run: ChainRun) -> list[str]:
    """At most one: between stored states motion is not resolved to the tolerance of the scene."""
    settings = run.scene.record.simulation
    found = output_error(run)
    if found <= INTEGRATION_SHARE * settings.tolerance:
        return []
    return [
        f"simulation.output_step = {settings.output_step:.4g} s: between stored states, {output_step(settings):.4g} s "
        f"apart, interpolation is off by about {found:.2g} m; states, events, energies and warnings do not suffer: "
        "ask at its multiples, or give a smaller one"
    ]


def _places(run: ChainRun, middles: IntArray, reach: int) -> Array:
    """(k, p, 3) positions of points at some knots, interpolated from those ``reach`` before and after; 0 for their own.
    """
    s = run.solution
    found = []
    for k in middles.tolist():
        ends = [k - reach, k + reach] if reach else [k]
        found.append([x[0] for x in hermite(s.t[ends], s.y[ends], s.v[ends], s.a[ends], s.t[[k]])])
    y, v = (np.array(part) for part in zip(*found, strict=True))
    states, mechanism = state_series(run.formulation, s.t[middles], y, v), run.formulation.mechanism
    nodes = [(p.link, np.array([p.node])) for p in mechanism.points] or [
        (k, np.array([i.node for i in link.model.interface_nodes])) for k, link in enumerate(mechanism.links)
    ]
    return np.concatenate([node_positions(mechanism, states, *own) for own in nodes], axis=1)
