"""Time and memory of reducing solid links, stage by stage, and side by side with Exudyn.

    python benchmarks/reduction.py [--dofs 10000,50000,150000,400000] [--modes 12,40] [--threads 1,2] [--json FILE]
    python benchmarks/reduction.py --exudyn [--dofs 50000,136000] [--threads 1,2] [--json FILE]

An L of legs 0.5 m and section 0.01 m x 0.03 m of hex20, two rigid interfaces (12 dofs). Every case runs in a process
of its own, with one thread and with two; CPU times change little on a busy machine, wall times say what threads bring
on an idle one, memory is the largest so far.

With ``--exudyn`` (extra: pip install exudyn==1.13.6), both get the same matrices and find the modes with clamped
interfaces and the static modes; ours then also counts the modes, to know that none is missing, which Exudyn does not.
"""

from __future__ import annotations

import argparse
import functools
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import meshio
import numpy as np

import fe_import.models.meshed
import fe_import.reduce
import fe_import.solver
import fe_import.solver.sparse
from fe_import.elements.solid import SolidMaterial, assemble_solid
from fe_import.elements.solid_elements import SOLID_ELEMENTS
from fe_import.elements.solid_mesh import SolidMesh
from fe_import.errors import FEImportError
from fe_import.interfaces.coupling import couple_interfaces
from fe_import.interfaces.faces import InterfaceFace
from fe_import.modal.file import write_modal_file
from fe_import.model import FEModel
from fe_import.reduction import fixed_interface

LEG, WIDTH, HEIGHT = 0.5, 0.01, 0.03
LINK = """
name = "l"
[materials.steel]
youngs_modulus = 2e11
poissons_ratio = 0.3
density = 7800.0
[solid]
mesh = "l.inp"
material = "steel"
[[interfaces]]
name = "root"
face = "root"
[[interfaces]]
name = "tip"
face = "tip"
[reduction]
fixed_interface_modes = {modes}
"""
STAGES = [  # name, module, function; a stage within a stage counts for itself only
    ("read mesh", fe_import.models.meshed, "read_mesh"),
    ("assembly", fe_import.models.meshed, "assemble_solid"),
    ("order of elimination", fe_import.solver.sparse, "analyse"),
    ("factorization", fixed_interface, "factorize"),
    ("constraint modes", sys.modules["fe_import.reduction.craig_bampton"], "constraint_modes"),
    ("eigenmodes", fe_import.solver.sparse, "lowest_eigenpairs"),
    ("inertia counts", fe_import.solver.sparse, "negative_pivots"),
    ("invariants", fe_import.reduce, "inertia_invariants"),
    ("second order", fe_import.reduce, "second_order"),
    ("health checks", fe_import.reduce, "check_model"),
    ("health checks", fe_import.reduce, "check_basis"),
    ("health checks", fe_import.reduce, "check_completeness"),
    ("health checks", fe_import.reduce, "check_reduction"),
    ("health checks", fe_import.reduce, "mode_residuals"),
]


def l_mesh(dofs: int) -> SolidMesh:
    """An L along x and y of cubic hex20 elements, with about so many dofs; sets root and tip."""
    size = (2 * LEG * WIDTH * HEIGHT * 12.5 / dofs) ** (1 / 3)  # about four nodes to an element, and the surface
    across, up = (max(1, round(length / size)) for length in (WIDTH, HEIGHT))
    layer = 2 * (across + 1) * (up + 1) + across * (up + 1) + up * (across + 1)  # nodes per element along
    along = round((dofs / 3 / layer - across) / 2)
    grid = np.meshgrid(np.arange(along + across), np.arange(along + across), np.arange(up), indexing="ij")
    cells = np.stack([g.ravel() for g in grid], axis=1)
    cells = cells[(cells[:, 0] >= along) | (cells[:, 1] < across)]
    element = SOLID_ELEMENTS["hex20"]
    corners = 2 * (cells[:, None, :] + np.array(element.cell.corners))
    places = [corners[:, k] for k in range(8)]
    places += [corners[:, list(between)].sum(axis=1) // len(between) for between in element.midpoints]
    base = 2 * max(along + across, up) + 1
    keys = np.stack(places, axis=1) @ np.array([base * base, base, 1])
    used, elements = np.unique(keys, return_inverse=True)
    lattice = np.stack([used // base**2, used // base % base, used % base], axis=1)
    x = np.interp(lattice[:, 0], [0, 2 * along, 2 * (along + across)], [0.0, LEG, LEG + WIDTH])
    y = np.interp(lattice[:, 1], [0, 2 * across, 2 * (along + across)], [0.0, WIDTH, LEG + WIDTH])
    nodes = np.stack([x, y, lattice[:, 2] * HEIGHT / (2 * up)], axis=1)
    sets = {"root": np.flatnonzero(lattice[:, 0] == 0), "tip": np.flatnonzero(lattice[:, 1] == lattice[:, 1].max())}
    return SolidMesh.uniform(nodes, elements.reshape(keys.shape), "hex20", node_sets=sets, source="benchmark")


def peak_mb() -> float:
    """Largest memory of this process so far."""
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (2**20 if sys.platform == "darwin" else 2**10)


class Stages:
    """CPU and wall time by stage, without the stages within, and the peak of memory at the end of each."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self.wall: dict[str, float] = {}
        self.peak_mb: dict[str, float] = {}
        self._running: list[str] = []
        self._since = time.process_time(), time.perf_counter()

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """What runs inside belongs to the stage."""
        self._charge()
        self._running.append(name)
        try:
            yield
        finally:
            self._charge()
            self._running.pop()
            self.peak_mb[name] = peak_mb()

    def _charge(self) -> None:
        now = time.process_time(), time.perf_counter()
        if self._running:
            for kept, ended, begun in zip((self.seconds, self.wall), now, self._since, strict=True):
                kept[self._running[-1]] = kept.get(self._running[-1], 0.0) + ended - begun
        self._since = now

    def wrap(self, name: str, function: Callable[..., Any]) -> Callable[..., Any]:
        """The function, timed."""

        @functools.wraps(function)
        def timed(*arguments: Any, **options: Any) -> Any:
            with self.stage(name):
                return function(*arguments, **options)

        return timed


def reduce_case(dofs: int, modes: int) -> dict[str, Any]:
    """Reduce and write; stages, mesh and result."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_mesh(l_mesh(dofs), folder / "l.inp")
        (folder / "l.toml").write_text(LINK.format(modes=modes), encoding="utf-8")
        stages = Stages()
        for stage, module, function in STAGES:
            setattr(module, function, stages.wrap(stage, getattr(module, function)))
        begun, wall = time.process_time(), time.perf_counter()
        try:
            with stages.stage("other"):
                model = fe_import.reduce.reduce_link(folder / "l.toml", lambda text: print(text, file=sys.stderr))
        except FEImportError as problem:
            return {"asked_dofs": dofs, "modes": modes, "refused": str(problem), "peak_mb": peak_mb()}
        with stages.stage("write"):
            write_modal_file(folder / "l.modal.h5", model)
    return {
        "dofs": int(model.provenance["dofs"]),
        "modes": modes,
        "solver": model.provenance["solver"],
        "healthy": all(check.ok for check in model.health),
        "first_frequency_hz": float(model.frequencies_hz[6]),
        "cpu_s": time.process_time() - begun,
        "wall_s": time.perf_counter() - wall,
        "peak_mb": peak_mb(),
        "stages": {
            s: {"cpu_s": t, "wall_s": stages.wall[s], "peak_mb": stages.peak_mb[s]} for s, t in stages.seconds.items()
        },
    }


def write_mesh(mesh: SolidMesh, path: Path) -> None:
    """An Abaqus input file, without leaving the mesh in memory."""
    cells = [(mesh.only.element.meshio_name, mesh.only.elements)]
    meshio.Mesh(mesh.nodes, cells, point_sets=mesh.node_sets).write(path)


def ours(dofs: int, modes: int) -> dict[str, Any]:
    """Static and clamped modes from matrices that are there, and their count."""
    mesh = l_mesh(dofs)
    mass, stiffness = assemble_solid(mesh, [SolidMaterial(2e11, 0.3, 7800.0)])
    faces = [InterfaceFace(name, nodes, mesh.nodes[nodes].mean(axis=0)) for name, nodes in mesh.node_sets.items()]
    coupled = couple_interfaces(mesh.nodes, faces)
    model = FEModel(
        "l",
        coupled.nodes,
        coupled.dof_map,
        coupled.extended(mass),
        coupled.extended(stiffness),
        coupled.interface_nodes,
        coupled.independent,
        coupled.coupling,
        kind="solid",
    )
    del mass, stiffness
    before, begun, wall = peak_mb(), time.process_time(), time.perf_counter()
    parts = fixed_interface.partition(model)
    fixed_interface.constraint_modes(parts)
    counting = Stages()
    fe_import.solver.sparse.negative_pivots = counting.wrap("count", fe_import.solver.sparse.negative_pivots)
    lowest = fe_import.solver.sparse.lowest_modes
    omega, _ = lowest(parts.inner_stiffness, parts.inner_mass, modes, "l", solve=parts.solve)
    return {
        "program": "erls",
        "dofs": mesh.nodes.size,
        "cpu_s": time.process_time() - begun,
        "of_which_count_s": counting.seconds["count"],
        "wall_s": time.perf_counter() - wall,
        "peak_mb": peak_mb(),
        "before_mb": before,
        "frequencies_hz": (omega[:3] / (2 * np.pi)).tolist(),
    }


def exudyn(dofs: int, modes: int) -> dict[str, Any]:
    """The same by Exudyn; its static modes are those of the second interface, the first is the reference."""
    import scipy.sparse as sp
    from exudyn.FEM import FEMinterface, HCBstaticModeSelection

    mesh = l_mesh(dofs)
    mass, stiffness = assemble_solid(mesh, [SolidMaterial(2e11, 0.3, 7800.0)])
    fem = FEMinterface()
    fem.nodes = {"Position": mesh.nodes}
    fem.massMatrix, fem.stiffnessMatrix = (
        sp.csr_matrix((m.data, m.indices, m.indptr), m.shape) for m in (mass, stiffness)
    )
    before, begun, wall = peak_mb(), time.process_time(), time.perf_counter()
    fem.ComputeHurtyCraigBamptonModes(
        list(mesh.node_sets.values()), modes, computationMode=HCBstaticModeSelection.RBE2, timerTreshold=10**9
    )
    return {
        "program": "exudyn",
        "dofs": mesh.nodes.size,
        "cpu_s": time.process_time() - begun,
        "wall_s": time.perf_counter() - wall,
        "peak_mb": peak_mb(),
        "before_mb": before,
        "frequencies_hz": fem.GetEigenFrequenciesHz()[:3].tolist(),
    }


CASES: dict[str, Callable[[int, int], dict[str, Any]]] = {"reduce": reduce_case, "ours": ours, "exudyn": exudyn}


def in_own_process(case: str, dofs: int, modes: int, threads: str) -> dict[str, Any]:
    """The result of a case that runs in a process of its own."""
    command = [sys.executable, __file__, "--case", case, "--dofs", str(dofs), "--modes", str(modes)]
    variables = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
    environment = {**os.environ, **dict.fromkeys(variables, threads)}
    done = subprocess.run(command, stdout=subprocess.PIPE, encoding="utf-8", check=True, env=environment)
    return {"threads": int(threads), **json.loads(done.stdout.splitlines()[-1])}


def print_stages(results: list[dict[str, Any]]) -> None:
    """One column per case: CPU seconds, wall seconds, peak memory so far."""
    names = list(dict.fromkeys([*(stage for stage, *_ in STAGES), "other", "write"]))
    heads = (f"{r['dofs']:>16d}/{r['modes']}/{r['threads']:<3d}" for r in results)
    print(f"{'':20s}" + "".join(heads) + " dofs/modes/threads")
    for name in names:
        cells = [r["stages"].get(name) for r in results]
        print(f"{name:20s}" + "".join(_cell(c) if c else " " * 23 for c in cells))
    print(f"{'all':20s}" + "".join(map(_cell, results)) + "   CPU s, wall s, MB")


def _cell(times: dict[str, Any]) -> str:
    return f"{times['cpu_s']:8.1f}{times['wall_s']:7.1f}{times['peak_mb']:8.0f}"


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--dofs", default="")
    parser.add_argument("--modes", default="")
    parser.add_argument("--threads", default="1,2")
    parser.add_argument("--exudyn", action="store_true")
    parser.add_argument("--json", type=Path)
    parser.add_argument("--case", choices=CASES, help=argparse.SUPPRESS)
    given = parser.parse_args()
    usual = "50000,136000" if given.exudyn else "10000,50000,150000,400000"
    dofs = [int(d) for d in (given.dofs or usual).split(",")]
    modes = [int(m) for m in (given.modes or ("12" if given.exudyn else "12,40")).split(",")]
    if given.case:
        print(json.dumps(CASES[given.case](dofs[0], modes[0])))
        return
    if given.exudyn:
        cases = [*(("ours", threads) for threads in given.threads.split(",")), ("exudyn", "1")]
        results = [in_own_process(case, d, m, threads) for d in dofs for m in modes for case, threads in cases]
        print("           dofs threads  CPU [s]  (count)  wall [s]  peak [MB]  (before)  first frequencies [Hz]")
        for r in results:
            frequencies = "  ".join(f"{f:.3f}" for f in r["frequencies_hz"])
            print(
                f"{r['program']:8s}{r['dofs']:7d}{r['threads']:8d}{r['cpu_s']:9.2f}{r.get('of_which_count_s', 0):9.2f}"
                f"{r['wall_s']:10.2f}{r['peak_mb']:11.0f}{r['before_mb']:10.0f}  {frequencies}"
            )
    else:
        threads = given.threads.split(",")
        results = [in_own_process("reduce", d, m, number) for d in dofs for m in modes for number in threads]
        for r in results:
            if "refused" in r:
                print(f"{r['asked_dofs']} dofs, {r['modes']} modes: {r['refused']}")
        print_stages([r for r in results if "refused" not in r])
    if given.json:
        given.json.write_text(json.dumps(results, indent=1), encoding="utf-8")


if __name__ == "__main__":
    main()
