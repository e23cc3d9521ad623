"""The inside of the process that expands a xacro file; see `xacro_file`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from xacrodoc import XacroDoc
from xacrodoc import packages as found_packages
from xacrodoc.packages import PackageNotFoundError

from drake_navbench.errors import InputError, as_line
from drake_navbench.typed_files.ros_packages import Packages


def expand(asked: dict[str, Any]) -> dict[str, Any]:
    """Returns the text of a xacro file expanded, and its arguments with their values.

    asked: file, folders (of `Packages`) and arguments, by name. Raises InputError, one line, where
    a package is not found or xacro cannot expand the file.
    """
    path = Path(asked["file"])
    packages = Packages(path, [Path(folder) for folder in asked["folders"]])
    found_packages.update_package_cache(packages.all())
    while True:
        try:
            arguments = _Arguments(asked["arguments"])
            text = _expanded(path, arguments)
            break
        except PackageNotFoundError as error:
            name = str(error.args[0])
            folder = packages.folder(name)
            if folder is None:
                raise InputError(
                    f"needs the package {name!r}, which is not in {packages.root}; expected it "
                    "there or below a folder of --packages"
                ) from error
            found_packages.update_package_cache({name: folder})
    return {"text": text, "arguments": {n: str(arguments[n]) for n in sorted(arguments.declared)}}


class _Arguments(dict[str, str]):
    """The values of arguments; declared: the names that xacro files declare.

    xacro looks whether an argument has a value where it meets the declaration of one.
    """

    def __init__(self, values: dict[str, str]) -> None:
        super().__init__(values)
        self.declared: set[str] = set()

    def __contains__(self, name: object) -> bool:
        self.declared.add(str(name))
        return super().__contains__(name)


def _expanded(path: Path, arguments: _Arguments) -> str:
    try:
        document = XacroDoc.from_file(
            str(path), walk_up=False, subargs=arguments, resolve_packages=False
        )
    except PackageNotFoundError:
        raise
    except Exception as error:
        cause: BaseException | None = error
        while cause is not None:
            if isinstance(cause, MemoryError | PackageNotFoundError):
                raise cause from None
            cause = cause.__cause__ or getattr(cause, "exc", None)
        name = _missing_package(error)
        if name is not None:
            raise PackageNotFoundError(name) from error
        raise InputError(f"xacro cannot expand it: {as_line(str(error))}") from error
    return str(document.to_urdf_string())


def _missing_package(error: BaseException) -> str | None:
    """Returns the name of the package that a wrapped error tells of; None where it is another."""
    _, found, name = str(error).partition("Package not found:")
    return name.split()[0] if found and name.split() else None
