"""Points of a sweep as they go to workers: some at a time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

from erls.studies.sweep.evaluate import Task
from erls.studies.sweep.points import Points


class Chunks(Sequence[Task]):
    """Points in chunks of about a size, each made when it is asked for.

    Points with the same links stay together where that makes no chunk twice as long: whoever gets them reduces those.
    """

    def __init__(self, task: Task, points: Points, numbers: Sequence[int], size: int) -> None:
        self._task, self._points, self._numbers = task, points, numbers
        of_links = [k for k, key in enumerate(points.keys) if key.startswith("links.")]
        self._ends = list(range(size, len(numbers), size)) if not of_links else list(self._changes(of_links, size))
        self._ends += [len(numbers)] if numbers else []

    def _changes(self, of_links: list[int], size: int) -> Iterator[int]:
        """Where links change after so many points, or where there are twice as many."""
        begun, before = 0, None
        for at, number in enumerate(self._numbers):
            row = self._points.row(number)
            links = [row[k] for k in of_links]
            if at - begun >= size and (links != before or at - begun >= 2 * size - 1):
                yield at
                begun = at
            before = links

    def __len__(self) -> int:
        return len(self._ends)

    def __getitem__(self, k: Any) -> Any:
        chunk = self._numbers[self._ends[k - 1] if k else 0 : self._ends[k]]
        return replace(self._task, rows=[(number, self._points.row(number)) for number in chunk])
