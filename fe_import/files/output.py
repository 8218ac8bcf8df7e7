"""What speaks against writing a file, known before any work is done."""

from __future__ import annotations

import os
from pathlib import Path


def refusal(target: Path) -> tuple[str, str] | None:
    """Why a path cannot be written, and what to do; None if it can."""
    folder = target.parent
    if not folder.is_dir():
        return f"no folder {str(folder)!r}", "make the folder first"
    if target.is_dir():
        return "it is a folder", "give the name of a file"
    if target.exists() and not target.is_file():
        return "it is not a regular file", "choose another path"
    if not os.access(folder, os.W_OK | os.X_OK) or (target.exists() and not os.access(target, os.W_OK)):
        return "no permission", "choose another folder, or change its permissions"
    return None
