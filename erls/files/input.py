"""Files that are read as a whole."""

from __future__ import annotations

import stat
from pathlib import Path

from erls.errors import Cause, SceneError


def content_of(path: Path, kind: str, most: int, where: str = "", remedy: str = "") -> bytes:
    """The bytes of a file.

    Parameters
    ----------
    path : Path
    kind : str
        What it should be, for messages: "a table".
    most : int
        Bytes that it may have.
    where : str
        Field that names it, for messages; the path unless given.
    remedy : str
        Against a file that is too large or cannot be read; says to give one of its kind unless given.

    Raises
    ------
    SceneError
        FILE_NOT_FOUND; NOT_READABLE: no regular file (a pipe would never end), too large, or refused by the system.
    """
    place, plain = where or str(path), remedy or f"give {kind}"
    try:
        status = path.stat()
        if not stat.S_ISREG(status.st_mode):
            raise SceneError(Cause.NOT_READABLE, f"{path} is not a file", where=place, remedy=f"give {kind}")
        if status.st_size > most:
            message, limit = f"{path} is too large for {kind}", f"{most} bytes"
            raise SceneError(
                Cause.NOT_READABLE, message, where=place, value=status.st_size, limit=limit, remedy=plain
            )
        return path.read_bytes()
    except FileNotFoundError:
        message, remedy = f"no such file: {path}", "check the path"
        if where:
            remedy += ", relative paths start at the scene file"
        raise SceneError(Cause.FILE_NOT_FOUND, message, where=place, remedy=remedy) from None
    except (OSError, ValueError) as problem:
        message = f"{path} cannot be read: {problem}"
        raise SceneError(Cause.NOT_READABLE, message, where=place, remedy=f"give {kind}") from None


def text_of(path: Path, kind: str, most: int, where: str = "", remedy: str = "") -> str:
    """The text of a file in UTF-8, lines ended by a line feed; see `content_of`."""
    content = content_of(path, kind, most, where, remedy)
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as problem:
        message = f"{path} cannot be read: {problem}"
        place = where or str(path)
        raise SceneError(Cause.NOT_READABLE, message, where=place, remedy=f"give {kind} in UTF-8") from None
    return text.replace("\r\n", "\n").replace("\r", "\n")
