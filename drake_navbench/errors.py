"""The exceptions that a user may see; each prints as one line."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class NavbenchError(Exception):
    """Base of every error whose text is fit to be shown without a traceback."""


class InputError(NavbenchError):
    """Something the user gave is wrong: a file, a field, a value, a name. Exit status 2."""


class InputWarning(UserWarning):
    """Something the user gave is taken, but probably not what was meant; its text is one line."""


def nearest_name_hint(name: str, known_names: Iterable[str]) -> str:
    """Returns '; did you mean X?' for the known name closest to `name`, else the list of names."""
    known = sorted(known_names)
    close = difflib.get_close_matches(str(name), known, n=1, cutoff=0.6)
    if close:
        return f"; did you mean {close[0]!r}?"
    return f"; known: {', '.join(known)}" if known else ""


def one_line(error: BaseException) -> str:
    """Returns the type of any exception and the first line of its text: 'KeyError: name'."""
    lines = str(error).strip().splitlines()
    name = type(error).__name__
    return f"{name}: {lines[0]}" if lines else name
