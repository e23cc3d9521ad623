"""Code that all commands share: exit statuses, types of arguments, and the format of errors.

Imports the standard library and `errors` only, so that --help is quick.
"""

from __future__ import annotations

import argparse
import math
import os
import re
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from itertools import takewhile
from pathlib import Path
from typing import Any, NoReturn

from drake_navbench.errors import (
    LIKENESS,
    InputError,
    InputWarning,
    NavbenchError,
    as_line,
    nearest_name_hint,
    printable,
)

# From this likeness on an unknown option counts as a slip of a known one.
LIKE_A_SLIP = 0.75
EXIT_DONE = 0
EXIT_FAILED = 1
EXIT_WRONG_INPUT = 2
# The exit status that a shell reports for a program ended by Ctrl-C: 128 + SIGINT.
EXIT_INTERRUPTED = 130

# The kernels have one of their own, whose import would load numba before --help.
PERCENT = 100.0


class CommandParser(argparse.ArgumentParser):
    """Reads the arguments of a command; a wrong one is one line on stderr and EXIT_WRONG_INPUT."""

    def __init__(self, *args: Any, **options: Any) -> None:
        # An abbreviation would mean something else as soon as there is one more option.
        options.setdefault("allow_abbrev", False)
        if "\n" in (options.get("epilog") or ""):
            # A text with line ends of its own keeps them.
            options.setdefault("formatter_class", argparse.RawDescriptionHelpFormatter)
        super().__init__(*args, **options)
        self._given: Sequence[str] = ()

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> tuple[Any, list[str]]:
        """Returns the known arguments and the rest; an unknown option is an error."""
        self._given = sys.argv[1:] if args is None else list(args)
        known, rest = super().parse_known_args(args, namespace)
        options = [text for text in rest if text.startswith("-")]
        # Behind -- nothing is an option.
        if options and "--" not in self._given:
            self.error(self._unknown_option(options[0]))
        return known, rest

    def error(self, message: str) -> NoReturn:
        """Prints the line `drake-navbench COMMAND: message`, and exits.

        If an option is unknown, only that is printed: other errors mostly follow from it.
        """
        unknown = self._unknown_options()
        if unknown:
            message = self._unknown_option(unknown[0])
        self.exit(EXIT_WRONG_INPUT, f"{as_line(f'{self.prog}: {message}')}\n")

    def _unknown_options(self) -> list[str]:
        """Returns the unknown options among the arguments."""
        if self._subparsers is not None:
            return []
        before = takewhile(lambda text: text != "--", self._given)
        names = [text.partition("=")[0] for text in before if text.startswith("--")]
        known = self._option_string_actions
        return [name for name in names if " " not in name and name not in known]

    def _unknown_option(self, text: str) -> str:
        name = text.partition("=")[0]
        known = [option for option in self._option_string_actions if option.startswith("--")]
        longer = [option for option in known if len(name) > 2 and option.startswith(name)]
        # Two dashes alone make any two short options alike: --bogus is no slip of --out.
        likeness = LIKENESS if longer else LIKE_A_SLIP
        hint = nearest_name_hint(name, longer or known, likeness=likeness, listed_by="--help")
        return f"option {name!r} is not known{hint}"

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        """Raises ArgumentError for a value that is none of the choices of an argument."""
        if action.choices is not None and value not in action.choices:
            *first, last = map(str, action.choices)
            known = f"{', '.join(first)} or {last}" if first else last
            raise argparse.ArgumentError(action, f"got {value!r}, expected {known}")

    def _print_message(self, message: str, file: Any = None) -> None:
        """Writes the text of --help, or an error, to a reader that may have gone."""
        print_text(message, file or sys.stderr)


class Options:
    """Adds options to a parser or a group of it, each written as its usage line shows it.

    `--all` is a flag; `--out DIR` takes a value, `--start X Y YAW` three, and `--metric FILE ...`
    may be given several times; its value is [] if it is not given. A name without dashes is a
    positional argument.
    """

    def __init__(self, container: argparse._ActionsContainer) -> None:
        self._container = container

    def __call__(
        self,
        usage: str,
        about: str,
        read: Callable[[str], Any] | None = None,
        default: Any = None,
        **more: Any,
    ) -> None:
        """Adds the option `usage`.

        about: its line of --help. read: makes the value of its text. more: as `add_argument` takes
        it.
        """
        name, *values = usage.split()
        if values[-1:] == ["..."]:
            values.pop()
            more |= {"action": "append"}
            default = []
        if len(values) > 1:
            more |= {"nargs": len(values), "metavar": tuple(values)}
        elif values:
            more["metavar"] = values[0]
        elif name.startswith("-") and not more and read is None:
            more["action"] = "store_true"
        if read is not None:
            more["type"] = number if read is float else read
        if default is not None:
            more["default"] = default
        self._container.add_argument(name, help=about, **more)


def print_text(text: str, file: Any = None) -> None:
    """Writes and flushes a text to stdout or another file; a closed pipe (`| head`) is no error."""
    file = file or sys.stdout
    try:
        print(text, end="", file=file, flush=True)
    except BrokenPipeError:
        _forget_output(file)


def _forget_output(file: Any) -> None:
    """Discards buffered output, which at the interpreter's end would raise a traceback."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), file.fileno())


@contextmanager
def _input_warnings_as_lines() -> Iterator[None]:
    """Prints each warning about the input as a line on stderr, and equal ones once."""
    told: set[str] = set()
    with warnings.catch_warnings():
        show_others = warnings.showwarning

        def show(
            message: Warning | str, category: type[Warning], *where: Any, **options: Any
        ) -> None:
            if issubclass(category, InputWarning):
                if str(message) not in told:
                    print(printable(str(message)), file=sys.stderr)
                told.add(str(message))
            else:
                show_others(message, category, *where, **options)

        warnings.showwarning = show
        yield


def exit_status_of(
    work: Callable[[], int | None],
    *,
    failed: int = EXIT_FAILED,
    interrupted: str = "interrupted",
) -> int:
    """Does a command's work; returns its exit status, EXIT_DONE where the work returns None.

    A NavbenchError is one line on stderr; the status is EXIT_WRONG_INPUT where the input is at
    fault, else `failed`. Warnings about the input are a line each. Ctrl-C prints the line
    `interrupted`. Output that nobody reads any more (`| head`) is no fault.
    """
    try:
        with _input_warnings_as_lines():
            status = work()
        # The reader of buffered output may be gone; noticed at the end, that would print a
        # traceback.
        print(end="", flush=True)
    except NavbenchError as error:
        print(error, file=sys.stderr)
        return EXIT_WRONG_INPUT if isinstance(error, InputError) else failed
    except KeyboardInterrupt:
        print(interrupted, file=sys.stderr)
        return EXIT_INTERRUPTED
    except BrokenPipeError:
        _forget_output(sys.stdout)
        return EXIT_DONE
    return EXIT_DONE if status is None else status


def command(
    build_parser: Callable[[], argparse.ArgumentParser],
    work: Callable[[argparse.Namespace], int | None],
    **how: Any,
) -> Callable[[Sequence[str] | None], int]:
    """Returns the `main` of a command: reads its arguments, works, returns the exit status.

    how: as `exit_status_of` takes it.
    """

    def main(argv: Sequence[str] | None = None) -> int:
        arguments = build_parser().parse_args(argv)
        return exit_status_of(lambda: work(arguments), **how)

    return main


def whole_number(text: str, *, least: int = 0) -> int:
    """Returns an argument as a number; raises ArgumentTypeError unless whole and large enough."""
    number = int(text) if text.isdecimal() else -1
    if number < least:
        raise argparse.ArgumentTypeError(
            f"got {text!r}, expected a whole number of at least {least}"
        )
    return number


def positive_number(text: str) -> int:
    """Returns an argument that counts something; raises ArgumentTypeError unless 1 or more."""
    return whole_number(text, least=1)


def number_or_file(text: str) -> int | Path:
    """Returns an argument that counts something, or that names a file; raises ArgumentTypeError."""
    if re.fullmatch(r"[-+]?[\d.]+", text):
        return positive_number(text)
    if Path(text).suffix or Path(text).exists():
        return Path(text)
    raise argparse.ArgumentTypeError(
        f"got {text!r}, expected a whole number of at least 1, or a file of places"
    )


def number(
    text: str, expected: str = "a number", is_right: Callable[[float], bool] = math.isfinite
) -> float:
    """Returns an argument as a finite number that `is_right`; raises ArgumentTypeError."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and is_right(value)):
        raise argparse.ArgumentTypeError(f"got {text!r}, expected {expected}")
    return value


def percentage(text: str) -> float:
    """Returns an argument in percent as a share; raises ArgumentTypeError below 0."""
    return number(text, "a percentage of at least 0", lambda value: value >= 0.0) / PERCENT


def positive_percentage(text: str) -> float:
    """Returns an argument in percent as a share; raises ArgumentTypeError unless above 0."""
    return number(text, "a percentage above 0", lambda value: value > 0.0) / PERCENT


def listed_names(text: str) -> tuple[str, ...]:
    """Returns the names between commas, each once, in their order."""
    return tuple(dict.fromkeys(name for name in map(str.strip, text.split(",")) if name))
