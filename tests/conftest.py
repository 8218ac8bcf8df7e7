"""Fixtures that every test shares."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

# links are small matrices: threads of the linear algebra cost more than they bring, most of all on a busy machine
for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")

# reductions made by tests go to a cache of their own, shared by the workers of one session
os.environ.setdefault("ERLS_CACHE", os.path.join(tempfile.gettempdir(), f"erls-test-cache-{os.getuid()}"))
# compiled code lies there even for tests that give reductions an empty cache
os.environ.setdefault("ERLS_KERNELS", os.environ["ERLS_CACHE"])


KERNELS = (
    (
        "equations.nodal.matrix",
        "equations.nodal.sums",
        "equations.nodal.step",
        "equations.serial.stiffness",
        "equations.ffr.residual",
        "equations.ffr.mass",
        "equations.ffr.acceleration",
        "equations.ffr.link_by_link",
        "equations.quasi_static.chain",
        "equations.erls.paper.functions",
        "equations.erls.paper.acceleration",
        "auto.deviation",
    ),
    (
        "equations.erls.residual",
        "equations.erls.segments",
        "equations.erls.energy",
        "equations.erls.states",
        "equations.erls.solve",
        "equations.erls.stiffened_chain",
        "equations.erls.stiffened_solve",
        "equations.erls.stiffened_states",
        "integrate.stepping.generalized_alpha",
        "integrate.stepping.lobatto",
        "equations.independent",
        "equations.loops.system",
        "equations.loops.steps",
        "equations.loops.nearest",
        "equations.erls.ends",
        "equations.erls.stiffened_ends",
    ),
)
"""Modules with compiled code, shared out to two processes."""


def pytest_configure(config: pytest.Config) -> None:
    """Compile before the workers of a session start, so that no test pays for it or tells of it."""
    if not hasattr(config, "workerinput") and not config.option.collectonly:
        imports = (f"import {', '.join(f'erls.{name}' for name in share)}" for share in KERNELS)
        jobs = [subprocess.Popen([sys.executable, "-c", code], cwd=Path(__file__).parents[1]) for code in imports]
        assert [job.wait() for job in jobs] == [0, 0]
