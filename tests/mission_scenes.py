"""Small missions over two floors, for tests all over the suite."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

from drake_navbench.inputs.scenario import Scenario
from drake_navbench.typed_files.typed_yaml import validate

# Nothing errs, so that numbers can be worked out by hand.
EXACT = {"localization": {"xy_std_m": 0.0, "yaw_std_rad": 0.0}}
# The ground floor has a wall; upstairs there is nothing at all.
SMALL: dict[str, Any] = {
    "description": "By lift to an empty floor",
    "floors": [
        {
            "name": "ground",
            "world": {"obstacles": [{"type": "box", "min": [-1.0, 1.0], "max": [3.0, 1.2]}]},
        },
        {"name": "upper"},
    ],
    "lifts": [
        {"name": "main", "stops": {"ground": [0.8, 0.0, 0.0], "upper": [5.0, 2.0, 1.5]}},
    ],
    "mission": [
        {"lift": "main", "to": "upper"},
        {"floor": "upper", "goal": [5.0, 3.0, 1.5]},
    ],
    "navigation_mode": "navigate_to_pose",
    "timeout_s": 60.0,
    "robot_overrides": EXACT,
    "name": "small_mission",
}


def described_mission(lift: dict[str, Any] | None = None, **changes: Any) -> dict[str, Any]:
    """Returns the small mission as a file would hold it, with changes; lift: of its lift."""
    data = copy.deepcopy(SMALL) | changes
    if lift:
        data["lifts"][0] |= lift
    return data


def small_mission(lift: dict[str, Any] | None = None, **changes: Any) -> Scenario:
    """Returns the small mission, with changes."""
    scenario = validate(Scenario, described_mission(lift, **changes), "small_mission.yaml")
    return scenario.model_copy(update={"directory": str(Path(__file__).parent)})
