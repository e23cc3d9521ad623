"""How much may be driven for each seed: so many settings, or so much time."""

from __future__ import annotations

import json
import re
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from drake_navbench.errors import InputError
from drake_navbench.results import write_text

# With fewer settings an emulator foretells nothing; of a time, more would leave the emulators none.
LEAST_POINTS, MOST_POINTS = 16, 400
BATCH = 8
# Of all controllers in all scenarios nobody drives one setting sooner.
LEAST_SECONDS = 1.0
UNITS_S = {"s": 1.0, "min": 60.0, "h": 3600.0}
OPTION = "--budget"


@dataclass(frozen=True)
class Budget:
    """Of all that is driven to find settings: evaluations or seconds, the other one is None."""

    evaluations: int | None = None
    seconds: float | None = None


def parse_budget(text: str) -> Budget:
    """Returns the budget of a text such as 600, 90s, 40min or 2.5h; raises InputError."""
    found = re.fullmatch(r"(\d+(?:\.\d+)?)(s|min|h)?", text)
    number = float(found[1]) if found else 0.0
    if found is None or number <= 0.0 or (found[2] is None and "." in found[1]):
        raise InputError(
            f"{OPTION} {text!r}: expected a number of evaluations such as 600, or a time such as "
            "90s, 40min or 2.5h"
        )
    if found[2] is None:
        return Budget(evaluations=int(number))
    return Budget(seconds=number * UNITS_S[found[2]])


def check_budget(budget: Budget, folds: int, rounds: int) -> None:
    """Raises InputError where a budget is too small for the least that has to be driven."""
    least = LEAST_POINTS + folds * rounds
    what = f"{LEAST_POINTS} to learn from, and {rounds} rounds of {folds} fits"
    if budget.evaluations is not None and budget.evaluations < least:
        raise InputError(f"{OPTION} {budget.evaluations}: expected at least {least}: {what}")
    least_s = least * LEAST_SECONDS
    if budget.seconds is not None and budget.seconds < least_s:
        raise InputError(
            f"{OPTION} {budget.seconds:g}s: expected at least {least_s:g}s, {LEAST_SECONDS:g} s "
            f"for each of {least} settings: {what}"
        )


def drive_design(
    budget: Budget, folds: int, rounds: int, drive: Callable[[int, int], None], notes: Path
) -> int:
    """Drives settings that all folds learn from, batch by batch; returns how many.

    What is left is for the folds' own rounds; of a time it is told by how long the batches take.
    drive: is given the first one and the one behind the last. notes: a file that keeps the time
    that was taken, for a run that goes on. Raises InputError where it is no such file.
    """
    own = folds * rounds
    if budget.evaluations is not None:
        count = budget.evaluations - own
        for first in range(0, count, BATCH):
            drive(first, min(first + BATCH, count))
        return count
    count, taken_s = _noted(notes)
    while count < LEAST_POINTS or _is_time_left(budget, count, taken_s, own):
        begun = time.monotonic()
        drive(count, count + BATCH)
        taken_s += time.monotonic() - begun
        count += BATCH
        write_text(notes, json.dumps({"settings": count, "seconds": taken_s}) + "\n")
    return count


def _is_time_left(budget: Budget, count: int, taken_s: float, own: int) -> bool:
    if count >= MOST_POINTS:
        return False
    each_s = taken_s / count
    return taken_s + (BATCH + own) * each_s <= (budget.seconds or 0.0)


def _noted(notes: Path) -> tuple[int, float]:
    try:
        found = json.loads(notes.read_text(encoding="utf-8"))
        return int(found["settings"]), float(found["seconds"])
    except FileNotFoundError:
        return 0, 0.0
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(f"{notes}: not the notes of an identification: {error}") from error
