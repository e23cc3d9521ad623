"""Remarks of the check that take a whole file, or a file and its robot."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any

from drake_navbench.inputs.check import CheckRow, Status
from drake_navbench.inputs.presets import Preset
from drake_navbench.inputs.robot import Robot
from drake_navbench.logs.outcome import EARLY_M
from drake_navbench.nav2.controllers import listed_plugins
from drake_navbench.nav2.loadable import OLD_NODE, slips_of, told_of_libraries
from drake_navbench.nav2.node_names import READ
from drake_navbench.nav2.node_reader import Rows, similar_name_hint
from drake_navbench.nav2.parameters import PARAMETERS_KEY, Node, Section
from drake_navbench.plugins.releases import Release
from drake_navbench.typed_files.dotted_names import flattened

# The controllers' parameters for the least forward speed.
LEAST_SPEEDS = ("min_vel_x", "vx_min")
# The remark on a node's parameters within those of another node, for which no node looks.
NESTED = f"{PARAMETERS_KEY} stands within the parameters"
# The controllers' parameters for the largest turn rate, rad/s.
TURN_RATES = ("max_vel_theta", "wz_max", "rotate_to_heading_angular_vel", "v_angular_max")
# Two turns a second.
FAST_RADPS = 4.0 * math.pi
TOLERANCES = ("xy_goal_tolerance", "coarse_xy_goal_tolerance")
LIBRARIES = "plugin_lib_names"
# Parameters of these statuses name a class that is used here.
IN_USE = (Status.USED, Status.OTHER_FORM)
Places = Mapping[str, tuple[str, str]]
"""Node and block of a column's controller, by the column's name."""


def note_unloadable(rows: Rows, node: Node, release: Release, *, is_older: bool) -> None:
    """Notes the plugins and libraries that a node names and its release does not load.

    With such a name the node of Nav2 does not start. is_older: whether the file is of a release
    before Humble, whose own names are right.
    """
    full, base = node.name.lstrip("/"), node.name.rpartition("/")[2]
    values = {name: parameter.value for name, parameter in node.parameters.items()}

    def note(parameter: str, remark: str) -> None:
        line = node.parameters[parameter].line
        rows[full, parameter] = CheckRow(Status.STAND_IN, full, parameter, remark, line)

    for slip in slips_of(base, values, release, is_older=is_older):
        row = _row_about(rows, full, slip.parameter)
        # What is replaced anyway, or in a block that nothing lists, is told as such.
        if row is None or row.status in (*IN_USE, Status.NO_MEANING):
            used = "; used here all the same" if row is not None and row.status in IN_USE else ""
            remark = f"{slip.name} {slip.fault}: this node of Nav2 does not start{used}"
            note(slip.parameter, remark)
    libraries = told_of_libraries(values.get(LIBRARIES), release)
    if libraries:
        note(LIBRARIES, libraries)


def note_wide_tolerance(rows: Rows, server: Node, checker: object, radius_m: float) -> None:
    """Notes a goal checker's tolerance with which the robot arrives beside its goal.

    server: the controller server. checker: the parameters of its goal checker. radius_m: of the
    circle around the robot's outline.
    """
    name = next((name for name in TOLERANCES if hasattr(checker, name)), None)
    tolerance_m = getattr(checker, name) if name is not None else 0.0
    if name is None or tolerance_m <= max(EARLY_M, radius_m):
        return
    node, controllers = server.name.lstrip("/"), listed_plugins(server)
    for place, row in rows.items():
        block, _, last = row.parameter.rpartition(".")
        if row.node == node and last == name and block not in controllers:
            remark = (
                f"{tolerance_m:g} m: the robot counts as arrived where none of it, up to "
                f"{radius_m:.2g} m from its base frame, is at the goal"
            )
            rows[place] = row._replace(status=Status.DOUBTFUL, remark=remark)


def note_outlines_of_a_radius(rows: Rows, places: Places, presets: Collection[Preset]) -> None:
    """Notes the outline that MPPI is to check where the costmap has a radius."""
    remark = (
        "the costmap has a radius and no footprint: MPPI checks a polygon in its place; later "
        "releases refuse this"
    )
    for place, name, value in _values_of(presets, places):
        if name.endswith(".consider_footprint") and value is True and place in rows:
            rows[place] = rows[place]._replace(status=Status.DOUBTFUL, remark=remark)


def note_smoothed_away(
    rows: Rows, places: Places, presets: Collection[Preset], robot: Robot
) -> None:
    """Notes least speeds that the velocity smoother lets no command have."""
    smoother = robot.navigation.velocity_smoother
    if smoother is None:
        return
    most = smoother.max_velocity[0]
    for place, name, value in _values_of(presets, places):
        if name in LEAST_SPEEDS and value > most and place in rows:
            remark = f"{value:g} m/s, but the velocity smoother lets through {most:g} m/s"
            rows[place] = rows[place]._replace(status=Status.DOUBTFUL, remark=remark)


def note_fast_turns(rows: Rows, places: Places, presets: Collection[Preset]) -> None:
    """Notes largest turn rates that are probably degrees per second."""
    for place, name, value in _values_of(presets, places):
        if name in TURN_RATES and value > FAST_RADPS and place in rows:
            remark = f"{value:g} rad/s, {value / math.tau:.2g} turns a second: in degrees?"
            rows[place] = rows[place]._replace(status=Status.DOUBTFUL, remark=remark)


def _values_of(
    presets: Collection[Preset], places: Places
) -> Iterator[tuple[tuple[str, str], str, Any]]:
    """Yields the values of columns: the place of each in the file, its name and the value."""
    for preset in presets:
        node, block = places[preset.name]
        for name, value in flattened(preset.values):
            yield (node, f"{block}.{name}"), name, value


def note_other_sections(
    rows: Rows, sections: Sequence[Section], servers: Collection[str], namespace: str, release: str
) -> None:
    """Notes the nodes whose parameters are not read.

    servers: the controller servers, read in every namespace; of other nodes that of `namespace` is.
    """
    read = {*servers, *(f"{namespace}/{name}" for name in READ)}
    for section in sections:
        _note_nested(rows, section)
        if section.name not in read and not section.has_wildcards:
            name = section.name.lstrip("/")
            status, remark = _fate_of_section(name, namespace, release)
            rows[name, ""] = CheckRow(status, name, "", remark)


def _fate_of_section(name: str, namespace: str, release: str) -> tuple[Status, str]:
    if name.rpartition("/")[2] == OLD_NODE:
        remark = f"since humble the node is called behavior_server; {release} does not read this"
        return Status.UNREAD, f"{remark} one"
    if name in ("local_costmap", "global_costmap"):
        return Status.UNREAD, f"the node is called {name}/{name}"
    if any(name.endswith(f"/{other}") or name == other for other in READ):
        return Status.STAND_IN, f"another namespace; only that of '{namespace or '/'}' is read"
    if hint := similar_name_hint(name, READ):
        return Status.UNREAD, f"unknown node{hint}"
    return Status.NO_MEANING, ""


def _note_nested(rows: Rows, section: Section) -> None:
    """Notes the nodes that stand within the parameters of another one, and parameters twice so."""
    for name, parameter in section.parameters.items():
        if name.startswith(f"{PARAMETERS_KEY}."):
            place = section.name.lstrip("/"), PARAMETERS_KEY
            remark = f"{PARAMETERS_KEY} stands within itself: ROS gives the node none of these"
            rows[place] = CheckRow(Status.UNREAD, *place, remark, parameter.line)
            break
        nested, found, _ = name.partition(f".{PARAMETERS_KEY}.")
        place = section.name.lstrip("/"), nested
        if found and place not in rows:
            first = nested.partition(".")[0]
            remark = f"{NESTED} of {place[0]}; begin {first} at the left margin"
            rows[place] = CheckRow(Status.UNREAD, *place, remark, parameter.line)


def _row_about(rows: Rows, node: str, parameter: str) -> CheckRow | None:
    """Returns the row of a parameter, else that of its block; None without one."""
    block = parameter.partition(".")[0]
    return rows.get((node, parameter)) or rows.get((node, block))
