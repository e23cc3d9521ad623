"""The exceptions that a user may see; each prints as one line."""

from __future__ import annotations

import difflib
import errno
import signal
from collections.abc import Iterable, Iterator
from contextlib import contextmanager

# Longer lines are cut: what is wrong may be a value of any size.
MAX_LINE_LENGTH = 1000
MAX_LINES = 100
# A longer name is no misspelling, and comparing it would take long.
MAX_HINTED_LENGTH = 100
# A longer list of known names is cut to those most like the given one.
MAX_LIST_LENGTH = 300
MOST_NAMED = 5
# The share of equal letters from which one name is offered for another.
LIKENESS = 0.6


class NavbenchError(Exception):
    """Base of every error whose text is fit to be shown without a traceback.

    Names and values in it may be anybody's: its text has no control characters but line ends.
    """

    def __str__(self) -> str:
        lines = super().__str__().split("\n")
        return "\n".join(map(printable, lines[:MAX_LINES]))


class InputError(NavbenchError):
    """The user's input is wrong: a file, a field, a value or a name. Exit status 2."""


class InputWarning(UserWarning):
    """A warning about input that is accepted but probably a mistake; its text is one line."""


class CannotBeWritten(InputError):
    """A file cannot be written where it was asked for, as on a full disk. Exit status 2."""


@contextmanager
def writing(path: object) -> Iterator[None]:
    """Turns an OSError that is raised in the block into CannotBeWritten for the file `path`."""
    try:
        yield
    except OSError as error:
        reason = error.strerror or str(error)
        raise CannotBeWritten(f"{path}: cannot be written: {reason}") from error


class EndedFromOutside(NavbenchError):
    """A process that a trial needs was ended by a person or the system; a fault of the machine."""


# The signals that end a process from outside, as from the system when memory or
# its patience runs out, or from somebody's kill; the others a process brings upon itself.
OUTSIDE_SIGNALS = frozenset(
    {
        signal.SIGHUP,
        signal.SIGINT,
        signal.SIGKILL,
        signal.SIGQUIT,
        signal.SIGTERM,
        signal.SIGXCPU,
    }
)
# Errors of the machine: too little memory, space or open files; or a disk that fails.
MACHINE_FAULTS = frozenset(
    {
        errno.EDQUOT,
        errno.EIO,
        errno.EMFILE,
        errno.ENFILE,
        errno.ENOMEM,
        errno.ENOSPC,
    }
)


def is_machine_fault(error: BaseException) -> bool:
    """Returns whether the machine caused an exception, not the code that raised it."""
    if isinstance(error, OSError):
        return error.errno in MACHINE_FAULTS
    return isinstance(error, MemoryError | EndedFromOutside)


def nearest_name_hint(
    name: str, known_names: Iterable[str], *, likeness: float = LIKENESS, listed_by: str = ""
) -> str:
    """Returns '; did you mean X?' for the known name closest to `name`, else the list of names.

    If there are more than MAX_LIST_LENGTH names, the text has the ones most like `name`, and
    `listed_by`: the command or page that lists all.

    likeness: least similarity, 0 to 1, of a close name; more where a wrong hint is worse than none.
    """
    known = sorted(known_names)
    if len(str(name)) > MAX_HINTED_LENGTH:
        return ""
    close = difflib.get_close_matches(str(name), known, n=1, cutoff=likeness)
    if close:
        return f"; did you mean {close[0]!r}?"
    listed = ", ".join(known)
    if len(listed) > MAX_LIST_LENGTH:
        nearest = difflib.get_close_matches(str(name), known, n=MOST_NAMED, cutoff=0.0)
        where = f" ({listed_by} lists all)" if listed_by else ""
        return f"; the nearest of {len(known)} names: {', '.join(nearest)}{where}"
    return f"; known: {listed}" if known else ""


def printable(text: str, most: int = MAX_LINE_LENGTH) -> str:
    """Returns a text as one line that a terminal shows as it is, of `most` characters at most.

    What is not printable, such as the codes that move a cursor, becomes its escape ('\\x1b').
    """
    text = text[: most + 1]
    if not text.isprintable():
        text = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)
    return text if len(text) <= most else f"{text[: most - 3]}..."


def as_line(text: str) -> str:
    """Returns a text of any length and number of lines as one printable line."""
    return printable(" ".join(text[: 2 * MAX_LINE_LENGTH].splitlines()))


def one_line(error: BaseException) -> str:
    """Returns the type of any exception and the first line of its text: 'KeyError: name'."""
    name = type(error).__name__
    try:
        lines = str(error).strip().splitlines()
    except Exception:
        # A plugin's exception may break in its own __str__.
        lines = []
    return printable(f"{name}: {lines[0]}" if lines else name)
