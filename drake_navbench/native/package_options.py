"""Which options of the compiler a package asks for in its CMakeLists.txt.

Only those count that decide what is computed and how fast: of optimization (`-O3`), of what a
processor has (`-mfma`) and of code (`-ffast-math`). Conditions are not weighed but for those named
below: an option that stands behind one is taken where the compiler and the processor have it, which
is what such conditions ask.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import NamedTuple

from drake_navbench.native.checkout import Package, text_of

LISTS_FILE = "CMakeLists.txt"
# https://cmake.org/cmake/help/latest/manual/cmake-commands.7.html
OPTION_COMMANDS = {"add_compile_options", "target_compile_options"}
FLAGS_VARIABLE = "CMAKE_CXX_FLAGS"
# Branches for what is not built here.
OTHER_BUILDS = {"BUILD_TESTING", "MSVC", "WIN32", "COVERAGE_ENABLED", "ENABLE_COVERAGE", "Debug"}
# What changes how a library is linked or a language is read, and no number.
NOT_TAKEN = ("-fPIC", "-fPIE", "-fconcepts", "-fopenmp", "-fvisibility", "-fdiagnostics", "-fsan")

_TOKEN = re.compile(r'#\[\[.*?\]\]|#[^\n]*|"(?:[^"\\]|\\.)*"|[()]|[^\s()"#]+', re.DOTALL)
_TAKEN = re.compile(r"-(?:O\w*|m[\w.=+,-]+|f[\w=-]+)")


class _Command(NamedTuple):
    name: str
    arguments: list[str]


def options_of(package: Package) -> tuple[str, ...]:
    """Returns the options that a package asks for, in their order; none where it has no such file.

    Raises InputError where the file cannot be read.
    """
    path = package.folder / LISTS_FILE
    return options_in(text_of(path)) if path.is_file() else ()


def options_in(text: str) -> tuple[str, ...]:
    """Returns the options that a CMakeLists.txt asks for, each once, where it stands last."""
    found: list[str] = []
    # Of each condition that is open: whether its branch is one of another build.
    others: list[bool] = []
    for name, arguments in _commands(text):
        if name == "if":
            others.append(_is_other(arguments))
        elif name == "elseif" and others:
            others[-1] = _is_other(arguments)
        elif name == "else" and others:
            others[-1] = False
        elif name == "endif" and others:
            others.pop()
        elif not any(others):
            found += _options(name, arguments)
    last = {option: place for place, option in enumerate(found)}
    return tuple(sorted(last, key=last.__getitem__))


def _options(name: str, arguments: list[str]) -> list[str]:
    if name in OPTION_COMMANDS:
        words = arguments
    elif name == "set" and arguments[:1] == [FLAGS_VARIABLE]:
        words = " ".join(arguments[1:]).split()
    else:
        return []
    return [w for w in words if _TAKEN.fullmatch(w) and not w.startswith(NOT_TAKEN)]


def _is_other(condition: list[str]) -> bool:
    return "NOT" not in condition and not OTHER_BUILDS.isdisjoint(condition)


def _commands(text: str) -> Iterator[_Command]:
    """Yields the commands of a file with their arguments, quotes taken off."""
    tokens = [t for t in _TOKEN.findall(text) if not t.startswith("#")]
    place = 0
    while place + 1 < len(tokens):
        if tokens[place + 1] != "(":
            place += 1
            continue
        name, arguments, depth = tokens[place].lower(), [], 1
        place += 2
        while place < len(tokens) and depth:
            depth += {"(": 1, ")": -1}.get(tokens[place], 0)
            if tokens[place] not in "()":
                arguments.append(tokens[place].strip('"'))
            place += 1
        yield _Command(name, arguments)
