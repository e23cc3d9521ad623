"""Values that a launch file would put into a Nav2 file: `$(var name)` and `<name>`.

Sources: nav2_common's ReplaceString, launch_ros's ParameterFile with allow_substs.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from pathlib import Path

from drake_navbench.errors import InputError

NAME = r"[A-Za-z_]\w*"
# The names at the end are those that nav2_bringup's own launch files replace.
PLACEHOLDER = re.compile(
    rf"\$\(var\s+({NAME})\s*\)|<({NAME})>|\b(KEEPOUT_ZONE_ENABLED|SPEED_ZONE_ENABLED)\b"
)
# The values that nav2_bringup's launch files set by default.
DEFAULTS = {"KEEPOUT_ZONE_ENABLED": "true", "SPEED_ZONE_ENABLED": "true"}
BROKEN = re.compile(rf"\$\(var(?!\s+{NAME}\s*\))")


class Substitutions:
    """Replaces placeholders by given values, and remembers the names that files asked for."""

    def __init__(self, values: Mapping[str, str]) -> None:
        self._values = values
        self._asked: set[str] = set()

    def applied_to(self, text: str, path: Path) -> str:
        """Returns a file's text with given values; raises InputError for an open placeholder."""
        for number, line in enumerate(text.splitlines(), start=1):
            if BROKEN.search(line.partition("#")[0]):
                raise InputError(f"{path}, line {number}: expected $(var name), got {line.strip()}")
        return PLACEHOLDER.sub(self._value, text)

    def _value(self, found: re.Match[str]) -> str:
        name = _name(found)
        self._asked.add(name)
        return self._values.get(name, DEFAULTS.get(name, found[0]))

    def require_all_used(self, others: Collection[str] = ()) -> None:
        """Raises InputError where a value is given that no file asks for.

        others: names that are used elsewhere.
        """
        for name in self._values:
            if name not in self._asked and name not in others:
                known = ", ".join(sorted(self._asked)) or "none"
                raise InputError(
                    f"--set {name}: no file has $(var {name}) or <{name}>; found: {known}"
                )


def missing_value(value: object) -> str | None:
    """Returns the name of the first placeholder that remains in a value; None without one."""
    for entry in value if isinstance(value, list) else [value]:
        found = PLACEHOLDER.search(entry) if isinstance(entry, str) else None
        if found:
            return _name(found)
    return None


def _name(found: re.Match[str]) -> str:
    return found[1] or found[2] or found[3]
