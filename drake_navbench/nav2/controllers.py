"""Makes presets from the controller_server of a Nav2 file, one for each controller plugin.

A parameter that the controller does not know is left out, and the user is told: Nav2, too, ignores
parameters that no plugin declares. Every other parameter reaches the controller or is refused.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from drake_navbench.controller import CONTROLLERS, ControllerParameters
from drake_navbench.errors import InputError, InputWarning
from drake_navbench.inputs.presets import (
    Nav2Plugin,
    Preset,
    installed_controllers,
    load_preset_file,
)
from drake_navbench.nav2.node_reader import similar_plugin_hint
from drake_navbench.nav2.parameters import (
    PARAMETERS_KEY,
    Node,
    Section,
    nodes_called,
    read_parameter_file,
)
from drake_navbench.nav2.release import release_of, told_by
from drake_navbench.nav2.substitutions import missing_value
from drake_navbench.plugins.releases import RELEASE_FIELD
from drake_navbench.typed_files.dotted_names import SEPARATOR, flattened, nested
from drake_navbench.typed_files.typed_yaml import read_yaml, unknown_fields

SERVER = "controller_server"
PLUGINS = "controller_plugins"
# Where Dashing and Eloquent, the releases of 2019, had the names and the types of controllers.
LISTS_OF_2019 = ("controller_plugin_ids", "controller_plugin_types")
# The plugins that Nav2 loads where the file names none.
DEFAULT_PLUGINS = ["FollowPath"]
DEFAULT_TYPE = "dwb_core::DWBLocalPlanner"
# Only releases whose controller server cuts the plan have this parameter (from Lyrical on).
PATH_HANDLERS = "path_handler_plugins"
# Our controllers by Nav2's plugin type, which each names as `nav2_plugin`.
OUR_CONTROLLERS: Mapping[str, str] = {
    "dwb_core::DWBLocalPlanner": "dwb",
    "nav2_graceful_controller::GracefulController": "graceful",
    "nav2_mppi_controller::MPPIController": "mppi",
    "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController": "rpp",
    "nav2_rotation_shim_controller::RotationShimController": "rotation_shim",
    "teb_local_planner::TebLocalPlannerROS": "teb",
    "vector_pursuit_controller::VectorPursuitController": "vector_pursuit",
}


class NoCounterpart(InputError):
    """Raised for a controller plugin of a Nav2 file that has no counterpart here.

    hint: names the plugin that may be meant, "; did you mean ...?"; may be ''.
    """

    def __init__(self, message: str, hint: str = "") -> None:
        super().__init__(message)
        self.hint = hint


def controller_presets(
    sections: Iterable[Section], path: Path, release: str | None = None
) -> list[Preset]:
    """Returns a preset for each plugin of each controller server in a file.

    release: Nav2's; by default the one that the file's own marks tell. Raises InputError where
    there is no controller server, a plugin has no counterpart here, or a value is wrong.
    """
    sections = list(sections)
    servers = [node for node in nodes_called(SERVER, sections) if has_controllers(node)]
    if not servers:
        others = ", ".join(dict.fromkeys(section.name.lstrip("/") for section in sections))
        raise InputError(
            f"{path}: no parameters of a {SERVER} with {PLUGINS}; "
            f"it is a Nav2 parameter file of {others}"
        )
    found = release_of(sections, release)
    presets = [
        plugin_preset(server, plugin, found.release)
        for server in servers
        for plugin in listed_plugins(server)
    ]
    return [_with_release_told(preset, found.mark) for preset in presets]


def server_columns(server: Node, release: str) -> dict[str, Preset | NoCounterpart]:
    """Returns the column of each controller by its name in the file, or why it has none here.

    release: Nav2's, for controllers that follow a release. Raises InputError where a value is
    wrong.
    """
    for name, parameter in server.parameters.items():
        missing = missing_value(parameter.value)
        if missing is not None:
            raise InputError(
                f"{server.where(name)}: {missing} has no value; expected --set {missing}=value"
            )
    columns: dict[str, Preset | NoCounterpart] = {}
    for plugin in listed_plugins(server):
        try:
            columns[plugin] = plugin_preset(server, plugin, release)
        except NoCounterpart as error:
            columns[plugin] = error
    return columns


def why_without_column(columns: Mapping[str, Preset | NoCounterpart]) -> NoCounterpart | None:
    """Returns why none of a server's controllers exists here; None where one does.

    columns: as from `server_columns`.
    """
    faults = [column for column in columns.values() if isinstance(column, NoCounterpart)]
    return faults[0] if len(faults) == len(columns) > 0 else None


def _with_release_told(preset: Preset, mark: str) -> Preset:
    """Returns a preset whose remark names its release, if its controller follows one."""
    release = preset.values.get(RELEASE_FIELD)
    if release is None:
        return preset
    if RELEASE_FIELD in (preset.nav2_plugin.parameters if preset.nav2_plugin else ()):
        mark = RELEASE_FIELD
    return replace(preset, read_as=f"{release}, {told_by(mark)}")


def has_controllers(node: Node) -> bool:
    """Returns whether a controller server has any controllers."""
    return PLUGINS in node.parameters or any(node.below(plugin) for plugin in DEFAULT_PLUGINS)


def listed_plugins(server: Node) -> list[str]:
    """Returns the names of its controllers; raises InputError where one is listed twice.

    Nav2 reads nothing of the lists of 2019, and loads DWB without critics instead.
    """
    old = [name for name in LISTS_OF_2019 if name in server.parameters]
    if old and PLUGINS not in server.parameters:
        raise InputError(
            f"{server.where(old[0])}: is of 2019, before Foxy: no release from Humble on reads it; "
            f"expected {PLUGINS}: [FollowPath], and the type as FollowPath.plugin"
        )
    plugins = server.get(PLUGINS, DEFAULT_PLUGINS)
    if not isinstance(plugins, list) or not all(isinstance(name, str) for name in plugins):
        raise InputError(f"{server.where(PLUGINS)}: expected a list of names, got {plugins!r}")
    for name in plugins:
        if plugins.count(name) > 1:
            raise InputError(f"{server.where(PLUGINS)}: {name!r} is listed twice, expected once")
    return plugins


def takes_release(model: type[ControllerParameters]) -> bool:
    """Returns whether a controller follows the release of Nav2 that is given to it."""
    return RELEASE_FIELD in model.model_fields


def plugin_preset(server: Node, plugin: str, release: str | None = None) -> Preset:
    """Returns the preset of a plugin; its name is made from file, namespace and plugin.

    release: Nav2's, for a controller that follows a release where the file does not set it. Raises
    NoCounterpart where there is no controller of the type.
    """
    plugin_type = plugin_type_of(server, plugin)
    controller, model = _counterpart(plugin_type, server.where(f"{plugin}.plugin"))
    given = server.below(plugin)
    given.pop("plugin", None)
    for name in model.PLUGIN_NAMES:
        if isinstance(given.get(name), str):
            _counterpart(given[name], server.where(f"{plugin}.{name}"))
    whole = given if release is None else {RELEASE_FIELD: release} | given
    fields = {} if PATH_HANDLERS in server.parameters else model.path_handler_fields(whole)
    offered = {name: value for name, value in given.items() if name not in fields}
    source = server.where(plugin)
    if release is not None and takes_release(model):
        offered = {RELEASE_FIELD: release} | offered
    used = _known_values(model, offered, source)
    known = {name for name, _ in flattened(used)}
    namespace = server.name.removesuffix(SERVER).strip("/")
    preset = Preset(
        "/".join(filter(None, (server.file.stem, namespace, plugin))),
        controller,
        f"{plugin_type} from {server.file.name}",
        used,
        source,
        ignored=tuple(
            n
            for n in given
            if n not in fields and (n not in known or model.is_without_effect(n, whole))
        ),
        path_handler={field: given[name] for name, field in fields.items()},
        nav2_plugin=Nav2Plugin(plugin_type, given),
    )
    try:
        return preset.checked()
    except InputError as error:
        lines = (_at_its_line(line, server, plugin) for line in str(error).splitlines())
        raise InputError("\n".join(lines)) from error


def _at_its_line(fault: str, server: Node, plugin: str) -> str:
    """Returns a fault of a plugin's values with the line of the parameter that it names first.

    fault: 'FILE, line N: NODE.ros__parameters.FollowPath: FIELD: ...', with the plugin's line.
    """
    source = server.where(plugin)
    told = fault.removeprefix(f"{source}: ")
    named = (server.parameters.get(f"{plugin}.{word}") for word in re.findall(r"[\w.]*\w", told))
    found = next(filter(None, named), None)
    if found is None or told == fault:
        return fault
    place = source.partition(f": {server.name.lstrip('/')}.")[2]
    return f"{found.file}, line {found.line}: {server.name.lstrip('/')}.{place}: {told}"


def plugin_type_of(server: Node, plugin: str) -> str:
    """Returns the type of one of the server's controllers."""
    name = f"{plugin}.plugin"
    has_default = listed_plugins(server) == DEFAULT_PLUGINS and bool(server.below(plugin))
    plugin_type = server.get(name, DEFAULT_TYPE)
    if name not in server.parameters and not has_default:
        raise InputError(
            f"{server.where(plugin, PLUGINS)}: missing, but listed in {PLUGINS}; "
            "expected a mapping with a plugin type"
        )
    if not isinstance(plugin_type, str):
        raise InputError(f"{server.where(name)}: expected a plugin type, got {plugin_type!r}")
    return plugin_type


def _counterpart(plugin_type: str, where: str) -> tuple[str, type[ControllerParameters]]:
    """Returns name and parameter model of the controller that a plugin type selects."""
    ours = OUR_CONTROLLERS.get(plugin_type)
    if ours is not None and not any(map(CONTROLLERS.origin, CONTROLLERS.names)):
        # Asking every controller for its type takes half a second, as all must be imported.
        return ours, CONTROLLERS.load(ours).Parameters
    controllers = installed_controllers()
    by_type = {c.nav2_plugin: name for name, c in controllers.items() if c.nav2_plugin}
    if plugin_type not in by_type:
        advice = (
            "; name another controller in a further --nav2 file, or install one with "
            f"nav2_plugin = {plugin_type!r} (docs/controllers.md)"
        )
        hint = similar_plugin_hint(plugin_type, by_type)
        message = f"{where}: {plugin_type!r} has no counterpart here{hint or advice}"
        raise NoCounterpart(message, hint)
    name = by_type[plugin_type]
    return name, controllers[name].Parameters


def _known_values(
    model: type[ControllerParameters], values: Mapping[str, Any], source: str
) -> dict[str, Any]:
    """Returns, nested, the values that the model has fields for and Nav2 would read."""
    known = nested(values.items(), source)
    for name in model.keys_not_read(known):
        _remove(known, tuple(name.split(SEPARATOR)))
    # A model may only report an unknown name once others are gone.
    while any([_remove(known, place) for place in unknown_fields(model, known)]):
        pass
    return known


def _remove(values: Any, place: tuple[int | str, ...]) -> bool:
    """Removes a nested value; returns whether it existed."""
    *blocks, last = place
    for block in blocks:
        values = values.get(block)
        if not isinstance(values, dict):
            return False
    return values.pop(last, values) is not values


def load_parameter_file(path: Path, release: str | None = None) -> list[Preset]:
    """Returns the columns that a parameter file makes.

    The file is a preset file of ours or a Nav2 parameter file. In a Nav2 file every controller
    plugin of `controller_server` makes a column. It follows the given release of Nav2, else the one
    that the file's own marks tell. Warns of entries that Nav2 accepts although they are probably
    mistakes. Raises InputError.
    """
    file = read_parameter_file(path)
    if not file.sections:
        if SERVER in read_yaml(path):
            raise InputError(f"{path}: {SERVER}: expected a mapping with {PARAMETERS_KEY}")
        return [load_preset_file(path)]
    for remark in file.remarks:
        warnings.warn(remark, InputWarning, stacklevel=2)
    return controller_presets(file.sections, path, release)
