"""The files that a scene reads: none of them may be the output of a command."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec

from erls.scene.chain import Scene
from erls.scene.read import AnyScene
from fe_import.description.link import LinkFile, load_link
from fe_import.errors import ReportedError


def files_of_link(link: LinkFile) -> list[Path]:
    """The description, its mesh or its matrices."""
    return [link.path, *(link.folder / name for name in link.description.files())]


def files_of(scene: AnyScene) -> list[Path]:
    """The scene, its links with what they name, and its tables; what cannot be read is left to who reads it."""
    found = [scene.path, *(scene.folder / name for name in _tables(msgspec.to_builtins(scene.record)))]
    if not isinstance(scene, Scene):
        found += [scene.folder / shell.mesh for shell in scene.record.shells if shell.mesh]
    for link in scene.record.links if isinstance(scene, Scene) else ():
        if link.rigid is not None and link.rigid.surface:
            found.append(scene.folder / link.rigid.surface)
        if link.modal_file:
            found.append(scene.folder / link.modal_file)
        if link.model:
            found.append(scene.folder / link.model)
            try:
                found += files_of_link(load_link(scene.folder / link.model))[1:]
            except ReportedError:
                continue
    return found


def _tables(value: Any) -> Iterator[str]:
    """Names of all CSV files within a record."""
    if isinstance(value, dict):
        if value.get("shape") == "table" and value.get("file"):
            yield str(value["file"])
        for inner in value.values():
            yield from _tables(inner)
    elif isinstance(value, (list, tuple)):
        for inner in value:
            yield from _tables(inner)
