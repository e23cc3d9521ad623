"""Rules about what the release of a file does not read, or does wrongly."""

from __future__ import annotations

import re

from drake_navbench.nav2.loadable import OLD_NODE
from drake_navbench.nav2.node_reader import RENAMING
from drake_navbench.nav2.release import READ_BEFORE_HUMBLE
from drake_navbench.plugins.releases import Release
from drake_navbench.studies.doctor.facts import Facts
from drake_navbench.studies.doctor.rules.rule import Rule, down, outside, put, up, upgrade
from drake_navbench.studies.doctor.symptoms import Symptom

S = Symptom

# The check's words about a parameter that nobody reads.
UNREAD = re.compile(r"does not read it|unknown|no such|another name")
# A block of MPPI that is read for this kind of base alone.
OF_CARS = "AckermannConstraints"
OF_NAMES = (
    "delete these lines or give the names of this release; "
    "`drake-navbench run --nav2 FILE --check` lists all of them"
)
MANY = {
    S.NO_TURNING: 0.3,
    S.TOO_SLOW: 0.25,
    S.COLLISION: 0.25,
    S.WOBBLE_STRAIGHT: 0.2,
    S.GOAL_NOT_REACHED: 0.2,
    S.DOOR_STOP: 0.2,
    S.STALL_BEFORE_GOAL: 0.2,
    S.IGNORES_OBSTACLES: 0.3,
}


def _unread(f: Facts, node: str) -> list[str]:
    """Returns the parameters of a node that the release does not read, by their names there."""
    found = (
        (place.partition(": ")[2], remark)
        for place, remark in f.unread.items()
        if place.partition(":")[0].rpartition("/")[2] == node
    )
    return [
        name
        for name, remark in found
        if UNREAD.search(remark) and not _waits_for_a_model(f, name) and not _is_of_older(f, name)
    ]


def _renamed(f: Facts) -> list[str]:
    return [place.replace(": ", ".") for place, why in f.unread.items() if RENAMING in why]


def _is_of_older(f: Facts, name: str) -> bool:
    """Tells whether a file of a release before Humble has a name that this release reads."""
    return f.told.get("release") == "old" and name.rpartition(".")[2] in READ_BEFORE_HUMBLE


def _waits_for_a_model(f: Facts, name: str) -> bool:
    """Tells whether a name is of MPPI's model of a car while another one is chosen."""
    return f"{OF_CARS}." in name and f.controller("motion_model") != "Ackermann"


def _limits(f: Facts) -> list[str]:
    own = (f"{f.plugin}.", "max_accel", "max_decel")
    names = [*_unread(f, "controller_server"), *_unread(f, "velocity_smoother")]
    words = ("max_accel", "max_decel", "acc_lim", "ax_max", "ax_min", "az_max")
    return [n for n in names if n.startswith(own) and any(word in n for word in words)]


def _first(names: list[str]) -> str:
    more = len(names) - 3
    others = f" and {more} other{'s' if more > 1 else ''}" if more > 0 else ""
    return f"{', '.join(names[:3])}{others}"


def _told_unread(f: Facts, node: str) -> str:
    """Returns in words which parameters of a node the release does not read."""
    names = _unread(f, node)
    have = "they have" if len(names) > 1 else "it has"
    return f"Nav2 {f.release} does not read {_first(names)} of {node}: {have} no effect"


RULES = (
    Rule(
        "controller-parameters-not-read",
        lambda f: bool(_unread(f, "controller_server")),
        lambda f: _told_unread(f, "controller_server"),
        MANY | {S.NO_TURNING: 0.45},
        (put("critics"), upgrade("a release that reads them")),
        "the parameters that each release of Nav2 declares",
        advice=OF_NAMES,
    ),
    Rule(
        "costmap-parameters-not-read",
        lambda f: bool(_unread(f, "local_costmap")),
        lambda f: _told_unread(f, "local_costmap"),
        {S.IGNORES_OBSTACLES: 0.4, S.GHOST_OBSTACLES: 0.3},
        (put("local_costmap.observation_sources"),),
        "the parameters that each release of Nav2 declares",
        is_certain=False,
        advice=OF_NAMES,
    ),
    Rule(
        "ranges-by-their-old-names",
        lambda f: bool(_renamed(f)) and f.told.get("release") != "old",
        lambda f: (
            f"no release since Galactic reads {_first(_renamed(f))}: the costmaps mark obstacles "
            "up to 2.5 m and clear them up to 3 m, Nav2's defaults"
        ),
        {S.IGNORES_OBSTACLES: 0.9, S.GHOST_OBSTACLES: 0.5},
        (put("local_costmap.observation_sources"),),
        "nav2_costmap_2d: obstacle_layer.cpp",
        advice="call them obstacle_max_range and raytrace_max_range",
    ),
    Rule(
        "recoveries-server",
        lambda f: f.has_node(OLD_NODE),
        lambda f: (
            f"{OLD_NODE} is a node of Galactic and older; on Humble and newer it is called "
            f"behavior_server, and nothing reads the values below {OLD_NODE}"
        ),
        {S.NO_RECOVERY: 0.45},
        (put("behavior_server.behavior_plugins"),),
        "docs.nav2.org, migration to humble",
        advice=f"if the robot runs Humble or newer, rename {OLD_NODE} to behavior_server; on "
        "Galactic and older keep the name",
    ),
    Rule(
        "rpp-outline-check-of-galactic",
        lambda f: f.is_kind("rpp") and f.told.get("release") == "old",
        lambda f: (
            "before Humble RPP's collision check of the footprint stops the robot in doors "
            "although nothing is in its way"
        ),
        {S.DOOR_STOP: 1.0, S.FALSE_ABORT: 0.5, S.STOP_START_JERK: 0.4},
        (upgrade("humble or newer"),),
        "navigation2#2766",
    ),
    Rule(
        "rpp-slows-within-the-lookahead",
        lambda f: f.is_kind("rpp") and f.release is Release.HUMBLE,
        lambda f: (
            "before August 2022 RPP slowed down only within the lookahead distance of the goal"
        ),
        {S.GOAL_OVERSHOOT: 0.4, S.GOAL_OSCILLATION: 0.4},
        (
            up("approach_velocity_scaling_dist"),
            up("lookahead_dist"),
            upgrade("humble 1.1.2 or newer, with navigation2#3047"),
        ),
        "navigation2#3081",
        is_certain=False,
    ),
    Rule(
        "graceful-of-iron-and-jazzy",
        lambda f: f.is_kind("graceful") and f.release in (Release.IRON, Release.JAZZY),
        lambda f: (
            f"in {f.release} the Graceful controller has gains made for docking and steers to one "
            "fixed target; newer releases choose among several targets"
        ),
        {S.WOBBLE_STRAIGHT: 0.7, S.CORNER_CUTTING: 0.3},
        (down("k_phi", 2.0), down("k_delta", 1.0), upgrade("kilted or newer")),
        "navigation2#4795",
        is_certain=False,
    ),
    Rule(
        "mppi-first-release",
        lambda f: f.is_kind("mppi") and f.release is Release.HUMBLE,
        lambda f: "Humble's MPPI does not limit accelerations; Jazzy's does",
        {S.STOP_START_JERK: 0.3, S.WOBBLE_STRAIGHT: 0.2, S.GOAL_OVERSHOOT: 0.2},
        (upgrade("jazzy or newer"),),
        "docs.nav2.org, migration to jazzy",
        is_certain=False,
    ),
    Rule(
        "shim-without-goal-heading",
        lambda f: f.is_kind("shim") and f.release in (Release.HUMBLE, Release.IRON),
        lambda f: (
            "in this release the rotation shim does not turn the robot to the goal's "
            "heading; from Jazzy on it does"
        ),
        {S.GOAL_NOT_REACHED: 0.6, S.STALL_BEFORE_GOAL: 0.4},
        (
            upgrade("jazzy or newer, for rotate_to_goal_heading"),
            up("goal_checker.yaw_goal_tolerance"),
        ),
        "docs.nav2.org, migration to jazzy",
        is_certain=False,
    ),
    Rule(
        "shim-on-short-paths",
        lambda f: f.is_kind("shim") and f.release < Release.JAZZY,
        lambda f: (
            "before November 2024 the rotation shim did not turn the robot when the path is "
            "shorter than forward_sampling_distance, for example near the goal"
        ),
        {S.NO_TURNING: 0.55, S.GOAL_NOT_REACHED: 0.25},
        (
            upgrade("jazzy 1.3.3 or newer, with navigation2#4290 and #4716"),
            down("forward_sampling_distance"),
        ),
        "navigation2#4290, navigation2#4716",
        is_certain=False,
    ),
    Rule(
        "shim-with-one-threshold",
        lambda f: (
            f.is_kind("shim")
            and f.release < Release.KILTED
            and 0.0 < f.number("controller.angular_dist_threshold", 0.785) < 0.5
            and "controller.angular_disengage_threshold" not in f.given
        ),
        lambda f: (
            f"angular_dist_threshold is {f['controller.angular_dist_threshold']} rad and the file "
            "gives no angular_disengage_threshold: the shim takes over at every small bend; before "
            "October 2024 one threshold began and ended its turn"
        ),
        {S.STOP_START_JERK: 1.1},
        (
            put("angular_disengage_threshold"),
            up("angular_dist_threshold", 0.785),
            upgrade("a release with navigation2#4699"),
        ),
        "navigation2#4699",
        is_certain=False,
    ),
    Rule(
        "mppi-passes-the-goal-before-it-turns",
        lambda f: (
            f.is_kind("mppi")
            and f.release <= Release.JAZZY
            and f.controller("enforce_path_inversion") is True
            and "controller.enforce_path_inversion" in f.given
        ),
        lambda f: (
            "enforce_path_inversion is on: before May 2025 MPPI's goal critics pulled the robot "
            "to the goal although its path first goes on to a point of inversion"
        ),
        {S.GOAL_NOT_REACHED: 0.9, S.STALL_BEFORE_GOAL: 0.6, S.GOAL_OSCILLATION: 0.5},
        (upgrade("a release with navigation2#5105"),),
        "navigation2#5105",
        is_certain=False,
    ),
    Rule(
        "results-are-forgotten",
        lambda f: f.release is Release.IRON,
        lambda f: (
            "Iron forgets the result of a goal after action_server_result_timeout, until 1.2.3 "
            "after 10 s: a longer drive ends as UNKNOWN"
        ),
        {S.FALSE_ABORT: 0.4},
        (
            up("bt_navigator.action_server_result_timeout", 900.0),
            upgrade("iron 1.2.3 or newer, with navigation2#3787"),
        ),
        "navigation2#3787",
        is_certain=False,
    ),
    Rule(
        "recoveries-of-foxy",
        lambda f: f.told.get("release") == "old",
        lambda f: (
            "in Foxy and older BackUp looks for collisions too far ahead; until May 2020 Spin lost "
            "its goal beyond half a turn"
        ),
        {S.NO_RECOVERY: 0.6, S.SPINS: 0.4},
        (upgrade("galactic or newer, with navigation2#2193 and #1670"),),
        "navigation2#2193, navigation2#1670",
        is_certain=False,
    ),
    Rule(
        "servers-have-10-ms",
        lambda f: (
            f.told.get("release") == "old" and "bt_navigator.default_server_timeout" not in f.given
        ),
        lambda f: (
            "the behaviour tree gives each server 10 ms to take a goal in Foxy, which has no "
            "parameter for it, and 20 ms in Galactic"
        ),
        {S.FALSE_ABORT: 0.5, S.NO_START: 0.3},
        (up("bt_navigator.default_server_timeout", 100), upgrade("galactic or newer")),
        "navigation2#2320",
        is_certain=False,
    ),
    Rule(
        "vector-pursuit-turns-past",
        lambda f: f.is_kind("vector_pursuit"),
        lambda f: (
            "vector_pursuit_controller of 2024 does not slow its turn on the spot down before the "
            "heading is reached"
        ),
        {S.GOAL_OVERSHOOT: 0.7, S.SPINS: 0.4},
        (
            down("rotate_to_heading_angular_vel"),
            upgrade("a newer vector_pursuit_controller"),
        ),
        "vector_pursuit_controller#18",
        is_certain=False,
    ),
    Rule(
        "limits-that-nobody-reads",
        lambda f: bool(_limits(f)),
        lambda f: (
            f"Nav2 {f.release} does not read {_first(_limits(f))}: nothing in the file limits "
            "these accelerations"
        ),
        {S.STOP_START_JERK: 0.7, S.GOAL_OVERSHOOT: 0.6, S.COLLISION: 0.2},
        (upgrade("a release that reads them"), outside("lag")),
        "the parameters that each release of Nav2 declares",
    ),
)
