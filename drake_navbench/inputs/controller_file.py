"""A controller in a file of its own, `path/to/file.py:Class`, that no package has to carry."""

from __future__ import annotations

import ast
import hashlib
import re
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from drake_navbench.controller import CONTROLLERS, Controller
from drake_navbench.errors import InputError, nearest_name_hint
from drake_navbench.plugins.python_file import module_of
from drake_navbench.typed_files.input_file import read_input

MAX_FILE_BYTES = 2**20
# The text after a colon or an equals sign belongs to another controller's parameters.
_REFERENCE = re.compile(r"(?P<path>[^:=]+\.py)(?::(?P<rest>.*))?", re.DOTALL)


class ControllerFile(NamedTuple):
    """A class in a file, with the file's digest at the time of reading.

    path: absolute. sha256: digest of its bytes; a file with another content is not run.
    """

    path: Path
    class_name: str
    sha256: str

    def load(self) -> type[Controller]:
        """Returns the class; raises InputError where it cannot be loaded, or is no controller."""
        return _loaded(self)


def names_file(text: str) -> bool:
    """Returns whether a text names a controller by its file."""
    return _REFERENCE.fullmatch(text) is not None


def split_reference(text: str) -> tuple[str, list[str]]:
    """Returns `file.py:Class`, and the list of the parameters' assignments behind it."""
    found = _REFERENCE.fullmatch(text)
    assert found is not None
    class_name, *assignments = (found["rest"] or "").split(":")
    return f"{found['path']}:{class_name}", assignments


def find_controller_file(reference: str, folder: Path = Path()) -> ControllerFile:
    """Reads the file of a reference `file.py:Class`; a relative path starts from `folder`.

    The file is not run. Raises InputError where there is no such file, or no class is named.
    """
    found = _REFERENCE.fullmatch(reference)
    assert found is not None
    path = (folder / found["path"]).absolute()
    content = read_input(path, max_bytes=MAX_FILE_BYTES)
    class_name = found["rest"] or ""
    if not class_name.isidentifier():
        hint = nearest_name_hint(class_name, _classes(content))
        raise InputError(
            f"controller {reference!r}: got {class_name!r}, expected {path.name}:Class{hint}"
        )
    return ControllerFile(path, class_name, hashlib.sha256(content).hexdigest())


@cache
def _loaded(file: ControllerFile) -> type[Controller]:
    who = f"controller {file.class_name!r} of {file.path}"
    content = read_input(file.path, max_bytes=MAX_FILE_BYTES)
    if hashlib.sha256(content).hexdigest() != file.sha256:
        raise InputError(f"{who}: the file has changed since the run started; start the run again")
    module = module_of(file.path, content, file.sha256, "controller_file", who)
    if not hasattr(module, file.class_name):
        raise InputError(
            f"{who}: no such class{nearest_name_hint(file.class_name, _classes(content))}"
        )
    loaded: Any = getattr(module, file.class_name)
    CONTROLLERS.require_contract(loaded, who, file.class_name)
    return loaded


def _classes(content: bytes) -> list[str]:
    """Returns the names of the classes at the top level of a file, none where it does not parse."""
    try:
        body = ast.parse(content).body
    except (SyntaxError, ValueError, RecursionError):
        return []
    return [node.name for node in body if isinstance(node, ast.ClassDef)]
