"""Descriptions of links over the design, and what follows from each alone, made once for each set of its values."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from erls.maths.so3 import Array
from erls.optimization.problem import Problem
from erls.scene.build import link_description
from fe_import.description.check import check_link
from fe_import.description.link import LinkFile
from fe_import.description.numbers import tables_of
from fe_import.description.records import LinkDescription
from fe_import.files.toml import convert, place_of

T = TypeVar("T")
_MOST = 4000  # sets of values that are kept


class LinkNumbers:
    """Of the links of a problem's scene, by their numbers there."""

    def __init__(self, problem: Problem) -> None:
        self._factors, scene = problem.factors, problem.scene
        links = scene.record.links
        self._files = [link_description(scene, link) if link.model else None for link in links]
        self._own = [
            [(n, p.within) for n, p in enumerate(problem.parameters) if p.link == k and p.within]
            for k in range(len(links))
        ]
        self._kept: dict[tuple[str, int, bytes], Any] = {}

    def at(self, k: int, x: Array) -> LinkDescription | None:
        """Description of a link at a design (v,); None of one that has none.

        Raises
        ------
        FEImportError
            A value is refused.
        """
        file = self._files[k]
        return None if file is None else self.kept("description", k, x, lambda: self._described(file, k, x))

    def kept(self, name: str, k: int, x: Array, make: Callable[[], T]) -> T:
        """What follows from the values of a link at a design."""
        values = self._factors[[n for n, _ in self._own[k]]] @ x
        key = name, k, values.tobytes()
        if key not in self._kept:
            if len(self._kept) > _MOST:
                self._kept.clear()
            self._kept[key] = make()
        found: T = self._kept[key]
        return found

    def _described(self, file: LinkFile, k: int, x: Array) -> LinkDescription:
        if not self._own[k]:
            return file.description
        data, values = tables_of(file.description), self._factors @ x
        for n, within in self._own[k]:
            table, place = place_of(data, within, f"{file.path}: {within}")
            table[place] = float(values[n])
        description = convert(data, LinkDescription, str(file.path))
        check_link(description, str(file.path))
        return description
