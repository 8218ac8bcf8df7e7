"""The mesh of a run whose links are beam elements, nodes as coordinates: from a run on a finer one.

Elements of constant strain err at second order in their length, so that a mesh with twice the elements is closer by
three quarters of the error. It is run with steps twice as large: what these change is in the distance, to the safe
side.
"""

from __future__ import annotations

from dataclasses import replace

from erls.accuracy.judged_places import judged_nodes
from erls.accuracy.other_run import distance_from, other_run
from erls.equations.nodal.equations import Nodal
from erls.integrate.base import Solution
from erls.integrate.choice import options_of
from erls.integrate.step_plans import Plan, finer, plan_like
from erls.run.chain.run import ChainRun

FINER = 2
"""Elements in place of each."""

SHARE = 1.8 * FINER**2 / (FINER**2 - 1)
"""Of the distance from a run on the finer mesh: the error by its order, and a margin."""

_LARGER = 2.0  # steps


def mesh_error(run: ChainRun) -> tuple[float | None, str]:
    """Error of named points by the mesh [m], None where the finer one cannot be run, and why.

    Parameters
    ----------
    run : ChainRun
        Of nodal elements.

    Raises
    ------
    SimulationError
        INTERRUPTED.
    """
    assert isinstance(run.formulation, Nodal)
    options = replace(options_of(run.scene.record.simulation), output_step=None)
    refined = run.formulation.refined(FINER)
    found = other_run(run, refined, options, plan=larger_steps(run.solution))
    if found is None:
        return None, "a run with twice the elements fails; give links more elements"
    return float(SHARE * distance_from(run, judged_nodes(run), refined, found)[1][-1]), ""


def larger_steps(solution: Solution) -> Plan:
    """For the finer mesh: those of a run, of which not all need be kept, but larger."""
    plan = plan_like(solution.t)
    return finer(plan, solution.work.steps / (_LARGER * sum(stretch.steps for stretch in plan)))
