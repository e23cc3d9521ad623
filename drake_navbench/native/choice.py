"""Chooses the packages of a checkout to build: the wanted ones, or all that can be built here."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from drake_navbench.errors import InputError
from drake_navbench.native.checkout import Checkout
from drake_navbench.native.compiler import Compiler, missing_libraries
from drake_navbench.native.headers import HOST, NATIVE, REPLACEMENTS, made_headers
from drake_navbench.native.package import Package, includes_of

HOST_NEEDS = ("nav2_core",)

OURS = (REPLACEMENTS, NATIVE, HOST)


@dataclass(frozen=True)
class Choice:
    """The packages of a checkout that are built.

    chosen: names of packages with controllers or planners. is_asked: a user named them, so that
    none may be left out. reasons: the packages that are left out, with the reason in words.
    """

    checkout: Checkout
    chosen: tuple[str, ...]
    is_asked: bool
    reasons: Mapping[str, str] = field(default_factory=dict)

    @property
    def packages(self) -> dict[str, Package]:
        """The packages that are compiled: the chosen ones and those that they need."""
        return self.checkout.compiled_for((*self.chosen, *HOST_NEEDS), without=self.reasons)

    @property
    def plugins_left_out(self) -> dict[str, str]:
        """The plugins of the packages that are left out, each with the reason."""
        return {
            plugin: reason
            for name, reason in self.reasons.items()
            for plugin in self.checkout.packages[name].plugins
        }

    def without(self, failed: Mapping[str, str]) -> Choice:
        """Returns the choice without the failed packages and without the packages that need them.

        Raises InputError with the reason where a requested package needs a failed one, or where no
        package is left.
        """
        reasons, kept = dict(self.reasons), []
        needed = {name: self.checkout.needed_for([name, *HOST_NEEDS]) for name in self.chosen}
        for name in self.chosen:
            lacking = next((each for each in failed if each in needed[name]), None)
            if lacking is None:
                kept.append(name)
            elif self.is_asked:
                raise InputError(failed[lacking])
            else:
                reason = failed[lacking]
                reasons[name] = reason if lacking == name else f"{name} needs {reason}"
        if not kept:
            raise InputError("; ".join(dict.fromkeys(reasons.values())))
        # The remaining packages only have plugins for packages that are built.
        for name, reason in failed.items():
            if not any(name in packages for packages in needed.values()):
                reasons[name] = reason
        return replace(self, chosen=tuple(kept), reasons=reasons)


def choose(
    checkout: Checkout,
    requested: Sequence[str],
    compiler: Compiler,
    folders_of: Callable[[Package], tuple[Path, ...]],
) -> Choice:
    """Returns the packages to build: those asked for, or all with controllers that can be built.

    requested: names of packages, or of folders that hold packages. folders_of: see MissingHeaders.
    Raises InputError where no package is chosen, or where a requested one cannot be built.
    """
    named = [name for each in requested for name in checkout.named(each)]
    chosen = dict.fromkeys(named or checkout.controller_packages)
    choice = Choice(checkout, tuple(chosen), bool(requested))
    lacking = {}
    for name in choice.chosen:
        missing = missing_libraries(checkout.packages[name].dependencies, compiler)
        if missing:
            lacking[name] = f"{name} cannot be built, as this is missing: {', '.join(missing)}"
    if lacking:
        choice = choice.without(lacking)
    headers = MissingHeaders(checkout, compiler, folders_of)
    while failed := headers.reasons(choice.packages):
        choice = choice.without(failed)
    return choice


@dataclass
class MissingHeaders:
    """The missing headers of each package; each package is searched once.

    folders_of: returns a package's folders of headers. The compiler decides with them whether a
    header is really missing, since an include may stand behind a condition.
    """

    checkout: Checkout
    compiler: Compiler
    folders_of: Callable[[Package], tuple[Path, ...]]
    _reasons: dict[str, str | None] = field(default_factory=dict)

    def reasons(self, packages: Mapping[str, Package]) -> dict[str, str]:
        """Returns the packages that cannot be compiled, each with the reason in words."""
        new = [package for name, package in packages.items() if name not in self._reasons]
        foreign = {package.name: self._foreign_includes(package) for package in new}
        names = {name for found in foreign.values() for each in found.values() for name in each}
        absent = self.compiler.absent_headers(sorted(names))
        for package in new:
            suspects = {path for path, found in foreign[package.name].items() if absent & found}
            self._reasons[package.name] = self._confirmed(package, suspects)
        found = {name: self._reasons[name] for name in packages}
        return {name: reason for name, reason in found.items() if reason is not None}

    def _confirmed(self, package: Package, suspects: set[Path]) -> str | None:
        """Returns the first header that the compiler does not find for some sources."""
        for source in sorted(suspects):
            header = self.compiler.missing_header(self.folders_of(package), source)
            if header is not None:
                place = source.relative_to(package.folder).as_posix()
                return (
                    f"{package.name}: {place} needs {header}, "
                    "for which there is neither a file nor a stand-in"
                )
        return None

    def _foreign_includes(self, package: Package) -> dict[Path, set[str]]:
        """Returns for each source the headers it includes, directly or not, that are not ours."""
        seen = self.checkout.seen_from([package.name])
        made = made_headers(seen)
        folders = [
            *OURS,
            *(f for p in seen.values() for f in (p.include_folder, p.folder / "src")),
        ]
        known: dict[Path, tuple[list[Path], set[str]]] = {}

        def direct(path: Path) -> tuple[list[Path], set[str]]:
            if path not in known:
                ours, others = [], set()
                for name in includes_of(path):
                    if name in made:
                        continue
                    places = (folder / name for folder in (path.parent, *folders))
                    place = next((each for each in places if each.is_file()), None)
                    if place is None:
                        others.add(name)
                    elif not place.is_relative_to(NATIVE):
                        ours.append(place)
                known[path] = ours, others
            return known[path]

        found = {}
        for source in package.sources:
            foreign: set[str] = set()
            visited, waiting = {source}, [source]
            while waiting:
                ours, others = direct(waiting.pop())
                foreign |= others
                waiting += [path for path in ours if path not in visited]
                visited |= set(ours)
            found[source] = foreign
        return found
