"""Goal and progress checkers in a robot file: chosen by Nav2's plugin type, with its parameters."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Union

from pydantic import BaseModel, BeforeValidator, Discriminator, Tag

from drake_navbench.errors import nearest_name_hint
from drake_navbench.navigation.goal_checkers import GOAL_CHECKERS, GoalChecker, SimpleGoalChecker
from drake_navbench.navigation.progress_checkers import PROGRESS_CHECKERS, SimpleProgressChecker


def _choice(checkers: Mapping[str, Any], default: str) -> Any:
    """Returns the type of a field that holds one checker's parameters, told apart by `plugin`."""

    def plugin_of(data: Any) -> Any:
        if isinstance(data, Mapping):
            return data.get("plugin", default)
        return getattr(data, "plugin", default)

    def check_plugin(data: Any) -> Any:
        plugin = plugin_of(data)
        if plugin not in checkers:
            raise ValueError(f"unknown plugin {plugin!r}{nearest_name_hint(plugin, checkers)}")
        return data

    tagged = [Annotated[checker.Parameters, Tag(plugin)] for plugin, checker in checkers.items()]
    union = Union[tuple(tagged)]  # noqa: UP007
    return Annotated[union, Discriminator(plugin_of), BeforeValidator(check_plugin)]


GoalCheckerSettings = _choice(GOAL_CHECKERS, SimpleGoalChecker.nav2_plugin)
"""Parameters of a goal checker; without `plugin`, of the SimpleGoalChecker."""
ProgressCheckerSettings = _choice(PROGRESS_CHECKERS, SimpleProgressChecker.nav2_plugin)
"""Parameters of a progress checker; without `plugin`, of the SimpleProgressChecker."""


def make_goal_checker(settings: BaseModel) -> GoalChecker:
    """Returns the goal checker that settings choose."""
    return GOAL_CHECKERS[settings.plugin](settings)


def make_progress_checker(settings: BaseModel) -> SimpleProgressChecker:
    """Returns the progress checker that settings choose."""
    return PROGRESS_CHECKERS[settings.plugin](settings)
