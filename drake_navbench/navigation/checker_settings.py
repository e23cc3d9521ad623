"""Goal and progress checkers in a robot file: chosen by Nav2's plugin type, with its parameters."""

from __future__ import annotations

from typing import Any

from drake_navbench.navigation.goal_check import GoalChecker
from drake_navbench.navigation.goal_checkers import GOAL_CHECKERS, SimpleGoalChecker
from drake_navbench.navigation.progress_checkers import (
    PROGRESS_CHECKERS,
    ProgressChecker,
    SimpleProgressChecker,
)
from drake_navbench.plugins.choice import plugin_choice

GoalCheckerSettings = plugin_choice(GOAL_CHECKERS, SimpleGoalChecker.nav2_plugin)
"""Parameters of a goal checker; without `plugin`, of the SimpleGoalChecker."""
ProgressCheckerSettings = plugin_choice(PROGRESS_CHECKERS, SimpleProgressChecker.nav2_plugin)
"""Parameters of a progress checker; without `plugin`, of the SimpleProgressChecker."""


def make_goal_checker(settings: Any) -> GoalChecker:
    """Returns the goal checker that settings choose; raises InputError where it cannot be made."""
    return GOAL_CHECKERS.make(settings.plugin, settings)


def make_progress_checker(settings: Any) -> ProgressChecker:
    """Returns the progress checker that settings choose; raises InputError if it cannot be made."""
    return PROGRESS_CHECKERS.make(settings.plugin, settings)
