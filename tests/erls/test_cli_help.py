"""Help of the command ``erls``: every option with a sentence, at once."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from erls.cli.main import main

OPTIONS = {
    "reduce": ["--output", "-o", "--method", "--modes", "--parametric", "--set", "--force", "--json"],
    "export": ["--output", "-o", "--format", "--fmi", "--set", "--force", "--json"],
    "simulate": ["--output", "-o", "--formulation", "--set", "--at", "--strict", "--verdict", "--no-verdict",
                 "--resume", "--until", "--report", "--force", "--json"],
    "compare": ["--output", "-o", "--formulations", "--state", "--resume", "--set", "--workers", "--force", "--json"],
    "study modes": ["--output", "-o", "--counts", "--frequencies", "--ranked", "--link", "--tolerance",
                    "--load-tolerance", "--frequency-tolerance", "--beside", "--state", "--resume", "--set",
                    "--workers", "--force", "--json"],
    "study cost": ["--output", "-o", "--tolerance", "--formulations", "--modes", "--integrators", "--effects",
                   "--points", "--norm", "--reference", "--budget", "--apply", "--state", "--resume", "--set",
                   "--workers", "--force", "--json"],
    "study sweep": ["--output", "-o", "--vary", "--get", "--sample", "--seed", "--points", "--table", "--resume",
                    "--retry-failed", "--verdict", "--scheduler", "--set", "--workers", "--force", "--json"],
    "effects": ["--set", "--json"],
    "linearize": ["--output", "-o", "--at", "--equilibrium", "--inputs", "--outputs", "--campbell", "--locus", "--mode",
                  "--set", "--force", "--json"],
    "invert": ["--output", "-o", "--method", "--confirm", "--correct", "--set", "--force", "--json"],
    "plan": ["--output", "-o", "--method", "--confirm", "--set", "--force", "--json"],
    "optimize": ["--output", "-o", "--scene", "--state", "--resume", "--set", "--force", "--json"],
    "identify": ["--output", "-o", "--measured", "--fit", "--bounds", "--set", "--force", "--json"],
    "import": ["--output", "-o", "--flexible", "--floating", "--hold", "--stops", "--force", "--json"],
    "new": ["--json"],
    "examples list": ["--json"],
    "examples copy": ["--json"],
    "schema": ["--output", "-o", "--force", "--json"],
    "info": ["--json"],
    "view": ["--output", "-o", "--at", "--mode", "--magnify", "--color", "--fps", "--speed", "--overlay", "--force",
             "--json"],
}


def run(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """Stdout of a command that tells nothing else."""
    assert main(arguments) == 0
    out, err = capsys.readouterr()
    assert err == ""
    return out


@pytest.mark.parametrize("command", OPTIONS)
def test_help_of_a_command(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Exit code 0, on stdout, every option with a sentence."""
    for flag in ("--help", "-h"):
        out = run(capsys, *command.split(), flag)
        assert f"erls {command}" in out
        words = set(re.split(r"[\s,]+", out))
        assert words >= set(OPTIONS[command])
    listed = {w for w in words if re.fullmatch(r"--?[a-z-]+", w)} - {"--help", "-h"}
    assert listed == set(OPTIONS[command])


def test_help_of_all(capsys: pytest.CaptureFixture[str]) -> None:
    """Every command with a sentence; no arguments at all are answered likewise; the version alone."""
    out = run(capsys, "--help")
    assert out == run(capsys)
    for command in OPTIONS:
        assert re.search(rf"\b{command.split()[0]}  +[A-Z]", out)
    assert re.fullmatch(r"\d+\.\d+\.\d+\n", run(capsys, "--version"))


def test_help_needs_no_heavy_package() -> None:
    """Help answers at once: importing the command line imports none of them."""
    heavy = {"numpy", "scipy", "h5py", "pyvista", "vtkmodules", "matplotlib", "numba", "skfem", "meshio", "msgspec"}
    code = (
        "import sys\nfrom erls.cli.main import main\nassert main(['simulate', '--help']) == 0\n"
        f"print(sorted({heavy!r} & set(sys.modules)), file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert done.stderr.strip() == "[]"


def test_runs_on_reduced_links_load_no_solver(tmp_path: Path) -> None:
    """Elements, reductions and sparse matrices are for links that were never reduced before, and for the verdict;
    kernels of loops for loops; nodal elements for these alone.
    """
    heavy = {"fe_import.reduce", "fe_import.solver", "scipy.sparse", "erls.equations.loops.closure"}
    heavy |= {"erls.equations.nodal.layout", "erls.run.bodies.motion"}
    code = (
        "import sys\nfrom erls.cli.main import main\nassert main(['simulate', *sys.argv[1:]]) == 0\n"
        f"print('loaded', *sorted({heavy} & set(sys.modules)))"
    )
    scene = str(Path(__file__).parents[2] / "data/l_shape/steel_flat.toml")
    environment = {**os.environ, "ERLS_CACHE": str(tmp_path), "ERLS_KERNELS": os.environ["ERLS_KERNELS"]}
    last = []
    for option in ("--no-verdict", "--no-verdict", "--verdict"):
        command = [sys.executable, "-c", code, scene, option]
        done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True, env=environment)
        last.append(done.stdout.splitlines()[-1])
    solver = "fe_import.solver scipy.sparse"  # the verdict's, for the meshes of links
    assert last == [f"loaded fe_import.reduce {solver}", "loaded", f"loaded {solver}"]


def test_points_of_sweeps_of_chains_load_no_nodal_elements(tmp_path: Path) -> None:
    """Nor what draws, tests or reduces: workers start with what a chain on a link that is known needs."""
    heavy = ("erls.equations.nodal", "erls.run.bodies", "erls.equations.loops.closure", "fe_import.reduce")
    heavy += ("scipy.sparse", "scipy.spatial", "scipy.stats", "matplotlib", "pyvista", "skfem", "rich")
    code = (
        "import sys\nfrom pathlib import Path\nfrom erls.studies.sweep.evaluate import Task, evaluate\n"
        "task = Task(Path(sys.argv[1]), ('simulation.duration=0.01',), ('joints.0.initial.position_deg',),\n"
        "            [(1, (5.0,))], ('tip.z@end',), False)\n"
        "[row] = evaluate(task)\nassert row.numbers is not None, row\n"
        f"print('loaded', *sorted(name for name in sys.modules if name.startswith({heavy!r})))"
    )
    scene = str(Path(__file__).parents[2] / "data/l_shape/steel_flat.toml")
    environment = {**os.environ, "ERLS_CACHE": str(tmp_path), "ERLS_KERNELS": os.environ["ERLS_KERNELS"]}
    for _ in range(2):  # the first one reduces the link
        command = [sys.executable, "-c", code, scene]
        done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True, env=environment)
    assert done.stdout.splitlines()[-1] == "loaded"


def test_a_command_that_ends_leaves_its_objects_alone() -> None:
    """Looking for cycles among them took a fifth of the time of a short run; within Python they are looked at."""
    code = "import gc, sys\nfrom erls.cli.main import main\nassert main({0}) == 0\nprint(gc.get_freeze_count() > 0)"
    for arguments, frozen in (("", "True"), ("['examples', 'list']", "False")):
        command = [sys.executable, "-c", code.format(arguments), "examples", "list"]
        done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
        assert done.stdout.splitlines()[-1] == frozen
