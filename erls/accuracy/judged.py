"""A part of a stated error."""

from __future__ import annotations

from typing import NamedTuple

LEAST, MOST = 2.0, 3.0
"""Of the distance from a better run: that is off by its integration, too, and may know no terms of second order."""


class Judged(NamedTuple):
    """Metres, or None, and what is to be said of it; ``apart`` the distance of a better run, where one was made [m]."""

    error: float | None
    note: str = ""
    apart: float | None = None

    def grown(self, times: float, integration: float | None) -> Judged:
        """So many times the error, as the motion makes disturbances grow; but no more than `MOST` times the distance of
        a better run, which holds what they grow to, and no less than `LEAST` times what the integration leaves of it.
        """
        error = None if self.error is None else times * self.error
        if self.apart is None:
            return self._replace(error=error)
        least = LEAST * max(0.0, self.apart - (integration or 0.0))
        most = MOST * self.apart
        return self._replace(error=most if error is None else min(max(error, least), most))
