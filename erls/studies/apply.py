"""A copy of a scene with some fields changed; comments and order stay."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import tomlkit

from erls.errors import Cause, SceneError
from erls.output_file import check_writable, replacing
from erls.scene import load_scene
from erls.scene_overrides import apply_override


def check_copy(path: Path, scene: Path) -> None:
    """Refuse a copy that could not be written, or whose relative paths would lead elsewhere, before any work is done.

    Raises
    ------
    SceneError
        Not beside the scene, the scene itself, or not writable.
    """
    target = check_writable(path)
    message = ""
    if target == scene.resolve():
        message, remedy = "this is the scene itself", "give the copy another name"
    elif target.parent != scene.resolve().parent:
        message, remedy = "the copy must lie beside the scene, whose paths it keeps", f"write it into {scene.parent}"
    elif target.suffix != ".toml":
        message, remedy = "a scene is a TOML file", "end in .toml"
    if message:
        raise SceneError(Cause.NOT_WRITABLE, message, where="--apply", value=str(path), remedy=remedy)


def write_copy(path: Path, scene: Path, overrides: Sequence[str], note: str) -> None:
    """Write the scene with ``overrides`` applied and ``note`` as a comment at its top; refuses what does not load.

    Raises
    ------
    SceneError
    """
    document = tomlkit.parse(scene.read_text(encoding="utf-8-sig"))
    for text in overrides:
        apply_override(document, text)
    with replacing(path) as temporary:
        lines = "".join(f"# {line}\n" for line in note.splitlines())
        temporary.write_text(lines + tomlkit.dumps(document), encoding="utf-8")
        load_scene(temporary)
