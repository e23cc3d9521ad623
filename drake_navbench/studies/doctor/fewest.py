"""The fewest of several changes that do together what all of them do, some of which do harm."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

Part = TypeVar("Part")


def fewest(parts: Sequence[Part], suffices: Callable[[Sequence[Part]], bool]) -> list[Part]:
    """Returns parts, in their order, that suffice, and no longer do without any one of them.

    parts: the likeliest first. suffices: tells whether some of them are enough; whoever has more
    parts is assumed to be no worse off. The list is empty if not even all parts suffice.

    The shortest beginning of the list that suffices is found by bisection. Its last part is needed,
    and is kept while the others are looked at in the same way (Junker, QuickXplain, AAAI 2004). Of
    n parts, k of them needed, `suffices` is called at most 2 + k (2 + log2 n) times.
    """
    if not parts or not suffices(parts):
        return []
    kept: list[Part] = []
    rest = list(parts)
    while rest and not (kept and suffices(kept)):
        # The first `low` parts are too few, the first `high` are enough.
        low, high = 0, len(rest)
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (low, middle) if suffices([*kept, *rest[:middle]]) else (middle, high)
        kept.append(rest[high - 1])
        rest = rest[: high - 1]
    # Each part that was kept stands before those kept earlier.
    return kept[::-1]


def without_harmful(
    parts: Sequence[Part], effects: Sequence[float], most: int
) -> Iterator[list[Part]]:
    """Yields all parts, then fewer and fewer of them, in case one of them spoils what others do.

    parts: the likeliest first. effects: what each does alone; below 0 it does harm, 0 is not known.
    Those that do harm are dropped one by one, the worst first. Of the rest each alone is left out,
    at most `most`, those that help alone last. In the end the likelier half comes, and half of it.
    """
    yield list(parts)
    order = sorted(range(len(parts)), key=lambda index: effects[index])
    kept = set(order)
    for index in [index for index in order if effects[index] < 0.0 and len(kept) > 1]:
        kept.discard(index)
        yield [part for place, part in enumerate(parts) if place in kept]
    for index in [index for index in order if index in kept][:most]:
        yield [part for place, part in enumerate(parts) if place in kept - {index}]
    rest = [part for place, part in enumerate(parts) if place in kept]
    while len(rest) > 1:
        rest = rest[: len(rest) // 2]
        yield list(rest)
