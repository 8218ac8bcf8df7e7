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
    "import erls.kernels.nodal.matrix, erls.kernels.nodal.step, erls.kernels.nodal.system, erls.kernels.ffr.equations, "
    "erls.kernels.ffr.solve, erls.kernels.ffr.factoring, erls.kernels.quasi_static.chain",
    "import erls.kernels.chain.equations, erls.kernels.chain.elimination, erls.kernels.shifted.equations, "
    "erls.kernels.stepping.generalized_alpha, erls.kernels.stepping.lobatto, erls.kernels.stepping.absent, "
    "erls.kernels.loops.steps, erls.kernels.loops.system, erls.kernels.loops.nearest, "
    "erls.kernels.stiffened.equations, erls.kernels.stiffened.elimination, erls.kernels.deviation.follow",
)


def pytest_configure(config: pytest.Config) -> None:
    """Compile before the workers of a session start, so that no test pays for it or tells of it."""
    if not hasattr(config, "workerinput") and not config.option.collectonly:
        jobs = [subprocess.Popen([sys.executable, "-c", code], cwd=Path(__file__).parents[1]) for code in KERNELS]
        assert [job.wait() for job in jobs] == [0, 0]
