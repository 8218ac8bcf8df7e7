"""Reading a scene of bodies."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from erls.errors import SceneError
from erls.scene.bodies.check import check_body_scene
from erls.scene.bodies.schema import BodySceneRecord
from erls.scene.chain import is_body_scene
from erls.scene.overrides import apply_override
from fe_import.files.toml import convert, read_toml


@dataclass(frozen=True)
class BodyScene:
    """A checked scene and its file; relative paths start at ``folder``."""

    path: Path
    record: BodySceneRecord

    @property
    def name(self) -> str:
        """Its name, or that of its file."""
        return self.record.name or self.path.name.removesuffix(".toml")

    @property
    def folder(self) -> Path:
        """Folder of the file."""
        return self.path.parent


def load_body_scene(path: Path | str, overrides: Iterable[str] = ()) -> BodyScene:
    """Read and check a scene of bodies, beams and connections.

    Parameters
    ----------
    path : Path or str
    overrides : iterable of str
        ``KEY=VALUE`` as for `erls.scene.chain.load_scene`: ``simulation.tangent=full``, ``beams.strip.elements=16``.

    Raises
    ------
    SceneError, FEImportError
        Naming file, field, value and remedy.

    Examples
    --------
    >>> from erls.scene.bodies.read import load_body_scene
    >>> load_body_scene("data/statics/roll_up.toml", ["beams.strip.elements=8"]).record.beams[0].elements
    8
    """
    path = Path(path)
    data: dict[str, Any] = read_toml(path, SceneError)
    for text in overrides:
        apply_override(data, text)
    record = convert(data, BodySceneRecord, str(path), SceneError)
    check_body_scene(record, str(path))
    return BodyScene(path, record)


__all__ = ["BodyScene", "is_body_scene", "load_body_scene"]
