"""Link descriptions (TOML): the schema, its defaults, and reading it.

Every record below is one table of the file; unknown keys are errors with a suggestion.
"""

from __future__ import annotations

import contextlib
import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from fe_import.description.check import check_link
from fe_import.description.reduction import Reduction
from fe_import.elements.sections import Section
from fe_import.files.toml import convert, read_toml

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
    check_link(description, str(path))
    return LinkFile(path, description)
