"""Time and memory of factorizing the stiffness of a clamped solid link: here, by SuperLU, CHOLMOD and Pardiso.

    python benchmarks/factorization.py [--dofs 50000,136000] [--peers VENV/bin/python] [--threads 1,2] [--repeats 5]
                                       [--json FILE]

The L of `reduction.py`, both ends clamped. Every solver runs in a process of its own, on one matrix, with one thread
and with two: order of elimination, factor, and a solution of 8 right-hand sides, CPU and wall seconds, the least of the
repeats. ``--peers`` names the Python of an environment with ``scikit-sparse==0.4.16`` (built with Debian's
``libsuitesparse-dev``, ``libopenblas0-pthread``), ``pypardiso`` and ``threadpoolctl``; what it lacks is left out with
the reason. The note says which BLAS ran, and for which processor: ``OPENBLAS_CORETYPE`` in the environment may have
chosen an older one, which MKL knows nothing of. Of CHOLMOD with METIS, its own nested dissection and AMD the fastest
counts.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import scipy
import scipy.sparse as sp

Result = dict[str, Any]


def least(repeats: int, work: Callable[[], Any]) -> tuple[float, float, Any]:
    """CPU and wall seconds, and what came of it."""
    found = []
    result = None
    for _ in range(repeats):
        result = None  # its memory is free for the next
        cpu, wall = time.process_time(), time.perf_counter()
        result = work()
        found.append((time.process_time() - cpu, time.perf_counter() - wall))
    return *np.min(found, axis=0).tolist(), result


Timed = tuple[float, float, Any]


def measured(order: Timed, factor: Timed, solution: Timed, note: str) -> Result:
    names = ("order_cpu_s", "order_wall_s", "factor_cpu_s", "factor_wall_s", "solve_cpu_s", "solve_wall_s")
    times = (*order[:2], *factor[:2], *solution[:2])
    return {**dict(zip(names, times, strict=True)), "note": f"{note}; {linear_algebra()}"}


def linear_algebra() -> str:
    """Which BLAS is loaded, for which processor."""
    from threadpoolctl import threadpool_info

    found = {f"{r['internal_api']} {r['version']} {r.get('architecture', '')}".strip() for r in threadpool_info()}
    return ", ".join(sorted(found))


def eight(matrix: Any) -> Any:
    return np.random.default_rng(0).standard_normal((matrix.shape[0], 8))


def ours(matrix: Any, positions: Any, repeats: int) -> Result:
    from fe_import.solver.elimination import analyse
    from fe_import.solver.multifrontal import factorize

    matrix, right = sp.csc_array(matrix), eight(matrix)
    order = least(repeats, lambda: analyse(matrix, positions))
    factorize(matrix, order[2], lambda done: None).solve(right)  # compiled, or loaded, by now
    factor = least(repeats, lambda: factorize(matrix, order[2], lambda done: None))
    solution = least(repeats, lambda: factor[2].solve(right))
    return measured(order, factor, solution, f"scipy {scipy.__version__}")


def superlu(matrix: Any, positions: Any, repeats: int) -> Result:
    from scipy.sparse.linalg import splu

    options, right = {"SymmetricMode": True}, eight(matrix)
    factor = least(1, lambda: splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options))
    solution = least(repeats, lambda: factor[2].solve(right))
    return measured((0.0, 0.0, None), factor, solution, f"scipy {scipy.__version__}, order included, once")


def cholmod(matrix: Any, positions: Any, repeats: int) -> Result:
    import sksparse
    from sksparse import cholmod

    found, right = [], eight(matrix)
    for method in ("metis", "nesdis", "amd"):
        order = least(repeats, lambda: cholmod.analyze(matrix, ordering_method=method, mode="supernodal"))  # noqa: B023
        factor = least(repeats, lambda: order[2].cholesky(matrix))  # noqa: B023
        solution = least(repeats, lambda: factor[2](right))  # noqa: B023
        found.append(measured(order, factor, solution, f"scikit-sparse {sksparse.__version__}, {method}"))
    return min(found, key=lambda r: float(r["order_cpu_s"] + r["factor_cpu_s"]))


def pardiso(matrix: Any, positions: Any, repeats: int) -> Result:
    from importlib.metadata import version

    import pypardiso

    upper, right = sp.csr_matrix(sp.triu(matrix)), np.ones(matrix.shape[0])
    solver = pypardiso.PyPardisoSolver(mtype=2)

    def phase(number: int) -> None:
        solver.set_phase(number)
        solver._call_pardiso(upper, right)

    order = least(repeats, lambda: phase(11))
    factor = least(repeats, lambda: phase(22))
    right = np.asfortranarray(eight(matrix))
    solution = least(repeats, lambda: phase(33))
    return measured(order, factor, solution, f"pypardiso {version('pypardiso')}")


CASES: dict[str, Callable[[Any, Any, int], Result]] = {
    "multifrontal": ours, "superlu": superlu, "cholmod": cholmod, "pardiso": pardiso,
}  # fmt: skip


def run_case(case: str, folder: Path, repeats: int) -> Result:
    matrix, positions = sp.csc_matrix(sp.load_npz(folder / "k.npz")), np.load(folder / "x.npy")
    result = CASES[case](matrix, positions, repeats)
    return {**result, "peak_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**10}


def write_matrix(dofs: int, folder: Path) -> int:
    """The stiffness of the L with both ends clamped; its dofs."""
    from reduction import SolidMaterial, assemble_solid, l_mesh

    mesh = l_mesh(dofs)
    _, stiffness = assemble_solid(mesh, [SolidMaterial(2e11, 0.3, 7800.0)])
    free = np.setdiff1d(np.arange(len(mesh.nodes)), np.concatenate(list(mesh.node_sets.values())))
    rows = (3 * free[:, None] + np.arange(3)).ravel()
    sp.save_npz(folder / "k.npz", sp.csc_matrix(stiffness[:, rows][rows]), compressed=False)
    np.save(folder / "x.npy", np.repeat(mesh.nodes[free], 3, axis=0))
    return len(rows)


def in_own_process(case: str, folder: Path, peers: str, threads: str, repeats: int) -> Result:
    """What a case took, or why it is missing."""
    python = peers if case in ("cholmod", "pardiso") else sys.executable
    command = [python, __file__, "--case", case, "--folder", str(folder), "--repeats", str(repeats)]
    variables = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
    environment = {**os.environ, **dict.fromkeys(variables, threads)}
    done = subprocess.run(command, capture_output=True, encoding="utf-8", env=environment)
    if done.returncode:
        return {"missing": (done.stderr.strip() or f"ended with {done.returncode}").splitlines()[-1]}
    return dict(json.loads(done.stdout.splitlines()[-1]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dofs", default="50000,136000")
    parser.add_argument("--peers", default=sys.executable)
    parser.add_argument("--threads", default="1,2")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--case", choices=CASES, help=argparse.SUPPRESS)
    parser.add_argument("--folder", type=Path, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.case:
        print(json.dumps(run_case(given.case, given.folder, given.repeats)))
        return
    results: list[Result] = []
    print("              dofs threads  order [s]  factor [s]  both [s]  both, CPU [s]  solve [s]  peak [MB]")
    for dofs in map(int, given.dofs.split(",")):
        with tempfile.TemporaryDirectory() as name:
            size = write_matrix(dofs, Path(name))
            for threads in given.threads.split(","):
                for case in CASES:
                    r = in_own_process(case, Path(name), given.peers, threads, given.repeats)
                    if "missing" in r:
                        print(f"{case:12s}{size:8d}{threads:>4s}      left out: {r['missing']}")
                        continue
                    results.append({"case": case, "dofs": size, "threads": int(threads), **r})
                    both = [r[f"order_{kind}_s"] + r[f"factor_{kind}_s"] for kind in ("wall", "cpu")]
                    print(
                        f"{case:12s}{size:8d}{threads:>4s}{r['order_wall_s']:15.3f}{r['factor_wall_s']:12.3f}"
                        f"{both[0]:10.3f}{both[1]:15.3f}{r['solve_wall_s']:11.3f}{r['peak_mb']:11.0f}  {r['note']}",
                        flush=True,
                    )
    if given.json:
        given.json.write_text(json.dumps(results, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
