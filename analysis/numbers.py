"""Formats numbers for pages, tables and sentences."""

from __future__ import annotations

import math

DIGITS = 4
SHORT_DIGITS = 3
NARROW_SPACE = "\u202f"
# Numbers within these limits are written without an exponent; numbers below ROUNDING are 0.
PLAIN_FROM, PLAIN_BELOW = 1e-3, 1e6
ROUNDING = 1e-12
EMPTY = "–"
# The parts of a unit as a page prints them: raised powers, the degree sign.
DEGREE = "°"
TYPESET = (("^2", "²"), ("^3", "³"), ("deg", DEGREE))


def typeset(unit: str) -> str:
    """Returns a unit as it is printed in a page: m/s³ for m/s^3."""
    for plain, printed in TYPESET:
        unit = unit.replace(plain, printed)
    return unit


def number(value: float | None, digits: int = DIGITS) -> str:
    """Returns a value with `digits` significant digits, a dash where it is undefined."""
    if value is None or not math.isfinite(value):
        return EMPTY
    if abs(value) < ROUNDING:
        return "0"
    if PLAIN_FROM <= abs(value) < PLAIN_BELOW:
        # The exponent after rounding: 99.9999 is shown as 100.0.
        exponent = int(f"{value:.{digits - 1}e}".partition("e")[2])
        return f"{value:.{max(digits - 1 - exponent, 0)}f}"
    return f"{value:.{digits - 1}e}"


def short_number(value: float | None) -> str:
    """Returns a value with 3 digits and separated thousands; a dash where it is undefined."""
    if value is None or not 10.0**SHORT_DIGITS <= abs(value) < PLAIN_BELOW:
        return number(value, SHORT_DIGITS)
    return f"{float(f'{value:.{SHORT_DIGITS - 1}e}'):,.0f}".replace(",", NARROW_SPACE)


def counted(count: int, noun: str) -> str:
    """Returns a number of things in words: '1 trial', '2 trials'."""
    return f"{count} {noun}{'s' * (count != 1)}"
