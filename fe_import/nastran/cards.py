"""Nastran bulk data and punch files: their lines into cards, their fields into numbers.

A card has a name and fields of eight columns, of sixteen (a ``*`` behind the name), or between commas; it goes on in
lines whose first field is empty or starts with ``+`` or ``*``.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

from fe_import.errors import Cause, FEImportError

_INTEGER = re.compile(r"[+-]?\d{1,18}")
_REAL = re.compile(r"([+-]?(?:\d+\.\d*|\.\d+|\d+(?=[EDed])))(?:[EDed]?([+-]\d{1,4})|[EDed](\d{1,4}))?")
_COMMENT_IN_WORD = re.compile(r"[^\s,]\$\w")
_DATA_COLUMNS = 72  # the rest of a line names its continuation
_FREE_FORMAT = 10  # a comma among the first ten columns


@dataclass(frozen=True)
class Card:
    """A card: its name, its fields (blank ones too) and where it stands."""

    name: str
    fields: tuple[str, ...]
    where: str

    def field(self, number: int) -> str:
        """Field ``number``, counted from 1 behind the name as the manuals do from 2; empty if there is none."""
        return self.fields[number - 1] if number <= len(self.fields) else ""

    def fault(self, message: str, value: object = None, limit: object = None, remedy: str = "") -> FEImportError:
        """An error at this card."""
        message, remedy = f"{self.name}: {message}", remedy or "mend the card, or export again"
        return FEImportError(Cause.EXPORT, message, where=self.where, value=value, limit=limit, remedy=remedy)

    def integer(self, number: int, default: int | None = None) -> int:
        """Field as a whole number; ``default`` when it is blank."""
        text = self.field(number)
        if not text and default is not None:
            return default
        if not _INTEGER.fullmatch(text):
            raise self.fault(f"field {number + 1} must be a whole number", text)
        return int(text)

    def real(self, number: int, default: float | None = None) -> float:
        """Field as a finite real number in any of Nastran's forms: ``1.5``, ``1.5E+3``, ``1.5D+3``, ``1.5+3``."""
        text = self.field(number)
        if not text and default is not None:
            return default
        match = _REAL.fullmatch(text)
        value = float(f"{match[1]}E{match[2] or match[3] or 0}") if match else math.nan
        if not math.isfinite(value):
            raise self.fault(f"field {number + 1} must be a finite real number", text)
        return value


def read_cards(
    lines: Iterable[str], names: frozenset[str] | None, where: str | Callable[[int], str]
) -> Iterator[Card]:
    """The cards with given names, in order.

    Parameters
    ----------
    lines : iterable of str
        Executive and case control before ``BEGIN BULK`` may be among them, cards behind ``ENDDATA`` are left out.
    names : frozenset of str or None
        In capitals; all cards when None.
    where : str or callable
        Name of the file, for messages; or the place of a line by its number, from 1.

    Raises
    ------
    FEImportError
        ``EXPORT``: an INCLUDE that would have to be followed; a line behind a card that is neither a card nor its
        continuation.
    """
    place = where if callable(where) else f"{where}: line {{}}".format
    name, fields, start = "", [], 0
    for number, raw in enumerate(lines, start=1):
        line = raw.partition("$")[0].rstrip().expandtabs(8)
        if not line:
            continue
        head, data, more = _split(line)
        if more and (name or head[:1].isalpha()) and (names is None or name or head.rstrip("* ").upper() in names):
            raise _damaged(place(number), "more fields than a line holds", raw)
        if name and _COMMENT_IN_WORD.search(raw):
            raise _damaged(place(number), "a comment begins within a field", raw)
        if not head or head[0] in "+*":
            if name:
                fields += data
            continue
        if name:
            if not head[0].isalpha():
                message = "neither a card nor the continuation of one"
                if head.startswith("="):
                    message = "cards repeated with = and * are not followed"
                raise _damaged(place(number), message, raw)
            yield Card(name, tuple(fields), place(start))
        name = ""
        keyword = head.rstrip("* ").upper()
        if keyword == "ENDDATA":
            return
        if keyword.startswith("INCLUDE"):
            raise FEImportError(
                Cause.EXPORT,
                "INCLUDE is not followed",
                where=place(number),
                remedy="give one file that holds all cards",
            )
        if names is None or keyword in names:
            name, fields, start = keyword, data, number
    if name:
        yield Card(name, tuple(fields), place(start))


def _damaged(where: str, message: str, line: str) -> FEImportError:
    return FEImportError(Cause.EXPORT, message, where=where, value=line.strip()[:60], remedy="export again")


def _split(line: str) -> tuple[str, list[str], bool]:
    """First field, the fields behind it (always eight, or four wide ones), and whether numbers are left over.

    Between commas one more field may name the continuation.
    """
    if "," in line[:_FREE_FORMAT]:
        head, *data = (part.strip() for part in line.split(","))
        count = 4 if "*" in head else 8
        left = [text for text in data[count:] if text]
        more = len(left) > 1 or any(_INTEGER.fullmatch(text) or _REAL.fullmatch(text) for text in left)
        return head, (data + [""] * count)[:count], more
    head = line[:8].strip()
    width = 16 if "*" in head else 8
    return head, [line[at : at + width].strip() for at in range(8, _DATA_COLUMNS, width)], False
