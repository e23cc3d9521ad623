"""Xacro files that only define a robot as a macro, which a generated file is to call."""

from __future__ import annotations

import re
from pathlib import Path

MACRO = re.compile(
    r"<xacro:macro\b(?=[^>]*\bname\s*=\s*[\"']([\w-]+)[\"'])(?:[^>]*\bparams\s*=\s*(\"[^\"]*\"|'[^']*'))?"
)
# A parameter with its default: name:=value, name:='a value', name:=^|value.
PARAMETER = re.compile(r"(\*{0,2}[\w-]+)(:=(?:'[^']*'|\"[^\"]*\"|\$\{[^}]*\}|\S*)|=\S+)?")
# Parameters without a default that an empty text fits.
EMPTY = ("prefix", "namespace", "robot_namespace", "tf_prefix")
COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
END = re.compile(r"</robot\s*>\s*$")


def parameters_of(text: str, macro: str) -> dict[str, bool]:
    """Returns the parameters of a macro that a text defines: whether each must be given."""
    for found in MACRO.finditer(COMMENT.sub("", text)):
        if found[1] == macro:
            listed = (found[2] or '""')[1:-1]
            return {name: not default for name, default in PARAMETER.findall(listed)}
    return {}


def robot_macro(text: str, path: Path) -> str | None:
    """Returns the call of the macro that is named as its file; None where there is none.

    Where it must be given more than a prefix, there is none either.
    """
    stem = path.name.partition(".")[0]
    for name in (stem, stem.removesuffix("_macro")):
        if any(found[1] == name for found in MACRO.finditer(COMMENT.sub("", text))):
            needed = [own for own, must in parameters_of(text, name).items() if must]
            if all(own in EMPTY for own in needed):
                given = "".join(f' {own}=""' for own in needed)
                return f"<xacro:{name}{given}/>"
    return None


def with_call(text: str, call: str) -> str:
    """Returns the text of a xacro file with a macro called at its end."""
    return END.sub(f"{call}</robot>", text.rstrip())
