"""Assignments on the command line, NAME=VALUE."""

from __future__ import annotations

from collections.abc import Sequence

from drake_navbench.errors import InputError


def assignment(
    text: str, option: str, form: str = "NAME=VALUE", *, may_be_empty: bool = False
) -> tuple[str, str]:
    """Returns name and value; raises InputError where one of them is missing.

    option, form: the option, and the form of its values, for errors. may_be_empty: whether an empty
    value is allowed.
    """
    name, equals, value = text.partition("=")
    if not (name and equals and (value or may_be_empty)):
        raise InputError(f"{option} {text!r}: expected {form}")
    return name, value


def assignments(
    texts: Sequence[str], option: str, form: str = "NAME=VALUE", *, may_be_empty: bool = False
) -> dict[str, str]:
    """Returns the values by name; raises InputError as `assignment`, or for a repeated name."""
    values: dict[str, str] = {}
    for text in texts:
        name, value = assignment(text, option, form, may_be_empty=may_be_empty)
        if name in values:
            raise InputError(f"{option} {text!r}: {name} is given twice")
        values[name] = value
    return values
