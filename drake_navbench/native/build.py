"""Builds the host of a checkout's controllers."""

from __future__ import annotations

import hashlib
import os
import time
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from drake_navbench.errors import InputError
from drake_navbench.native.builds import (
    Build,
    FlagSet,
    NoiseSource,
    builds_folder,
    require_name,
    save_build,
)
from drake_navbench.native.checkout import Checkout, checkout_around, read_checkout
from drake_navbench.native.choice import HOST_NEEDS, choose
from drake_navbench.native.compiler import Compiler, find_compiler, link_arguments
from drake_navbench.native.flags import Flags, flags_of
from drake_navbench.native.headers import (
    HOST,
    NATIVE,
    REPLACEMENTS,
    STAND_INS,
    made_headers,
    plugin_names_header,
)
from drake_navbench.native.objects import Objects, Unit
from drake_navbench.native.package import Package
from drake_navbench.typed_files.output_file import write_text, write_whole

MAKER = NATIVE / "headers.py"
BENCHMARK_NOISE = NATIVE / "benchmark_noise"
PLUGIN_NAMES = "made/plugin_names.hpp"
# The environment's variables that name further folders of headers.
HEADER_SEARCH = ("CPATH", "CPLUS_INCLUDE_PATH")
# Package -> its source that draws random numbers. A file of ours, named as the package, can replace
# it.
NOISE_SOURCES: Mapping[str, str] = {"nav2_mppi_controller": "src/noise_generator.cpp"}


def build_checkout(
    root: Path,
    *,
    name: str | None = None,
    wanted: Sequence[str] = (),
    noise: NoiseSource = NoiseSource.OWN,
    flags: FlagSet = FlagSet.PORTABLE,
    jobs: int = 2,
    tell: Callable[[str], None] = lambda line: None,
) -> Build:
    """Builds the plugins of a checkout and keeps the result under a name.

    root: the checkout, or a folder in it whose packages alone are built. name: None for the name of
    the release. wanted: packages with controllers or global planners, or folders that hold such
    packages. If it is empty, all packages with controllers are built; those that cannot be built
    here are named by `tell` and left out. noise: whether the controllers draw random numbers of
    their own, or get those that the port draws in the same cycle. flags: the portable ones, or
    each package's own. Raises InputError where there is nothing to build, where the
    compiler or a needed library is missing, or where a wanted package cannot be compiled.
    """
    start = time.monotonic()
    root, inside = checkout_around(root)
    checkout = read_checkout(root)
    name = require_name(name or checkout.release)
    compiler = find_compiler()
    requested = wanted or ([inside] if inside else [])
    choice = choose(checkout, requested, compiler, folders_of(checkout))
    _require_sampling(noise, choice.chosen)
    for reason in choice.reasons.values():
        tell(f"left out: {reason}")
    all_flags = flags_of(flags, choice.packages.values(), compiler, tell=tell)
    logs = builds_folder() / "logs"
    compiled = 0
    while True:
        plan = _Plan(checkout, choice.packages, compiler, noise, all_flags)
        count, failed = plan.compile(jobs, logs, name, tell)
        compiled += count
        if not failed:
            break
        choice = choice.without(failed)
        for reason in failed.values():
            tell(f"left out: {reason}")
    left_out = choice.plugins_left_out
    build = Build(
        name=name,
        host=plan.link(logs / f"{name}.log"),
        release=checkout.release,
        version=checkout.version,
        commit=checkout.commit,
        checkout=checkout.root,
        compiler=compiler.version,
        controllers=tuple(c for name in choice.chosen for c in checkout.packages[name].controllers),
        planners=tuple(p for name in choice.chosen for p in checkout.packages[name].planners),
        left_out=left_out,
        seconds=time.monotonic() - start,
        noise=noise,
        flags=flags,
        more_flags=all_flags.description,
    )
    save_build(build)
    tell(f"{compiled} files compiled, {plan.file_count - compiled} taken from the cache")
    return build


def _require_sampling(noise: NoiseSource, chosen: Collection[str]) -> None:
    if noise is NoiseSource.BENCHMARK and NOISE_SOURCES.keys().isdisjoint(chosen):
        raise InputError(
            f"--noise {noise.value}: {', '.join(chosen)} draw no random numbers; "
            f"expected a build of {', '.join(NOISE_SOURCES)}"
        )


def folders_of(checkout: Checkout) -> Callable[[Package], tuple[Path, ...]]:
    """Returns a function that gives the include folders of a package's sources."""

    def folders(package: Package) -> tuple[Path, ...]:
        seen = checkout.seen_from([package.name])
        return _folders(seen, _written(made_headers(seen)))

    return folders


def _folders(seen: Mapping[str, Package], made: Path) -> tuple[Path, ...]:
    own = (
        folder
        for package in seen.values()
        for folder in (package.include_folder, package.folder / "src")
    )
    return (REPLACEMENTS, made, NATIVE, *(folder for folder in own if folder.is_dir()))


@dataclass(frozen=True)
class _Plan:
    """The sources to compile for some packages of a checkout."""

    checkout: Checkout
    packages: Mapping[str, Package]
    compiler: Compiler
    noise: NoiseSource
    flags: Flags

    @cached_property
    def units(self) -> list[Unit]:
        seen = self.checkout.seen_from(self.packages)
        made = made_headers(seen)
        made[PLUGIN_NAMES] = plugin_names_header(self.packages.values())
        root = _written(made)
        # The headers generated for a package follow from its files and this code alone, so that
        # builds with other packages can share its objects.
        ours = _digest_of_files([MAKER], NATIVE) + _digest_of_headers(STAND_INS, REPLACEMENTS)
        hosts = ours + _digest_of_headers(HOST)
        names = hosts + _digest_of_texts({"": made[PLUGIN_NAMES]})
        headers = {name: _header_digest(package) for name, package in seen.items()}
        units = []
        for package in self.packages.values():
            own = self.checkout.seen_from([package.name])
            sources, ours_instead = self._sources(package)
            flags = self.flags.of_package(package)
            units += self._units(sources, own, headers, root, ours, flags)
            flags = self.flags.of_stand_in(package)
            units += self._units(ours_instead, own, headers, root, hosts, flags)
        core = self.checkout.seen_from(HOST_NEEDS)
        flags = self.flags.of_host
        shared = ["main", "controller_host"]
        if any(package.planners for package in self.packages.values()):
            shared.append("planner_host")
        sources = [HOST / f"{name}.cpp" for name in shared]
        units += self._units(sources, core, headers, root, hosts, flags)
        return units + self._units([HOST / "plugin_names.cpp"], {}, {}, root, names, flags)

    @property
    def file_count(self) -> int:
        return len(self.units)

    def compile(
        self, jobs: int, logs: Path, name: str, tell: Callable[[str], None]
    ) -> tuple[int, dict[str, str]]:
        """Compiles the files that have no object yet; `jobs` at a time.

        Returns the number of compiled files, and the error by package of a file that failed.
        Compiling ends with the first file that fails; its compiler's messages are written to
        NAME.log in the folder `logs`. Raises InputError where that file belongs to no package.
        """
        objects, failed, count = Objects(), {}, 0
        missing = [unit for unit in self.units if objects.system_digest(unit) is None]
        with ThreadPoolExecutor(jobs) as pool:
            done = [
                pool.submit(objects.compile, unit, self.compiler, logs / f"{name}.log")
                for unit in missing
            ]
            try:
                for unit, each in zip(missing, done, strict=True):
                    each.result()
                    count += 1
                    tell(f"[{count}/{len(missing)}] {unit.source.name}")
            except InputError as error:
                owner = self._owner(unit)
                if owner is None:
                    raise
                failed = {owner: f"{owner}: {error}"}
            finally:
                for each in done:
                    each.cancel()
        return count, failed

    def _owner(self, unit: Unit) -> str | None:
        """Returns the package that a file belongs to; None for a file of the host."""
        owners = (name for name, package in self.packages.items() if unit.source in package.sources)
        return next(owners, None)

    def link(self, log: Path) -> Path:
        """Returns the host made of all objects; links it where it does not exist yet."""
        return self._linked(Objects(), log)

    def _linked(self, objects: Objects, log: Path) -> Path:
        """Returns the host made of all objects; links it where it does not exist yet."""
        needed = (d for package in self.packages.values() for d in package.dependencies)
        libraries = [*self.flags.of_link, *link_arguments(needed)]
        content = {unit.digest: str(objects.system_digest(unit)) for unit in self.units}
        digest = _digest_of_texts(content | {"": " ".join(libraries)})
        host = builds_folder() / "hosts" / digest / "nav2_host"
        if not host.is_file():
            inputs = [str(unit.object) for unit in self.units]
            link = [*inputs, "-pthread", *libraries, "-o"]
            write_whole(host, lambda part: self.compiler.run([*link, str(part)], log))
        return host

    def _sources(self, package: Package) -> tuple[list[Path], list[Path]]:
        """Returns the sources of a package that are compiled, and ours that replace the rest."""
        if self.noise is NoiseSource.OWN or package.name not in NOISE_SOURCES:
            return list(package.sources), []
        replaced = package.folder / NOISE_SOURCES[package.name]
        if replaced not in package.sources:
            raise InputError(f"{replaced}: no such file, expected the source of the noise")
        others = [path for path in package.sources if path != replaced]
        return others, [BENCHMARK_NOISE / f"{package.name}.cpp"]

    def _units(
        self,
        sources: Iterable[Path],
        needed: Mapping[str, Package],
        headers: Mapping[str, str],
        made: Path,
        ours: str,
        flags: tuple[str, ...],
    ) -> list[Unit]:
        folders = _folders(needed, made)
        seen = "".join(headers[name] for name in needed)
        search = [os.environ.get(name, "") for name in HEADER_SEARCH]
        words = " ".join(self.compiler.words)
        common = f"{self.compiler.version} {words} {search} {flags} {ours} {seen}"
        return [
            Unit(
                path,
                folders,
                flags,
                hashlib.sha256(f"{common} {path.name} ".encode() + path.read_bytes()).hexdigest(),
            )
            for path in sources
        ]


def _digest_of_headers(*folders: Path) -> str:
    """Returns the digest of our own headers in some folders."""
    paths = [path for folder in folders for path in sorted(folder.rglob("*.hpp"))]
    return _digest_of_files(paths, NATIVE)


def _header_digest(package: Package) -> str:
    return _digest_of_files((*package.headers, *package.messages), package.folder)


def _digest_of_files(paths: Iterable[Path], root: Path) -> str:
    digest = hashlib.sha256()
    for path in paths:
        digest.update(f"{path.relative_to(root).as_posix()}\n".encode() + path.read_bytes())
    return digest.hexdigest()


def _digest_of_texts(texts: Mapping[str, str]) -> str:
    return hashlib.sha256(repr(sorted(texts.items())).encode()).hexdigest()


def _written(headers: Mapping[str, str]) -> Path:
    """Returns the folder with generated headers; raises CannotBeWritten."""
    folder = builds_folder() / "headers" / _digest_of_texts(headers)[:16]
    for name, text in headers.items():
        path = folder / name
        if not path.is_file():
            write_text(path, text)
    return folder
