"""Reads the servers of a Nav2 file, without controllers and costmaps, into a robot's settings.

Each function takes a node and returns fields of `NavigationSettings`, checked. A parameter that is
missing has Nav2's default. The trees of bt_navigator are read in `bt_navigator`. Sources:
nav2_planner, nav2_behaviors, nav2_waypoint_follower, nav2_velocity_smoother, nav2_smoother.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel

from drake_navbench.inputs.check import Status
from drake_navbench.nav2.controller_server import plugin_block
from drake_navbench.nav2.node_reader import WITHOUT_MEANING, NodeReader
from drake_navbench.navigation.behavior import BEHAVIORS, BehaviorServerParameters, DriveLimits
from drake_navbench.navigation.behavior_tree.settings import RECOVERY_ACTIONS
from drake_navbench.navigation.planner_settings import PLANNERS
from drake_navbench.navigation.smac_planner_2d_parameters import SmacPlanner2DParameters
from drake_navbench.navigation.smac_planner_hybrid_parameters import SmacPlannerHybridParameters
from drake_navbench.navigation.smoother_settings import SMOOTHERS
from drake_navbench.navigation.smoothers import SimpleSmoother
from drake_navbench.navigation.velocity_smoother import VelocitySmootherParameters
from drake_navbench.navigation.waypoint_follower import (
    WaitAtWaypointParameters,
    WaypointFollowerParameters,
)
from drake_navbench.plugins.releases import RELEASE_FIELD, Release, defaults_in

Fields = dict[str, Any]

NAVFN = "nav2_navfn_planner::NavfnPlanner"
# Fields of a planner that no Nav2 file has.
NOT_NAV2S = {"plugin", "expansions_per_second", RELEASE_FIELD}
TURNING_RADIUS = "minimum_turning_radius"
PARTIAL_PLAN = "allow_partial_planning"
SIMPLE_SMOOTHER = SimpleSmoother.nav2_plugin
DEFAULT_SMOOTHER = "simple_smoother"
WAIT_AT_WAYPOINT = "nav2_waypoint_follower::WaitAtWaypoint"
# The name that Nav2's default behaviour tree asks for if there are several planners.
DEFAULT_PLANNER = "GridBased"
# Behaviours of Nav2: type without its package -> the default tree's recovery action.
RECOVERY_OF: Mapping[str, str] = {
    "Spin": "spin",
    "BackUp": "backup",
    "Wait": "wait",
    "DriveOnHeading": "",
    "AssistedTeleop": "",
}
# The velocity smoother's parameters with a number for each axis.
SMOOTHER_LISTS = ("max_velocity", "min_velocity", "max_accel", "max_decel", "deadband_velocity")
# The behaviours with `DriveLimits`.
STRAIGHT = ("backup", "drive_on_heading")
BEHAVIOR_PACKAGES = ("nav2_behaviors", "nav2_recoveries")
DEFAULT_BEHAVIORS = {
    "spin": "nav2_behaviors::Spin",
    "backup": "nav2_behaviors::BackUp",
    "drive_on_heading": "nav2_behaviors::DriveOnHeading",
    "wait": "nav2_behaviors::Wait",
}


# What differs where another planner takes State Lattice's place.
LATTICE = (
    "; its plans turn as sharply as a point can and never reverse, State Lattice's are joined from "
    "the motions in lattice_filepath"
)


def read_planner_server(reader: NodeReader, release: Release, cell_m: float) -> Fields:
    """Returns the planner that the default tree names, with the parameters that the release reads.

    cell_m: the global costmap's resolution, m.
    """
    names = reader.names("planner_plugins", [DEFAULT_PLANNER])
    if not names:
        raise reader.fault("planner_plugins", "expected at least one name")
    types = {name: _planner_type(reader, name, names) for name in names}
    name = DEFAULT_PLANNER if DEFAULT_PLANNER in names else names[0]
    for other in names:
        if other != name:
            remark = f"{types[other]}: not used, as the default tree plans with {name}"
            reader.note_block(Status.NO_MEANING, other, remark)
    plugin_type = types[name]
    if plugin_type in PLANNERS:
        values = _planner(reader, name, plugin_type, release, cell_m)
    else:
        remark = f"{types[name]}: SmacPlanner2D with its defaults is used instead"
        if plugin_type.endswith("SmacPlannerLattice"):
            remark += LATTICE
        plugin_type = SmacPlanner2DParameters.model_fields["plugin"].default
        reader.note_block(Status.STAND_IN, name, remark)
        values = _classic({RELEASE_FIELD: str(release)})
    if release < Release.LYRICAL and reader.given(PARTIAL_PLAN):
        reader.note(Status.UNREAD, PARTIAL_PLAN, f"{release} does not read it")
    elif reader.flag(PARTIAL_PLAN, False):
        remark = "a plan through poses that does not reach all of them fails as a whole"
        reader.note(Status.STAND_IN, PARTIAL_PLAN, remark)
    reader.finish({"expected_planner_frequency", "costmap_update_timeout"})
    return {"planner": {"plugin": plugin_type, **values}}


def _planner_type(reader: NodeReader, name: str, names: list[str]) -> str:
    default = NAVFN if names == [DEFAULT_PLANNER] else None
    return reader.plugin_type(name, default, "planner_plugins")


def _planner(
    reader: NodeReader, name: str, plugin_type: str, release: Release, cell_m: float
) -> Fields:
    model = PLANNERS.load(plugin_type).Parameters
    rules = {RELEASE_FIELD: str(release)} if RELEASE_FIELD in model.model_fields else {}
    if model is SmacPlannerHybridParameters:
        return _hybrid_planner(reader, name, release, cell_m) | rules
    if model is not SmacPlanner2DParameters:
        names = [field for field in model.model_fields if field not in NOT_NAV2S]
        return reader.block(model, f"{name}.", names=names) | rules
    ours = {*_classic({}), *NOT_NAV2S}
    names = [field for field in model.model_fields if field not in ours]
    return _classic(reader.block(model, f"{name}.", names=names) | rules)


def _hybrid_planner(reader: NodeReader, name: str, release: Release, cell_m: float) -> Fields:
    """Returns the parameters of SmacPlannerHybrid."""
    apart = (*NOT_NAV2S, TURNING_RADIUS)
    fields = [field for field in SmacPlannerHybridParameters.model_fields if field not in apart]
    values = reader.block(SmacPlannerHybridParameters, f"{name}.", names=fields)
    factor = reader.node.get(f"{name}.downsampling_factor", 1)
    least_m = cell_m * (factor if isinstance(factor, int) else 1)
    return values | _turning_radius(reader, f"{name}.{TURNING_RADIUS}", release, least_m)


def _turning_radius(reader: NodeReader, name: str, release: Release, least_m: float) -> Fields:
    """Returns the turning radius, at least a cell of the search.

    Nav2 enforces this since Jazzy. Before, it starts with 0, too, but then makes no curves.
    """
    if not reader.given(name):
        return {}
    radius_m = reader.number(name, least_m)
    if radius_m < 0.0 or not math.isfinite(radius_m):
        raise reader.fault(name, f"expected 0 or more, got {radius_m}")
    if release >= Release.JAZZY and radius_m < least_m:
        remark = f"{least_m:g}, a cell of the search, as in Nav2, in place of {radius_m:g}"
        reader.note(Status.OTHER_FORM, name, remark)
        radius_m = least_m
    elif radius_m == 0.0:
        remark = f"{release} plans no curve of radius 0: {least_m:g}, a cell, is used instead"
        reader.note(Status.STAND_IN, name, remark)
        radius_m = least_m
    return {TURNING_RADIUS: radius_m}


def _classic(values: Fields) -> Fields:
    """Returns parameters with which SmacPlanner2D behaves as Nav2's, flaws included."""
    switches = SmacPlanner2DParameters.nav2_classic().model_dump(exclude_unset=True)
    return {**switches, **values}


def read_behavior_server(reader: NodeReader) -> Fields:
    """Returns the behaviours, and those of them that the default tree uses as recoveries."""
    values = reader.block(BehaviorServerParameters)
    for behavior in STRAIGHT:
        if behavior in values:
            values[behavior] = _drive_limits(reader, values[behavior])
    listed_in = "behavior_plugins"
    found = []
    names = reader.names(listed_in, DEFAULT_BEHAVIORS)
    for name in names:
        default = DEFAULT_BEHAVIORS.get(name) if names == list(DEFAULT_BEHAVIORS) else None
        plugin_type = reader.plugin_type(name, default, listed_in)
        is_field = name in BehaviorServerParameters.model_fields
        if BEHAVIORS.origin(plugin_type) is not None and not is_field:
            values[name] = plugin_block(reader, name, BEHAVIORS, plugin_type)
            found.append(name)
            if name not in RECOVERY_ACTIONS:
                remark = "the default tree tries it only where recovery_actions lists it"
                reader.note(Status.OTHER_FORM, f"{name}.plugin", remark)
        else:
            found.append(_recovery_action(reader, name, plugin_type))
    actions = [action for action in RECOVERY_ACTIONS if action == "clear" or action in found]
    reader.finish(WITHOUT_MEANING["behavior_server"])
    return {"behavior_server": values, "behavior_tree": {"recovery_actions": actions}}


def straight_drive_of(release: Release) -> Fields:
    """Returns a release's default limits of the STRAIGHT behaviours where they differ from ours."""
    limits = defaults_in(DriveLimits, release)
    return {behavior: limits for behavior in STRAIGHT} if limits else {}


def _drive_limits(reader: NodeReader, given: Fields) -> Fields:
    """Returns the limits of a behaviour that drives straight; 0, Humble's default, is no limit."""
    limits = ("acceleration_limit", "deceleration_limit")
    if reader.release is Release.HUMBLE and not all(given.get(name) for name in limits):
        return {**given, **dict.fromkeys(limits)}
    return given


def _recovery_action(reader: NodeReader, name: str, plugin_type: str) -> str:
    """Returns the default tree's recovery action that a behaviour serves, '' without one."""
    package, _, kind = plugin_type.partition("::")
    if package in BEHAVIOR_PACKAGES and kind in RECOVERY_OF:
        if not RECOVERY_OF[kind]:
            remark = "the default tree does not use it"
            reader.note(Status.NO_MEANING, f"{name}.plugin", remark)
        return RECOVERY_OF[kind]
    action = {"back_up": "backup"}.get(name, name)
    if action in RECOVERY_OF.values():
        reader.note(Status.STAND_IN, f"{name}.plugin", f"{plugin_type}: Nav2's own is used instead")
        return action
    remark = f"{plugin_type}: left out, as the default tree does not use it"
    reader.note_block(Status.NO_MEANING, name, remark)
    return ""


def read_waypoint_follower(reader: NodeReader) -> Fields:
    """Returns the waypoint follower with its pause at each waypoint."""
    values = reader.block(WaypointFollowerParameters, names=("stop_on_failure",))
    name = reader.text("waypoint_task_executor_plugin", "wait_at_waypoint")
    plugin_type = reader.plugin_type(name, WAIT_AT_WAYPOINT, "waypoint_task_executor_plugin")
    if plugin_type == WAIT_AT_WAYPOINT:
        values["wait_at_waypoint"] = reader.block(WaitAtWaypointParameters, f"{name}.")
    else:
        remark = f"{plugin_type}: left out; nothing is done at waypoints"
        reader.note_block(Status.STAND_IN, name, remark)
        values["wait_at_waypoint"] = {"enabled": False}
    reader.finish({"loop_rate", "global_frame_id"})
    return {"waypoint_follower": values}


def read_velocity_smoother(reader: NodeReader) -> Fields:
    """Returns the velocity smoother."""
    model = VelocitySmootherParameters
    lists = {name: reader.value(name) for name in SMOOTHER_LISTS if reader.given(name)}
    is_six = reader.release >= Release.LYRICAL and all(
        isinstance(given, list) and len(given) == 6 for given in lists.values()
    )
    if len(lists) < len(SMOOTHER_LISTS) or not is_six:
        values = reader.block(model)
    else:
        values = reader.block(model, names=model.model_fields.keys() - lists.keys())
        for name, (x, y, _, _, _, yaw) in lists.items():
            reader.note(Status.OTHER_FORM, name, "of the six axes x, y and yaw")
            values[name] = [x, y, yaw]
        values = reader.checked(model, values)
    _require_standstill(reader, values)
    reader.finish({"odom_duration", "stamp_smoothed_velocity_with_smoothing_time"})
    return {"velocity_smoother": values}


def _require_standstill(reader: NodeReader, values: Fields) -> None:
    """Requires limits that let the robot stand, without which only Humble's smoother starts."""
    parameters = VelocitySmootherParameters(**values)
    if all(least <= 0.0 <= most for least, most in parameters.ranges):
        return
    name = "min_velocity" if max(parameters.min_velocity) > 0.0 else "max_velocity"
    told = "the robot never stands still"
    if reader.release > Release.HUMBLE:
        raise reader.fault(name, f"{told}, and the smoother of {reader.release} does not start")
    reader.note(Status.DOUBTFUL, name, told)


def read_smoother_server(reader: NodeReader, *, is_asked: bool) -> Fields:
    """Returns the first smoother of the file where the tree asks for one, else {}."""
    if not is_asked:
        for name in reader.node.parameters:
            reader.note(Status.NO_MEANING, name)
        remark = "the tree smooths no path; a scenario's plan.smoother does"
        reader.note(Status.NO_MEANING, "", remark)
        return {}
    listed_in = "smoother_plugins"
    names = reader.names(listed_in, [DEFAULT_SMOOTHER])
    if not names:
        raise reader.fault(listed_in, "expected at least one name")
    name, *others = names
    for other in others:
        reader.note_block(Status.OTHER_FORM, other, f"{name} smooths every path")
    default = SIMPLE_SMOOTHER if names == [DEFAULT_SMOOTHER] else None
    plugin_type = reader.plugin_type(name, default, listed_in)
    if plugin_type not in SMOOTHERS.built_in:
        reader.note_block(
            Status.STAND_IN, name, f"{plugin_type}: {SIMPLE_SMOOTHER} is used instead"
        )
        model = SMOOTHERS.load(SIMPLE_SMOOTHER).Parameters
        return {"smoother": smoother_of_release(model, reader.release)}
    model = SMOOTHERS.load(plugin_type).Parameters
    fields = [field for field in model.model_fields if field not in {"plugin", RELEASE_FIELD}]
    values = reader.block(model, f"{name}.", names=fields)
    if RELEASE_FIELD in model.model_fields:
        values[RELEASE_FIELD] = str(reader.release)
    reader.finish(
        {"costmap_topic", "footprint_topic", "local_costmap_topic", "transform_tolerance"}
    )
    return {"smoother": {"plugin": plugin_type, **values}}


def smoother_of_release(model: type[BaseModel], release: Release) -> Fields:
    """Returns the fields of a smoother without parameters whose rules are those of a release."""
    rules = {RELEASE_FIELD: str(release)} if RELEASE_FIELD in model.model_fields else {}
    return defaults_in(model, release) | rules
