"""The wheel in empty environments, as its users install it: what it weighs, what it runs, what mypy sees of it.

    python benchmarks/installations.py [PYTHON ...] [--lowest]

For each interpreter: a virtual environment, the wheel without byte code and its weight, then with the extra ``view``,
and outside the checkout ``erls examples copy``, ``erls simulate`` and ``erls view`` of a table and a picture, with no
kernels compiled before; mypy of this environment reads a program with misspelt methods, with types from there.
``--lowest`` installs every dependency of the package and of ``view`` at its lower bound.
"""

from __future__ import annotations

import argparse
import os
import re
import resource
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
OWN = {"pip", "setuptools", "wheel", "_distutils_hack", "pkg_resources"}  # what an empty environment has already
SCENE = "l_shape/steel_tall.toml"
COMMANDS = (
    "examples copy l_shape",
    f"simulate {SCENE} -o r.run.h5 --set simulation.duration=0.2",
    "view r.run.h5 -o r.csv",
    "view r.run.h5 -o r.png",
)
HEADS = ("Python", "dependencies", "light core [MB]", *(f"{c.split()[0]} [s]" for c in COMMANDS), "again", "mypy")
PICTURES = ("matplotlib", "pyvista", "vtk", "pillow")  # what the extra view brings


def run(*words: str | Path, folder: Path | None = None, settings: Mapping[str, str] | None = None) -> float:
    """Processor time [s]; what fails ends the benchmark with what it said."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    own = {key: value for key, value in os.environ.items() if not key.startswith(("ERLS_", "PYTHON"))}
    command, env = [str(word) for word in words], {**own, **(settings or {})}
    done = subprocess.run(command, cwd=folder, env=env, capture_output=True, encoding="utf-8")
    if done.returncode:
        sys.exit(f"{' '.join(map(str, words))}\n{done.stdout}{done.stderr}")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def weight(python: Path) -> tuple[float, dict[str, float]]:
    """What the packages of an environment weigh without byte code, and the heaviest of them [MB]."""
    asked = [str(python), "-c", "import sysconfig; print(sysconfig.get_path('purelib'))"]
    folder = Path(subprocess.run(asked, capture_output=True, encoding="utf-8", check=True).stdout.strip())
    sizes = dict[str, float]()
    for path in folder.rglob("*"):
        top = path.relative_to(folder).parts[0]
        package = re.split(r"-\d|\.libs", top)[0]
        if package not in OWN and path.suffix != ".pyc" and path.is_file():
            sizes[package] = sizes.get(package, 0.0) + path.stat().st_size / 1e6
    return sum(sizes.values()), dict(sorted(sizes.items(), key=lambda item: -item[1])[:6])


def lower_bounds() -> list[str]:
    """Of the package and of what ``view`` adds, as exact versions."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"]
    asked = [*project["dependencies"], *extras["view"], *extras["plot"]]
    return [text.replace(">=", "==") for text in asked if ">=" in text]


def checked_types(python: Path, folder: Path) -> str:
    """Whether mypy finds exactly the misspelt methods that ``tests/typed_use.py`` marks."""
    text = (ROOT / "tests/typed_use.py").read_text(encoding="utf-8")
    marked = [k for k, line in enumerate(text.splitlines(), 1) if "type: ignore" in line]
    (folder / "use.py").write_text(re.sub(r"  # type: ignore.*", "", text), encoding="utf-8")
    options = ["--python-executable", str(python), "--cache-dir", str(folder / "mypy")]
    words = [sys.executable, "-m", "mypy", *options, "use.py"]
    told = subprocess.run(words, cwd=folder, capture_output=True, encoding="utf-8").stdout
    found = [int(line) for line in re.findall(r"^use\.py:(\d+): error", told, flags=re.MULTILINE)]
    if found != marked:
        sys.exit(f"mypy with {python} found {found}, and not {marked}:\n{told}")
    return f"{len(found)} of {len(marked)}"


def row(interpreter: str, wheel: Path, lowest: bool) -> tuple[str, ...]:
    """One environment, from nothing."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        run(interpreter, "-m", "venv", folder / "env")
        scripts, python = folder / "env/bin", folder / "env/bin/python"
        pins = lower_bounds() if lowest else []
        light = [text for text in pins if not text.startswith(PICTURES)]
        run(python, "-m", "pip", "install", "-q", "--no-compile", wheel, *light)
        total, heaviest = weight(python)
        print(f"  {', '.join(f'{package} {size:.0f}' for package, size in heaviest.items())} MB", file=sys.stderr)
        run(python, "-m", "pip", "install", "-q", f"{wheel}[view]", *pins)
        (folder / "work").mkdir()
        settings = {"ERLS_CACHE": str(folder / "cache"), "ERLS_KERNELS": str(folder / "kernels")}
        first, *times = [run(scripts / "erls", *c.split(), folder=folder / "work", settings=settings) for c in COMMANDS]
        again = run(scripts / "erls", *COMMANDS[1].split(), folder=folder / "work", settings=settings)
        assert (folder / "work/r.png").stat().st_size > 10_000
        version = subprocess.run([python, "-V"], capture_output=True, encoding="utf-8", check=True).stdout.split()[1]
        seconds = [f"{t:.1f}" for t in (first, *times, again)]
        return version, "lowest" if lowest else "newest", f"{total:.0f}", *seconds, checked_types(python, folder)


def main(arguments: Sequence[str] | None = None) -> None:
    """A row per interpreter."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pythons", nargs="*", default=[sys.executable])
    parser.add_argument("--lowest", action="store_true")
    given = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        run(sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "-w", folder, ROOT)
        (wheel,) = Path(folder).glob("*.whl")
        print(f"wheel: {wheel.stat().st_size / 1e6:.1f} MB")
        print(f"| {' | '.join(HEADS)} |\n|{'---|' * len(HEADS)}")
        for python in given.pythons:
            print(f"| {' | '.join(row(python, wheel, given.lowest))} |", flush=True)


if __name__ == "__main__":
    main()
