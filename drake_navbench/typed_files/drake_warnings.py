"""Drake's warnings about a model's file: few of them, each with the name of the file."""

from __future__ import annotations

import logging
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from drake_navbench.errors import as_line

# The name that Drake gives to a parsed text; the line numbers in it are not those of the file.
TEXT_NAME = re.compile(r"<literal-string>\.\w+(:\d+)?")
MAX_WARNINGS = 3


@contextmanager
def few_warnings(path: Path) -> Iterator[None]:
    """Shows Drake's first warnings with the file's name; counts the others."""
    logger = logging.getLogger("drake")
    count = 0

    def is_let_through(record: logging.LogRecord) -> bool:
        nonlocal count
        count += 1
        record.msg = as_line(TEXT_NAME.sub(lambda _: str(path), record.getMessage()))
        record.args = ()
        return count <= MAX_WARNINGS

    logger.addFilter(is_let_through)
    try:
        yield
    finally:
        logger.removeFilter(is_let_through)
    if count > MAX_WARNINGS:
        logger.warning("%s: %d warnings more", path, count - MAX_WARNINGS)
