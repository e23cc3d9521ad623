"""Compiled objects by their content: the source, all headers that it includes, compiler and flags.

The content of a checkout and of this package is known before anything is compiled. Only the
compiler can tell which of the system's headers a source includes, and does so while it compiles.
Their contents are kept beside the object, which is used as long as they are the same.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

from drake_navbench.native.builds import builds_folder
from drake_navbench.native.compiler import Compiler, include_arguments
from drake_navbench.typed_files.output_file import write_text, write_whole

# The separator of names in a rule of make, in which a name's own blanks follow a backslash.
_BETWEEN = re.compile(r"(?<!\\)\s+")


@dataclass(frozen=True)
class Unit:
    """One file to compile, with its folders of headers and its flags.

    digest: digest of the file, its headers and its flags, without the system's headers.
    """

    source: Path
    folders: tuple[Path, ...]
    flags: tuple[str, ...]
    digest: str

    @property
    def object(self) -> Path:
        """The path of the compiled object, which need not exist yet."""
        return builds_folder() / "objects" / self.digest[:2] / f"{self.digest}.o"


@dataclass(frozen=True)
class Objects:
    """The compiled objects on the disk, and the digests of the system's headers as they are now."""

    _known: dict[str, str] = field(default_factory=dict)

    def system_digest(self, unit: Unit) -> str | None:
        """Returns the digest of the system's headers in a unit's object.

        None where there is no object, or where it was compiled with other headers.
        """
        try:
            kept = json.loads(_record(unit).read_bytes())
            paths, digest = kept["headers"], kept["digest"]
        except (OSError, ValueError, KeyError, TypeError):
            return None
        if not unit.object.is_file() or self._digest(paths) != digest:
            return None
        return str(digest)

    def compile(self, unit: Unit, compiler: Compiler, log: Path) -> None:
        """Compiles a unit; raises InputError where it cannot be compiled."""
        rule = unit.object.with_name(f"{unit.object.name}.{os.getpid()}.d")
        arguments = [*unit.flags, *include_arguments(unit.folders), "-c", str(unit.source)]
        arguments += ["-MD", "-MF", str(rule), "-o"]
        write_whole(unit.object, lambda part: compiler.run([*arguments, str(part)], log))
        ours = (*unit.folders, unit.source.parent)
        headers = system_headers(rule.read_text(encoding="utf-8", errors="surrogateescape"), ours)
        rule.unlink()
        kept = {"digest": self._digest(headers), "headers": headers}
        write_text(_record(unit), json.dumps(kept))

    def _digest(self, paths: Iterable[str]) -> str:
        digest = hashlib.sha256()
        for path in paths:
            if path not in self._known:
                self._known[path] = _content_digest(path)
            digest.update(f"{path}\n{self._known[path]}\n".encode(errors="surrogateescape"))
        return digest.hexdigest()


def system_headers(rule: str, ours: Iterable[Path]) -> list[str]:
    """Returns the headers in a compiler's rule of make that are outside of our folders, sorted."""
    _, _, needed = rule.replace("\\\n", " ").partition(": ")
    names = (re.sub(r"\\(.)", r"\1", name).replace("$$", "$") for name in _BETWEEN.split(needed))
    roots = [Path(os.path.normpath(folder)) for folder in ours]
    paths = {os.path.normpath(name) for name in names if name}
    return sorted(p for p in paths if not any(Path(p).is_relative_to(r) for r in roots))


def _record(unit: Unit) -> Path:
    return unit.object.with_suffix(".json")


def _content_digest(path: str) -> str:
    try:
        return hashlib.sha256(Path(path).read_bytes()).hexdigest()
    except OSError:
        return "none"
