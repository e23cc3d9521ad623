"""Runs a user's Python file as a module, for a controller or a metric that no package carries."""

from __future__ import annotations

import contextlib
import importlib.util
import sys
import traceback
from pathlib import Path
from types import ModuleType

from drake_navbench.errors import InputError, is_machine_fault, one_line


def module_of(path: Path, content: bytes, sha256: str, kind: str, who: str) -> ModuleType:
    """Returns the module of a file, run once for each of its contents.

    kind: begins the name of the module. who: begins an error. Raises InputError where the module
    raises.
    """
    name = f"{kind}_{path.stem}_{sha256[:16]}"
    if name in sys.modules:
        return sys.modules[name]
    spec = importlib.util.spec_from_loader(name, loader=None, origin=str(path))
    assert spec is not None
    module = importlib.util.module_from_spec(spec)
    module.__file__ = str(path)
    # Dataclasses and pydantic look a class's module up by its name.
    sys.modules[name] = module
    try:
        # Back to the user's folder, wherever the file goes.
        with contextlib.chdir("."):
            exec(compile(content, str(path), "exec"), module.__dict__)
    except BaseException as error:
        del sys.modules[name]
        if isinstance(error, KeyboardInterrupt) or is_machine_fault(error):
            raise
        where = _line_of(error, path)
        # The file is somebody's code: it may raise anything.
        raise InputError(f"{who}: cannot be loaded: {one_line(error)}{where}") from error
    return module


def _line_of(error: BaseException, path: Path) -> str:
    """Returns ' (line 7)' for the last line of the file that an error passed."""
    if isinstance(error, SyntaxError):
        # The text of a syntax error has the line already.
        return ""
    frames = traceback.extract_tb(error.__traceback__)
    lines = [frame.lineno for frame in frames if frame.filename == str(path)]
    return f" (line {lines[-1]})" if lines else ""
