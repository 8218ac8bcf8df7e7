"""Lines of an Abaqus or CalculiX deck: keywords with their parameters, data lines, numbers."""

from __future__ import annotations

import math
import re
from pathlib import Path

from fe_import.errors import FEImportError, shortened
from fe_import.files.includes import MOST_INCLUDED, included_name, resolved
from fe_import.files.text import TextFile

_FLAT = "write the mesh as one flat deck with *NODE, *ELEMENT, *NSET, *ELSET and *SURFACE"
_INTEGER = re.compile(r"[+-]?\d{1,18}\Z")
_PARAMETERS = {
    "NODE": ("NSET", "SYSTEM", "INPUT"),
    "ELEMENT": ("TYPE", "ELSET", "INPUT", "OFFSET", "SOLIDELEMENTNUMBERING"),
    "NSET": ("NSET", "ELSET", "GENERATE", "INSTANCE", "INTERNAL", "SORTED", "UNSORTED"),
    "ELSET": ("ELSET", "GENERATE", "INSTANCE", "INTERNAL", "SORTED", "UNSORTED"),
}
_SHORTEST = 3  # letters of a parameter that is cut short, as in GEN


class DeckReader:
    """Keyword lines and data lines of a deck and of what it includes; comments (``**``) and blank lines left out.

    Parameters
    ----------
    file : TextFile
    first : Path
        Whose folder the names of included files start at.
    """

    def __init__(self, file: TextFile, first: Path) -> None:
        self._files, self._first, self._included = [file], first, 0
        self._line = self._at = (file, 0)
        self._waiting = self._next()

    def _next(self) -> str | None:
        """The next line; `_at` tells where it stands."""
        while True:
            file = self._files[-1]
            line = file.line()
            if line is None:
                if len(self._files) == 1:
                    return None
                self._files.pop().close()
                continue
            self._at = (file, file.number)
            line = line.strip()
            if line[:1] == "*" and (name := included_name(line)) is not None:
                self._include(name, file)
            elif line and not line.startswith("**"):
                return line

    def _include(self, name: str, file: TextFile) -> None:
        here = self._first if len(self._files) == 1 else file.path
        target = resolved(name, here, self._first)
        self._included += 1
        if target is None or self._included > MOST_INCLUDED or any(f.path.samefile(target) for f in self._files):
            why = "it includes itself, or too many files are included"
            if target is None:
                why = "there is no such file, or this one is packed"
            message, remedy = f"*INCLUDE cannot be followed: {why}", "join the files into one"
            raise file.failure(message, line=file.number, value=shortened(name), remedy=remedy)
        self._files.append(TextFile(target, str(target), file.cause))

    def close(self) -> None:
        """Close the included files."""
        while len(self._files) > 1:
            self._files.pop().close()

    def _take(self) -> str:
        line, self._line = self._waiting or "", self._at
        self._waiting = self._next()
        return line

    def data(self) -> list[str] | None:
        """Fields of the next data line, None before the next keyword or at the end."""
        if self._waiting is None or self._waiting.startswith("*"):
            return None
        fields = [f.strip() for f in self._take().split(",")]
        return fields[:-1] if len(fields) > 1 and not fields[-1] else fields

    def keyword(self) -> tuple[str, dict[str, str]] | None:
        """Name and parameters of the next keyword, names in capitals; data lines before it are skipped."""
        while self.data() is not None:
            pass
        if self._waiting is None:
            return None
        line = self._take()
        while line.endswith(",") and self._waiting is not None and self._waiting[0].isalpha() and "=" in self._waiting:
            line += self._take()  # others are data behind a comma too many
        name, *fields = line[1:].split(",")
        pairs = (given.partition("=") for given in fields if given.strip())
        options = {"".join(key.split()).upper(): value.strip().strip('"') for key, _, value in pairs}
        return " ".join(name.split()).upper(), options

    def known(self, keyword: str, options: dict[str, str]) -> dict[str, str]:
        """The parameters of a keyword that is read, those cut short in full."""
        if keyword not in _PARAMETERS:
            return options
        result = {}
        for name, value in options.items():
            full = [p for p in _PARAMETERS[keyword] if p == name or (p.startswith(name) and len(name) >= _SHORTEST)]
            if len(full) != 1:
                known = ", ".join(_PARAMETERS[keyword])
                raise self.fault(f"*{keyword} has no such parameter", shortened(name), f"known: {known}")
            result[full[0]] = value
        if "INPUT" in result:
            raise self.fault(f"*{keyword}, INPUT is not followed", result["INPUT"], "join the files into one")
        return result

    @property
    def place(self) -> str:
        """Of the line that was read last: its number, in included files with their name."""
        file, number = self._line
        return f"line {number}" if file is self._files[0] else f"{file.path.name}: line {number}"

    def fault(self, message: str, value: str | None = None, remedy: str = _FLAT) -> FEImportError:
        """An error at the line that was read last."""
        file, number = self._line
        return file.failure(message, line=number, value=value, remedy=remedy)

    def integer(self, text: str) -> int:
        """A whole number."""
        if not _INTEGER.match(text):
            raise self.fault("expected a whole number", shortened(text))
        return int(text)

    def real(self, text: str) -> float:
        """A finite number, 0 for an empty field."""
        try:
            value = float(text.upper().replace("D", "E") or 0.0)
        except ValueError:
            value = math.nan
        if not math.isfinite(value) or "_" in text:
            raise self.fault("expected a finite number", shortened(text))
        return value
