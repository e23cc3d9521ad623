"""Reads the compiler's options that a package asks for in its CMakeLists.txt.

Only options that change results or speed are taken: optimization (`-O3`), instructions of the
processor (`-mfma`) and code generation (`-ffast-math`). Options that make the compiler write other
files, load programs or print (`-fdump-tree-all`, `-fplugin=...`) are ignored. Conditions other than
those named below are not evaluated: an option behind a condition is taken if the compiler and the
processor support it, since that is what such conditions test.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import NamedTuple

from drake_navbench.native.package import Package, text_of

LISTS_FILE = "CMakeLists.txt"
# https://cmake.org/cmake/help/latest/manual/cmake-commands.7.html
OPTION_COMMANDS = {"add_compile_options", "target_compile_options"}
FLAGS_VARIABLE = "CMAKE_CXX_FLAGS"
# Variables of branches for builds that do not happen here.
OTHER_BUILDS = {"BUILD_TESTING", "MSVC", "WIN32", "COVERAGE_ENABLED", "ENABLE_COVERAGE", "Debug"}
# https://gcc.gnu.org/onlinedocs/gcc/Optimize-Options.html names them; Clang has many of them, too.
OF_ARITHMETIC = (
    "fast-math|[a-z]+-math-optimizations|[a-z-]+-math|math-errno|signaling-nans|signed-zeros|"
    "fp-contract|fp-model|float-store|excess-precision|single-precision-constant|"
    "cx-limited-range|cx-fortran-rules|wrapv|strict-overflow|strict-aliasing"
)
OF_OPTIMIZATION = (
    "tree-[a-z-]+|ipa-[a-z-]+|loop-[a-z-]+|unroll-[a-z-]+|inline(?:-[a-z-]+)?|align-[a-z]+|"
    "sched[a-z0-9-]*|gcse[a-z-]*|split-[a-z-]+|merge-[a-z-]+|reorder-[a-z-]+|prefetch-[a-z-]+|"
    "vectorize|slp-vectorize|[a-z]+-cost-model|peel-loops|unswitch-loops|move-loop-[a-z]+|"
    "optimize-sibling-calls|omit-frame-pointer|rename-registers|devirtualize[a-z-]*|"
    "partial-inlining|early-inlining|semantic-interposition|function-sections|data-sections"
)
OF_PROCESSOR = (
    "mmx|s?sse[0-9a-z.]*|avx[0-9a-z.-]*|fma4?|bmi2?|abm|lzcnt|popcnt|f16c|movbe|aes|pclmul|"
    "adx|cx16|sahf|vzeroupper|recip|neon|crypto|altivec|vsx"
)
OF_PROCESSOR_BY_NAME = "arch|tune|cpu|fpu|fpmath|float-abi|recip|prefer-vector-width"
# Options that are neither used nor reported: libraries, languages and sanitizers change no number.
NOT_TOLD = ("-fPIC", "-fPIE", "-fconcepts", "-fopenmp", "-fvisibility", "-fdiagnostics", "-fsan")

_TOKEN = re.compile(r'#\[\[.*?\]\]|#[^\n]*|"(?:[^"\\]|\\.)*"|[()]|[^\s()"#]+', re.DOTALL)
_CODE = re.compile(r"-[Ofm]\S*")
_TAKEN = re.compile(
    r"-O\w*"
    rf"|-m(?:no-)?(?:{OF_PROCESSOR})|-m(?:{OF_PROCESSOR_BY_NAME})=[\w.+,!-]+"
    rf"|-f(?:no-)?(?:{OF_ARITHMETIC}|{OF_OPTIMIZATION})(?:=[\w-]+)?"
)


class _Command(NamedTuple):
    name: str
    arguments: list[str]


class Options(NamedTuple):
    """The compiler options of a package.

    of_code: those that change the machine code, which are used. others: further ones that begin
    with -O, -f or -m, which are ignored.
    """

    of_code: tuple[str, ...] = ()
    others: tuple[str, ...] = ()


def options_of(package: Package) -> Options:
    """Returns the options that a package asks for, in their order; none without CMakeLists.txt.

    Raises InputError where the file cannot be read.
    """
    path = package.folder / LISTS_FILE
    return options_in(text_of(path)) if path.is_file() else Options()


def options_in(text: str) -> Options:
    """Returns the options in a CMakeLists.txt in order; a repeated option keeps its last place."""
    found: list[str] = []
    # For each open condition, whether its branch is for another build.
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
    ordered = sorted(last, key=last.__getitem__)
    return Options(
        tuple(option for option in ordered if _TAKEN.fullmatch(option)),
        tuple(option for option in ordered if not _TAKEN.fullmatch(option)),
    )


def _options(name: str, arguments: list[str]) -> list[str]:
    if name in OPTION_COMMANDS:
        words = arguments
    elif name == "set" and arguments[:1] == [FLAGS_VARIABLE]:
        words = " ".join(arguments[1:]).split()
    else:
        return []
    return [w for w in words if _CODE.fullmatch(w) and not w.startswith(NOT_TOLD)]


def _is_other(condition: list[str]) -> bool:
    return "NOT" not in condition and not OTHER_BUILDS.isdisjoint(condition)


def _commands(text: str) -> Iterator[_Command]:
    """Yields the commands of a file with their arguments, without quotes."""
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
