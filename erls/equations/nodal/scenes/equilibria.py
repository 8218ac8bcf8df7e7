"""Equilibria that a scene asks for: over load steps, or along their path."""

from __future__ import annotations

from erls.equations.nodal.assembly import NodalSystem
from erls.equations.nodal.path import PathOptions, follow_path
from erls.equations.nodal.statics import Statics, solve_statics
from erls.scene.bodies.analyses import AtRest, Buckling, Continuation, Frequencies, StaticSteps


def equilibria(system: NodalSystem, analysis: AtRest) -> Statics:
    """From where the system is built on."""
    if isinstance(analysis, Continuation):
        options = PathOptions(analysis.load, analysis.load_steps, analysis.most_steps, analysis.branch)
        return follow_path(system, system.start, options)
    end = analysis.load if isinstance(analysis, (Buckling, Frequencies)) else 1.0
    search = isinstance(analysis, StaticSteps) and analysis.line_search
    return solve_statics(system, system.start, analysis.load_steps, analysis.tangent, end=end, line_search=search)
