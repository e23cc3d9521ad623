"""Fingerprint of code, packages and processor: where it is equal, equal trials give equal bytes."""

from __future__ import annotations

import hashlib
import platform
from functools import cache
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

from drake_navbench.processes.instruction_set import BASELINE, instruction_set
from drake_navbench.processes.machine import processor_name
from drake_navbench.processes.version import __version__

PACKAGE = Path(__file__).parents[1]
# The packages on whose versions the contents of a log depend.
COMPUTING_PACKAGES = ("drake", "numba", "numpy", "pandas", "pyarrow", "scipy")
# Subpackages that lie in other folders in an editable installation than in a wheel.
APART = ("analysis", "controllers", "models", "scenarios")


class Fingerprint(NamedTuple):
    """The fingerprint of a process.

    software: versions that must be equal for equal results. processor: its name. features: the
    instructions that this process uses: the baseline's name, or a digest of all that the processor
    has. Processes that differ in features may round differently, since compiled kernels use the
    processor's instructions, such as fused multiply-adds.
    """

    software: dict[str, str]
    processor: str
    features: str

    def differing(self, other: Fingerprint) -> str:
        """Returns the packages whose versions differ from the other fingerprint's; '' for none."""
        return ", ".join(
            f"{name} {self.software.get(name, 'none')} instead of {value}"
            for name, value in other.software.items()
            if self.software.get(name) != value
        )


@cache
def fingerprint() -> Fingerprint:
    """Returns the fingerprint of this process."""
    software = {
        "drake_navbench": __version__,
        "code": _code_digest(),
        "python": ".".join(platform.python_version_tuple()[:2]),
        **{name: version(name) for name in COMPUTING_PACKAGES},
    }
    return Fingerprint(software, processor_name(), _features())


def _features() -> str:
    """Returns the baseline's name, or a digest of the instructions that the processor has."""
    if instruction_set() == BASELINE:
        return BASELINE
    import llvmlite.binding as llvm

    text = f"{llvm.get_host_cpu_name()} {llvm.get_host_cpu_features().flatten()}"
    return hashlib.sha256(f"{instruction_set()} {text}".encode()).hexdigest()[:12]


def _code_digest() -> str:
    """Returns a digest of the code that drives and measures, wherever its folders are installed."""
    digest = hashlib.sha256()
    for path in sorted(PACKAGE.rglob("*.py")):
        name = path.relative_to(PACKAGE)
        if name.parts[0] not in APART:
            digest.update(name.as_posix().encode() + path.read_bytes())
    for part in APART:
        found = find_spec(f"drake_navbench.{part}")
        for folder in map(Path, (found and found.submodule_search_locations) or ()):
            for path in sorted(folder.rglob("*.py")):
                name = path.relative_to(folder)
                digest.update(f"{part}/{name.as_posix()}".encode() + path.read_bytes())
    return digest.hexdigest()[:12]
