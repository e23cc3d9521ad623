"""How numbers are written for a reader: in the report and in the terminal's tables."""

from __future__ import annotations

import math

DIGITS = 4
# Between these, numbers are written without an exponent; below ROUNDING they are 0.
PLAIN_FROM, PLAIN_BELOW = 1e-3, 1e6
ROUNDING = 1e-12
EMPTY = "–"


def number(value: float | None) -> str:
    """Returns a value with 4 significant digits, a dash where it is undefined."""
    if value is None or not math.isfinite(value):
        return EMPTY
    if abs(value) < ROUNDING:
        return "0"
    if PLAIN_FROM <= abs(value) < PLAIN_BELOW:
        # The exponent of what is shown: 99.9999 is shown as 100.0.
        exponent = int(f"{value:.{DIGITS - 1}e}".partition("e")[2])
        return f"{value:.{max(DIGITS - 1 - exponent, 0)}f}"
    return f"{value:.{DIGITS - 1}e}"
