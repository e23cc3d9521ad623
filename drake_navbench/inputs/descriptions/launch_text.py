"""The text of a launch file, with the values of its variables put in where they complete a name.

`MAP = 'attic'; f'{MAP}.yaml'` reads as 'attic.yaml'.
"""

from __future__ import annotations

import re
from pathlib import Path

from drake_navbench.typed_files.input_file import read_head_text

REMARKS = re.compile(r"(?:^|\s)#[^\n]*|<!--[\s\S]*?-->")
# A value is a word: an expression tells none.
WORD = r"([\w.+-]+)"
CONSTANT = re.compile(rf"^[ \t]*(\w+)\s*=\s*[\"']{WORD}[\"'][ \t]*;?[ \t]*$", re.MULTILINE)
# A variable that holds an argument of the launch file, as Python and YAML or XML give it.
HOLDS = re.compile(
    r"^[ \t]*(\w+)\s*=\s*(?:context\.perform_substitution\(\s*)?"
    r"(?:LaunchConfiguration\(|context\.launch_configurations\[)\s*[\"'](\w+)[\"']",
    re.MULTILINE,
)
SAME = re.compile(
    r"^[ \t]*(\w+)\s*=\s*(?:context\.perform_substitution\(\s*(\w+)\s*\)|(\w+)\.perform\()",
    re.MULTILINE,
)
DEFAULTS = (
    re.compile(
        r"DeclareLaunchArgument\(\s*(?:name\s*=\s*)?[\"'](\w+)[\"']\s*,\s*"
        rf"default_value\s*=\s*(?:str\()?[\"']{WORD}[\"']"
    ),
    re.compile(rf"LaunchConfiguration\(\s*[\"'](\w+)[\"']\s*,\s*default\s*=\s*[\"']{WORD}[\"']"),
)
# The places where a variable's value completes a name: between braces, beside a plus, before a
# text that goes on with a point, a dash or an underscore, and after xacro's `name:=`.
BRACES = re.compile(r"\{(\w+)\}")
BEFORE_TEXT = re.compile(r"\b(\w+)\s*\+\s*([\"'])(?=[\w.-])")
AFTER_TEXT = re.compile(r"(?<=[\w./-])([\"'])\s*\+\s*(\w+)\b(?!\s*[(.\[])")
JOINED = re.compile(r"(?<=[\w.-])([\"'])\s*\+\s*\1(?=[\w.-])")
IN_LIST = re.compile(r"(?<=[\[,\s])(\w+)\s*,\s*([\"'])(?=[._-])")
GIVEN = re.compile(r"(:=\s*[\"']\s*,\s*)(\w+)\b(?!\s*[(.\[])")


def without_remarks(file: Path) -> str:
    """Returns a launch file's text without its remarks."""
    return REMARKS.sub("", read_head_text(file))


def launch_text(file: Path) -> str:
    """Returns a launch file's text without its remarks, names completed by its variables' values.

    A variable with two values completes none.
    """
    text = without_remarks(file)
    values = _values(text)
    if not values:
        return text

    def of(variable: str) -> str | None:
        return values.get(variable)

    text = BRACES.sub(lambda m: of(m[1]) or m[0], text)
    text = BEFORE_TEXT.sub(lambda m: f"{m[2]}{of(m[1])}" if of(m[1]) else m[0], text)
    text = AFTER_TEXT.sub(lambda m: f"{of(m[2])}{m[1]}" if of(m[2]) else m[0], text)
    text = JOINED.sub("", text)
    text = IN_LIST.sub(lambda m: f"{m[2]}{of(m[1])}" if of(m[1]) else m[0], text)
    return GIVEN.sub(lambda m: f"{m[1]}'{of(m[2])}'" if of(m[2]) else m[0], text)


def argument_of(name: str, text: str) -> str | None:
    """Returns the launch argument whose value a launch file gives xacro's argument `name`."""
    direct = re.search(
        rf"\b{re.escape(name)}:=\s*[\"']\s*,\s*(?:LaunchConfiguration\(\s*[\"'](\w+)[\"']|(\w+))",
        text,
    )
    if direct is None:
        return None
    return direct[1] or _held(text).get(direct[2])


def _held(text: str) -> dict[str, str]:
    """Returns the launch argument that each variable holds."""
    held = dict(HOLDS.findall(text))
    for variable, performed, other in SAME.findall(text):
        if (performed or other) in held:
            held[variable] = held[performed or other]
    return held


def _values(text: str) -> dict[str, str]:
    """Returns the one value of each variable: a text, or the default of the argument it holds."""
    defaults = [pair for form in DEFAULTS for pair in form.findall(text)]
    said = CONSTANT.findall(text) + [
        (variable, value)
        for variable, argument in _held(text).items()
        for name, value in defaults
        if name == argument
    ]
    found: dict[str, set[str]] = {}
    for variable, value in said:
        found.setdefault(variable, set()).add(value)
    return {variable: values.pop() for variable, values in found.items() if len(values) == 1}
