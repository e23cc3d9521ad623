"""Facts from a few named values: all other values are the defaults of the release."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

from drake_navbench.inputs.navigation_settings import NavigationSettings
from drake_navbench.inputs.presets import load_preset
from drake_navbench.plugins.releases import NEWEST_RELEASE, Release
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
from drake_navbench.studies.doctor.usual import OF_BRINGUP, PRESETS
from drake_navbench.typed_files.dotted_names import flattened

# Words for controllers that drive, without a shim before them -> the kind.
DRIVING = (
    (r"mppi", "mppi"),
    (r"rpp|regulated|pure pursuit", "rpp"),
    (r"vector", "vector_pursuit"),
    (r"graceful", "graceful"),
    (r"teb", "teb"),
    (r"dwb|dwa", "dwb"),
)
# Servers whose parameters users name without the server, in the order in which they are meant.
SERVERS = (
    "goal_checker",
    "progress_checker",
    "controller_server",
    "local_costmap",
    "planner",
    "behavior_server",
)
# Their parameters that no model of this program has as a default, and those of other nodes.
BARE = {
    "odom_topic": "controller_server",
    "transform_tolerance": CONTROLLER,
    "robot_radius": "local_costmap",
    "footprint": "local_costmap",
    "observation_persistence": "local_costmap",
    "observation_sources": "local_costmap",
    "minimum_turning_radius": "planner",
    "default_server_timeout": "bt_navigator",
    "bt_loop_duration": "bt_navigator",
    **dict.fromkeys(
        (
            "velocity_timeout",
            "smoothing_frequency",
            "deadband_velocity",
            "feedback",
            "max_accel",
            "max_decel",
            "max_velocity",
            "min_velocity",
        ),
        "velocity_smoother",
    ),
    **dict.fromkeys(
        ("update_min_d", "update_min_a", "max_particles", "min_particles", "sigma_hit"), "amcl"
    ),
}
# Words for the size of a value that is not given as a number.
SIZES = {
    "low": r"^(low|small|short|tight|tiny|near)",
    "high": r"^(high|large|big|long|far|wide)",
    "missing": r"^(missing|not set|not given|unset)",
}
OLD_RELEASES = r"galactic|foxy|eloquent|dashing|crystal|kinetic|melodic|noetic|ros ?1"
# Parameters without a known default in the code: nav2_bringup's values count.
AS_IN_BRINGUP = [
    f"{costmap}.{name}"
    for costmap in ("local_costmap", "global_costmap")
    for name in ("cost_scaling_factor", "inflation_radius")
]
# Other names for the same, most of them of ROS 1's planners, costmap_2d and amcl.
OTHER_NAMES = {
    "path_distance_bias": "PathDist.scale",
    "goal_distance_bias": "GoalDist.scale",
    "occdist_scale": "BaseObstacle.scale",
    "pdist_scale": "PathDist.scale",
    "gdist_scale": "GoalDist.scale",
    "forward_point_distance": "PathAlign.forward_point_distance",
    "max_trans_vel": "max_speed_xy",
    "min_trans_vel": "min_speed_xy",
    "max_rot_vel": "max_vel_theta",
    "min_rot_vel": "min_speed_theta",
    "min_in_place_vel_theta": "min_speed_theta",
    "acc_lim_th": "acc_lim_theta",
    "vth_samples": "vtheta_samples",
    "sim_granularity": "linear_granularity",
    "angular_sim_granularity": "angular_granularity",
    "trans_stopped_vel": "trans_stopped_velocity",
    "max_allowed_time_to_collision": "max_allowed_time_to_collision_up_to_carrot",
    "obstacle_range": "obstacle_max_range",
    "raytrace_range": "raytrace_max_range",
    **{f"odom_alpha{number}": f"amcl.alpha{number}" for number in range(1, 6)},
    "size": "width",
    **ALIASES,
}


def facts_of_values(controller: str, release: str, values: Mapping[str, Any]) -> Facts:
    """Returns the facts of a user's report: controller and release in words, values by name."""
    named = release.lower()
    known = next((entry for entry in Release if entry in named), None)
    is_older = is_old(release)
    preset = load_preset(_preset_name(controller))
    found = dict(_defaults()) | dict(controller_values(preset))
    told = {"release": "old"} if is_older else {}
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
        elif isinstance(value, bool | list) or isinstance(found.get(place, ""), str):
            found[place] = value
    # A velocity smoother or collision monitor that the user names exists.
    nodes = frozenset(place.partition(".")[0] for place in given)
    kinds = kinds_of(preset) if _is_shim(controller) or kind_in(controller) else ()
    return Facts(
        kinds,
        known or (Release.HUMBLE if is_older else NEWEST_RELEASE),
        found,
        frozenset(given),
        defaults_of(preset),
        {},
        nodes,
        told,
        raw=dict(values),
    )


def is_old(release: str) -> bool:
    """Tells whether words name a release before Humble."""
    return bool(re.search(OLD_RELEASES, release.lower()))


def kind_in(words: str) -> str:
    """Returns the kind of the controller that words name and that drives; '' without one."""
    text = words.lower()
    return next((kind for pattern, kind in DRIVING if re.search(pattern, text)), "")


def _preset_name(controller: str) -> str:
    """Returns the preset with the values of Nav2's own files."""
    return PRESETS["shim" if _is_shim(controller) else kind_in(controller) or "dwb"]


def _is_shim(controller: str) -> bool:
    return "shim" in controller.lower()


def _defaults() -> Iterator[tuple[str, Any]]:
    """Yields the servers' defaults; nav2_bringup's values where nobody keeps the code's."""
    for name, value in flattened(NavigationSettings().model_dump(mode="json")):
        yield shortened(name), value
    yield from ((place, OF_BRINGUP[place][-1]) for place in AS_IN_BRINGUP)


def _place(name: str, known: Mapping[str, Any]) -> str:
    """Returns the place of a parameter by the name that a user gives it."""
    name = OTHER_NAMES.get(name, name)
    first, _, rest = name.partition(".")
    if first == "collision_monitor":
        return f"collision_monitor.polygons.{rest}"
    if first in ELSEWHERE and rest:
        return shortened(f"{first}.{OTHER_NAMES.get(rest, rest)}")
    own = f"{CONTROLLER}.{name}"
    last = name.rpartition(".")[2]
    if name == "plugin":
        return own
    checked = [f"{server}.{last}" for server in SERVERS if f"{server}.{last}" in known]
    # TEB and DWB have tolerances of their own, but the checkers' decide.
    of_a_checker = [place for place in checked if place.partition(".")[0].endswith("checker")]
    if "." not in name and of_a_checker:
        return of_a_checker[0]
    if own in known:
        return own
    if checked:
        return checked[0]
    return f"{BARE[last]}.{last}" if last in BARE else own


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
    # "> x" is taken as 1.2 x, "< x" as 0.8 x.
    return number * 1.2 if found[1] == ">" else number * 0.8 if found[1] == "<" else number
