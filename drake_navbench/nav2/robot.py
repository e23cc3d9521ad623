"""Makes a robot, columns and a check of every parameter from whole Nav2 files.

Properties that a Nav2 file cannot contain (mass, response and accelerations of the drive, lidar,
localization) come from a base robot. A server in the file replaces the base robot's server as a
whole: a parameter that is missing there has Nav2's default, not the base robot's value.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

from drake_navbench.errors import InputError
from drake_navbench.inputs.check import Check, CheckRow, Status
from drake_navbench.inputs.move_base import MOVE_BASE_FILE, is_of_move_base
from drake_navbench.inputs.overrides import merged
from drake_navbench.inputs.presets import Preset
from drake_navbench.inputs.robot import Robot
from drake_navbench.nav2.body import costmap_body, drive_for, note_body, with_body
from drake_navbench.nav2.collision_monitor import read_collision_monitor
from drake_navbench.nav2.columns import column_rows
from drake_navbench.nav2.controller_server import read_controller_server
from drake_navbench.nav2.controllers import SERVER, has_controllers, server_columns
from drake_navbench.nav2.costmaps import (
    GLOBAL_COSTMAP,
    LOCAL_COSTMAP,
    read_global_costmap,
    read_local_costmap,
)
from drake_navbench.nav2.nav2_setup import Nav2Setup
from drake_navbench.nav2.node_reader import NodeReader, Rows, similar_name_hint
from drake_navbench.nav2.outline import (
    Outline,
    note_small_inflation,
    read_outline,
)
from drake_navbench.nav2.parameters import (
    PARAMETERS_KEY,
    Node,
    Section,
    nodes_called,
    read_parameter_file,
    read_parameter_text,
)
from drake_navbench.nav2.release import (
    OLD_NODE,
    Found,
    has_node,
    navigation_of,
    note_absent_classes,
    release_of,
    release_row,
    tree_of,
)
from drake_navbench.nav2.sensors import Nav2Sensors
from drake_navbench.nav2.servers import (
    read_behavior_server,
    read_bt_navigator,
    read_planner_server,
    read_smoother_server,
    read_velocity_smoother,
    read_waypoint_follower,
    straight_drive_of,
)
from drake_navbench.nav2.substitutions import Substitutions
from drake_navbench.navigation.behavior_tree.settings import NAVIGATOR_OF
from drake_navbench.typed_files.dotted_names import flattened
from drake_navbench.typed_files.typed_yaml import validate

PLANNER_SERVER = "planner_server"
SMOOTHER_SERVER = "smoother_server"
BT_NAVIGATOR = "bt_navigator"
COLLISION_MONITOR = "collision_monitor"
# The node of a behaviour tree that asks the smoother server.
SMOOTHING_NODE = "SmoothPath"
# The readers of further servers by the node's name.
SERVERS: dict[str, Callable[[NodeReader], dict[str, Any]]] = {
    "behavior_server": read_behavior_server,
    "waypoint_follower": read_waypoint_follower,
    "velocity_smoother": read_velocity_smoother,
}
READ = (
    SERVER,
    LOCAL_COSTMAP,
    GLOBAL_COSTMAP,
    PLANNER_SERVER,
    SMOOTHER_SERVER,
    BT_NAVIGATOR,
    COLLISION_MONITOR,
    *SERVERS,
)
# The controllers' parameters for the least forward speed.
LEAST_SPEEDS = ("min_vel_x", "vx_min")
# The remark on a node's parameters within those of another node, for which no node looks.
NESTED = f"{PARAMETERS_KEY} stands within the parameters"
# Servers that a robot only has if its file has them.
OPTIONAL = ("velocity_smoother", COLLISION_MONITOR)


class ReadFiles(NamedTuple):
    """The sections of files that are merged, and the remarks on them."""

    paths: tuple[Path, ...]
    sections: tuple[Section, ...]
    remarks: Rows


def read_sections(
    paths: Sequence[Path], substitutions: Substitutions, texts: Mapping[Path, str] | None = None
) -> ReadFiles:
    """Returns the sections of files; raises InputError.

    texts: contents that replace those of a path.
    """
    sections: list[Section] = []
    rows: Rows = {}
    for path in paths:
        prepare = partial(substitutions.applied_to, path=path)
        if texts and path in texts:
            file = read_parameter_text(prepare(texts[path]), path)
        else:
            file = read_parameter_file(path, prepare)
        if not file.sections:
            what = MOVE_BASE_FILE if is_of_move_base(path) else "expected a Nav2 file"
            raise InputError(f"{path}: no node with {PARAMETERS_KEY}; {what}")
        sections += file.sections
        for number, remark in enumerate(file.remarks):
            row = CheckRow(Status.OTHER_FORM, path.name, "", remark.removeprefix(f"{path}, "))
            rows[path.name, str(number)] = row
    return ReadFiles(tuple(paths), tuple(sections), rows)


def setup_of(
    read: ReadFiles,
    base: Robot,
    base_name: str,
    *,
    release: str | None = None,
    beside: Sequence[Nav2Setup] = (),
    needs_controller: bool = True,
) -> Nav2Setup:
    """Returns the setup that Nav2 files define; raises InputError.

    beside: setups whose controllers drive the same base; its speed limits suffice for all of them.
    needs_controller: whether files are refused of whose controllers none exists here.
    """
    found = release_of(read.sections, release)
    files = _Files(list(read.sections), dict(read.remarks), base, base_name, found)
    return files.setup(read.paths, beside, needs_controller)


class _Files:
    """The sections of all files on the way to a robot."""

    def __init__(
        self, sections: list[Section], rows: Rows, base: Robot, base_name: str, release: Found
    ) -> None:
        self._release = release
        self._places: dict[str, tuple[str, str]] = {}
        self._readers: list[NodeReader] = []
        self._sections = sections
        self._rows = rows
        self._base = base
        self._base_name = base_name
        servers = [node for node in nodes_called(SERVER, sections) if has_controllers(node)]
        self._servers = servers
        self._namespace = servers[0].name.removesuffix(f"/{SERVER}") if servers else ""

    def setup(
        self, paths: Sequence[Path], beside: Sequence[Nav2Setup], needs_controller: bool
    ) -> Nav2Setup:
        """Returns the columns and the robot that the files describe."""
        columns = [self._columns(node, needs_controller) for node in self._servers]
        presets = tuple(preset for own in columns for preset in own)
        row = release_row(self._release)
        self._rows[row.node, row.parameter] = row
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
        needed_speeds = tuple(preset.parameters.asked_speeds() for preset in presets)
        spin = navigation.get("behavior_server", {}).get("max_rotational_vel") or 0.0
        data["drive"], remarks = drive_for(
            data.get("drive", {}),
            [*needed_speeds, *(speeds for other in beside for speeds in other.needed_speeds)],
            self._base,
            self._base_name,
            spin_radps=max([spin, *(other.spin_radps for other in beside)]),
        )
        for name, remark in remarks.items():
            self._note(Status.OTHER_FORM, "robot", f"drive.{name}", remark)
        source = ", ".join(map(str, paths))
        robot = validate(Robot, data, source)
        self._note_smoothed_away(presets, robot)
        for node in [*self._servers, *(reader.node for reader in self._readers)]:
            note_absent_classes(self._rows, node, self._release.release)
        self._note_other_sections()
        robot = robot.model_copy(update={"directory": self._base.directory})
        if robot.drive.has_wheels:
            robot.running_gear(source)
        for reader, _ in self._outlines:
            settings = getattr(robot.navigation, reader.node.name.rpartition("/")[2])
            note_small_inflation(reader, settings, robot.radii[0])
        if body:
            note_body(self._outlines, robot, self._base_name)
        if robot.is_circle:
            self._note_outlines_of_a_radius(presets)
        check = Check(tuple(self._rows.values()))
        return Nav2Setup(
            presets,
            robot,
            check,
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
        )

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

    def _columns(self, node: Node, needs_one: bool) -> list[Preset]:
        columns = server_columns(node, self._release.release, needs_one=needs_one)
        for row in column_rows(node, columns):
            self._rows[row.node, row.parameter] = row
        presets = {plugin: preset for plugin, preset in columns.items() if preset is not None}
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
        of_release = {
            PLANNER_SERVER: partial(
                read_planner_server, release=release, cell_m=self._global_cell_m(fields)
            ),
            COLLISION_MONITOR: partial(
                read_collision_monitor, range_sensors=self._base.range_sensors
            ),
            BT_NAVIGATOR: partial(read_bt_navigator, release=release),
        }
        for name, read in (SERVERS | of_release).items():
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
        smoother = self._find(SMOOTHER_SERVER)
        if smoother is not None:
            is_asked = any(has_node(tree, SMOOTHING_NODE) for tree in trees.values())
            fields |= read_smoother_server(self._reader(smoother), is_asked=is_asked)
        return fields

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
        self._outlines: list[tuple[NodeReader, Outline]] = []
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

    def _note_outlines_of_a_radius(self, presets: Collection[Preset]) -> None:
        remark = (
            "the costmap has a radius and no footprint: MPPI checks a polygon in its place; later "
            "releases refuse this"
        )
        for preset in presets:
            node, block = self._places[preset.name]
            for name, value in flattened(preset.values):
                place = node, f"{block}.{name}"
                if name.endswith(".consider_footprint") and value is True and place in self._rows:
                    row = self._rows[place]
                    self._rows[place] = row._replace(status=Status.DOUBTFUL, remark=remark)

    def _note_smoothed_away(self, presets: Collection[Preset], robot: Robot) -> None:
        """Notes least speeds that the velocity smoother lets no command have."""
        smoother = robot.navigation.velocity_smoother
        if smoother is None:
            return
        most = smoother.max_velocity[0]
        for preset in presets:
            node, block = self._places[preset.name]
            for name, value in flattened(preset.values):
                place = node, f"{block}.{name}"
                if name in LEAST_SPEEDS and value > most and place in self._rows:
                    remark = f"{value:g} m/s, but the velocity smoother lets through {most:g} m/s"
                    row = self._rows[place]
                    self._rows[place] = row._replace(status=Status.DOUBTFUL, remark=remark)

    def _note(self, status: Status, node: str, parameter: str, remark: str) -> None:
        self._rows[node, parameter] = CheckRow(status, node, parameter, remark)

    def _note_missing(self, name: str) -> None:
        remark = f"not in the file; that of {self._base_name}"
        self._note(Status.OTHER_FORM, name, "", remark)

    def _note_other_sections(self) -> None:
        """Notes the nodes whose parameters are not read."""
        read = {f"{self._namespace}/{name}" for name in READ}
        read |= {node.name for node in self._servers}
        for section in self._sections:
            self._note_nested(section)
            if section.name in read or section.has_wildcards:
                continue
            self._note_unread_section(section.name.lstrip("/"))

    def _note_nested(self, section: Section) -> None:
        """Notes the nodes that stand within the parameters of another one."""
        for name, parameter in section.parameters.items():
            nested, found, _ = name.partition(f".{PARAMETERS_KEY}.")
            place = section.name.lstrip("/"), nested
            if found and place not in self._rows:
                first = nested.partition(".")[0]
                remark = f"{NESTED} of {place[0]}; begin {first} at the left margin"
                self._rows[place] = CheckRow(Status.UNREAD, *place, remark, parameter.line)

    def _note_unread_section(self, name: str) -> None:
        if name.rpartition("/")[2] == OLD_NODE:
            remark = f"since humble the node is called behavior_server; {self._release.release} "
            self._note(Status.UNREAD, name, "", f"{remark}does not read this one")
        elif name in ("local_costmap", "global_costmap"):
            self._note(Status.UNREAD, name, "", f"the node is called {name}/{name}")
        elif any(name.endswith(f"/{other}") or name == other for other in READ):
            remark = f"another namespace; only that of '{self._namespace or '/'}' is read"
            self._note(Status.STAND_IN, name, "", remark)
        elif hint := similar_name_hint(name, READ):
            self._note(Status.UNREAD, name, "", f"unknown node{hint}")
        else:
            self._note(Status.NO_MEANING, name, "", "")
