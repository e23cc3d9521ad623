"""Reads the controller server of a Nav2 file, without its controllers, into a robot's settings.

Missing parameters have Nav2's defaults. Source: nav2_controller.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from drake_navbench.inputs.check import Status
from drake_navbench.inputs.navigation_settings import ControllerServerSettings
from drake_navbench.nav2.node_reader import NodeReader
from drake_navbench.navigation.goal_checkers import GOAL_CHECKERS, SimpleGoalChecker
from drake_navbench.navigation.path_handler import PathHandlerParameters
from drake_navbench.navigation.progress_checkers import PROGRESS_CHECKERS, SimpleProgressChecker
from drake_navbench.plugins.kinds import PluginKind
from drake_navbench.plugins.releases import RELEASE_FIELD

Fields = dict[str, Any]

PATH_HANDLER = "nav2_controller::FeasiblePathHandler"
# The name that Nav2's default behaviour tree asks for if there are several goal checkers.
DEFAULT_GOAL_CHECKER = "general_goal_checker"
# The lists that Nav2 has by default, and for which alone it knows the types.
ONLY_GOAL_CHECKER, ONLY_PROGRESS_CHECKER = ["goal_checker"], ["progress_checker"]
PATH_HANDLERS = "path_handler_plugins"


def read_controller_server(reader: NodeReader, controllers: Collection[str]) -> Fields:
    """Returns controller server, checkers and path handler; controllers: blocks read elsewhere."""
    names = [field for field in ControllerServerSettings.model_fields if field != RELEASE_FIELD]
    fields: Fields = {
        "controller_server": reader.block(ControllerServerSettings, names=names)
        | {RELEASE_FIELD: str(reader.release)},
        "goal_checker": _goal_checker(reader),
        "progress_checker": _progress_checker(reader),
    }
    if reader.gives(ControllerServerSettings, PATH_HANDLERS, PATH_HANDLERS):
        fields["path_handler"] = _path_handler(reader)
    reader.value("controller_plugins")
    idle = {"odom_duration", "publish_zero_velocity", "search_window", "speed_limit_topic"}
    reader.finish({*controllers, *idle})
    return fields


def _goal_checker(reader: NodeReader) -> Fields:
    names = reader.names("goal_checker_plugins", ONLY_GOAL_CHECKER)
    if not names:
        raise reader.fault("goal_checker_plugins", "expected at least one name")
    name = DEFAULT_GOAL_CHECKER if DEFAULT_GOAL_CHECKER in names else names[0]
    for other in names:
        if other != name:
            remark = f"not used, as in the default tree {name} checks every goal"
            reader.note_block(Status.NO_MEANING, other, remark)
    default = SimpleGoalChecker.nav2_plugin if names == ONLY_GOAL_CHECKER else None
    plugin_type = reader.plugin_type(name, default, "goal_checker_plugins")
    return _checker(reader, name, GOAL_CHECKERS, SimpleGoalChecker, plugin_type)


def _progress_checker(reader: NodeReader) -> Fields:
    listed_in, single = "progress_checker_plugins", "progress_checker_plugin"
    is_listed = reader.gives(ControllerServerSettings, listed_in, listed_in)
    if reader.gives(ControllerServerSettings, single, single):
        # Humble has this parameter only; in Iron it prevails.
        if is_listed:
            reader.note(Status.UNREAD, listed_in, f"{single} prevails")
        listed_in, is_listed = single, True
    names = reader.names(listed_in, []) if is_listed else ONLY_PROGRESS_CHECKER
    if not names:
        raise reader.fault(listed_in, "expected at least one name")
    for other in names[1:]:
        remark = f"not used, as in the default tree {names[0]} checks progress"
        reader.note_block(Status.NO_MEANING, other, remark)
    default = SimpleProgressChecker.nav2_plugin if names == ONLY_PROGRESS_CHECKER else None
    plugin_type = reader.plugin_type(names[0], default, listed_in)
    return _checker(reader, names[0], PROGRESS_CHECKERS, SimpleProgressChecker, plugin_type)


def _checker(
    reader: NodeReader, name: str, known: PluginKind, simple: Any, plugin_type: str
) -> Fields:
    if plugin_type not in known:
        remark = f"{plugin_type}: {simple.nav2_plugin} is used instead"
        reader.note(Status.STAND_IN, f"{name}.plugin", remark)
        plugin_type = simple.nav2_plugin
    return plugin_block(reader, name, known, plugin_type)


def _path_handler(reader: NodeReader) -> Fields:
    names = reader.names(PATH_HANDLERS, ["PathHandler"])
    for other in names[1:]:
        reader.note_block(Status.NO_MEANING, other, f"{names[0]} handles every path")
    if not names:
        return {}
    plugin_type = reader.plugin_type(names[0], PATH_HANDLER, PATH_HANDLERS)
    if plugin_type != PATH_HANDLER:
        remark = f"{plugin_type}: {PATH_HANDLER} is used instead"
        reader.note(Status.STAND_IN, f"{names[0]}.plugin", remark)
    return reader.block(PathHandlerParameters, f"{names[0]}.")


def plugin_block(reader: NodeReader, name: str, kind: PluginKind, plugin_type: str) -> Fields:
    """Returns the block of a plugin of another package."""
    model = kind.load(plugin_type).Parameters
    names = [field for field in model.model_fields if field != "plugin"]
    return {"plugin": plugin_type, **reader.block(model, f"{name}.", names=names)}
