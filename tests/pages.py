"""README and docs as the tests see them: pages, the blocks of code on them, and running these."""

from __future__ import annotations

import contextlib
import io
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
DOCS = sorted(f"docs/{path.name}" for path in (ROOT / "docs").glob("*.md"))
PAGES = {name: (ROOT / name).read_text(encoding="utf-8") for name in ("README.md", *DOCS)}


def blocks(page: str, language: str) -> list[str]:
    """Blocks of code in a language on a page."""
    return re.findall(rf"```{language}\n(.*?)```", PAGES[page], flags=re.DOTALL)


def shell_lines(page: str) -> list[str]:
    """Lines of its shell blocks."""
    return [line for block in blocks(page, "sh") for line in block.splitlines() if line.strip()]


def run(command: str, folder: Path) -> None:
    """Run ``erls ...`` or ``python -m erls...`` as a user would, from a folder like a checkout; it has to succeed.

    Commands run in this process, where everything is loaded; `test_cli` starts some for real.
    """
    program, *words = shlex.split(command)
    told = io.StringIO()
    if program.endswith("erls"):
        from erls.cli.main import main

        with contextlib.chdir(folder), contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(told):
            code = main(words)
    else:
        settings = {**os.environ, "PYTHONPATH": str(ROOT)}
        done = subprocess.run([sys.executable, *words], cwd=folder, env=settings, capture_output=True, encoding="utf-8")
        code, told = done.returncode, io.StringIO(done.stderr)
    assert code == 0, told.getvalue()
    assert not any(line.startswith("error") for line in told.getvalue().splitlines()), told.getvalue()
    if "-o" in words:
        assert (folder / words[words.index("-o") + 1]).exists()
