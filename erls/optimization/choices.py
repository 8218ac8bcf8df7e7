"""Problems with choices: every combination of options is a problem of its own.

Designs of options do not lie between each other, so that no derivative leads from one to the next: each combination is
optimized, and the best of their designs is kept.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from erls.optimization.memory import Memory
from erls.optimization.problem import Problem
from erls.optimization.result import CONVERGED, INTERRUPTED, Optimization, Tried


def best_of(
    problem: Problem,
    memory: Memory,
    solved: Callable[[Problem, Memory, bool], Optimization],
    confirm: bool,
    tell: Callable[[str], None],
) -> Optimization:
    """The best combination, and what came of the others.

    Parameters
    ----------
    problem : Problem
        With alternatives.
    memory : Memory
    solved : callable
        A problem without choices, with its memory, its designs simulated again or not.
    confirm : bool
    tell : callable
    """
    tried: list[Tried] = []
    found: list[tuple[Optimization, Memory]] = []
    interrupted = False
    for chosen, alternative in problem.alternatives:
        label = ", ".join(f"{name} {option}" for name, option in chosen.items())
        tell(f"with {label}")
        own = memory.labelled(label)
        one = solved(alternative, own, False)
        found.append((one, own))
        tried.append(Tried(chosen, one.best))
        interrupted = any(o.status == INTERRUPTED for o in one.outcomes)
        if interrupted:
            break
    numbers = range(len(found))
    least = min(numbers, key=lambda n: (tried[n].best.status not in (CONVERGED, INTERRUPTED), found[n][0].merit))
    best, own = found[least]
    wall_s = sum(one.wall_s for one, _ in found)
    if confirm and not interrupted:  # known designs are not run again
        best = solved(best.problem, own, True)
        wall_s += best.wall_s
    if interrupted:
        best = replace(best, outcomes=tuple(replace(o, status=INTERRUPTED) for o in best.outcomes))
    return replace(best, tried=tuple(tried), chosen=tried[least].options, wall_s=wall_s)
