"""Xacro files that only define a robot as a macro, for a generated file to call."""

from __future__ import annotations

import re
from collections.abc import Container, Mapping
from pathlib import Path
from typing import NamedTuple
from xml.sax.saxutils import quoteattr

from drake_navbench.errors import InputError

MACRO = re.compile(
    r"<xacro:macro\b(?=[^>]*\bname\s*=\s*[\"']([\w-]+)[\"'])(?:[^>]*\bparams\s*=\s*(\"[^\"]*\"|'[^']*'))?"
)
# A parameter with its default: name:=value, name:='a value', name:=^|value.
PARAMETER = re.compile(r"(\*{0,2}[\w-]+)(:=(?:'[^']*'|\"[^\"]*\"|\$\{[^}]*\}|\S*)|=\S+)?")
# Parameters without a default for which an empty text will do.
EMPTY = ("prefix", "namespace", "robot_namespace", "tf_prefix")
COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
END = re.compile(r"</robot\s*>\s*$")


class Call(NamedTuple):
    """Call of a macro: its element, and the values that it gives the macro's parameters."""

    text: str
    values: dict[str, str]


def parameters_of(text: str, macro: str) -> dict[str, bool]:
    """Returns the parameters of a macro that a text defines: whether each must be given."""
    for found in MACRO.finditer(COMMENT.sub("", text)):
        if found[1] == macro:
            listed = (found[2] or '""')[1:-1]
            return {name: not default for name, default in PARAMETER.findall(listed)}
    return {}


def robot_macro(text: str, path: Path) -> str | None:
    """Returns the macro that a text defines under its file's name; None without one."""
    stem = path.name.partition(".")[0]
    defined = {found[1] for found in MACRO.finditer(COMMENT.sub("", text))}
    return next((name for name in (stem, stem.removesuffix("_macro")) if name in defined), None)


def lacking(text: str, macro: str, given: Container[str] = ()) -> list[str]:
    """Returns the parameters that a macro needs and that are not given; an empty prefix will do."""
    takes = parameters_of(text, macro).items()
    return [name for name, must in takes if must and name not in given and name not in EMPTY]


def call_of(text: str, macro: str, given: Mapping[str, str]) -> Call:
    """Returns the call of a macro; given: values of its parameters, by name.

    Raises InputError where a parameter without a default is not given.
    """
    needed = lacking(text, macro, given)
    if needed:
        listed = " ".join(f"--set {name}=VALUE" for name in needed if not name.startswith("*"))
        way = f", or its parameters by {listed}" if listed else ""
        raise InputError(f"only defines the macro {macro}; expected a file that calls it{way}")
    takes = parameters_of(text, macro).items()
    values = {name: given.get(name, "") for name, must in takes if must or name in given}
    listed = "".join(f" {name}={quoteattr(value)}" for name, value in values.items())
    return Call(f"<xacro:{macro}{listed}/>", values)


def with_call(text: str, call: str) -> str:
    """Returns the text of a xacro file with a macro called at its end."""
    return END.sub(f"{call}</robot>", text.rstrip())
