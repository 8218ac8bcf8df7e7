"""Messages of this program for whoever listens: the logger ``erls`` of the standard library's ``logging``."""

from __future__ import annotations

import logging

LOGGER = "erls"

logging.getLogger(LOGGER).addHandler(logging.NullHandler())  # silent unless somebody listens: runs keep their warnings


def log(text: str) -> None:
    """Where functions that take time tell what they do, unless they are given somebody else to tell.

    ``logging.basicConfig(level="INFO")`` shows it.
    """
    level = logging.WARNING if text.startswith("warning: ") else logging.INFO
    logging.getLogger(LOGGER).log(level, text.removeprefix("warning: "))
