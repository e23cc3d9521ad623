"""The compiler flags of a checkout: portable ones, or the packages' own.

Portable flags use no instructions that only some processors have, and fuse no multiplications with
additions, so that every machine computes the same. A package's own flags are those that its users
run with: CMake's flags for Release, and the options in its CMakeLists.txt.
"""

from __future__ import annotations

import os
import shlex
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field

from drake_navbench.errors import InputError
from drake_navbench.native.builds import FlagSet
from drake_navbench.native.compiler import Compiler
from drake_navbench.native.package import Package
from drake_navbench.native.package_options import options_of

# CMake's flags for Release, and two that change no result.
RELEASE = ("-O3", "-DNDEBUG", "-fPIE", "-w")
PORTABLE = (*RELEASE, "-ffp-contract=off")
# Every operation is computed as written. The last two let a compiler compute lanes side by side;
# some functions of Eigen are not inlined with them.
STRICT = ("-fno-fast-math", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math")
# The whole program is optimized when it is linked, where the compiler can: collision checks ask the
# costmap, of another file, for the cost of each cell.
WHOLE_PROGRAM = (("-flto=auto",), ("-flto",))
STANDARD = "-std=c++20"
# Packages with xtensor are compiled with the standard of the releases that use it: up to 0.24,
# xtensor chooses other types for its temporaries in later standards, and throws.
OLDER_STANDARD = "-std=c++17"
NEEDS_OLDER_STANDARD = frozenset({"xtensor"})
# The variable with the user's flags, which come last in compiling and in linking.
FLAGS_VARIABLE = "CXXFLAGS"


@dataclass(frozen=True)
class Flags:
    """The flags of a build.

    requested: by package, the accepted flags that the package asks for. whole_program: the flags
    for optimization across all files. given: the user's flags.
    """

    kind: FlagSet
    requested: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    whole_program: tuple[str, ...] = ()
    given: tuple[str, ...] = ()

    @property
    def everywhere(self) -> tuple[str, ...]:
        """The flags of every compilation and link; the user's come last."""
        return (*self.whole_program, *self.given)

    @property
    def instructions(self) -> tuple[str, ...]:
        """The flags for the processor's instructions, the same for all files of a program.

        Eigen and xtensor lay out memory by them, so files with different ones do not fit together.
        """
        found = (word for words in self.requested.values() for word in words if word[:2] == "-m")
        return tuple(dict.fromkeys(found))

    def of_package(self, package: Package) -> tuple[str, ...]:
        """Returns the flags for the sources of a package."""
        is_older = not NEEDS_OLDER_STANDARD.isdisjoint(package.dependencies)
        standard = OLDER_STANDARD if is_older else STANDARD
        if self.kind is FlagSet.PORTABLE:
            return (standard, *PORTABLE, *self.everywhere)
        requested = self.requested.get(package.name, ())
        # A package that asks for no instructions has no fused ones either.
        contraction = (
            () if _instructions(requested) == self.instructions else ("-ffp-contract=off",)
        )
        return (standard, *RELEASE, *self.instructions, *requested, *contraction, *self.everywhere)

    def of_stand_in(self, package: Package) -> tuple[str, ...]:
        """Returns the flags for a source of ours in a package: its layout, and our arithmetic.

        Optimized together with the rest of the program, which has other flags, its loops would lose
        their lanes.
        """
        apart = ("-fno-lto",) if self.whole_program else ()
        return (*self.of_package(package), *STRICT, *apart)

    @property
    def of_host(self) -> tuple[str, ...]:
        """The flags for the host's own sources."""
        return (STANDARD, *PORTABLE, *self.instructions, *self.everywhere)

    @property
    def of_link(self) -> tuple[str, ...]:
        """The flags for linking the whole program."""
        return ("-O3", *self.everywhere)

    @property
    def description(self) -> str:
        """The flags that differ from the portable ones, in one line; empty where none does."""
        rows = [
            f"{name} {' '.join(words)}" for name, words in sorted(self.requested.items()) if words
        ]
        if self.given:
            rows.append(f"{FLAGS_VARIABLE} {' '.join(self.given)}")
        return "; ".join(rows)


def flags_of(
    kind: FlagSet,
    packages: Iterable[Package],
    compiler: Compiler,
    *,
    tell: Callable[[str], None] = lambda line: None,
) -> Flags:
    """Returns the flags of a build of some packages; `tell` gets a line on each flag not taken.

    Raises InputError where the compiler does not know a flag of the user.
    """
    given = tuple(shlex.split(os.environ.get(FLAGS_VARIABLE, "")))
    if given and not compiler.knows(given):
        raise InputError(f"{FLAGS_VARIABLE}: {compiler.words[0]} refuses {shlex.join(given)}")
    whole_program = next((words for words in WHOLE_PROGRAM if compiler.links(words)), ())
    if kind is FlagSet.PORTABLE:
        return Flags(kind, whole_program=whole_program, given=given)
    requested = {}
    for package in packages:
        options = options_of(package)
        taken = tuple(option for option in options.of_code if compiler.serves(option))
        if taken:
            requested[package.name] = taken
        if left := [option for option in options.of_code if option not in taken]:
            tell(f"{package.name}: not of this compiler or processor: {' '.join(left)}")
        if options.others:
            tell(f"{package.name}: no options that change its code: {' '.join(options.others)}")
    return Flags(kind, requested, whole_program, given)


def _instructions(options: Iterable[str]) -> tuple[str, ...]:
    return tuple(option for option in options if option[:2] == "-m")
