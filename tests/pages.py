"""README and docs as the tests see them: pages, the blocks of code on them, and running these."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]
DOCS = sorted(f"docs/{path.name}" for path in (ROOT / "docs").glob("*.md"))
PAGES = {name: (ROOT / name).read_text(encoding="utf-8") for name in ("README.md", *DOCS)}
_ERLS = "import sys; from erls.cli.main import main; sys.exit(main())"


def blocks(page: str, language: str) -> list[str]:
    """Blocks of code in a language on a page."""
    return re.findall(rf"```{language}\n(.*?)```", PAGES[page], flags=re.DOTALL)


def shell_lines(page: str) -> list[str]:
    """Lines of its shell blocks."""
    return [line for block in blocks(page, "sh") for line in block.splitlines() if line.strip()]


def run(command: str, folder: Path) -> None:
    """Run ``erls ...`` or ``python -m erls...`` as a user would, from a folder like a checkout; it has to succeed."""
    words = shlex.split(command)
    code = ["-c", _ERLS] if words[0].endswith("erls") else []
    done = subprocess.run(
        [sys.executable, *code, *words[1:]],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert "error" not in done.stderr
    if "-o" in words:
        assert (folder / words[words.index("-o") + 1]).exists()
