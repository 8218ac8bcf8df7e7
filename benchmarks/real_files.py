"""Files that nobody here wrote, read: meshes and decks of other programs, and 95 OUTPUT4 files.

    python benchmarks/real_files.py FOLDER [--only ccx] [--sources]

FOLDER holds one folder for each source of `real_files_table.py` (``--sources`` lists them: clones of the repositories
and the unpacked decks of the Debian package). Each file must be read
right or refused for the reason stated there. Mass and first elastic frequency of the free link stand beside those of
CalculiX (``ccx``, when it is installed) or of the program that made the file. Every mesh gets one steel, so that only
the reading is compared. Prints the table of the documentation; ends with 1 when something is otherwise.
"""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess
import sys
import tempfile
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import scipy.sparse.linalg as sla
from real_files_table import CASES, SOURCES, Case

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "fe_import"))
from calculix_points import RULES, assembled

from fe_import.description.link import load_link
from fe_import.elements.solid import SolidMaterial
from fe_import.elements.solid_mesh import SolidMesh
from fe_import.errors import FEImportError
from fe_import.exports.nastran_op4_layout import op4_layout
from fe_import.mesh.read import read_mesh
from fe_import.reduce import reduce_link

YOUNG, POISSON, DENSITY = 2.1e11, 0.3, 7850.0  # Pa, -, kg/m³
SAME = 1e-6  # relative: ccx prints seven digits
_LENGTHS = {"m": 1.0, "mm": 1e-3, "in": 0.0254}
_KEPT = re.compile(r"NODE|ELEMENT|NSET|ELSET|SURFACE|MASS|SPRING|EQUATION|RIGIDBODY|SOLIDSECTION|MPC|TIE|ROTARYINERTIA")
_LONG = re.compile(r"[+-]?\d\.\d{14,}[Ee][+-]\d+")  # ccx reads twenty characters
WHAT = {"program": "Ansys", **{name: f"ccx, {name}" for name in ("deck", "twin", "mesh")}}
_DECK_TYPES = {
    "tet4": "C3D4", "tet10": "C3D10", "wedge6": "C3D6", "wedge15": "C3D15",
    "hex8": "C3D8", "hex20": "C3D20",
}
_ANSYS = 7366.49503969  # Hz, first elastic one of HexBeam in Ansys: README of pymapdl-reader
_TITANIUM = (16900000.0, 0.31, 0.00041408)  # its material there: lbf/in², -, lbf s²/in⁴


def free_deck(text: str) -> list[str]:
    """The model of a deck without supports and steps, of one steel, its elements of the formulations used here."""
    lines, kept = [], False
    for line in text.splitlines():
        word = line.strip().upper().replace(" ", "")
        if not word or word.startswith("**"):
            continue
        if word.startswith("*"):
            name = word[1:].split(",")[0]
            if name == "STEP":
                break
            kept = bool(_KEPT.fullmatch(name))
            if name == "MATERIAL":
                lines += [line, *_steel()]
            line = re.sub(r"(?i),\s*ORIENTATION\s*=\s*[^,\s]+", "", line)
            line = re.sub(r"(?i)(TYPE\s*=\s*)C3D20RH?\b", r"\1C3D20", line)
            line = re.sub(r"(?i)(TYPE\s*=\s*)C3D8[RI]?\b", r"\1C3D8", line)
            line = re.sub(r"(?i)(TYPE\s*=\s*C3D10)T\b", r"\1", line)
        if kept:
            lines.append(_LONG.sub(lambda found: f"{float(found[0]):.12e}", line))
    return lines


def _steel() -> list[str]:
    return ["*ELASTIC", f"{YOUNG}, {POISSON}", "*DENSITY", f"{DENSITY}"]


def mesh_deck(mesh: SolidMesh) -> list[str] | None:
    """A deck of a mesh as read; None with elements that CalculiX lacks."""
    if any(block.type not in _DECK_TYPES for block in mesh.blocks) or mesh.attachments:
        return None
    lines = ["*NODE", *(f"{k}, {x:.12e}, {y:.12e}, {z:.12e}" for k, (x, y, z) in enumerate(mesh.nodes.tolist(), 1))]
    number = 1
    for block in mesh.blocks:
        lines.append(f"*ELEMENT, TYPE={_DECK_TYPES[block.type]}, ELSET=ALL")
        for nodes in (block.elements + 1).tolist():
            words = [str(number), *map(str, nodes)]
            first, rest = ", ".join(words[:11]), ", ".join(words[11:])
            lines += [f"{first},", rest] if rest else [first]
            number += 1
    return [*lines, *_material()]


def _material() -> list[str]:
    return ["*MATERIAL, NAME=STEEL", *_steel(), "*SOLID SECTION, ELSET=ALL, MATERIAL=STEEL"]


def calculix(lines: list[str]) -> tuple[float, float] | None:
    """Mass and first elastic frequency of a free deck, its lengths taken for metres; None where ccx gives none."""
    if shutil.which("ccx") is None:
        return None
    with tempfile.TemporaryDirectory() as folder:
        step = ["*STEP", "*FREQUENCY", "9", "*END STEP", ""]
        (Path(folder) / "job.inp").write_text("\n".join([*lines, *step]), encoding="utf-8")
        subprocess.run(["ccx", "-i", "job"], cwd=folder, capture_output=True, check=False, timeout=600)
        result = Path(folder) / "job.dat"
        text = result.read_text(encoding="utf-8") if result.exists() else ""
    rows = re.findall(r"^\s+\d+((?:\s+\S+E[+-]\d+){4})\s*$", text.split("P A R T I C")[0], re.M)
    frequencies = [float(row.split()[2]) for row in rows]
    masses = re.findall(r"^\s+\d+\s+(\S+E[+-]\d+)", text.partition("E F F E C T I V E   M O D A L")[2], re.M)
    elastic = [f for f in frequencies[6:] if f > 0]
    return (sum(map(float, masses)), elastic[0]) if elastic and masses else None


def by_its_points(mesh: SolidMesh, length: float, first: float) -> float:
    """First elastic frequency of a mesh [Hz], integrated as CalculiX does; ``first``, with our points.

    The latter where both are the same, as then attachments count.
    """
    if all(RULES[block.type] == (None, None) for block in mesh.blocks):
        return first
    metres = replace(mesh, nodes=mesh.nodes * length)
    stiffness, mass = assembled(metres, SolidMaterial(YOUNG, POISSON, DENSITY))
    shift = -1e-2 * (2 * np.pi * first) ** 2
    squares = sla.eigsh(stiffness, 7, mass, sigma=shift, which="LM", return_eigenvectors=False)
    return float(np.sqrt(np.sort(squares)[6]) / (2 * np.pi))


def link_of(path: Path, case: Case) -> tuple[Any, SolidMesh]:
    """The free link of a file, with one interface that moves as the corner face of an element does on average."""
    found: list[SolidMesh] = []

    def with_face(mesh: Path, *how: Any) -> SolidMesh:
        read = read_mesh(mesh, *how)
        found.append(read)
        block = read.blocks[0]
        nodes = np.unique(block.elements[0][block.element.faces[0]])
        return replace(read, node_sets={**read.node_sets, "ONE FACE": nodes})

    (young, poisson, density), length, mass = (YOUNG, POISSON, DENSITY), _LENGTHS[case.length], "kg"
    if case.beside == "program":
        (young, poisson, density), mass = _TITANIUM, "lbf*s2/in"
    else:
        young, density = young * length, density * length**3  # in kg, s and this length
    text = f"""
[units]
length = "{case.length}"
mass = "{mass}"
[materials.steel]
youngs_modulus = {young}
poissons_ratio = {poisson}
density = {density}
[solid]
mesh = "{path}"
material = "steel"
mesh_error = 1e9
hex8 = "compatible"
ignore = {list(case.ignore)}
[[interfaces]]
name = "face"
face = "ONE FACE"
coupling = "averaged"
weights = "uniform"
[reduction]
method = "craig-chang"
free_modes = 3
"""
    with tempfile.TemporaryDirectory() as folder:
        description = Path(folder) / "link.toml"
        description.write_text(text, encoding="utf-8")
        with patch("fe_import.models.meshed.read_mesh", with_face):
            return reduce_link(load_link(description)), found[0]


def tried(folder: Path, case: Case) -> tuple[str, bool]:
    """A row of the table, and whether it is as expected."""
    place = folder / SOURCES[case.source].folder / case.path
    start = f"| `{Path(case.path).name}` | {case.source} | {case.program} |"
    if not place.exists():
        return f"{start} not there | | | | |", True
    try:
        model, mesh = link_of(place, case)
    except FEImportError as problem:
        reason = str(problem).replace(str(place), "").lstrip(": ").replace("|", "/")
        right = bool(case.refused) and case.refused in reason
        return f"{start} refused: {case.refused if right else reason} | | | | |", right
    alarms = [check.name for check in model.health if not check.ok]
    mass, first = model.mass_properties.mass, float(model.frequencies_hz[6])
    kinds = ", ".join(f"{len(block)} {block.type}" for block in mesh.blocks)
    beside, limit, ours = None, SAME, first
    if case.beside == "program":
        beside, limit = (mass, _ANSYS), 1e-3  # SOLID186 with reduced integration
    elif case.beside in ("deck", "twin"):
        twin = place if case.beside == "deck" else folder / SOURCES[case.source].folder / case.twin
        lines = free_deck(twin.read_text(encoding="utf-8", errors="replace"))
        sections = any(line.upper().startswith("*SOLID") for line in lines)
        beside = calculix(lines if sections else [*_set_of_all(lines), *_material()])
    elif case.beside:
        deck = mesh_deck(mesh)
        beside = None if deck is None else calculix(deck)
    if beside is not None and case.beside != "program":  # ccx took the file's lengths for metres
        scale = _LENGTHS[case.length]
        beside = (beside[0] * scale**3, beside[1] / scale)
        ours = by_its_points(mesh, scale, first)
    good = not case.refused and not alarms
    numbers = f"{kinds} | {mass:.6g} | {first:.6g} | – | |"
    if beside is not None:
        off = abs(ours / beside[1] - 1)
        good &= off <= limit
        heavy = "" if abs(beside[0] / mass - 1) < 1e-4 else f" (mass {beside[0]:.6g})"
        numbers = f"{kinds} | {mass:.6g} | {first:.6g} | {beside[1]:.6g}{heavy} | {off:.1e}, {WHAT[case.beside]} |"
    return f"{start} {numbers}" + (f" ALARM {alarms}" if alarms else ""), good


def _set_of_all(lines: list[str]) -> list[str]:
    """Solid elements of a deck without sections, put into one set; others left out."""
    result, kept = [], True
    for line in lines:
        if line.startswith("*"):
            kept = not re.match(r"(?i)\*ELEMENT(?!.*TYPE\s*=\s*C3D)", line)
            if "*ELEMENT" in line.upper():
                line = re.sub(r"(?i),\s*ELSET\s*=\s*[^,\s]+", "", line) + ", ELSET=ALL"
            kept &= not line.upper().startswith(("*ELSET", "*NSET", "*SURFACE"))
        if kept:
            result.append(line)
    return result


def op4_files(folder: Path) -> tuple[int, int, list[str]]:
    """How many OUTPUT4 files there are, how many are whole, and what is said of the others."""
    paths = sorted(folder.rglob("*.op4"))
    said = []
    for path in paths:
        try:
            op4_layout(path, path.name)
        except FEImportError as problem:
            said.append(str(problem))
    return len(paths), len(paths) - len(said), said


def main() -> int:
    """Print the table; 1 when something is not as expected."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", default="", help="sources or files whose name holds this")
    parser.add_argument("--sources", action="store_true", help="list where the files come from")
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    if given.sources:
        for name, source in SOURCES.items():
            print(f"{name}: {source.place}, {source.licence}, in FOLDER/{source.folder}")
        return 0
    print("| file | from | program | elements, or why refused | kg | Hz | beside | difference |")
    print("|---|---|---|---|---|---|---|---|")
    faults, read, refused = [], 0, 0
    for case in CASES:
        if given.only not in case.source and given.only not in case.path:
            continue
        row, good = tried(given.folder, case)
        print(row, flush=True)
        faults += [] if good else [case.path]
        read += " refused: " not in row and " not there " not in row
        refused += " refused: " in row
    count, whole, said = op4_files(given.folder)
    print(f"\n{read} read, {refused} refused, {len(faults)} not as expected: {faults}")
    print(f"OUTPUT4: {whole} of {count} files whole", *said, sep="\n  ")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
