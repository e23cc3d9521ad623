"""Which trials run code that is not ours: plugins, by entry point like our own, or in files."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from drake_navbench.controller import CONTROLLERS
from drake_navbench.inputs.presets import Preset
from drake_navbench.inputs.robot import Robot
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.inputs.scenario_plan import GridPlan
from drake_navbench.navigation.behavior import BEHAVIORS
from drake_navbench.navigation.behavior_tree.settings import TREE_NODES
from drake_navbench.navigation.costmaps.layer_plugin import COSTMAP_LAYERS
from drake_navbench.navigation.goal_checkers import GOAL_CHECKERS
from drake_navbench.navigation.planner_settings import PLANNERS
from drake_navbench.navigation.progress_checkers import PROGRESS_CHECKERS
from drake_navbench.navigation.smoother_settings import SMOOTHERS
from drake_navbench.plugins.kinds import Origin, PluginKind, foreign_plugins

# The kinds of plugins that a robot and a scenario name.
KINDS = (
    PLANNERS,
    SMOOTHERS,
    COSTMAP_LAYERS,
    GOAL_CHECKERS,
    PROGRESS_CHECKERS,
    BEHAVIORS,
    TREE_NODES,
)
# The groups of plugins that no parameter of a column names: those above, and metrics, which run
# after trials.
NAMED_ELSEWHERE = {*(kind.group for kind in KINDS), "drake_navbench.metrics"}

# The number of digits of a file's digest, which stands in place of a version.
DIGEST_LENGTH = 12


def runs_foreign_code(preset: Preset) -> bool:
    """Returns whether a column's controller, or a plugin of its parameters, is third-party code."""
    return bool(_origins_of_column(preset))


def has_foreign_plugins(scenario: Scenario, robot: Robot) -> bool:
    """Returns whether anything that a scenario or a robot names is not ours."""
    return any(kind.origin(name) for kind, name in plugins_of(scenario, robot))


def foreign_code(preset: Preset, scenario: Scenario, robot: Robot) -> dict[str, Origin]:
    """Returns the origins of all third-party code in a trial, by kind and name."""
    origins = _origins_of_column(preset)
    for kind, name in plugins_of(scenario, robot):
        origin = kind.origin(name)
        if origin is not None:
            origins[f"{kind.noun} {name}"] = origin
    return origins


def plugins_of(scenario: Scenario, robot: Robot) -> Iterator[tuple[PluginKind, str]]:
    """Yields the kind and the name of every plugin that a scenario or a robot names."""
    navigation = robot.navigation
    yield PLANNERS, navigation.planner.plugin
    yield GOAL_CHECKERS, navigation.goal_checker.plugin
    yield PROGRESS_CHECKERS, navigation.progress_checker.plugin
    for settings in (
        navigation.local_costmap,
        navigation.global_costmap,
        navigation.behavior_server,
        navigation.behavior_tree,
    ):
        for block in settings.plugin_blocks.values():
            yield settings.PLUGINS, block.plugin
    if isinstance(scenario.plan, GridPlan) and scenario.plan.smoother is not None:
        yield SMOOTHERS, scenario.plan.smoother.plugin


def _origins_of_column(preset: Preset) -> dict[str, Origin]:
    """Returns the origins of third-party controllers and of plugins that their parameters name."""
    foreign: dict[str, tuple[str, Origin]] = {
        name: (_noun(group), origin)
        for group, name, origin in foreign_plugins()
        if group not in NAMED_ELSEWHERE
    }
    file = preset.file
    origin = CONTROLLERS.origin(preset.controller)
    if file is not None:
        origin = Origin(file.path.name, file.sha256[:DIGEST_LENGTH])
    origins = {} if origin is None else {f"{CONTROLLERS.noun} {preset.controller}": origin}
    if not foreign:
        return origins
    for text in _texts(preset.parameters.model_dump(mode="json")):
        if text in foreign:
            noun, found = foreign[text]
            origins[f"{noun} {text}"] = found
    return origins


def _noun(group: str) -> str:
    """Returns the noun for a group's plugins, such as 'mppi critic' for '...mppi_critics'."""
    return group.rpartition(".")[2].replace("_", " ").removesuffix("s")


def _texts(value: Any) -> Iterator[str]:
    """Yields every text in a nest of mappings and lists, keys included."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, Mapping):
        for key, entry in value.items():
            yield str(key)
            yield from _texts(entry)
    elif isinstance(value, list | tuple):
        for entry in value:
            yield from _texts(entry)
