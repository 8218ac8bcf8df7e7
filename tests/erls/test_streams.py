"""Standard streams that are closed, full or of the C locale, pipes for files, little address space: no traceback."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
import scenes

from erls.cli.main import main
from fe_import.modal.file import read_modal_file

pytestmark = pytest.mark.skipif(not Path("/dev/full").exists(), reason="shells and devices of POSIX systems")

ERLS = f"{sys.executable} -c 'import sys; from erls.cli.main import main; sys.exit(main())'"
C_LOCALE = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}


def _shell(folder: Path, line: str, **variables: str) -> tuple[int, str, str]:
    """Exit code, stdout and stderr of a line in which ERLS stands for the command."""
    done = subprocess.run(
        ["bash", "-o", "pipefail", "-c", line.replace("erls ", f"{ERLS} ", 1)],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(scenes.ROOT), **variables},
        capture_output=True,
        timeout=60,
    )
    return done.returncode, done.stdout.decode("utf-8"), done.stderr.decode("utf-8")


UNKNOWN = 'error: command line: Unknown command "--nix"; see erls --help\n'
FULL = "error: stdout: cannot be written: No space left on device; free disk space, or send it elsewhere\n"
LINES = [
    ("erls --version >&-", 0, ""),  # nobody wants it
    ("erls info --help | true", 0, ""),
    ("erls --version >/dev/full", 2, FULL),
    ("erls --help >/dev/full", 2, FULL),
    ("erls --nix --json >/dev/full", 2, UNKNOWN),  # the reason counts, and stderr takes it
    ("erls --nix --json | true", 2, UNKNOWN),
    ("erls --nix 2>/dev/full", 2, ""),
    ("erls --nix <&- >&- 2>&-", 2, ""),
]


@pytest.mark.parametrize(("line", "code", "told"), LINES, ids=[line for line, *_ in LINES])
def test_streams_that_take_nothing(line: str, code: int, told: str, tmp_path: Path) -> None:
    """Exit code and message as if they did; output that is lost is an error unless nobody wants it."""
    found, _, err = _shell(tmp_path, line)
    assert (found, err) == (code, told)


def test_no_file_takes_the_place_of_a_closed_stream(tmp_path: Path) -> None:
    """What a library prints would come into it."""
    scenes.l_link(tmp_path)
    assert _shell(tmp_path, "erls reduce link.toml -o m.h5 <&- >&- 2>&-") == (0, "", "")
    assert read_modal_file(tmp_path / "m.h5").elastic_modes == 18


def test_a_locale_without_letters(tmp_path: Path) -> None:
    """Names in files, and of files, come out as they went in."""
    text = scenes.l_link(tmp_path).read_text(encoding="utf-8")
    (tmp_path / "bürste.toml").write_text('name = "λ-Bürste"\n' + text, encoding="utf-8")
    code, out, err = _shell(tmp_path, "erls info bürste.toml", **C_LOCALE)
    assert (code, err) == (0, "")
    assert "link: λ-Bürste" in out


def test_too_little_address_space(tmp_path: Path) -> None:
    """Libraries would abort, or spin for ever."""
    code, out, err = _shell(tmp_path, "ulimit -v 500000; erls info link.toml")
    assert (code, out) == (3, "")
    assert err.startswith("error: ulimit -v: too little address space")
    assert err.count("\n") == 1


def test_pipes_are_no_files(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """One that nobody writes to would never end."""
    os.mkfifo(tmp_path / "pipe")
    assert main(["info", str(tmp_path / "pipe")]) == 2
    assert capsys.readouterr().err.startswith(f"error: {tmp_path / 'pipe'}: not a file but a pipe or device; ")
