"""Calls the compiler, and reports its first error in one line."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from drake_navbench.errors import InputError

APT = "on Debian or Ubuntu: apt-get install"
# For each dependency of a checkout, a header that exists if it is installed, and Debian's package.
SYSTEM_LIBRARIES: Mapping[str, tuple[str, str]] = {
    "eigen": ("Eigen/Core", f"{APT} libeigen3-dev"),
    "xtensor": ("xtensor/xtensor.hpp", f"{APT} libxtensor-dev"),
    "ompl": ("ompl/config.h", f"{APT} libompl-dev"),
    "nlohmann-json-dev": ("nlohmann/json.hpp", f"{APT} nlohmann-json3-dev"),
    # g2o with its solver by CSparse, as ROS has it; Debian has no package of it.
    "libg2o": (
        "g2o/solvers/csparse/linear_solver_csparse.h",
        "https://github.com/RainerKuemmerle/g2o, with CSparse",
    ),
}
# The libraries to link for a dependency that is more than headers.
LINKED: Mapping[str, tuple[str, ...]] = {
    "ompl": ("-lompl",),
    "libg2o": ("-lg2o_csparse_extension", "-lg2o_core", "-lg2o_stuff", "-lcxsparse"),
}
# Debian keeps headers of some libraries in folders below this one.
SYSTEM_HEADERS = Path("/usr/include")
INCLUDE_FOLDERS = ("eigen3", "ompl-*", "suitesparse")
# A controller may be large: MPPI's takes a minute for one file on a slow machine.
PATIENCE_S = 1200.0

_ERROR = re.compile(
    r"^(?P<place>[^\s:][^:\n]*:\d+)(?::\d+)?: (?:fatal )?error: (?P<what>.*)$", re.M
)
# An error as GCC and Clang print it.
_NO_HEADER = re.compile(r"error: '?(?P<name>[^\s':]+)'?(?:: No such file| file not found)")
_HEADER_NAME = re.compile(r"[\w./+-]+")
_ABSENT = "drake_navbench_absent"
_LINK_ERROR = re.compile(r"^.*(undefined reference to .*|multiple definition of .*)$", re.MULTILINE)


@dataclass(frozen=True)
class Compiler:
    """A C++ compiler: its program with arguments, and its version line."""

    words: tuple[str, ...]
    version: str

    def has_header(self, header: str) -> bool:
        """Returns whether a header of the system is found."""
        text = f"#if !__has_include(<{header}>)\n#error\n#endif\n"
        return self._output(["-std=c++17", *include_arguments(()), "-E"], text) is not None

    def absent_headers(self, names: Sequence[str]) -> set[str]:
        """Returns the headers, among those given, that the system does not have."""
        plain = [name for name in names if _HEADER_NAME.fullmatch(name)]
        lines = [f"#if !__has_include(<{name}>)\n{_ABSENT} {name}\n#endif\n" for name in plain]
        text = self._output(["-std=c++17", *include_arguments(()), "-E"], "".join(lines)) or ""
        shown = (line.split(maxsplit=1) for line in text.splitlines() if line.startswith(_ABSENT))
        return {words[1].strip() for words in shown} | ({*names} - {*plain})

    def missing_header(self, folders: Iterable[Path], source: Path) -> str | None:
        """Returns the first header that a source includes and that is not found; None without."""
        words = ["-std=c++20", *include_arguments(folders), "-E", "-P", str(source)]
        command = [*self.words, *words]
        done = subprocess.run(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            timeout=PATIENCE_S,
            check=False,
            env=os.environ | {"LC_ALL": "C"},
        )
        found = _NO_HEADER.search(done.stderr.decode(errors="replace"))
        return found["name"] if found is not None and done.returncode != 0 else None

    def knows(self, options: Iterable[str]) -> bool:
        """Returns whether the compiler accepts some options."""
        # A compiler may only warn of an unknown option.
        return self._output([*options, "-Werror", "-fsyntax-only"], "int main() {}\n") is not None

    def links(self, options: Iterable[str]) -> bool:
        """Returns whether the compiler compiles and links a program with some options."""
        with tempfile.TemporaryDirectory() as folder:
            arguments = [*options, "-Werror", "-o", str(Path(folder) / "program")]
            return self._output(arguments, "int main() {}\n") is not None

    def serves(self, option: str) -> bool:
        """Returns whether the compiler accepts an option and the processor its instructions."""
        if not option.startswith("-m") or not self.knows([option]):
            return self.knows([option])
        return self._macros(option) - self._macros() <= self._macros("-march=native")

    def _macros(self, *options: str) -> set[str]:
        """Returns the macros that some options predefine, by name, without those for tuning."""
        text = self._output([*options, "-dM", "-E"], "") or ""
        names = {line.split()[1] for line in text.splitlines() if line.startswith("#define ")}
        return {name for name in names if "tune" not in name}

    def _output(self, arguments: Sequence[str], text: str) -> str | None:
        """Returns the compiler's output for a text; None where it fails."""
        command = [*self.words, *arguments, "-x", "c++", "-"]
        done = subprocess.run(command, input=text, capture_output=True, text=True, check=False)
        return done.stdout if done.returncode == 0 else None

    def run(self, arguments: Sequence[str], log: Path) -> None:
        """Runs the compiler; raises InputError with its first error and the log's path."""
        command = [*self.words, *arguments]
        try:
            done = subprocess.run(
                command,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                timeout=PATIENCE_S,
                check=False,
                env=os.environ | {"LC_ALL": "C"},
            )
        except OSError as error:
            raise InputError(f"{self.words[0]}: cannot be run: {error.strerror}") from error
        except subprocess.TimeoutExpired as error:
            raise InputError(f"{shlex.join(command)}: took over {PATIENCE_S:g} s") from error
        if done.returncode == 0:
            return
        text = done.stdout.decode(errors="replace")
        log.parent.mkdir(parents=True, exist_ok=True)
        log.write_text(f"{shlex.join(command)}\n\n{text}", encoding="utf-8")
        raise InputError(f"{first_error(text)}; the whole log: {log}")


def first_error(text: str) -> str:
    """Returns the place and the text of the first error in a compiler's output."""
    found = _ERROR.search(text)
    if found is not None:
        return f"{found['place']}: {found['what']}"
    linked = _LINK_ERROR.search(text)
    if linked is not None:
        return linked[1]
    lines = text.strip().splitlines()
    return lines[-1] if lines else "the compiler failed and said nothing"


def find_compiler() -> Compiler:
    """Returns the compiler that CXX names, else the first of c++, g++ and clang++.

    Raises InputError where there is none.
    """
    given = shlex.split(os.environ.get("CXX", ""))
    for words in [given] if given else [["c++"], ["g++"], ["clang++"]]:
        program = shutil.which(words[0])
        if program is not None:
            command = (program, *words[1:])
            return Compiler(command, _version(command))
    looked = f"{given[0]!r} (of CXX)" if given else "c++, g++ or clang++"
    raise InputError(f"compiler: no {looked}; on Debian or Ubuntu: apt-get install g++")


def missing_libraries(dependencies: Iterable[str], compiler: Compiler) -> list[str]:
    """Returns the libraries that the system lacks, each with the package that contains it."""
    return [
        f"{name} ({source})"
        for name, (header, source) in SYSTEM_LIBRARIES.items()
        if name in dependencies and not compiler.has_header(header)
    ]


def include_arguments(folders: Iterable[Path]) -> list[str]:
    """Returns the arguments for folders of headers, and for Debian's extra folders."""
    system = (path for name in INCLUDE_FOLDERS for path in sorted(SYSTEM_HEADERS.glob(name)))
    return [*(f"-I{folder}" for folder in folders), *(f"-isystem{folder}" for folder in system)]


def link_arguments(dependencies: Iterable[str]) -> list[str]:
    """Returns the arguments for the libraries of some packages' dependencies.

    Libraries found by LIBRARY_PATH are found again when the program runs.
    """
    needed = set(dependencies)
    libraries = [word for name, words in LINKED.items() if name in needed for word in words]
    folders = filter(None, os.environ.get("LIBRARY_PATH", "").split(os.pathsep))
    return [*libraries, *(f"-Wl,-rpath,{folder}" for folder in folders)] if libraries else []


def _version(command: Sequence[str]) -> str:
    try:
        done = subprocess.run([*command, "--version"], capture_output=True, text=True, check=True)
    except (OSError, subprocess.SubprocessError) as error:
        raise InputError(f"{command[0]}: does not tell its version: {error}") from error
    return done.stdout.splitlines()[0] if done.stdout else command[0]
