"""How identification.md writes numbers, tables and what several seeds come to."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

Result = Mapping[str, Any]
PERCENT = 100.0
# Between what the seeds come to.
SEEDS_APART = " / "


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> Iterator[str]:
    """Yields the lines of a table, and an empty one."""
    yield f"| {' | '.join(header)} |"
    yield f"|{'---|' * len(header)}"
    for row in rows:
        yield f"| {' | '.join(row)} |"
    yield ""


def of_seeds(texts: Sequence[str]) -> str:
    """Returns what the seeds come to side by side; once where it is the same for all."""
    return texts[0] if len(set(texts)) == 1 else SEEDS_APART.join(texts)


def percent(share: float | None) -> str:
    """Returns a share in per cent; a dash where there is none."""
    if share is None or not math.isfinite(share):
        return "–"
    percent = PERCENT * share
    return f"{percent:.1f}%" if percent < 9.95 else f"{percent:.0f}%"
