"""Facts of a few named values: the rest has the defaults of the release."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

from drake_navbench.inputs.navigation_settings import NavigationSettings
from drake_navbench.inputs.presets import load_preset
from drake_navbench.plugins.names import flattened
from drake_navbench.releases import NEWEST_RELEASE, Release
from drake_navbench.studies.doctor.facts import (
    ALIASES,
    CONTROLLER,
    Facts,
    controller_values,
    defaults_of,
    kinds_of,
    shortened,
)
from drake_navbench.studies.doctor.suspects import ELSEWHERE

# Words for controllers, and the preset that has the defaults of Nav2's own files.
PRESETS = (
    (r"shim.*rpp|rotationshim\+rpp", "rotation_shim"),
    (r"shim", "rotation_shim"),
    (r"mppi", "mppi_bringup"),
    (r"rpp|regulated|pure pursuit", "rpp_bringup"),
    (r"vector", "vector_pursuit"),
    (r"graceful", "graceful"),
    (r"teb", "teb_upstream"),
    (r"dwb|dwa", "dwb_bringup"),
)
# Parameters of servers that users name without the server.
BARE = {
    "controller_frequency": "controller_server",
    "failure_tolerance": "controller_server",
    "odom_topic": "controller_server",
    "required_movement_radius": "progress_checker",
    "movement_time_allowance": "progress_checker",
    "xy_goal_tolerance": "goal_checker",
    "yaw_goal_tolerance": "goal_checker",
    "stateful": "goal_checker",
    "velocity_timeout": "velocity_smoother",
    "smoothing_frequency": "velocity_smoother",
    "deadband_velocity": "velocity_smoother",
    "feedback": "velocity_smoother",
    "max_accel": "velocity_smoother",
    "max_velocity": "velocity_smoother",
    "inflation_radius": "local_costmap",
    "cost_scaling_factor": "local_costmap",
    "robot_radius": "local_costmap",
    "footprint": "local_costmap",
    "footprint_padding": "local_costmap",
    "obstacle_max_range": "local_costmap",
    "raytrace_max_range": "local_costmap",
    "observation_persistence": "local_costmap",
}
# Words for the size of a value that is not told.
SIZES = {"low": r"^(low|small|short|tight|tiny|near)", "high": r"^(high|large|big|long|far|wide)"}
OLD_RELEASES = r"galactic|foxy|eloquent|dashing|crystal|kinetic|melodic|noetic|ros ?1"
# What nav2_bringup's own file has, which nearly every file begins as.
OF_BRINGUP = {
    f"{costmap}.{name}": value
    for costmap in ("local_costmap", "global_costmap")
    for name, value in {"cost_scaling_factor": 3.0, "inflation_radius": 0.7}.items()
}
# Other names for the same.
OTHER_NAMES = {
    "path_distance_bias": "PathDist.scale",
    "goal_distance_bias": "GoalDist.scale",
    "occdist_scale": "BaseObstacle.scale",
    "size": "width",
    **ALIASES,
}


def facts_of_values(controller: str, release: str, values: Mapping[str, Any]) -> Facts:
    """Returns the facts of what a user tells: controller and release in words, values by name."""
    named = release.lower()
    known = next((entry for entry in Release if entry in named), None)
    is_old = bool(re.search(OLD_RELEASES, named))
    preset = load_preset(_preset_name(controller))
    found = dict(_defaults()) | dict(controller_values(preset))
    told = {"release": "old"} if is_old else {}
    given = set()
    for name, value in values.items():
        place = _place(str(name), found)
        given.add(place)
        size = _size(value)
        number = _number(value)
        if size is not None:
            told[place] = size
        elif number is not None:
            found[place] = number
        elif isinstance(value, bool | list) or place not in found:
            found[place] = value
    # A speed smoother or monitor that is named is there.
    nodes = frozenset(place.partition(".")[0] for place in given)
    kinds = (
        kinds_of(preset) if re.search("|".join(p for p, _ in PRESETS), controller.lower()) else ()
    )
    return Facts(
        kinds,
        known or (Release.HUMBLE if is_old else NEWEST_RELEASE),
        found,
        frozenset(given),
        defaults_of(preset),
        {},
        nodes,
        told,
    )


def _preset_name(controller: str) -> str:
    text = controller.lower()
    return next((name for pattern, name in PRESETS if re.search(pattern, text)), "dwb_bringup")


def _defaults() -> Iterator[tuple[str, Any]]:
    """Yields the servers' defaults; nav2_bringup's values where nobody keeps the code's."""
    for name, value in flattened(NavigationSettings().model_dump(mode="json")):
        yield shortened(name), value
    yield from OF_BRINGUP.items()


def _place(name: str, known: Mapping[str, Any]) -> str:
    """Returns the place that a user's name of a parameter stands for."""
    first, _, rest = name.partition(".")
    last = OTHER_NAMES.get(name.rpartition(".")[2], name.rpartition(".")[2])
    if first == "collision_monitor":
        return f"collision_monitor.polygons.{rest}"
    if first in ELSEWHERE and rest:
        return shortened(f"{first}.{OTHER_NAMES.get(rest, rest)}")
    own = f"{CONTROLLER}.{OTHER_NAMES.get(name, name)}"
    if own not in known and last in BARE:
        return f"{BARE[last]}.{last}"
    if "." not in name and last in BARE and BARE[last] in ("goal_checker", "progress_checker"):
        return f"{BARE[last]}.{last}"
    return own


def _size(value: Any) -> str | None:
    if not isinstance(value, str):
        return None
    return next((size for size, pattern in SIZES.items() if re.match(pattern, value.lower())), None)


def _number(value: Any) -> float | None:
    """Returns the number of a value such as 0.4, '>0.3' or '20-40', None without one."""
    if isinstance(value, bool):
        return None
    if isinstance(value, int | float):
        return float(value)
    found = re.match(r"\s*([<>]?)=?\s*(-?\d+\.?\d*(?:e-?\d+)?)", str(value))
    if not isinstance(value, str) or found is None:
        return None
    number = float(found[2])
    # More than a value that is told is a little more than it.
    return number * 1.2 if found[1] == ">" else number * 0.8 if found[1] == "<" else number
