"""A scene packed as a functional mock-up unit (FMU): its run file, the C of its door, and that compiled if possible.

Who opens it needs `erls` for Python, but neither the scene nor its links: the unit starts the Python that packed it, or
the one that ``ERLS_PYTHON`` names, or ``python3``.
"""

from __future__ import annotations

import platform
import re
import shutil
import subprocess
import sys
import tempfile
import uuid
import zipfile
from dataclasses import replace
from importlib import resources
from pathlib import Path

import msgspec

from erls.errors import Cause, SceneError
from erls.files.output import replacing
from erls.files.results import MARK
from erls.fmi.channels import Channels
from erls.fmi.description import UnitText, build_description, described
from erls.fmi.serve import RUN
from erls.run.file import save_run
from erls.scene.build import Message
from erls.scene.chain import Scene
from erls.scene.integrators import FIXED_STEP
from erls.simulation.simulate import simulate
from erls.simulation.stepper import Stepper
from fe_import.files.log import log
from fe_import.files.versions import package_version

VERSIONS = (3, 2)

_COMPILERS = ("cc", "gcc", "clang")
_SHARED = {"Darwin": (".dylib", "darwin", "darwin64"), "Linux": (".so", "linux", "linux64")}
_MACHINES = {"AMD64": "x86_64", "x86_64": "x86_64", "arm64": "aarch64", "aarch64": "aarch64"}


def write_unit(path: Path, scene: Scene, version: int = 3, tell: Message = log) -> UnitText:
    """Write a co-simulation unit, completely or not at all.

    Parameters
    ----------
    path : Path
        Ends in ``.fmu``.
    scene : Scene
    version : int
        Of FMI: 3 or 2.
    tell : callable
        Told about what takes time, and if no binary could be made.

    Raises
    ------
    SceneError, FEImportError
        Bad input, or a scene that cannot be stepped.
    SimulationError
        There is no start.
    """
    if version not in VERSIONS:
        remedy = "give 3 or 2"
        raise SceneError(Cause.BAD_FIELD, "no such version", where="--fmi", value=version, remedy=remedy)
    stepper = Stepper(scene, tell=tell)
    channels = Channels(stepper)
    own = stepper.scene.record  # with its tables, and what gauges need of link descriptions
    settings = own.simulation
    text = UnitText(
        name=scene.name,
        identifier=re.sub(r"\W", "_", scene.name, flags=re.ASCII).lstrip("0123456789") or "scene",
        token=f"{{{uuid.uuid4()}}}",
        tool=f"erls {package_version('erls')}",
        inputs=channels.inputs,
        outputs=channels.outputs,
        step=stepper.step_size,
        stop=settings.duration,
    )
    short = {"integrator": FIXED_STEP, "step": stepper.step_size, "duration": stepper.step_size, "output_step": None}
    record = msgspec.structs.replace(own, simulation=msgspec.structs.replace(settings, **short), events=[])
    run = simulate(replace(stepper.scene, record=record), verdict=False)
    with tempfile.TemporaryDirectory() as temporary, replacing(path) as target:
        folder = Path(temporary)
        save_run(folder / RUN, run, beside=lambda group: None)
        counts = f"{len(text.inputs)}\n{len(text.outputs)}"
        (folder / "unit.txt").write_text(f"{text.token}\n{counts}\n{sys.executable}\n", encoding="utf-8")
        sources = _sources(folder / "sources")
        binary = _compiled(sources, folder / text.identifier, tell)
        with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as package:
            package.comment = MARK.encode()
            package.writestr("modelDescription.xml", described(text, version))
            for name in (RUN, "unit.txt"):
                package.write(folder / name, f"resources/{name}")
            for source in sorted(sources.iterdir()):
                package.write(source, f"sources/{source.name}")
            if version == 3:
                package.writestr("sources/buildDescription.xml", build_description(text))
            if binary is not None:
                package.write(binary, f"binaries/{_platform(version)}/{binary.name}")
    return text


def _sources(folder: Path) -> Path:
    folder.mkdir()
    for part in resources.files("erls.fmi").joinpath("sources").iterdir():
        (folder / part.name).write_bytes(part.read_bytes())
    return folder


def _platform(version: int) -> str:
    """Folder of binaries for this machine."""
    _, system, second = _SHARED[platform.system()]
    return second if version == 2 else f"{_MACHINES.get(platform.machine(), platform.machine())}-{system}"


def _compiled(sources: Path, stem: Path, tell: Message) -> Path | None:
    """The binary; None, and a word about it, where there is no compiler."""
    compiler = next((found for name in _COMPILERS if (found := shutil.which(name))), None)
    if compiler is None or platform.system() not in _SHARED:
        tell("no C compiler here: the unit holds its sources, which importers compile (fmpy compile)")
        return None
    binary = stem.with_suffix(_SHARED[platform.system()][0])
    files = sorted(str(each) for each in sources.glob("*.c"))
    options = ["-std=c99", "-O2", "-fPIC", "-fvisibility=hidden", "-shared"]
    done = subprocess.run(
        [compiler, *options, "-o", str(binary), *files],
        capture_output=True,
        encoding="utf-8",
        errors="replace",
        check=False,
    )
    if done.returncode:
        tell(f"{compiler} could not compile the unit, which holds its sources alone: {done.stderr.strip()[:200]}")
        return None
    return binary
