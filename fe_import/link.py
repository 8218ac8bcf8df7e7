"""Link descriptions (TOML): the schema, its defaults, and reading it.

Every record below is one table of the file; unknown keys are errors with a suggestion.
"""

from __future__ import annotations

import contextlib
import hashlib
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from fe_import.elements.sections import Section, check_section
from fe_import.errors import Cause, FEImportError, ReportedError
from fe_import.link_reduction import Reduction, check_reduction_options
from fe_import.toml_file import choose, convert, read_toml

COUPLINGS = ("rigid", "averaged")
WEIGHTS = ("area", "uniform")
_METHOD = Reduction().method

Vector = tuple[float, float, float]
Inertia = tuple[float | Vector, float | Vector, float | Vector]  # [Ixx, Iyy, Izz] or a 3x3 matrix


class _Record(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    pass


class Units(_Record, frozen=True):
    """Units of the description and its mesh; converted to SI at the border."""

    length: str = "m"
    mass: str = "kg"
    time: str = "s"


class Material(_Record, frozen=True):
    """Isotropic linear elastic material: E [Pa], ν, ρ [kg/m³] (in the stated units)."""

    youngs_modulus: float
    poissons_ratio: float
    density: float


class Member(_Record, frozen=True):
    """A straight member between two named nodes, divided into ``elements`` equal elements.

    ``local_z`` is the direction of the section's height; the default is z, or y for members along z. Inner nodes
    are named ``FROM-TO/1`` ... in order.
    """

    start: str = msgspec.field(name="from")
    end: str = msgspec.field(name="to")
    material: str = ""
    section: str = ""
    elements: int = 1
    local_z: Vector | None = None


class Frame(_Record, frozen=True):
    """A link made of beams.

    ``theory``: ``timoshenko`` or ``euler-bernoulli``; ``mass``: ``consistent`` or ``lumped``; ``rotary_inertia``:
    cross sections resist turning; ``torsion``: ``saint-venant`` or ``polar``.
    """

    nodes: dict[str, Vector]
    members: list[Member]
    theory: str = "timoshenko"
    mass: str = "consistent"
    rotary_inertia: bool = True
    torsion: str = "saint-venant"


class Region(_Record, frozen=True):
    """The elements of a named set of the mesh, and their material."""

    set: str
    material: str


class Solid(_Record, frozen=True):
    """A link meshed with solid elements; ``mesh`` is any file that meshio reads.

    ``material`` holds for the whole mesh, or ``regions`` give one per element set. ``nodes`` names positions
    (nearest mesh node) that scenes may refer to.
    """

    mesh: str
    material: str = ""
    regions: list[Region] = []
    nodes: dict[str, Vector] = {}


class Matrices(_Record, frozen=True):
    """A link whose mass and stiffness matrices a finite-element program exported.

    ``format`` names a reader (`fe_import.exports`), ``files`` the files by their role (``stiffness``, ``mass``,
    ``dofs``, ``mesh`` ...), ``options`` what the reader wants to know. ``nodes`` names nodes that interfaces, masses
    and scenes may refer to, by their number in that program or by position (nearest node).
    """

    format: str
    files: dict[str, str]
    options: dict[str, Any] = {}
    nodes: dict[str, int | Vector] = {}


class PointMass(_Record, frozen=True):
    """Mass and inertia ([Ixx, Iyy, Izz] or a 3x3 matrix about the node) added to a node or interface."""

    node: str
    mass: float = 0.0
    inertia: Inertia = (0.0, 0.0, 0.0)


class Interface(_Record, frozen=True):
    """A node where a joint sits: on a frame ``node``, or on a ``face`` (node or face set) of a solid.

    ``coupling``: the face follows the interface node (``rigid``), or the node moves as the face does on average
    (``averaged``), with each node's share of the ``area`` as its weight (the default on a mesh) or ``uniform`` ones.
    ``position`` defaults to the centre of the face.
    """

    name: str
    node: str = ""
    face: str = ""
    coupling: str = "rigid"
    weights: str = ""
    position: Vector | None = None


class Recovery(_Record, frozen=True):
    """Where stress (solids) or section forces (frames) can be found from the modal coordinates later.

    ``nodes``: named nodes; ``sets``: node or element sets of the mesh, or members of a frame (``FROM-TO``); or
    ``all``.
    """

    nodes: list[str] = []
    sets: list[str] = []
    all: bool = False


class Rayleigh(_Record, frozen=True):
    """Damping matrix ``alpha`` M + ``beta`` K, in 1/s and s."""

    alpha: float = 0.0
    beta: float = 0.0


class Damping(_Record, frozen=True):
    """Modal damping: one ``ratio`` for all elastic modes, ``ratios`` from the lowest on, or ``rayleigh``."""

    ratio: float | None = None
    ratios: list[float] | None = None
    rayleigh: Rayleigh | None = None


class LinkDescription(_Record, frozen=True):
    """A link: exactly one of ``frame``, ``solid`` and ``matrices``, its interfaces and its reduction.

    Without a table ``recovery`` the modal file holds nothing for stresses.
    """

    interfaces: list[Interface]
    name: str = ""
    units: Units = Units()
    materials: dict[str, Material] = {}
    sections: dict[str, Section] = {}
    frame: Frame | None = None
    solid: Solid | None = None
    matrices: Matrices | None = None
    masses: list[PointMass] = []
    reduction: Reduction = Reduction()
    damping: Damping = Damping()
    recovery: Recovery | None = None

    def files(self) -> list[str]:
        """The files that it names, as they stand there."""
        if self.solid is not None:
            return [self.solid.mesh]
        return [] if self.matrices is None else [name for _, name in sorted(self.matrices.files.items())]


@dataclass(frozen=True)
class LinkFile:
    """A link description with the file that it came from; relative paths start at ``folder``."""

    path: Path
    description: LinkDescription

    @property
    def folder(self) -> Path:
        """Folder of the file."""
        return self.path.parent

    def content_hash(self) -> str:
        """SHA-256 of everything that the reduction depends on: the description and the files it names."""
        digest = hashlib.sha256(msgspec.json.encode(self.description, order="deterministic"))
        for name in self.description.files():
            with contextlib.suppress(OSError, ValueError):  # reported with its name when it is read
                digest.update((self.folder / name).read_bytes())
        return digest.hexdigest()


def load_link(path: Path | str, overrides: dict[str, Any] | None = None) -> LinkFile:
    """Read and check a link description.

    Parameters
    ----------
    path : Path or str
    overrides : dict, optional
        Fields of the ``reduction`` table that replace those of the file (``method``, ``elastic_modes`` ...).

    Raises
    ------
    FEImportError
        Naming file, field, value and remedy.
    """
    path = Path(path)
    data = read_toml(path)
    if overrides:
        table = data.setdefault("reduction", {})
        if isinstance(table, dict):
            if overrides.get("method", table.get("method", _METHOD)) != table.get("method", _METHOD):
                for field in set(table) - {"form"}:  # they belong to the file's method
                    del table[field]
            table.update(overrides)
    description = convert(data, LinkDescription, str(path))
    if not description.name:
        description = msgspec.structs.replace(description, name=path.name.removesuffix(".toml"))
    _check(description, str(path))
    return LinkFile(path, description)


def _fail(where: str, message: str, value: Any = None, remedy: str = "", limit: Any = None) -> FEImportError:
    return FEImportError(Cause.BAD_FIELD, message, where=where, value=value, limit=limit, remedy=remedy)


_CHOICES = {
    "frame.theory": ("timoshenko", "euler-bernoulli"),
    "frame.mass": ("consistent", "lumped"),
    "frame.torsion": ("saint-venant", "polar"),
}


def _check(link: LinkDescription, file: str) -> None:
    """The conditions that the types cannot state."""
    if [link.frame, link.solid, link.matrices].count(None) != 2:
        message = "give exactly one of the tables 'frame', 'solid' and 'matrices'"
        raise _fail(file, message, remedy="a link has one model")
    for field, options in _CHOICES.items():
        table, name = field.split(".")
        record = getattr(link, table)
        if record is not None and getattr(record, name) not in options:
            raise _fail(
                f"{file}: {field}", "unknown choice", getattr(record, name), remedy="one of " + ", ".join(options)
            )
    for name, m in link.materials.items():
        place = f"{file}: materials.{name}"
        for field in ("youngs_modulus", "density"):
            value = getattr(m, field)
            if not (math.isfinite(value) and value > 0):
                raise _fail(f"{place}.{field}", f"{field} must be positive", value, "give a value above 0")
        if not -1 < m.poissons_ratio < 0.5:
            raise _fail(
                f"{place}.poissons_ratio", "Poisson's ratio out of range", m.poissons_ratio, "between -1 and 0.5"
            )
    for name, section in link.sections.items():
        check_section(section, f"{file}: sections.{name}")
    for table, nodes in (("frame", link.frame), ("solid", link.solid), ("matrices", link.matrices)):
        for name, position in nodes.nodes.items() if nodes is not None else ():
            place = f"{file}: {table}.nodes.{name}"
            if not name or "\0" in name:
                raise _fail(place, "a name must not be empty", name, "name the node")
            if not isinstance(position, int) and not all(map(math.isfinite, position)):
                raise _fail(place, "a position must be finite", position, "give three numbers")
    if link.matrices is not None:
        for field in ("materials", "sections"):
            if getattr(link, field):
                message = "exported matrices hold stiffness and mass already"
                raise _fail(f"{file}: {field}", message, remedy="remove the table")
    if not link.interfaces:
        raise _fail(f"{file}: interfaces", "a link needs at least one interface", remedy="add [[interfaces]]")
    seen: set[str] = set()
    for k, i in enumerate(link.interfaces):
        if i.name in seen or not i.name:
            raise _fail(f"{file}: interfaces[{k}].name", "interface names must differ", i.name, "rename one")
        seen.add(i.name)
        choose(i.coupling, COUPLINGS, f"{file}: interfaces[{k}].coupling")
        if i.weights:
            choose(i.weights, WEIGHTS, f"{file}: interfaces[{k}].weights")
            if i.coupling != "averaged":
                message, remedy = "only averages have weights", 'remove it, or use coupling = "averaged"'
                raise _fail(f"{file}: interfaces[{k}].weights", message, i.weights, remedy)
        if i.position is not None and not all(map(math.isfinite, i.position)):
            raise _fail(
                f"{file}: interfaces[{k}].position", "a position must be finite", i.position, "give three numbers"
            )
    check_reduction_options(link.reduction, seen, f"{file}: reduction")
    if link.reduction.form == "physical" and link.damping != Damping():
        message = "the physical form carries no modal damping"
        raise _fail(f"{file}: damping", message, remedy="remove it, or use form = 'orthonormal'")
    if link.reduction.form == "physical" and link.recovery is not None:
        message = "the physical form carries no recovery data"
        raise _fail(f"{file}: recovery", message, remedy="remove it, or use form = 'orthonormal'")
    for k, p in enumerate(link.masses):
        if not (math.isfinite(p.mass) and p.mass >= 0):
            raise _fail(f"{file}: masses[{k}].mass", "a mass cannot be negative", p.mass, "give 0 or more")
    check_damping(link.damping, f"{file}: damping")


def check_damping(d: Damping, where: str, error: type[ReportedError] = FEImportError) -> None:
    """Refuse damping that is stated twice, negative, or more than critical.

    Raises
    ------
    ReportedError
        Of class ``error``, BAD_FIELD.
    """
    given = [n for n in ("ratio", "ratios", "rayleigh") if getattr(d, n) is not None]
    if len(given) > 1:
        kinds = " and ".join(given)
        raise error(Cause.BAD_FIELD, "more than one kind of damping", where=where, value=kinds, remedy="keep one")
    for field, value in _damping_numbers(d):
        place = f"{where}.{field}"
        if not (math.isfinite(value) and value >= 0):
            message = "damping cannot be negative"
            raise error(Cause.BAD_FIELD, message, where=place, value=value, remedy="give 0 or more")
        if value > 1 and "rayleigh" not in field:
            message, remedy = "a damping ratio above 1 is more than critical", "for 2 percent give 0.02"
            raise error(Cause.BAD_FIELD, message, where=place, value=value, limit=1, remedy=remedy)


def _damping_numbers(d: Damping) -> Iterator[tuple[str, float]]:
    if d.ratio is not None:
        yield "ratio", d.ratio
    for k, value in enumerate(d.ratios or []):
        yield f"ratios[{k}]", value
    if d.rayleigh is not None:
        yield "rayleigh.alpha", d.rayleigh.alpha
        yield "rayleigh.beta", d.rayleigh.beta
