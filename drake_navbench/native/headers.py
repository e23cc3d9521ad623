"""Generates headers that a checkout includes but does not contain: ROS messages and other names."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from drake_navbench.errors import InputError
from drake_navbench.native.package import Package, includes_of, text_of

NATIVE = Path(__file__).parent
STAND_INS = NATIVE / "stand_ins"
REPLACEMENTS = NATIVE / "replacements"
HOST = NATIVE / "host"

# Types of a message's fields: https://docs.ros.org/en/rolling/Concepts/Basic/About-Interfaces.html
BUILT_IN_TYPES: Mapping[str, str] = {
    "bool": "bool",
    "byte": "std::uint8_t",
    "char": "std::uint8_t",
    "float32": "float",
    "float64": "double",
    "string": "std::string",
    "wstring": "std::u16string",
    **{f"int{bits}": f"std::int{bits}_t" for bits in (8, 16, 32, 64)},
    **{f"uint{bits}": f"std::uint{bits}_t" for bits in (8, 16, 32, 64)},
}
_FIELD = re.compile(
    r"(?P<type>[\w/]+)(?:<=\d+)?(?P<array>\[(?:<=)?\d*\])?\s+(?P<name>\w+)\s*(?P<rest>.*)"
)
# The path of a generated header lies below the folder of all of them: no `..`, not absolute.
_HEADER = re.compile(r"\w[\w.-]*(?:/\w[\w.-]*)+")


def stand_ins() -> frozenset[str]:
    """Returns the packages of ROS that have a stand-in."""
    return frozenset(path.stem for path in STAND_INS.glob("*.hpp"))


def made_headers(packages: Mapping[str, Package]) -> dict[str, str]:
    """Returns the headers to generate for some packages, by the path of their include.

    One leads from each of ROS's names for a header to our stand-in for its package; one is made of
    each message that the checkout itself defines.
    """
    known = stand_ins()
    messages = {
        f"{package.name}/msg/{_file_name(path.stem)}.hpp": path
        for package in packages.values()
        for path in package.messages
    }
    made: dict[str, str] = {}
    waiting = list(_included(packages.values()))
    while waiting:
        name = waiting.pop()
        package = name.partition("/")[0]
        if name in made or _HEADER.fullmatch(name) is None:
            continue
        if name in messages:
            made[name] = message_header(package, messages[name])
            waiting += re.findall(r'#include "([^"]+)"', made[name])
        elif package in known:
            made[name] = f'#pragma once\n\n#include "stand_ins/{package}.hpp"\n'
    return dict(sorted(made.items()))


def plugin_names_header(packages: Iterable[Package]) -> str:
    """Returns the header with the names that plugin descriptions give to classes."""
    names = {name: kind for package in packages for name, kind in package.plugin_names.items()}
    rows = [f"    {{{cpp_text(name)}, {cpp_text(kind)}}}," for name, kind in sorted(names.items())]
    return "\n".join(
        [
            "#pragma once",
            "",
            "#include <array>",
            "#include <utility>",
            "",
            "namespace drake_navbench {",
            "",
            f"inline constexpr std::array<std::pair<const char *, const char *>, {len(rows)}>",
            "    kPluginNames = {{",
            *rows,
            "}};",
            "",
            "}  // namespace drake_navbench",
            "",
        ]
    )


def cpp_text(text: str) -> str:
    """Returns a text as C++ source: anything but plain characters as octal bytes."""
    plain = {byte: chr(byte) for byte in range(0x20, 0x7F) if chr(byte) not in '"\\?'}
    return '"' + "".join(plain.get(byte, f"\\{byte:03o}") for byte in text.encode()) + '"'


def message_header(package: str, path: Path) -> str:
    """Returns a message definition as the C++ struct that ROS would make; raises InputError.

    Arrays begin empty or as zeros: their default values are left out.
    """
    name, fields, constants, used = path.stem, [], [], set()
    for line in _lines(text_of(path)):
        found = _FIELD.fullmatch(line)
        if found is None:
            raise InputError(f"{path}: cannot be read: {line!r}, expected a field of a message")
        kind, header = _type_of(found["type"], package)
        if header:
            used.add(header)
        rest = found["rest"].strip()
        if rest.startswith("="):
            constants.append(_constant(kind, found["name"], rest[1:].strip()))
            continue
        size = (found["array"] or "").strip("[]")
        if found["array"] is None:
            is_text = rest and kind == "std::string"
            default = cpp_text(unquoted(rest)) if is_text else rest.lower()
        else:
            default = ""
            fixed = size.isdecimal()
            kind = f"std::array<{kind}, {size}>" if fixed else f"std::vector<{kind}>"
        fields.append(f"  {kind} {found['name']}{{{default}}};")
    includes = sorted({'#include "stand_ins/message.hpp"', *(f'#include "{h}"' for h in used)})
    return "\n".join(
        [
            "#pragma once",
            "",
            *includes,
            "",
            f"namespace {package}::msg {{",
            "",
            f"struct {name} {{",
            *constants,
            *fields,
            f"  DRAKE_NAVBENCH_MESSAGE({name})",
            "};",
            "",
            f"}}  // namespace {package}::msg",
            "",
        ]
    )


def _included(packages: Iterable[Package]) -> Iterator[str]:
    for package in packages:
        for path in (*package.sources, *package.headers):
            yield from includes_of(path)
    for folder in (HOST, REPLACEMENTS):
        for path in sorted(folder.rglob("*")):
            if path.is_file():
                yield from includes_of(path)


def _lines(text: str) -> Iterator[str]:
    """Yields the lines of a message definition without comments; no empty ones."""
    for line in text.splitlines():
        # As ROS 2 does, also within quotation marks.
        line = line.partition("#")[0].strip()
        if line:
            yield line


def _type_of(text: str, package: str) -> tuple[str, str]:
    """Returns the C++ type of a field, and the header that it needs."""
    if text in BUILT_IN_TYPES:
        return BUILT_IN_TYPES[text], ""
    owner, _, name = text.replace("/msg/", "/").rpartition("/")
    owner = owner or ("std_msgs" if name == "Header" else package)
    return f"{owner}::msg::{name}", f"{owner}/msg/{_file_name(name)}.hpp"


def unquoted(value: str) -> str:
    """Returns the text of a message definition without its quotation marks."""
    is_quoted = len(value) > 1 and value[0] == value[-1] and value[0] in "\"'"
    return value[1:-1] if is_quoted else value


def _constant(kind: str, name: str, value: str) -> str:
    if kind == "std::string":
        return f"  inline static const std::string {name} = {cpp_text(unquoted(value))};"
    return f"  static constexpr {kind} {name} = {value.lower()};"


def _file_name(name: str) -> str:
    """Returns a message's name as ROS names its header: Twist2DStamped is twist2_d_stamped."""
    name = re.sub(r"(.)([A-Z][a-z]+)", r"\1_\2", name)
    return re.sub(r"([a-z0-9])([A-Z])", r"\1_\2", name).lower()
