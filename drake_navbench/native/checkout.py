"""Reads a checkout of Nav2: its packages, its release, and the controllers in the packages."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

from drake_navbench.errors import InputError, nearest_name_hint
from drake_navbench.native.commit import commit_of
from drake_navbench.native.package import (
    CONTROLLER_BASE,
    CORE,
    NOT_OF_A_PACKAGE,
    PACKAGE_FILE,
    PARTS,
    Package,
    last_name,
    read_package,
)
from drake_navbench.plugins.releases import Release

# Version of nav2_core -> release; Nav2's branches number their packages so.
RELEASE_OF_VERSION = {"{}.{}".format(*release.version): release for release in Release}
# Until a release branches off, main has the number of the last one. With Lyrical's interface of
# controllers, it follows Lyrical's rules.
CORE_INTERFACE = Path("include") / CORE / "controller.hpp"
SINCE_LYRICAL = "newPathReceived"
LONGEST_INTERFACE = 1_000_000


@dataclass(frozen=True)
class Checkout:
    """A folder with packages of Nav2.

    release: by the version of its nav2_core and by the interface of its controllers. commit: commit
    of git, '' where it is not known, with a plus where files differ from it.
    """

    root: Path
    packages: Mapping[str, Package]
    release: Release
    version: str
    commit: str

    @property
    def controller_packages(self) -> dict[str, Package]:
        """The packages with controllers, by name."""
        return {name: package for name, package in self.packages.items() if package.controllers}

    @property
    def planner_packages(self) -> dict[str, Package]:
        """The packages with global planners, by name."""
        return {name: package for name, package in self.packages.items() if package.planners}

    def seen_from(self, names: Iterable[str]) -> dict[str, Package]:
        """Returns the packages and all their dependencies, whose headers the compiler must find.

        package.xml names a package's direct dependencies.
        """
        return self._closure(names, lambda package: package.dependencies)

    def compiled_for(
        self, names: Iterable[str], *, without: Collection[str] = ()
    ) -> dict[str, Package]:
        """Returns the packages that are linked: the given ones, their dependencies, their plugins.

        Dependencies of packages in PARTS are not linked. without: packages with plugins that are
        left out.
        """
        return self._closure(
            names, lambda package: self._needed_by(package) | self._made_for(package) - {*without}
        )

    def _needed_by(self, package: Package) -> frozenset[str]:
        """Returns the packages that a package is linked with because it depends on them."""
        if package.name in PARTS and not package.planners:
            return frozenset()
        return package.dependencies

    def _made_for(self, package: Package) -> frozenset[str]:
        """Returns the packages with plugins that a package with controllers loads."""
        if not package.controllers:
            return frozenset()
        return frozenset(
            other.name
            for other in self.packages.values()
            if package.name in other.dependencies
            and not other.controllers
            and other.name not in PARTS
            and any(last_name(base) in package.loaded for base in other.plugins.values())
        )

    def needed_for(self, names: Iterable[str]) -> dict[str, Package]:
        """Returns packages and those that they are linked with, without plugins for them."""
        return self._closure(names, self._needed_by)

    def named(self, name: str) -> list[str]:
        """Returns the packages with controllers or planners that a name stands for.

        The name is that of such a package, or of a folder with such packages. Raises InputError for
        other names.
        """
        known = self.controller_packages | self.planner_packages
        if name in known:
            return [name]
        inside = [
            each.name for each in known.values() if name in each.folder.relative_to(self.root).parts
        ]
        if not inside:
            raise InputError(
                f"{self.root}: no package or folder of packages {name!r} with a controller or "
                f"planner{nearest_name_hint(name, known)}"
            )
        return sorted(inside)

    def _closure(
        self, names: Iterable[str], leads_to: Callable[[Package], Iterable[str]]
    ) -> dict[str, Package]:
        found: dict[str, Package] = {}
        waiting = list(names)
        while waiting:
            name = waiting.pop()
            if name not in found and name in self.packages:
                found[name] = self.packages[name]
                waiting += leads_to(found[name])
        return dict(sorted(found.items()))


def checkout_around(folder: Path) -> tuple[Path, str | None]:
    """Returns the checkout that a folder is or lies in, and the folder's name in it, if any.

    A folder of one or several packages, such as nav2_dwb_controller, has no nav2_core beside them.
    """
    folder = folder.absolute()
    for place in (folder, *folder.parents):
        if (place / CORE / PACKAGE_FILE).is_file():
            return place, folder.name if place != folder else None
    return folder, None


def read_checkout(root: Path) -> Checkout:
    """Reads the packages of a checkout of Nav2; raises InputError for any other folder."""
    root = root.absolute()
    if not root.is_dir():
        raise InputError(f"{root}: no such folder, expected a checkout of navigation2")
    packages = {package.name: package for package in map(read_package, _package_files(root))}
    if CORE not in packages:
        raise InputError(
            f"{root}: not a checkout of navigation2: no package {CORE} in it or its folders"
        )
    version = packages[CORE].version
    release = RELEASE_OF_VERSION.get(".".join(version.split(".")[:2]))
    if release is None:
        known = ", ".join(f"{name} ({version})" for version, name in RELEASE_OF_VERSION.items())
        raise InputError(
            f"{packages[CORE].folder / PACKAGE_FILE}: version: got {version!r}, "
            f"expected a release that is known: {known}"
        )
    if release is Release.KILTED and _has_interface_of_lyrical(packages[CORE].folder):
        release = Release.LYRICAL
    checkout = Checkout(root, packages, release, version, commit_of(root))
    if not checkout.controller_packages:
        raise InputError(f"{root}: no package in it exports a {CONTROLLER_BASE}")
    return checkout


def _has_interface_of_lyrical(core: Path) -> bool:
    header = core / CORE_INTERFACE
    if not header.is_file():
        return False
    with header.open(encoding="utf-8", errors="replace") as text:
        return SINCE_LYRICAL in text.read(LONGEST_INTERFACE)


def _package_files(root: Path) -> list[Path]:
    # The depth of packages in a workspace with several repositories.
    return [
        path
        for depth in range(5)
        for path in sorted(root.glob("*/" * depth + PACKAGE_FILE))
        if not any(
            part.startswith(".") or part in NOT_OF_A_PACKAGE
            for part in path.relative_to(root).parts[:-1]
        )
    ]
