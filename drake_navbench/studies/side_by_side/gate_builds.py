"""The two builds of a gate: found by name, or made from checkouts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from drake_navbench.errors import InputError
from drake_navbench.inputs.presets import original_plugin
from drake_navbench.native.build import NOISE_SOURCES, build_checkout
from drake_navbench.native.builds import Build, FlagSet, NoiseSource, find_build
from drake_navbench.native.checkout import read_checkout
from drake_navbench.native.package import Package
from drake_navbench.studies.side_by_side.gate import split_column

# A gate's default for a checkout: the flags that users run with, and the benchmark's noise. With
# its own noise, an original would draw the same numbers in every trial.
FLAGS = FlagSet.PACKAGE
NOISE = NoiseSource.BENCHMARK


def build_of(
    text: str,
    name: str,
    controllers: Sequence[str],
    *,
    flags: FlagSet | None = None,
    noise: NoiseSource | None = None,
    tell: Callable[[str], None],
) -> Build:
    """Returns the build with the name `text`, or makes one from the checkout in the folder `text`.

    name: name of a new build. controllers: presets; only packages with their originals are built.
    flags, noise: the wanted ones. With None a checkout is built with the gate's defaults, and a
    named build may have any. Raises InputError where there is no such build or folder, or where a
    named build has other flags or noise.
    """
    if not Path(text).is_dir():
        build = find_build(text)
        _require_built(build, "flags", build.flags, flags)
        if _samples(build.controllers, controllers):
            _require_built(build, "noise", build.noise, noise)
        return build
    packages = _packages(Path(text), controllers)
    # Packages without a generator of noise have nothing to replace.
    samples = any(package.name in NOISE_SOURCES for package in packages)
    return build_checkout(
        Path(text),
        name=name,
        wanted=[package.name for package in packages],
        noise=noise or (NOISE if samples else NoiseSource.OWN),
        flags=flags or FLAGS,
        tell=tell,
    )


def left_out_changes(base: str, head: str, controllers: Sequence[str]) -> list[str]:
    """Returns the files that differ between two checkouts and that the benchmark's noise replaces.

    The list is empty where one is a named build, whose checkout may have changed since.
    """
    if not (Path(base).is_dir() and Path(head).is_dir()):
        return []
    texts = [
        {
            f"{package.name}/{NOISE_SOURCES[package.name]}": _content(package)
            for package in _packages(Path(root), controllers)
            if package.name in NOISE_SOURCES
        }
        for root in (base, head)
    ]
    return sorted(name for name in texts[0] if texts[0][name] != texts[1].get(name))


def _packages(root: Path, controllers: Sequence[str]) -> list[Package]:
    plugins = _plugins(controllers)
    packages = read_checkout(root).controller_packages.values()
    return [package for package in packages if plugins & set(package.controllers)]


def _plugins(controllers: Sequence[str]) -> set[str | None]:
    return {original_plugin(split_column(controller)[0]) for controller in controllers}


def _samples(built: Sequence[str], controllers: Sequence[str]) -> bool:
    """Returns whether one of the driven controllers samples, judged by its plugin's name."""
    driven = {str(plugin).partition("::")[0] for plugin in _plugins(controllers) & set(built)}
    return not driven.isdisjoint(NOISE_SOURCES)


def _content(package: Package) -> bytes:
    path = package.folder / NOISE_SOURCES[package.name]
    return path.read_bytes() if path.is_file() else b""


def _require_built(build: Build, what: str, built: str, requested: str | None) -> None:
    if requested is not None and requested != built:
        raise InputError(
            f"--{what} {requested}: build {build.name!r} has {what} {built}; "
            f"nav2-build CHECKOUT --{what} {requested} makes another"
        )
