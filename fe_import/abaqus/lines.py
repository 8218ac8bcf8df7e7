"""Lines of an Abaqus or CalculiX deck: keywords with their parameters, data lines, numbers."""

from __future__ import annotations

import math
import re

from fe_import.errors import FEImportError, shortened
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
    """Keyword lines and data lines of a deck; comments (``**``) and blank lines left out."""

    def __init__(self, file: TextFile) -> None:
        self.file, self._line = file, 0
        self._waiting, self._at = self._next()

    def _next(self) -> tuple[str | None, int]:
        while (line := self.file.line()) is not None:
            line = line.strip()
            if line and not line.startswith("**"):
                return line, self.file.number
        return None, self.file.number

    def _take(self) -> str:
        line, self._line = self._waiting or "", self._at
        self._waiting, self._at = self._next()
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
        while line.endswith(",") and self._waiting is not None and not self._waiting.startswith("*"):
            line += self._take()
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
    def number(self) -> int:
        """Of the line that was read last."""
        return self._line

    def fault(self, message: str, value: str | None = None, remedy: str = _FLAT) -> FEImportError:
        """An error at the line that was read last."""
        return self.file.failure(message, line=self._line, value=value, remedy=remedy)

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
