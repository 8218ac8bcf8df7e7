"""Cost of the compiled equations of motion: a residual and an acceleration, against modes and against links.

    python benchmarks/kernels.py [--quick] [--ffr]

Chains of equal links on revolute joints in all directions; between two links of a spatial chain nothing can be told of
the axis of rotation, so this is the general case. Then the shipped L and the two-link robot. Prints the least CPU time
of several repetitions, of a residual, an acceleration, a step of generalized-α and one of lobatto, with its share of
factors, the growth exponent from row to row, and how many times longer a residual takes that Python calls.
"""

from __future__ import annotations

import math
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numba
import numpy as np

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests/erls"))

import scenes  # noqa: E402

from erls.equations.compiled_system import (  # noqa: E402
    ACCELERATION,
    INTEGERS,
    REALS,
    RESIDUAL,
    call_acceleration,
    call_residual,
)
from erls.equations.erls.formulation import Erls  # noqa: E402
from erls.equations.ffr.formulation import Ffr  # noqa: E402
from erls.integrate.base import Integrator, Options  # noqa: E402
from erls.integrate.generalized_alpha import generalized_alpha  # noqa: E402
from erls.integrate.lobatto import lobatto  # noqa: E402
from erls.maths.calls import handed  # noqa: E402

QUICK = "--quick" in sys.argv[1:]
FORMULATION = Ffr if "--ffr" in sys.argv[1:] else Erls
MODES = (6, 12, 25, 50) if QUICK else (6, 12, 25, 50, 100, 200)
LINKS = (1, 2, 5) if QUICK else (1, 2, 5, 10, 20)
MODES_PER_LINK = 8
REPEATS = 3 if QUICK else 7
SLICE = 0.02  # s of one repetition
STEPS = 200
TOLERANCE = 1e-4  # m, of lobatto


_SYSTEM = (REALS, INTEGERS, REALS)


@numba.njit(numba.void(numba.int64, numba.int64, *_SYSTEM, *[REALS] * 4))
def residuals(count, function, reals, integers, scratch, y, v, a, out):  # type: ignore[no-untyped-def]
    """Many residuals, called from compiled code."""
    for _ in range(count):
        call_residual(function, reals, integers, scratch, 0.1, y, v, a, out)


@numba.njit(numba.void(numba.int64, numba.int64, *_SYSTEM, *[REALS] * 3))
def accelerations(count, function, reals, integers, scratch, y, v, out):  # type: ignore[no-untyped-def]
    """Many accelerations, called from compiled code."""
    for _ in range(count):
        call_acceleration(function, reals, integers, scratch, 0.1, y, v, out)


def least_time(call: Callable[[int], object]) -> float:
    """Seconds of CPU per call, at best."""
    start = time.process_time()
    call(1)
    count = max(1, int(SLICE / max(time.process_time() - start, 1e-6)))
    best = math.inf
    for _ in range(REPEATS):
        start = time.process_time()
        call(count)
        best = min(best, (time.process_time() - start) / count)
    return best


def costs(chain: Erls | Ffr) -> tuple[float, float, float]:
    """Seconds of a residual and an acceleration called from compiled code, and of a residual called from Python."""
    system = chain.compiled
    assert system is not None
    y, v, a = np.random.default_rng(1).uniform(-1, 1, (3, chain.size)) * 1e-3
    out = np.empty(chain.size)
    constants = system.reals, system.integers, system.scratch
    residual, acceleration = handed(system.residual, RESIDUAL), handed(system.acceleration, ACCELERATION)
    compiled = least_time(lambda n: residuals(n, residual, *constants, y, v, a, out))
    solved = least_time(lambda n: accelerations(n, acceleration, *constants, y, v, out))
    plain = least_time(lambda n: [chain.residual(0.1, y, v, a) for _ in range(n)])
    return compiled, solved, plain


def chain_of(links: int, modes: int) -> Erls | Ffr:
    """A spatial chain of equal links."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        elements = max(3, math.ceil(modes / 5) + 1)
        fixed = max(modes - 6, 1)
        scenes.arm_link(
            folder,
            frame={"members": [{**scenes.ARM_LINK["frame"]["members"][0], "elements": elements}]},
            reduction={"fixed_interface_modes": fixed, "elastic_modes": modes},
        )
        joints = [
            {"name": f"j{k}", "dh": {"convention": "standard", "a": 0.4, "alpha_deg": 35.0 + 20 * (k % 3)}}
            for k in range(links)
        ]
        arms = [{"name": f"l{k}", "model": "arm.toml", "mesh_pose": {"frame": "joint"}} for k in range(links)]
        data = {"simulation": {"duration": 1.0}, "joints": joints, "links": arms}
        return FORMULATION(scenes.mechanism(scenes.write_toml(folder / "chain.toml", data)))


def step_cost(chain: Erls | Ffr, integrate: Integrator, options: Options) -> float:
    """Seconds of CPU of a step, at best."""
    y, v = chain.initial_state()
    best = math.inf
    for _ in range(REPEATS):
        start = time.process_time()
        found = integrate(chain, (0.0, STEPS * 1e-3), y, v, options, None)
        best = min(best, (time.process_time() - start) / found.work.steps)
    return best


def table(title: str, what: str, cases: dict[int, Erls | Ffr]) -> None:
    """Print costs with growth exponents."""
    heads = "".join(f"{name:>13} {'exponent':>9}" for name in ("residual", "acceleration", "step", "lobatto"))
    print(f"\n{title}\n{what:>6} {heads} {'Python':>8}")
    before: tuple[int, tuple[float, ...]] | None = None
    for number, chain in cases.items():
        residual, acceleration, plain = costs(chain)
        fixed = step_cost(chain, generalized_alpha, Options(1e-3))
        now = residual, acceleration, fixed, step_cost(chain, lobatto, Options(tolerance=TOLERANCE))
        growth = [""] * len(now)
        if before is not None:
            span = math.log(number / before[0])
            growth = [f"{math.log(a / b) / span:.2f}" for a, b in zip(now, before[1], strict=True)]
        cells = "".join(f"{cost * 1e6:10.2f} µs {exponent:>9}" for cost, exponent in zip(now, growth, strict=True))
        print(f"{number:6d} {cells} {plain / residual:7.0f}x")
        before = number, now


def main() -> None:
    """Print all tables."""
    table("two links, against elastic modes of each", "modes", {n: chain_of(2, n) for n in MODES})
    table(
        f"{MODES_PER_LINK} modes in each link, against links", "links", {n: chain_of(n, MODES_PER_LINK) for n in LINKS}
    )
    print("\nshipped scenes")
    for name in ("l_shape/steel_flat.toml", "robot/two_link.toml"):
        residual, acceleration, plain = costs(FORMULATION(scenes.mechanism(ROOT / "data" / name)))
        print(
            f"{name}: residual {residual * 1e6:.2f} µs, acceleration {acceleration * 1e6:.2f} µs, "
            f"called from Python {plain / residual:.0f}x"
        )


if __name__ == "__main__":
    main()
