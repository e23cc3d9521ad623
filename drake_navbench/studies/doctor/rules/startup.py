"""Rules about names that the file's release cannot load, and blocks that its servers need."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from drake_navbench.nav2.file_remarks import NESTED
from drake_navbench.nav2.loadable import Slip, slips_of, told_of_libraries
from drake_navbench.plugins.releases import Release
from drake_navbench.studies.doctor.facts import COSTMAPS, Facts
from drake_navbench.studies.doctor.rules.rule import SURE, Rule, add, put
from drake_navbench.studies.doctor.symptoms import Symptom

S = Symptom

SOURCE = "nav2_util: get_plugin_type_param; the plugin descriptions of each release"
# The place of a plugin's name by its package; those of others are found by their node.
PLACES = {
    "nav2_amcl": "amcl.robot_model_type",
    "nav2_behaviors": "behavior_server.*.plugin",
    "nav2_bt_navigator": "bt_navigator.*.plugin",
    "nav2_navfn_planner": "planner.plugin",
    "nav2_recoveries": "behavior_server.*.plugin",
    "nav2_smac_planner": "planner.plugin",
    "nav2_theta_star_planner": "planner.plugin",
}
NOT_LOADED: Mapping[str, Mapping[Symptom, float]] = {
    "amcl.robot_model_type": {S.NO_START: SURE, S.LOCALIZATION_JUMPS: 1.0},
    "behavior_server.*.plugin": {S.NO_START: SURE, S.NO_RECOVERY: SURE},
    "bt_navigator.*.plugin": {S.NO_START: SURE},
    "planner.plugin": {S.NO_START: SURE, S.PLANNER_FAILS: SURE},
    "controller.plugin": {S.NO_START: SURE},
    "global_costmap.plugins": {S.NO_START: SURE},
    "local_costmap.plugins": {S.NO_START: SURE},
}
# The lists of plugins of servers -> the place of the types.
LISTS = {
    "behavior_server.behavior_plugins": "behavior_server.*.plugin",
    "planner_server.planner_plugins": "planner.plugin",
    "local_costmap.plugins": "local_costmap.plugins",
    "global_costmap.plugins": "global_costmap.plugins",
    "controller_server.controller_plugins": "controller.plugin",
    "controller_server.goal_checker_plugins": "goal_checker.plugin",
    "controller_server.progress_checker_plugins": "progress_checker.plugin",
}
# The nodes whose plugins' classes differ by release -> the place of the types.
CLASSES_OF = {listed_in.partition(".")[0]: place for listed_in, place in LISTS.items()} | {
    "controller_server": "controller.plugin"
}
# Names of plugins that a server knows without a block, where its list is Nav2's own.
OWN_NAMES = frozenset(
    {
        "FollowPath",
        "GridBased",
        "assisted_teleop",
        "back_up",
        "backup",
        "drive_on_heading",
        "goal_checker",
        "inflation_layer",
        "obstacle_layer",
        "progress_checker",
        "spin",
        "static_layer",
        "wait",
    }
)
# The nodes that nav2_bringup starts from Jazzy on and that fail without parameters.
STARTED = ("collision_monitor", "docking_server")


def _slips(f: Facts) -> Iterator[tuple[str, Slip]]:
    """Yields the plugins that the file's release does not load, each with its node's name."""
    nodes: dict[str, dict[str, Any]] = {}
    for raw, value in f.raw.items():
        node, _, name = raw.partition(".")
        nodes.setdefault(node, {})[name] = value
    unlisted = {place.rpartition("/")[2].replace(": ", ".") for place in f.unread}
    for node, values in nodes.items():
        for slip in slips_of(node, values, f.release, is_older=f.told.get("release") == "old"):
            if f"{node}.{slip.parameter.partition('.')[0]}" not in unlisted:
                yield node, slip


def _misspelt_at(place: str) -> Callable[[Facts], list[Slip]]:
    """Returns the function from facts to the names that the release spells otherwise."""

    return lambda f: [s for node, s in _slips(f) if s.right and _place_of(node, s) == place]


def _place_of(node: str, slip: Slip) -> str:
    """Returns the place of a misspelt plugin's name, by its package or else by its node."""
    return PLACES.get(slip.package, CLASSES_OF.get(node, ""))


def _not_loaded(place: str, symptoms: Mapping[Symptom, float]) -> Rule:
    """Returns the rule about a place whose plugins the release loads by other names."""
    slips = _misspelt_at(place)

    def seen(f: Facts) -> str:
        told = {slip.name: slip.right for slip in slips(f)}
        lines = (f"{name} ({f.release} knows it as {right})" for name, right in told.items())
        return f"the file asks for the plugin {', '.join(lines)}: the server does not start"

    return Rule(
        f"not-loaded-{place.partition('.')[0]}",
        lambda f: bool(slips(f)),
        seen,
        symptoms,
        (put(place, lambda f: slips(f)[0].right) if place in PLACES.values() else put(place),),
        SOURCE,
        advice="write each name as it stands in brackets",
    )


def _absent(f: Facts, node: str) -> dict[str, str]:
    """Returns by name why the file's release lacks a class that a node's parameters name."""
    return {s.name: s.fault for owner, s in _slips(f) if owner == node and not s.right}


def _of_another_release(node: str, place: str) -> Rule:
    """Returns the rule about classes that another release has."""
    return Rule(
        f"class-of-another-release-{node}",
        lambda f: bool(_absent(f, node)),
        lambda f: (
            f"{node} names "
            + ", ".join(f"{name}, which {fault}" for name, fault in _absent(f, node).items())
            + ": the server does not start"
        ),
        {S.NO_START: SURE},
        (put(place),),
        SOURCE,
        advice="name a class that the release has, or give the release: --nav2-release",
    )


def _libraries(f: Facts) -> str:
    return told_of_libraries(f.raw.get("bt_navigator.plugin_lib_names"), f.release)


def _without_block(f: Facts, listed_in: str) -> list[str]:
    """Returns the names in a server's list of plugins that have no type."""
    names = f.raw.get(listed_in)
    node = listed_in.partition(".")[0]
    if not f.is_whole or not isinstance(names, list):
        return []
    return [
        str(name)
        for name in names
        if name and f"{node}.{name}.plugin" not in f.raw and name not in OWN_NAMES
    ]


def _listed_alone(listed_in: str, place: str) -> Rule:
    """Returns the rule about a list that names plugins without a type."""
    node, _, name = listed_in.partition(".")
    failing = S.NO_RECOVERY if node == "behavior_server" else S.PLANNER_FAILS
    return Rule(
        f"listed-without-a-type-{node}-{name}",
        lambda f: f.told.get("release") != "old" and bool(_without_block(f, listed_in)),
        lambda f: (
            f"{listed_in} lists {', '.join(_without_block(f, listed_in))}, but the file has no "
            f"block of that name with its plugin: {node} does not start"
        ),
        {S.NO_START: SURE, failing: 1.0},
        (put(place),),
        SOURCE,
    )


def _missing(f: Facts) -> list[str]:
    """Returns the parameters without which the file's collision monitor does not start."""
    # Up to Iron it starts without polygons.
    needed = ("polygons", "observation_sources")[f.release < Release.JAZZY :]
    names = f.raw.get("collision_monitor.polygons")
    listed = names if isinstance(names, list) else []
    types = [f"{name}.type" for name in listed if name and isinstance(name, str)]
    return [name for name in (*needed, *types) if f"collision_monitor.{name}" not in f.raw]


def _started(f: Facts) -> str:
    """Returns the condition, in words, if nav2_bringup does not start a collision monitor."""
    return "" if f.release >= Release.JAZZY else "where a launch file of yours starts it, "


def _named_once(f: Facts) -> list[str]:
    """Returns the costmaps whose parameters stand below their name once, where no node has it."""
    names = (place.partition(":")[0] for place, why in f.unread.items() if "is called" in why)
    return [name for name in names if name in COSTMAPS]


def _nested(f: Facts) -> list[str]:
    """Returns the nodes whose parameters stand within those of another node."""
    return [
        place.partition(": ")[2].rpartition(".")[2]
        for place, why in f.unread.items()
        if why.startswith(NESTED)
    ]


def _not_started(f: Facts) -> list[str]:
    """Returns the nodes that nav2_bringup starts and that have no section in a whole file."""
    is_new = f.is_whole and f.release >= Release.JAZZY and f.has_node("bt_navigator")
    return [node for node in STARTED if is_new and not f.has_node(node)]


RULES = (
    *(_not_loaded(place, symptoms) for place, symptoms in NOT_LOADED.items()),
    Rule(
        "libraries-not-loaded",
        lambda f: bool(_libraries(f)),
        lambda f: f"bt_navigator.plugin_lib_names {_libraries(f)}",
        {S.NO_START: SURE},
        (put("bt_navigator.plugin_lib_names"),),
        "nav2_bt_navigator: bt_navigator.cpp; nav2_behavior_tree: CMakeLists.txt",
        advice="delete these names from bt_navigator.plugin_lib_names; from Jazzy on it lists only "
        "libraries of your own",
    ),
    *(_listed_alone(listed_in, place) for listed_in, place in LISTS.items()),
    *(_of_another_release(node, place) for node, place in CLASSES_OF.items()),
    Rule(
        "monitor-without-zones",
        lambda f: f.has_node("collision_monitor") and f.is_whole and bool(_missing(f)),
        lambda f: (
            f"collision_monitor has no {', '.join(_missing(f))}: {_started(f)}it does not start, "
            "nor do the nodes that start with it"
        ),
        {S.NO_START: SURE},
        (put("collision_monitor.polygons"), put("collision_monitor.observation_sources")),
        "nav2_collision_monitor: collision_monitor_node.cpp",
    ),
    Rule(
        "bringup-starts-more",
        lambda f: bool(_not_started(f)),
        lambda f: (
            f"nav2_bringup of {f.release} also starts {' and '.join(_not_started(f))}, but the "
            "file has no parameters for it: it fails, and nav2_bringup stops all nodes"
        ),
        {S.NO_START: 0.6},
        (add("collision_monitor"), add("docking_server")),
        "nav2_bringup: navigation_launch.py",
        is_certain=False,
    ),
    Rule(
        "initial-pose-not-read",
        lambda f: (
            any(name.startswith("amcl.initial_pose.") for name in f.raw)
            and f.raw.get("amcl.set_initial_pose") is not True
        ),
        lambda f: (
            "the file gives amcl an initial_pose, but set_initial_pose is off: AMCL waits until "
            "somebody gives it a pose, and until then there is no transform from map to odom"
        ),
        {S.NO_START: 1.5, S.PLANNER_FAILS: 0.6, S.LOCALIZATION_JUMPS: 0.4},
        (put("amcl.set_initial_pose", True),),
        "nav2_amcl: amcl_node.cpp",
        is_certain=False,
    ),
    Rule(
        "costmap-named-once",
        lambda f: bool(_named_once(f)),
        lambda f: (
            f"no node reads the parameters of {', '.join(_named_once(f))}: a costmap's name is "
            "its namespace and its node's name, so the file must give it twice"
        ),
        {S.IGNORES_OBSTACLES: SURE, S.COLLISION: 1.3, S.PLANNER_FAILS: 1.0, S.NO_START: 0.8},
        (put("local_costmap.plugins"),),
        "nav2_costmap_2d: costmap_2d_ros.cpp",
        advice="write the costmap's name twice: local_costmap: local_costmap: ros__parameters:",
    ),
    Rule(
        "nodes-within-parameters",
        lambda f: bool(_nested(f)),
        lambda f: (
            f"{', '.join(_nested(f))} and their ros__parameters stand within the ros__parameters "
            "of another node, such as /**: no node reads them, and each takes its defaults"
        ),
        {S.NO_START: SURE, S.IGNORES_OBSTACLES: 1.0},
        (put("controller_server.controller_plugins"),),
        "rcl_yaml_param_parser: parse.c",
        advice="begin each node's name at the left margin, with its own ros__parameters below it",
    ),
)
