"""Xacro files that only define a robot as a macro, which a generated file is to call."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple
from xml.sax.saxutils import quoteattr

from drake_navbench.errors import InputError

MACRO = re.compile(
    r"<xacro:macro\b(?=[^>]*\bname\s*=\s*[\"']([\w-]+)[\"'])(?:[^>]*\bparams\s*=\s*(\"[^\"]*\"|'[^']*'))?"
)
# A parameter with its default: name:=value, name:='a value', name:=^|value.
PARAMETER = re.compile(r"(\*{0,2}[\w-]+)(:=(?:'[^']*'|\"[^\"]*\"|\$\{[^}]*\}|\S*)|=\S+)?")
# Parameters without a default that an empty text fits.
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


def robot_macro(text: str, path: Path, given: Mapping[str, str]) -> Call | None:
    """Returns the call of the macro that is named as its file; None where there is none.

    given: values of the macro's parameters by name; a prefix that is not given is empty. Raises
    InputError where another parameter without a default is not given.
    """
    stem = path.name.partition(".")[0]
    defined = {found[1] for found in MACRO.finditer(COMMENT.sub("", text))}
    name = next((name for name in (stem, stem.removesuffix("_macro")) if name in defined), None)
    if name is None:
        return None
    takes = parameters_of(text, name)
    values = {own: given.get(own, "") for own in takes if own in given or own in EMPTY}
    lacking = [own for own, must in takes.items() if must and own not in values]
    if lacking:
        needed = " ".join(f"--set {own}=VALUE" for own in lacking if not own.startswith("*"))
        raise InputError(
            f"only defines the macro {name}; expected a file that calls it"
            + (f", or its parameters by {needed}" if needed else "")
        )
    # A prefix with a default keeps it.
    values = {own: value for own, value in values.items() if takes[own] or own in given}
    listed = "".join(f" {own}={quoteattr(value)}" for own, value in values.items())
    return Call(f"<xacro:{name}{listed}/>", values)


def with_call(text: str, call: str) -> str:
    """Returns the text of a xacro file with a macro called at its end."""
    return END.sub(f"{call}</robot>", text.rstrip())
