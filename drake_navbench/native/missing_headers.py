"""Finds the packages of a checkout that include a header which exists nowhere.

A header may be in the checkout, in the system, or among our stand-ins. The search runs before
anything is compiled, so that packages that cannot be built here, such as Nav2's own system tests,
are left out.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from drake_navbench.native.checkout import Checkout
from drake_navbench.native.compiler import Compiler
from drake_navbench.native.headers import HOST, NATIVE, REPLACEMENTS, made_headers
from drake_navbench.native.package import Package, includes_of

OURS = (REPLACEMENTS, NATIVE, HOST)


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
