"""The inside of the process that expands a xacro file; see `xacro_file`."""

from __future__ import annotations

import os
import re
import tempfile
from collections.abc import Iterator, Mapping, Set
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import xacro
from xacrodoc import XacroDoc
from xacrodoc import packages as found_packages
from xacrodoc.packages import PackageNotFoundError

from drake_navbench.errors import InputError, as_line
from drake_navbench.inputs.descriptions.launched_value import (
    FLAGS,
    chosen_value,
    launched_flags,
    launched_value,
    launched_variable,
)
from drake_navbench.inputs.descriptions.ros_packages import Packages
from drake_navbench.inputs.descriptions.xacro_macro import call_of, robot_macro, with_call
from drake_navbench.inputs.descriptions.xml_file import without_late_declaration
from drake_navbench.typed_files.input_file import LFS_POINTER, read_head, require_fetched

UNDEFINED = re.compile(r"Undefined substitution argument (\w+)")
# The beginning of a file's place in a package.
PACKAGE = "package://"
UNSET = re.compile(r"environment variable '(\w+)' is not set")
ASKED = re.compile(r"asks for the environment variable (\w+)")
# The variables for which a file has a default.
OPTIONAL = re.compile(r"\$\(optenv\s+(\w+)")
# xacro tells a missing file twice.
TOLD_AGAIN = re.compile(r" \[Errno 2\] No such file or directory: '[^']*'$")
# The most files of missing packages; xacro asks for one after the other.
MAX_MISSING = 100
LINK = re.compile(r"<link\b")
SCANS = re.compile(r"<sensor\b[^>]*\btype\s*=\s*[\"'](?:gpu_)?(?:ray|lidar)[\"']")
# Values of a flag.
ON, OFF = "true", frozenset({"false", "0", "no"})
# Without such an element nothing is left that drives.
WHEEL = re.compile(r"<joint\b[^>]*wheel", re.IGNORECASE)
XML_SUFFIXES = (".xacro", ".urdf", ".xml", ".gazebo", ".sdf")
# Elements that xacro once took without its prefix, and the attribute by which they are recognised.
OLD = {
    "property": "name",
    "macro": "params",
    "include": "filename",
    "if": "value",
    "unless": "value",
    "insert_block": "name",
}
# The functions of xacro, in whose places each expansion puts its own.
PARSE, CALL_MACRO = xacro.parse, xacro.handle_macro_call


def expand(request: dict[str, Any]) -> dict[str, Any]:
    """Returns the text of a xacro file expanded, its arguments with values, remarks, and files.

    request: file, text (None: the file's own), folders (of `Packages`) and arguments, by name. For
    a file that only defines a macro of its own name, the macro is called. Parts that a missing
    package describes are left out. Raises InputError, one line, where no wheels are left, or xacro
    cannot expand the file.
    """
    path = Path(request["file"])
    given = path.read_bytes() if request["text"] is None else request["text"].encode()
    content = without_late_declaration(given).decode(errors="replace")
    with _environment_kept():
        return _expanded_file(path, content, request)


def _expanded_file(path: Path, content: str, request: dict[str, Any]) -> dict[str, Any]:
    text, arguments, remarks = _expanded_with(path, content, request)
    macro = None if LINK.search(text) else robot_macro(content, path)
    if macro is not None:
        call = call_of(content, macro, request["arguments"])
        text, arguments, remarks = _expanded_with(path, with_call(content, call.text), request)
        arguments |= call.values
        remarks.append(f"only defines a macro; expanded as {call.text}")
    files = sorted(set(map(str, xacro.all_includes)))
    return {"text": text, "arguments": arguments, "remarks": remarks, "files": files}


@contextmanager
def _environment_kept() -> Iterator[None]:
    """Sets the environment back at the end."""
    before = dict(os.environ)
    try:
        yield
    finally:
        os.environ.clear()
        os.environ.update(before)


def _expanded_with(
    path: Path, content: str, request: dict[str, Any]
) -> tuple[str, dict[str, str], list[str]]:
    """Returns a text expanded, the arguments with their values, and remarks."""
    packages = Packages(path, [Path(folder) for folder in request["folders"]])
    found_packages.update_package_cache(packages.all())
    with tempfile.TemporaryDirectory() as folder:
        missing = _Missing(Path(folder), packages)
        launched: dict[str, str] = {}
        for name in OPTIONAL.findall(content):
            missing.sets(f"asks for the environment variable {name}")
        for _ in range(MAX_MISSING):
            arguments = _Arguments(launched | request["arguments"])
            try:
                text = _expanded(path, content, arguments, missing)
                given = {*launched, *request["arguments"]}
                chosen = _chosen(arguments, given, path, packages)
                if not (chosen or SCANS.search(text)):
                    flags = launched_flags(arguments.off() - given, path, packages)
                    chosen = _scanning(flags, path, content, dict(arguments), missing)
                if not chosen:
                    break
                for name, (value, how) in chosen.items():
                    missing.told.append(
                        f"argument {name}: {value}, {how}; its own default is {arguments[name]}"
                    )
                launched |= {name: value for name, (value, _) in chosen.items()}
            except PackageNotFoundError as error:
                missing.add(str(error.args[0]))
            except InputError as error:
                if missing.sets(str(error)):
                    continue
                asked = UNDEFINED.search(str(error))
                found = launched_value(asked[1], path, packages) if asked else None
                if asked and found and asked[1] not in launched:
                    launched[asked[1]] = found[0]
                    missing.told.append(
                        f"argument {asked[1]} has no default: {found[0]}, as in {found[1].name}"
                    )
                elif not missing.provides(str(error)):
                    raise missing.fault(error) from error
        else:
            raise InputError(f"more than {MAX_MISSING} of the files that it includes are missing")
        if missing.macros and not (LINK.search(text) and WHEEL.search(text)):
            raise missing.fault(InputError(missing.remarks()[-1]))
        # Files of a missing package do not exist under its name.
        there = f"{missing.folder}/"
        text = text.replace(there, PACKAGE)
        told = {name: str(arguments[name]) for name in sorted(arguments.declared)}
    values = {name: value.replace(there, PACKAGE) for name, value in told.items()}
    return text, values, missing.remarks()


def _chosen(
    arguments: _Arguments, given: Set[str], path: Path, packages: Packages
) -> dict[str, tuple[str, str]]:
    """Returns the values other than their defaults that launch files give arguments not `given`.

    Each has a remark that names the launch file. None for an argument that is empty by default,
    such as a namespace.
    """
    found = {
        name: chosen_value(name, path, packages)
        for name in sorted(arguments.declared - given)
        if name in arguments and str(arguments[name]).lower() not in {"", *FLAGS}
    }
    return {
        name: (told[0], f"as in {told[1].name}")
        for name, told in found.items()
        if told and told[0] != arguments[name]
    }


def _scanning(
    flags: Mapping[str, str],
    path: Path,
    content: str,
    values: Mapping[str, str],
    missing: _Missing,
) -> dict[str, tuple[str, str]]:
    """Returns the first flag that gives a model a lidar, with its value and remark; {} else.

    flags: those that are off by default, and a remark on the launch file of each. A launch file of
    a simulation sets one that brings the sensors, and that of the robot does not.
    """
    for name, how in flags.items():
        try:
            text = _expanded(path, content, _Arguments({**values, name: ON}), missing)
        except (InputError, PackageNotFoundError):
            continue
        if SCANS.search(text):
            return {name: (ON, how)}
    return {}


class _Missing:
    """The missing packages: each is an empty folder, in which files appear when asked for."""

    def __init__(self, folder: Path, packages: Packages) -> None:
        self.folder = folder
        self._packages = packages
        self.names: list[str] = []
        self.macros: dict[str, None] = {}
        self.told: list[str] = []

    def remarks(self) -> list[str]:
        """Returns a remark on each package, and one on the parts that only such packages define."""
        absent = [f"left out what the package {name} describes: not found" for name in self.names]
        absent += self.told
        if self.macros:
            parts = ", ".join(self.macros)
            absent.append(f"left out {parts}: defined by a package that is not found")
        return absent

    def parse(self, inp: Any, filename: str | None = None) -> Any:
        """Parses as xacro does; a path of the author's computer is the repository's file."""
        if filename is not None and os.path.isabs(filename) and not os.path.exists(filename):
            filename = str(self._packages.place(filename) or filename)
        if filename is not None:
            require_fetched(Path(filename), read_head(Path(filename), len(LFS_POINTER)))
        return _parse_old(inp, filename)

    def call(self, node: Any, macros: Any, symbols: Any) -> Any:
        """Calls a macro as xacro does; leaves out a macro that a missing package defines."""
        try:
            return _call_old(node, macros, symbols)
        except xacro.XacroException as error:
            name = node.tagName
            if not self.names or str(error) != f"unknown macro name: {name}":
                raise
            self.macros[name.removeprefix("xacro:")] = None
            xacro.replace_node(node, by=None)
            return True

    def add(self, name: str) -> None:
        """Adds a package: its folder, or an empty one."""
        place = self._packages.folder(name)
        if place is None:
            place = self.folder / name
            place.mkdir(parents=True, exist_ok=True)
            self.names.append(name)
        found_packages.update_package_cache({name: place})

    def sets(self, fault: str) -> bool:
        """Sets the environment variable that a fault calls unset, as a launch file does."""
        unset = ASKED.search(fault)
        found = launched_variable(unset[1], self._packages) if unset else None
        if unset is None or found is None or unset[1] in os.environ:
            return False
        os.environ[unset[1]] = found[0]
        self.told.append(f"environment variable {unset[1]}: {found[0]}, as in {found[1].name}")
        return True

    def provides(self, fault: str) -> bool:
        """Creates the file that a fault calls missing; tells whether it is in a missing package."""
        named = re.search(rf"{re.escape(str(self.folder))}/[^\s'\"]+", fault)
        if named is None or "No such file" not in fault:
            return False
        file = Path(named[0].rstrip(":,"))
        if file.exists():
            return False
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text("<robot/>" if file.suffix in XML_SUFFIXES else "{}", encoding="utf-8")
        return True

    def fault(self, error: InputError) -> InputError:
        """Returns the fault of a missing package, if there is one, in place of a later fault."""
        if not self.names or "No such file" in str(error):
            return error
        first, *others = map(repr, self.names)
        named = f"packages {', '.join((first, *others))}" if others else f"package {first}"
        are, them = ("are", "them") if others else ("is", "it")
        return InputError(
            f"needs the {named}, which {are} not in {self._packages.root}; "
            f"expected {them} there or below a folder of --packages ({error})"
        )


class _Arguments(dict[str, str]):
    """The values of arguments; declared: the names that xacro files declare, or use without it.

    xacro asks for an argument's value where it meets its declaration.
    """

    def __init__(self, values: dict[str, str]) -> None:
        super().__init__(values)
        self.declared: set[str] = set()

    def off(self) -> set[str]:
        """Returns the flags that are off."""
        return {name for name in self.declared if str(self.get(name, "")).lower() in OFF}

    def __contains__(self, name: object) -> bool:
        self.declared.add(str(name))
        return super().__contains__(name)

    def __getitem__(self, name: str) -> str:
        value = super().__getitem__(name)
        self.declared.add(name)
        return value


def _expanded(path: Path, content: str, arguments: _Arguments, missing: _Missing) -> str:
    """Returns a text expanded once; raises PackageNotFoundError, and InputError for all else."""
    xacro.parse, xacro.handle_macro_call = missing.parse, missing.call
    # After a failed attempt, xacro still stands in the file in which it failed.
    xacro.init_stacks(None)
    try:
        document = XacroDoc.from_string(
            content,
            subargs=arguments,
            resolve_packages=False,
            rootdir=str(path.parent),
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
        said = TOLD_AGAIN.sub("", as_line(str(error)))
        unset = UNSET.search(said)
        if unset:
            raise InputError(
                f"asks for the environment variable {unset[1]}, which is not set; set it before "
                f"the command: {unset[1]}=VALUE drake-navbench ..."
            ) from error
        undefined = UNDEFINED.search(said)
        hint = f"; give it by --set {undefined[1]}=VALUE" if undefined else ""
        raise InputError(f"xacro cannot expand {_file_of_fault(path)}: {said}{hint}") from error
    # The library takes these for relative paths and puts the file's folder before them.
    return str(document.to_urdf_string()).replace(f"model://{path.parent}/", "model://")


def _file_of_fault(path: Path) -> str:
    """Returns the included file in which xacro failed, or "it" for the file itself."""
    inside = (xacro.filestack or [None])[-1]
    return "it" if inside is None else os.path.relpath(inside, path.parent)


def _parse_old(inp: Any, filename: str | None = None) -> Any:
    """Parses as xacro does; elements from before ROS Melodic get the prefix that they lack."""
    document = PARSE(inp, filename)
    for name, needed in OLD.items():
        for element in list(document.getElementsByTagName(name)):
            if element.hasAttribute(needed):
                element.tagName = element.nodeName = f"xacro:{name}"
    return document


def _call_old(node: Any, macros: Any, symbols: Any) -> Any:
    """Calls a macro as xacro does; in old files an element without prefix calls one.

    It does where its attributes are the macro's parameters; without any it must be empty.
    """
    name = node.tagName
    if ":" not in name and name in macros:
        macro, given = macros[name], set(node.attributes.keys())
        takes = {parameter for parameter in macro.params if not parameter.startswith("*")}
        needed = takes - macro.defaultmap.keys()
        if needed <= given <= takes and (needed or not node.hasChildNodes()):
            node.tagName = node.nodeName = f"xacro:{name}"
    return CALL_MACRO(node, macros, symbols)


def _missing_package(error: BaseException) -> str | None:
    """Returns the name of the missing package in a wrapped error; None for another error."""
    _, found, name = str(error).partition("Package not found:")
    return name.split()[0] if found and name.split() else None
