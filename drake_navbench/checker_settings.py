"""Goal and progress checkers in a robot file: chosen by Nav2's plugin type, with its parameters."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal, Union

from pydantic import BaseModel, BeforeValidator, Discriminator, Tag, create_model

from drake_navbench.errors import nearest_name_hint
from drake_navbench.goal_checkers import GOAL_CHECKERS, GoalChecker, SimpleGoalChecker
from drake_navbench.progress_checkers import PROGRESS_CHECKERS, SimpleProgressChecker


def _models(checkers: Mapping[str, Any]) -> dict[str, type[BaseModel]]:
    """Returns each checker's parameter model with a field `plugin` that names the checker."""
    return {
        plugin: create_model(
            f"{checker.__name__}Settings",
            __base__=checker.Parameters,
            plugin=(Literal[plugin], plugin),  # type: ignore[valid-type]
        )
        for plugin, checker in checkers.items()
    }


def _choice(models: Mapping[str, type[BaseModel]], default: str) -> Any:
    """Returns the type of a field that holds one of the models, told apart by `plugin`."""

    def plugin_of(data: Any) -> Any:
        if isinstance(data, Mapping):
            return data.get("plugin", default)
        return getattr(data, "plugin", default)

    def check_plugin(data: Any) -> Any:
        plugin = plugin_of(data)
        if plugin not in models:
            raise ValueError(f"unknown plugin {plugin!r}{nearest_name_hint(plugin, models)}")
        return data

    tagged = [Annotated[model, Tag(plugin)] for plugin, model in models.items()]
    union = Union[tuple(tagged)]  # noqa: UP007
    return Annotated[union, Discriminator(plugin_of), BeforeValidator(check_plugin)]


_GOAL_MODELS = _models(GOAL_CHECKERS)
_PROGRESS_MODELS = _models(PROGRESS_CHECKERS)

GoalCheckerSettings = _choice(_GOAL_MODELS, SimpleGoalChecker.nav2_plugin)
"""Parameters of a goal checker; without `plugin`, of the SimpleGoalChecker."""
ProgressCheckerSettings = _choice(_PROGRESS_MODELS, SimpleProgressChecker.nav2_plugin)
"""Parameters of a progress checker; without `plugin`, of the SimpleProgressChecker."""

default_goal_checker = _GOAL_MODELS[SimpleGoalChecker.nav2_plugin]
default_progress_checker = _PROGRESS_MODELS[SimpleProgressChecker.nav2_plugin]


def make_goal_checker(settings: BaseModel) -> GoalChecker:
    """Returns the goal checker that settings choose."""
    return GOAL_CHECKERS[settings.plugin](settings)


def make_progress_checker(settings: BaseModel) -> SimpleProgressChecker:
    """Returns the progress checker that settings choose."""
    return PROGRESS_CHECKERS[settings.plugin](settings)
