"""A copy of a scene with some fields changed; comments and order stay, and new fields stand in their own tables."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import tomlkit
from tomlkit import TOMLDocument
from tomlkit.container import Container
from tomlkit.items import AoT, Comment, Item, Table, Whitespace

from erls.errors import Cause, SceneError
from erls.files.output import check_writable, replacing
from erls.scene.overrides import apply_override
from erls.scene.read import load_chain

ACCURACY_FIELDS = {"generalized_alpha": ("step",), "lobatto": ("tolerance",), "auto": ("tolerance",)}


def check_copy(path: Path, scene: Path, option: str = "--apply") -> None:
    """Refuse a copy that could not be written, or whose relative paths would lead elsewhere, before any work is done.

    Parameters
    ----------
    path : Path
        Of the copy.
    scene : Path
    option : str
        That gave the path.

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
        raise SceneError(Cause.NOT_WRITABLE, message, where=option, value=str(path), remedy=remedy)


def write_copy(path: Path, scene: Path, overrides: Sequence[str], note: str) -> tuple[str, ...]:
    """Write the scene with ``overrides`` applied and ``note`` as a comment at its top; refuses what does not load.

    Where they name an integrator, fields that it does not use are removed; a comment at the top says so.

    Returns
    -------
    tuple of str
        The fields removed.

    Raises
    ------
    SceneError
    """
    document = tomlkit.parse(scene.read_text(encoding="utf-8-sig"))
    trailing = list(_trailing(document))
    for text in overrides:
        apply_override(document, text)
    removed = _without_dead_fields(document) if any(o.startswith("simulation.integrator=") for o in overrides) else ()
    for container, items in trailing:
        for item in items:
            container.append(None, item)
    lines = note.splitlines()
    if removed:
        lines.append(f"removed, since the integrator does not use them: {', '.join(removed)}")
    with replacing(path) as temporary:
        text = "".join(f"# {line}\n" for line in lines) + tomlkit.dumps(document)
        temporary.write_text(text, encoding="utf-8")
        load_chain(temporary)
    return removed


def _trailing(container: Container) -> Iterator[tuple[Container, list[Item]]]:
    """Takes the comments and blank lines off the end of every table, where new fields are to stand before them."""
    for _, item in container.body:
        if isinstance(item, Table):
            yield from _trailing(item.value)
        elif isinstance(item, AoT):
            for table in item.body:
                yield from _trailing(table.value)
    items: list[Item] = []
    while container.body and isinstance(container.body[-1][1], Comment | Whitespace):
        items.insert(0, container.body.pop()[1])
    if items:
        yield container, items


def _without_dead_fields(document: TOMLDocument) -> tuple[str, ...]:
    """Removes settings of accuracy of other integrators than the one there is."""
    settings = document["simulation"]
    used = ACCURACY_FIELDS.get(str(settings["integrator"]), ("step", "rtol", "atol"))
    dead = tuple(name for name in ("step", "tolerance", "rtol", "atol") if name in settings and name not in used)
    for name in dead:
        del settings[name]
    return tuple(f"simulation.{name}" for name in dead)
