"""Published robots and what comes out here, side by side: objective, diameters, analyses, processor time, more starts.

    python benchmarks/optimization.py [--starts N] [--optimizers] [--derivatives] [PROBLEM ...]

All three methods are shown of every problem, with the processor time that each takes once compiled, confirmations
apart. With --starts every method begins N times, first from 50 mm, then from diameters drawn between the bounds; times
are then the mean of these. With
--optimizers SciPy's methods are shown beside sequential convex programming. Deflections and stresses of the published
designs and of ours are those at every step. With --derivatives those of aggregates are held against central differences
of runs, where a problem asks for them, at its start.
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
METHODS = ("esl-component", "esl-system", "integrated")
WARM = ("settings.most_analyses=2", "settings.starts=1")


def designs(name: str, changes: list[str], label: str = "") -> tuple[list[tuple[str, ...]], dict[str, np.ndarray]]:
    """A row for each method and for what is published of it; and the designs."""
    rows: list[tuple[str, ...]] = []
    found: dict[str, np.ndarray] = {}
    own = load_problem(DATA / f"{name}.toml").record
    methods = METHODS if name in PUBLISHED else own.settings.methods
    for method in methods:
        given = [*changes, f'settings.methods=["{method}"]']
        erls.optimize(DATA / f"{name}.toml", changes=[*given, *WARM], confirm=False)
        begun = time.process_time()
        (outcome,) = erls.optimize(DATA / f"{name}.toml", changes=given, confirm=False).outcomes
        spent = f"{(time.process_time() - begun) / (1 + len(outcome.further)):.2f}"
        found[method] = outcome.x
        x = ", ".join(f"{1e3 * d:.2f}" for d in outcome.x)
        counts = f"{outcome.analyses}", f"{outcome.inner_iterations or ''}", spent, f"{outcome.residual:.0e}"
        each = [outcome.objective, *(objective for objective, *_ in outcome.further)]
        spread = f"{(max(each) - min(each)) / min(each):.1e}" if outcome.further else ""
        rows.append((f"{name}{label}", method, f"{outcome.objective:.4f}", x, *counts, spread))
        known = own.published.get(method)
        if known is not None:
            x = ", ".join(f"{1e3 * d:.2f}" for d in known.variables.values())
            counts = f"{known.analyses or ''}", f"{known.inner_iterations or ''}", "", ""
            rows.append(("", "  published", f"{known.objective:.4f}", x, *counts, ""))
    return rows, found


def looked_at(name: str, ours: dict[str, np.ndarray]) -> list[tuple[str, ...]]:
    """Constraints of the published designs and of ours, over all steps."""
    problem = load_problem(DATA / f"{name}.toml")
    rows: list[tuple[str, ...]] = []
    known = problem.record.published.items()
    given = [(f"{method}, published", np.array([p.variables[v] for v in problem.names])) for method, p in known]
    for label, x in (*given, *ours.items()):
        found = simulated(problem, x, lambda text: None)
        for c in problem.record.constraints:
            value = found.values[c.name]
            share = f"{value / (c.limit or 1.0):.4f}"
            rows.append((name, label, c.name, f"{value:.5g}", share, f"{found.times[c.name]:.4f}"))
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
    again: list[tuple[str, ...]] = []
    for name in asked.problems:
        own, ours = designs(name, [f"settings.starts={asked.starts}"])
        rows += own
        again += looked_at(name, ours) if name in PUBLISHED else []
        for optimizer in ("slsqp", "trust-constr") if asked.optimizers else ():
            rows += designs(name, [f'settings.optimizer="{optimizer}"'], f", {optimizer}")[0]
    head = "problem", "method", "objective", "variables / 1000", "analyses", "inner", "CPU [s]", "KKT", "spread"
    print(table(head, rows))
    if asked.derivatives:
        rows = [derivatives(name) for name in asked.problems if name == "three_link"]
        print("\nDerivatives of aggregates, backward over the run\n")
        print(table(("problem", "variables", "largest relative difference"), rows))
    if again:
        print("\nPublished designs and ours, at all steps\n")
        print(table(("problem", "design", "constraint", "largest", "of its limit", "at t [s]"), again))


if __name__ == "__main__":
    main()
