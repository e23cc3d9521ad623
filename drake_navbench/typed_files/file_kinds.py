"""The error for a YAML file of one kind given where another kind belongs."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from drake_navbench.errors import InputError

SCENARIO: Final = "a scenario file"
ROBOT: Final = "a robot file"
PRESET: Final = "a preset file"
MAP: Final = "a map file"
NAV2: Final = "a Nav2 parameter file"
# Fields that only files of this kind have.
SIGNS: Final[Mapping[str, frozenset[str]]] = {
    SCENARIO: frozenset({"world", "floors", "plan", "navigation_mode"}),
    ROBOT: frozenset({"drive", "lidar", "footprint", "like", "robot_radius", "navigation"}),
    PRESET: frozenset({"controller", "parameters"}),
    MAP: frozenset({"image", "occupied_thresh"}),
    "a file of goals, for --goals beside a map": frozenset(
        {"waypoints", "goals", "poses", "features"}
    ),
}
NAV2_SIGN = "ros__parameters"


def require_kind(data: Mapping[str, Any], expected: str, path: Path) -> None:
    """Raises InputError where a file's fields are those of another kind than expected.

    expected: a key of `SIGNS`. A file with a field of the expected kind, or of no kind, passes: the
    reader of that kind describes its faults better.
    """
    if SIGNS[expected] & data.keys():
        return
    found = [kind for kind, signs in SIGNS.items() if signs & data.keys()]
    if _is_nav2(data):
        found.append(NAV2)
    if found:
        wanted = f"{PRESET} or {NAV2}" if expected == PRESET else expected
        if (expected, found[0]) == (SCENARIO, NAV2):
            wanted += ", or --nav2 before each Nav2 file of several"
        raise InputError(f"{path}: is {found[0]}; expected {wanted}")


def _is_nav2(data: Mapping[str, Any]) -> bool:
    """Tells whether a node has parameters, below its namespaces: local_costmap.local_costmap."""
    blocks = [value for value in data.values() if isinstance(value, Mapping)]
    return any(NAV2_SIGN in block or _is_nav2(block) for block in blocks)
