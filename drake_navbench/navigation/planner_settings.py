"""The global planner in a robot file: chosen by Nav2's plugin type, with its parameters."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_navbench.navigation.navfn_planner import NavfnPlanner
from drake_navbench.navigation.planner import Planner
from drake_navbench.navigation.plugin_choice import plugin_choice
from drake_navbench.navigation.smac_planner_2d import SmacPlanner2D
from drake_navbench.navigation.theta_star_planner import ThetaStarPlanner

PLANNERS: Mapping[str, Any] = MappingProxyType(
    {planner.nav2_plugin: planner for planner in (SmacPlanner2D, NavfnPlanner, ThetaStarPlanner)}
)
"""The planners by Nav2's plugin type."""

PlannerSettings = plugin_choice(PLANNERS, SmacPlanner2D.nav2_plugin)
"""Parameters of a planner; without `plugin`, of the SmacPlanner2D."""


def make_planner(settings: Any, *, footprint: NDArray[np.float64] | None) -> Planner:
    """Returns the planner that settings choose.

    footprint: (K, 2) padded, base frame, m; None where the robot is given by a radius.
    """
    return PLANNERS[settings.plugin](settings, footprint)
