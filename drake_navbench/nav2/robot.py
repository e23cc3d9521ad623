"""Makes a robot, columns and a check of every parameter from whole Nav2 files.

Properties that a Nav2 file cannot contain (mass, response and accelerations of the drive, lidar,
localization) come from a base robot. A server in the file replaces the base robot's server as a
whole: a parameter that is missing there has Nav2's default, not the base robot's value.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from drake_navbench.controller import AskedSpeeds
from drake_navbench.inputs.check import Check, CheckRow, Status
from drake_navbench.inputs.overrides import merged
from drake_navbench.inputs.presets import Preset
from drake_navbench.inputs.robot import Robot
from drake_navbench.nav2.body import costmap_body, drive_for, note_body, with_body
from drake_navbench.nav2.bt_navigator import read_bt_navigator
from drake_navbench.nav2.collision_monitor import read_collision_monitor
from drake_navbench.nav2.columns import column_rows
from drake_navbench.nav2.controller_server import read_controller_server
from drake_navbench.nav2.controllers import (
    SERVER,
    NoCounterpart,
    has_controllers,
    server_columns,
    why_without_column,
)
from drake_navbench.nav2.costmaps import (
    GLOBAL_COSTMAP,
    LOCAL_COSTMAP,
    read_global_costmap,
    read_local_costmap,
)
from drake_navbench.nav2.file_remarks import (
    note_fast_turns,
    note_other_sections,
    note_outlines_of_a_radius,
    note_smoothed_away,
    note_unloadable,
    note_wide_tolerance,
)
from drake_navbench.nav2.loadable import AMCL
from drake_navbench.nav2.nav2_setup import Nav2Setup
from drake_navbench.nav2.node_names import (
    BEHAVIOR_SERVER,
    BT_NAVIGATOR,
    COLLISION_MONITOR,
    PLANNER_SERVER,
    READ,
    SMOOTHER_SERVER,
    VELOCITY_SMOOTHER,
    WAYPOINT_FOLLOWER,
)
from drake_navbench.nav2.node_reader import NodeReader, Rows
from drake_navbench.nav2.outline import (
    Outline,
    note_small_inflation,
    note_wide_cells,
    read_outline,
)
from drake_navbench.nav2.parameters import Node, Section, nodes_called
from drake_navbench.nav2.read_files import ReadFiles
from drake_navbench.nav2.release import (
    Found,
    has_node,
    is_before_humble,
    navigation_of,
    release_of,
    release_row,
    tree_of,
)
from drake_navbench.nav2.sensors import Nav2Sensors
from drake_navbench.nav2.servers import (
    read_behavior_server,
    read_planner_server,
    read_smoother_server,
    read_velocity_smoother,
    read_waypoint_follower,
    smoother_of_release,
    straight_drive_of,
)
from drake_navbench.navigation.behavior_tree.settings import NAVIGATOR_OF
from drake_navbench.typed_files.typed_yaml import validate

# The node of a behaviour tree that asks the smoother server.
SMOOTHING_NODE = "SmoothPath"
# The readers of further servers by the node's name.
SERVERS: dict[str, Callable[[NodeReader], dict[str, Any]]] = {
    BEHAVIOR_SERVER: read_behavior_server,
    WAYPOINT_FOLLOWER: read_waypoint_follower,
    VELOCITY_SMOOTHER: read_velocity_smoother,
}
# Servers that a robot only has if its file has them.
OPTIONAL = (VELOCITY_SMOOTHER, COLLISION_MONITOR)


def setup_of(
    read: ReadFiles,
    base: Robot,
    base_name: str,
    *,
    release: str | None = None,
    beside: Sequence[Nav2Setup] = (),
) -> Nav2Setup:
    """Returns the setup that Nav2 files define; raises InputError.

    beside: setups whose controllers drive the same base; its speed limits suffice for all of them.
    A file of whose controllers none exists here has a setup, too: see `without_column`.
    """
    found = release_of(read.sections, release)
    files = _Files(list(read.sections), dict(read.remarks), base, base_name, found)
    return files.setup(read.paths, beside)


class _Files:
    """The sections of all files on the way to a robot."""

    def __init__(
        self, sections: list[Section], rows: Rows, base: Robot, base_name: str, release: Found
    ) -> None:
        self._release = release
        self._places: dict[str, tuple[str, str]] = {}
        self._readers: list[NodeReader] = []
        self._outlines: list[tuple[NodeReader, Outline]] = []
        self._without_column: NoCounterpart | None = None
        self._sections = sections
        self._rows = rows
        self._base = base
        self._base_name = base_name
        servers = [node for node in nodes_called(SERVER, sections) if has_controllers(node)]
        self._servers = servers
        self._namespace = servers[0].name.removesuffix(f"/{SERVER}") if servers else ""

    def setup(self, paths: Sequence[Path], beside: Sequence[Nav2Setup]) -> Nav2Setup:
        """Returns the columns and the robot that the files describe."""
        presets = tuple(preset for node in self._servers for preset in self._columns(node))
        row = release_row(self._release)
        self._rows[row.node, row.parameter] = row
        needed_speeds = tuple(preset.parameters.asked_speeds() for preset in presets)
        robot, spin = self._robot(paths, needed_speeds, beside)
        self._note_across_nodes(presets, robot)
        return Nav2Setup(
            presets,
            robot,
            Check(tuple(self._rows.values())),
            self._places,
            given=self._given(),
            offers={
                (reader.node.name.rpartition("/")[2], name): offer
                for reader in self._readers
                for name, offer in reader.offers.items()
            },
            needed_speeds=needed_speeds,
            spin_radps=spin,
            namespace=self._namespace.lstrip("/"),
            without_column=self._without_column,
        )

    def _robot(
        self, paths: Sequence[Path], speeds: Sequence[AskedSpeeds], beside: Sequence[Nav2Setup]
    ) -> tuple[Robot, float]:
        """Returns the robot that the files describe, and the yaw rate of its spin, rad/s.

        speeds: those that the files' controllers ask of the base. beside: as in `setup_of`.
        """
        navigation = self._navigation()
        data = self._base.model_dump(mode="json", exclude_unset=True)
        data["description"] = f"from {', '.join(p.name for p in paths)}, drive of {self._base_name}"
        remark = f"not in a Nav2 file; those of {self._base_name}"
        self._note(Status.OTHER_FORM, "robot", "mass, lidar, accelerations, localization", remark)
        body = self._body(navigation)
        if body:
            data = with_body(data, body, self._base, self._base_name)
        data["navigation"] = {**data.get("navigation", {}), **dict.fromkeys(OPTIONAL), **navigation}
        if self._added_sensors:
            data["depth_sensors"] = {**data.get("depth_sensors", {}), **self._added_sensors}
        spin = navigation.get("behavior_server", {}).get("max_rotational_vel") or 0.0
        data["drive"], remarks = drive_for(
            data.get("drive", {}),
            [*speeds, *(speeds for other in beside for speeds in other.needed_speeds)],
            self._base,
            self._base_name,
            spin_radps=max([spin, *(other.spin_radps for other in beside)]),
        )
        for name, remark in remarks.items():
            self._note(Status.OTHER_FORM, "robot", f"drive.{name}", remark)
        source = ", ".join(map(str, paths))
        robot = validate(Robot, data, source)
        robot = robot.model_copy(update={"directory": self._base.directory})
        if robot.drive.has_wheels:
            robot.running_gear(source)
        return robot, spin

    def _note_across_nodes(self, presets: Sequence[Preset], robot: Robot) -> None:
        """Notes what is told by several nodes together, or by a node and the robot."""
        note_smoothed_away(self._rows, self._places, presets, robot)
        note_fast_turns(self._rows, self._places, presets)
        for server in self._servers[:1]:
            checker = robot.navigation.goal_checker
            note_wide_tolerance(self._rows, server, checker, robot.radii[1])
        self._note_unloadable()
        servers = [node.name for node in self._servers]
        release = self._release.release
        note_other_sections(self._rows, self._sections, servers, self._namespace, release)
        for reader, _ in self._outlines:
            settings = getattr(robot.navigation, reader.node.name.rpartition("/")[2])
            note_small_inflation(reader, settings, robot.radii[0])
            note_wide_cells(reader, settings.resolution, robot.radii[0])
        note_body(self._outlines, robot, self._base_name)
        if robot.is_circle:
            note_outlines_of_a_radius(self._rows, self._places, presets)

    def _given(self) -> dict[tuple[str, str], Any]:
        """Returns the values of all nodes in the namespace that is read."""
        named = {s.name for s in self._sections if not s.has_wildcards}
        bases = {*READ, *(name.removeprefix(f"{self._namespace}/").lstrip("/") for name in named)}
        return {
            (base, name): parameter.value
            for base in sorted(bases)
            # A section for all nodes alone, such as /**, makes no node.
            if any(s.name.rpartition("/")[2] == base.rpartition("/")[2] for s in self._sections)
            for node in nodes_called(base, self._sections)
            if node.name == f"{self._namespace}/{base}"
            for name, parameter in node.parameters.items()
        }

    def _columns(self, node: Node) -> list[Preset]:
        columns = server_columns(node, self._release.release)
        self._without_column = self._without_column or why_without_column(columns)
        for row in column_rows(node, columns):
            self._rows[row.node, row.parameter] = row
        presets = {name: found for name, found in columns.items() if isinstance(found, Preset)}
        for plugin, preset in presets.items():
            self._places[preset.name] = node.name.lstrip("/"), plugin
        return [replace(preset, ignored=()) for preset in presets.values()]

    def _find(self, name: str) -> Node | None:
        """Returns the node of a name beside the first controller server; None without one."""
        full = f"{self._namespace}/{name}"
        nodes = [node for node in nodes_called(name, self._sections) if node.name == full]
        is_named = any(s.is_for(full) and s.name.endswith(f"/{name}") for s in self._sections)
        return nodes[0] if nodes and is_named else None

    def _navigation(self) -> dict[str, Any]:
        fields: dict[str, Any] = {}
        if self._servers:
            server = self._servers[0]
            blocks = {name.partition(".")[0] for _, name in self._rows if "." in name}
            listed = server.get("controller_plugins", ["FollowPath"])
            reader = self._reader(server)
            columns_rows = dict(self._rows)
            fields |= read_controller_server(reader, blocks & set(listed))
            self._rows.update(columns_rows)
        fields = merged(navigation_of(self._release.release), fields)
        fields |= self._costmaps()
        release = self._release.release
        by_release = {
            PLANNER_SERVER: partial(
                read_planner_server, release=release, cell_m=self._global_cell_m(fields)
            ),
            COLLISION_MONITOR: partial(
                read_collision_monitor, range_sensors=self._base.range_sensors
            ),
            BT_NAVIGATOR: partial(read_bt_navigator, release=release),
        }
        for name, read in (SERVERS | by_release).items():
            node = self._find(name)
            if node is not None:
                fields = merged(fields, read(self._reader(node)))
            elif name not in OPTIONAL:
                self._note_missing(name)
        given = fields["behavior_tree"]
        trees = {name: given[name] for name in NAVIGATOR_OF if name in given}
        for name, tree in trees.items():
            given[name] = tree_of(self._release.release, tree)
        if "behavior_server" not in fields:
            fields |= self._own_behaviors()
        is_asked = any(has_node(tree, SMOOTHING_NODE) for tree in trees.values())
        return fields | self._smoother(is_asked)

    def _smoother(self, is_asked: bool) -> dict[str, Any]:
        """Returns the smoother that the tree asks for: the file's, else the base robot's.

        The base robot's has the rules and defaults of the file's release where it names none.
        """
        node = self._find(SMOOTHER_SERVER)
        if node is not None:
            return read_smoother_server(self._reader(node), is_asked=is_asked)
        if not is_asked:
            return {}
        release = self._release.release
        remark = f"not in the file; that of {self._base_name}, by the rules of {release}"
        self._note(Status.OTHER_FORM, SMOOTHER_SERVER, "", remark)
        own = self._base.navigation.smoother.model_dump(mode="json", exclude_unset=True)
        return {
            "smoother": smoother_of_release(type(self._base.navigation.smoother), release) | own
        }

    def _global_cell_m(self, fields: dict[str, Any]) -> float:
        """Returns the resolution of the global costmap, m."""
        own = self._base.navigation.global_costmap.resolution
        return float(fields.get("global_costmap", {}).get("resolution", own))

    def _own_behaviors(self) -> dict[str, Any]:
        """Returns the base robot's behaviours with the release's way of driving straight."""
        drive = straight_drive_of(self._release.release)
        if not drive:
            return {}
        remark = (
            f"not in the file; that of {self._base_name}, without limits where it drives straight"
        )
        self._note(Status.OTHER_FORM, "behavior_server", "", remark)
        own = self._base.navigation.behavior_server.model_dump(mode="json", exclude_unset=True)
        return {"behavior_server": merged(own, drive)}

    def _reader(self, node: Node) -> NodeReader:
        self._readers.append(NodeReader(node, self._rows, self._release.release))
        return self._readers[-1]

    def _costmaps(self) -> dict[str, Any]:
        fields: dict[str, Any] = {}
        sensors = Nav2Sensors(self._base)
        read_local = partial(read_local_costmap, is_override=not self._servers)
        for name, read in ((LOCAL_COSTMAP, read_local), (GLOBAL_COSTMAP, read_global_costmap)):
            node = self._find(name)
            if node is None:
                self._note_missing(name)
                continue
            reader = self._reader(node)
            self._outlines.append((reader, read_outline(reader)))
            settings = read(reader, sensors, self._release.release)
            if name == GLOBAL_COSTMAP:
                settings["margin_m"] = self._base.navigation.global_costmap.margin_m
            fields[name.partition("/")[0]] = settings
        sensors.note_added()
        self._added_sensors = sensors.added
        return fields

    def _body(self, navigation: dict[str, Any]) -> dict[str, Any]:
        """Returns the outline: the local costmap's, else the global one's, else none."""
        if "local_costmap" in navigation and self._outlines[0][1].padding_m is not None:
            navigation["local_costmap"]["footprint_padding"] = self._outlines[0][1].padding_m
        body = costmap_body(self._outlines)
        if not body:
            remark = f"not given, where Nav2 takes a radius of 0.1 m; that of {self._base_name}"
            self._note(Status.OTHER_FORM, "robot", "footprint", remark)
        return body

    def _note_unloadable(self) -> None:
        nodes = [*self._servers, *(reader.node for reader in self._readers)]
        is_older = is_before_humble(self._release.mark)
        for node in filter(None, [*nodes, self._find(AMCL)]):
            note_unloadable(self._rows, node, self._release.release, is_older=is_older)

    def _note(self, status: Status, node: str, parameter: str, remark: str) -> None:
        self._rows[node, parameter] = CheckRow(status, node, parameter, remark)

    def _note_missing(self, name: str) -> None:
        remark = f"not in the file; that of {self._base_name}"
        self._note(Status.OTHER_FORM, name, "", remark)
