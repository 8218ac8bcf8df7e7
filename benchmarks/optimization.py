"""Published robots and what comes out here, side by side: objective, diameters, analyses, processor time, more starts.

    python benchmarks/optimization.py [--starts N] [--optimizers] [--derivatives] [PROBLEM ...]

With --starts every method begins N times, first from 50 mm, then from diameters drawn between the bounds. With
--optimizers SciPy's methods are shown beside sequential convex programming. Deflections are also those of the published
designs, at every step. With --derivatives those of aggregates are held against central differences of runs, where a
problem asks for them, at its start.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np

import erls
from erls.optimization.aggregates import Aggregates
from erls.optimization.confirm import simulated
from erls.optimization.dynamics import Dynamics
from erls.optimization.evaluation import beside
from erls.optimization.memory import Memory
from erls.optimization.problem import load_problem
from erls.report.tables import table

DATA = Path(__file__).parents[1] / "data" / "optimization"
PUBLISHED = ("app1", "app1_inertial", "app2", "slide_robot", "four_bar")


def designs(name: str, changes: list[str], label: str = "") -> list[tuple[str, ...]]:
    """A row for each method, and for what is published of it."""
    begun = time.process_time()
    found = erls.optimize(DATA / f"{name}.toml", changes=changes, confirm=False)
    spent, rows = time.process_time() - begun, []
    for outcome in found.outcomes:
        x = [f"{1e3 * d:.2f}" for d in outcome.x]
        counts = f"{outcome.analyses}", f"{outcome.inner_iterations or ''}", f"{outcome.wall_s:.2f}"
        each = [outcome.objective, *(objective for objective, *_ in outcome.further)]
        spread = f"{(max(each) - min(each)) / min(each):.1e}" if outcome.further else ""
        rows.append((f"{name}{label}", outcome.method, f"{outcome.objective:.4f}", ", ".join(x), *counts, spread))
        known = found.problem.record.published.get(outcome.method)
        if known is not None:
            x = [f"{1e3 * d:.2f}" for d in known.variables.values()]
            counts = f"{known.analyses or ''}", f"{known.inner_iterations or ''}", ""
            rows.append(("", "  published", f"{known.objective:.4f}", ", ".join(x), *counts, ""))
    rows.append(("", "  processor time [s]", f"{spent:.2f}", "", "", "", "", ""))
    return rows


def published(name: str) -> list[tuple[str, ...]]:
    """Constraints of the published designs, over all steps."""
    problem, rows = load_problem(DATA / f"{name}.toml"), []
    for method, known in problem.record.published.items():
        x = np.array([known.variables[variable] for variable in problem.names])
        found = simulated(problem, x, lambda text: None)
        for constraint in problem.record.constraints:
            share = found.values[constraint.name] / (constraint.limit or 1.0)
            rows.append((name, method, constraint.name, f"{share:.4f}", f"{found.times[constraint.name]:.4f}"))
    return rows


def derivatives(name: str, share: float = 1e-4) -> tuple[str, ...]:
    """Of logarithms, at the start: largest difference over the largest derivative of the same value.

    Runs iterate to 1e-9, since at their usual tolerance differences of them have noise of 1e-4.
    """
    problem = load_problem(DATA / f"{name}.toml", ['set=["simulation.tolerance=1e-9"]'])
    seen = Aggregates(Dynamics(problem, Memory(problem)))

    def values(x: np.ndarray) -> np.ndarray:
        return np.concatenate([c[:, 0] for c in seen.evaluate(x).components])

    start = problem.start
    exact = np.concatenate([j[:, 0] for j in seen.differentiate(seen.evaluate(start)).jacobians])
    sides = beside(start, problem.upper - problem.lower, share)
    expected = np.stack([(values(above) - values(below)) / (2 * step) for above, below, step in sides], axis=1)
    apart, size = np.abs((exact - expected) * start).max(axis=1), np.abs(exact * start).max(axis=1)
    return name, str(len(start)), f"{(apart / size).max():.1e}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("problems", nargs="*", default=PUBLISHED)
    parser.add_argument("--starts", type=int, default=1)
    parser.add_argument("--optimizers", action="store_true")
    parser.add_argument("--derivatives", action="store_true")
    asked = parser.parse_args()
    rows: list[tuple[str, ...]] = []
    for name in asked.problems:
        rows += designs(name, [f"settings.starts={asked.starts}"])
        for optimizer in ("slsqp", "trust-constr") if asked.optimizers else ():
            rows += designs(name, [f'settings.optimizer="{optimizer}"'], f", {optimizer}")
    head = "problem", "method", "objective", "variables / 1000", "analyses", "inner", "wall [s]", "spread"
    print(table(head, rows))
    if asked.derivatives:
        rows = [derivatives(name) for name in asked.problems if name == "three_link"]
        print("\nDerivatives of aggregates, backward over the run\n")
        print(table(("problem", "variables", "largest relative difference"), rows))
    rows = [row for name in asked.problems if name in PUBLISHED[:4] for row in published(name)]
    if rows:
        print("\nPublished designs, simulated here\n")
        print(table(("problem", "method", "constraint", "of its limit", "at t [s]"), rows))


if __name__ == "__main__":
    main()
