"""Finds a YAML file by the name of a built-in one or by its path."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

from drake_navbench.errors import InputError, nearest_name_hint

YAML_SUFFIXES = frozenset({".yaml", ".yml"})
# The suffixes of world files, which are refused in place of YAML files.
WORLDS = (".world", ".sdf", ".wbt")
# The most files of a folder that an error names.
MAX_NAMED = 3


@dataclass(frozen=True)
class NamedFiles:
    """The YAML files of one kind that come with the package.

    kind: the noun in errors ('scenario', 'robot'). package: dotted name of the folder that holds
    the built-in ones.
    """

    kind: str
    package: str

    @property
    def folder(self) -> Path:
        """The folder of the built-in files."""
        return Path(str(files(self.package)))

    @property
    def names(self) -> list[str]:
        """The built-in names, sorted."""
        return sorted(path.stem for path in self.folder.glob("*.yaml"))

    def beside(self, folder: str | Path, name: str) -> Path:
        """Returns a file in a folder, else the built-in one of that name if there is one.

        So a copy of a built-in file in any folder finds the files that it names.
        """
        own, built_in = Path(folder) / name, self.folder / name
        return built_in if not own.is_file() and built_in.is_file() else own

    def find(self, name_or_path: str) -> Path:
        """Returns the file for a built-in name, or a path as it is given.

        Raises InputError if there is no such file.
        """
        if name_or_path in self.names:
            return self.folder / f"{name_or_path}.yaml"
        path = Path(name_or_path)
        if path.suffix in YAML_SUFFIXES or path.parent != Path():
            try:
                is_file = path.is_file()
            except OSError as error:
                raise InputError(
                    f"{self.kind} file {name_or_path}: cannot be read: {error.strerror}"
                ) from error
            if path.is_dir() or path.suffix in WORLDS:
                raise InputError(f"{self.kind} {name_or_path}: {_instead(path)}")
            if not is_file:
                what = "expected a regular file" if path.exists() else "no such file"
                raise InputError(f"{self.kind} file {name_or_path}: {what}")
            return path
        if path.exists():
            raise InputError(f"{self.kind} {name_or_path}: {_instead(path)}")
        raise InputError(
            f"{self.kind} {name_or_path!r} is not known"
            + nearest_name_hint(name_or_path, self.names, listed_by="drake-navbench list")
        )


def _instead(path: Path) -> str:
    """Returns the error for a path that is no YAML file: its kind, and the expected kind."""
    if path.is_dir():
        suffixes = (*YAML_SUFFIXES, ".sdf", ".urdf")
        files = []
        # A folder that may not be listed is told as any other.
        with suppress(OSError):
            files = sorted(file.name for file in path.iterdir() if file.suffix in suffixes)
        named = f", such as {', '.join(files[:MAX_NAMED])} in it" if files else ""
        return f"is a folder; expected a file{named} (a robot's repository is given by --package)"
    if path.suffix in WORLDS:
        return "is a simulator's world; expected a YAML file (worlds of BARN are for --barn)"
    return "expected a YAML file"
