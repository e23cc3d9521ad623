"""The resolved parameters of a Nav2 file as the rules of the doctor see them.

A parameter is named by its place: `controller.vx_std`, `local_costmap.inflation_radius`,
`velocity_smoother.velocity_timeout`. Places do not depend on how a file calls its plugins. What is
not in the file has the default of the file's release, or of the robot that fills the gaps.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from drake_navbench.inputs.check import Status
from drake_navbench.inputs.presets import Preset
from drake_navbench.inputs.robot import Robot
from drake_navbench.nav2.controllers import SERVER
from drake_navbench.nav2.costmaps import GLOBAL_COSTMAP, LOCAL_COSTMAP
from drake_navbench.nav2.loadable import OLD_NODE
from drake_navbench.nav2.nav2_setup import Nav2Setup
from drake_navbench.nav2.outline import is_footprint
from drake_navbench.nav2.release import BEFORE_HUMBLE, told_by
from drake_navbench.plugins.releases import NEWEST_RELEASE, Release
from drake_navbench.typed_files.dotted_names import flattened

CONTROLLER = "controller"
# The controllers' parameters for the largest speed ahead.
SPEEDS = ("vx_max", "max_linear_vel", "max_vel_x", "v_linear_max", "desired_linear_vel")
# Nav2's robot_radius where a file gives no outline, m.
DEFAULT_RADIUS_M = 0.1
COSTMAPS = {"local_costmap": LOCAL_COSTMAP, "global_costmap": GLOBAL_COSTMAP}
SHIM = "rotation_shim"
# Kinds of controllers as suspects name them.
KINDS = {SHIM: "shim", "teb_upstream": "teb", "external": "external"}
# The controller's name of a file whose controllers are all unknown here.
NO_PLUGIN = "no controller"
# The check's remarks on the release of a file that is older than all known releases.
WORDS_OF_OLDER = frozenset(told_by(mark) for mark in (*BEFORE_HUMBLE, OLD_NODE))
# Older names of parameters.
ALIASES = {"desired_linear_vel": "max_linear_vel"}


@dataclass(frozen=True)
class Facts:
    """The resolved parameters of a file, of a controller in it, and of the robot.

    kinds: of the controller: 'mppi', or 'shim' and 'rpp' of a shim before RPP. values: by place.
    given: places whose values are in the file. defaults: of the controller's model, by place.
    unread: names in the file that the release does not read, with the remark of the check. nodes:
    base names of all nodes in the file. told: places that a user calls 'low', 'high'
    or 'missing' without a number. plugin: the controller's name in the file. is_whole: whether the
    file is a whole one, so that what is missing in it is missing on the robot.
    unreadable: places that the release does not read. doubts: parameters whose values are probably
    mistakes, with what Nav2 makes of them, from the check. mark: how the release was found.
    others: further controllers in the file, by their names. left_out: a line for each thing in the
    file that could not be read. raw: all values of the file by node and parameter as the file
    spells them, 'local_costmap.obstacle_layer.scan.topic', also those that are refused. base_mps:
    the speed ahead that the robot's own file gives; 0 where it gives none.
    """

    kinds: tuple[str, ...]
    release: Release = NEWEST_RELEASE
    values: Mapping[str, Any] = field(default_factory=dict)
    given: frozenset[str] = frozenset()
    defaults: Mapping[str, Any] = field(default_factory=dict)
    unread: Mapping[str, str] = field(default_factory=dict)
    nodes: frozenset[str] = frozenset()
    told: Mapping[str, str] = field(default_factory=dict)
    robot: Robot | None = None
    plugin: str = ""
    is_whole: bool = False
    unreadable: frozenset[str] = frozenset()
    doubts: Mapping[str, str] = field(default_factory=dict)
    mark: str = ""
    others: tuple[str, ...] = ()
    left_out: tuple[str, ...] = ()
    raw: Mapping[str, Any] = field(default_factory=dict)
    base_mps: float = 0.0

    def __getitem__(self, place: str) -> Any:
        """Returns the value of a place; None where the file and its models have none."""
        return self.values.get(place)

    def number(self, place: str, default: float = 0.0) -> float:
        """Returns the value of a place as a number, the default where it is none."""
        value = self.values.get(place)
        if isinstance(value, bool) or not isinstance(value, int | float):
            return default
        return float(value)

    def axis(self, place: str, index: int) -> float | None:
        """Returns one entry of a list of numbers; None where there is none."""
        value = self.values.get(place)
        if not isinstance(value, list | tuple) or index >= len(value):
            return None
        return float(value[index])

    def is_kind(self, *kinds: str) -> bool:
        """Tells whether the controller is of one of these kinds."""
        return any(kind in self.kinds for kind in kinds)

    def has_node(self, name: str) -> bool:
        """Tells whether the file has a section for a node."""
        return name in self.nodes

    def matching(self, place: str) -> list[str]:
        """Returns the places that match one with `*`, which stands for any names."""
        if "*" not in place:
            return [place]
        start, _, end = place.partition("*")
        return [name for name in self.values if name.startswith(start) and name.endswith(end)]

    def controller(self, name: str) -> Any:
        """Returns a parameter of the controller; None where it has none."""
        return self.values.get(f"{CONTROLLER}.{name}")

    @property
    def is_told(self) -> bool:
        """Whether a user has named the given values one by one, without a file."""
        return not self.plugin

    @property
    def speed_mps(self) -> float:
        """The largest speed ahead that the controller commands; 0 where it is not known.

        DWB keeps max_speed_xy, too, unless it is negative.
        """
        limit = self.number(f"{CONTROLLER}.max_speed_xy")
        return min(self.asked_mps, limit) if limit > 0.0 else self.asked_mps

    @property
    def asked_mps(self) -> float:
        """The controller's own limit of the speed ahead; 0 where it is not known."""
        return self.number(self.speed_place)

    @property
    def speed_place(self) -> str:
        """The place of the largest speed ahead; '' where it is not known."""
        places = (f"{CONTROLLER}.{name}" for name in SPEEDS)
        return next((p for p in places if isinstance(self[p], int | float)), "")

    @property
    def period_s(self) -> float:
        """The controller server's period, s."""
        return 1.0 / max(self.number("controller_server.controller_frequency", 20.0), 0.1)

    @property
    def inscribed_radius_m(self) -> float:
        """The radius of the circle within the outline that Nav2 takes, m; 0 if not known."""
        return self._radii_m[0]

    @property
    def circumscribed_radius_m(self) -> float:
        """The radius of the circle around the outline that Nav2 takes, m; 0 if not known."""
        return self._radii_m[1]

    @property
    def has_outline(self) -> bool:
        """Whether the file gives the local costmap an outline that Nav2 can read."""
        if "local_costmap.robot_radius" in self.given:
            return True
        return "local_costmap.footprint" in self.given and is_footprint(
            self["local_costmap.footprint"]
        )

    @property
    def _radii_m(self) -> tuple[float, float]:
        if self.is_whole and not self.has_outline:
            return DEFAULT_RADIUS_M, DEFAULT_RADIUS_M
        return self.robot.radii if self.robot is not None else (0.0, 0.0)


def kinds_of(preset: Preset) -> tuple[str, ...]:
    """Returns the kinds of a column's controller, the shim before the controller that drives."""
    if preset.controller != SHIM:
        return (KINDS.get(preset.controller, preset.controller),)
    primary = preset.parameters.model_dump(mode="json")["primary_controller"]["plugin"]
    return "shim", KINDS.get(primary, primary)


def facts_of(setup: Nav2Setup, preset: Preset | None) -> Facts:
    """Returns the facts of a column of a Nav2 file; None: of no controller that is known here."""
    values = dict(_navigation_values(setup.robot))
    values |= {} if preset is None else dict(controller_values(preset))
    given: set[str] = set()
    plugin = setup.places[preset.name][1] if preset is not None else NO_PLUGIN
    names = Names(plugin, _blocks_of_checkers(setup))
    nodes = {name.rpartition("/")[2] for name, _ in setup.given}
    rows = setup.check.of(Status.UNREAD)
    nobodys = {(row.node, row.parameter) for row in rows}
    unreadable = unreadable_by(preset) if preset is not None else frozenset()
    for (owner, parameter), value in setup.given.items():
        place = names.place_of(owner.rpartition("/")[2], parameter, setup)
        # A costmap whose name stands there once is no node, and nothing reads its parameters.
        is_no_node = owner in COSTMAPS and (owner, "") in nobodys
        if place is None or is_no_node:
            continue
        given.add(place)
        if place not in values and (owner, parameter) in nobodys:
            unreadable |= {place}
        # The reader spells every plugin as from Jazzy on.
        is_spelled = place.endswith(".plugin") and isinstance(value, str)
        if place not in values or place.partition(".")[0] in COSTMAPS or is_spelled:
            values[place] = value
    unread = {row.place: row.remark for row in rows}
    return Facts(
        kinds_of(preset) if preset is not None else (),
        release_in(setup),
        values,
        frozenset(given),
        defaults_of(preset) if preset is not None else {},
        unread,
        frozenset(nodes),
        {"release": "old"} if _mark_in(setup) in WORDS_OF_OLDER else {},
        setup.robot,
        plugin,
        SERVER in nodes and "local_costmap" in nodes,
        unreadable,
        {row.place: row.remark for row in setup.check.of(Status.DOUBTFUL)},
        _mark_in(setup),
        tuple(name for name, other in setup.controllers.items() if other is not preset),
        raw={raw_name(owner, name): value for (owner, name), value in setup.given.items()},
    )


def raw_name(node: str, parameter: str) -> str:
    """Returns a parameter's name with that of its node, without namespaces."""
    return f"{node.rpartition('/')[2]}.{parameter}"


def controller_values(preset: Preset) -> Iterator[tuple[str, Any]]:
    """Yields the parameters of a controller as its release reads them, by place."""
    for name, value in flattened(preset.parameters.as_read().model_dump(mode="json")):
        bare = name.removeprefix("primary_controller.")
        if name != "primary_controller.plugin":
            yield f"{CONTROLLER}.{bare}", value


def unreadable_by(preset: Preset) -> frozenset[str]:
    """Returns the places of a controller's parameters that its release does not read."""
    parameters = preset.parameters
    release = getattr(parameters, "nav2_release", NEWEST_RELEASE)
    models = [type(parameters)]
    if preset.controller == SHIM:
        models.append(type(parameters.primary_controller.parameters))  # type: ignore[attr-defined]
    return frozenset(
        place
        for place, _ in controller_values(preset)
        if not all(model.is_read(place.partition(".")[2], release) for model in models)
    )


def defaults_of(preset: Preset) -> dict[str, Any]:
    """Returns the defaults of a controller's own parameters, by place."""
    fields = type(preset.parameters).model_fields
    return {
        f"{CONTROLLER}.{name}": entry.get_default()
        for name, entry in fields.items()
        if not entry.is_required()
    }


def _navigation_values(robot: Robot) -> Iterator[tuple[str, Any]]:
    navigation = robot.navigation.model_dump(mode="json")
    for costmap in COSTMAPS:
        block = navigation[costmap]
        active = (*block.get("plugins", ()), *block.get("filters", ()))
        navigation[costmap] = {
            name: value
            for name, value in block.items()
            if name in active or not isinstance(value, dict)
        }
    # A source's parameter prevails over its layer's of the same name: it is the one to change.
    for name, value in sorted(flattened(navigation), key=lambda entry: entry[0].count(".")):
        yield shortened(name), value


def shortened(place: str) -> str:
    """Returns the place of a costmap's parameter without its layer.

    `local_costmap.inflation_layer.inflation_radius` is `local_costmap.inflation_radius`.
    """
    first, _, rest = place.partition(".")
    if first in COSTMAPS and "." in rest:
        return f"{first}.{rest.rpartition('.')[2]}"
    return place


@dataclass(frozen=True)
class Names:
    """The file's names of its controller and its checkers."""

    plugin: str
    checkers: Mapping[str, str]

    def place_of(self, node: str, parameter: str, setup: Nav2Setup) -> str | None:
        """Returns the place of a node's parameter; None of a layer that is not listed."""
        block, _, rest = parameter.partition(".")
        place = f"{node}.{parameter}"
        if node == SERVER and block == self.plugin and rest:
            bare = rest.removeprefix("primary_controller.")
            return f"{CONTROLLER}.{ALIASES.get(bare, bare)}"
        if node == SERVER and block in self.checkers and rest:
            return f"{self.checkers[block]}.{rest}"
        if node == "collision_monitor" and rest and block in _listed(setup, node, "polygons"):
            return f"{node}.polygons.{parameter}"
        if node == "planner_server":
            return f"planner.{rest or parameter}"
        if node in COSTMAPS and rest:
            listed = (*_listed(setup, node, "plugins"), *_listed(setup, node, "filters"))
            return shortened(place) if block in listed else None
        return shortened(place)


def release_in(setup: Nav2Setup) -> Release:
    """Returns the release of Nav2 that a file was read for."""
    found = (row.parameter for row in setup.check.rows if row.node == "nav2_release")
    return Release(next(found, NEWEST_RELEASE))


def _mark_in(setup: Nav2Setup) -> str:
    found = (row.remark for row in setup.check.rows if row.node == "nav2_release")
    return next(found, "")


def _listed(setup: Nav2Setup, node: str, parameter: str) -> Sequence[Any]:
    for (owner, name), value in setup.given.items():
        if owner.rpartition("/")[2] == node and name == parameter:
            return value if isinstance(value, list) else [value]
    return ()


def _blocks_of_checkers(setup: Nav2Setup) -> dict[str, str]:
    """Returns the place of each checker of the controller server, by the name of its block."""
    found: dict[str, str] = {}
    for kind in ("goal_checker", "progress_checker"):
        listed = _listed(setup, SERVER, f"{kind}_plugins") or _listed(
            setup, SERVER, f"{kind}_plugin"
        )
        found |= {str(name): kind for name in listed[:1] or [kind]}
    return found
