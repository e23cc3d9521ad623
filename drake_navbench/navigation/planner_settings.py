"""The global planner in a robot file: chosen by Nav2's plugin type, with its parameters."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from drake_navbench.navigation.costmaps.built_in_layers import InflationLayerParameters
from drake_navbench.navigation.navfn_planner import NavfnPlanner
from drake_navbench.navigation.planner import Planner
from drake_navbench.navigation.smac_planner_2d import SmacPlanner2D
from drake_navbench.navigation.smac_planner_hybrid import SmacPlannerHybrid
from drake_navbench.navigation.straight_line_planner import StraightLine
from drake_navbench.navigation.theta_star_planner import ThetaStarPlanner
from drake_navbench.plugins.choice import plugin_choice
from drake_navbench.plugins.kinds import PluginKind
from drake_navbench.plugins.parameters import PluginParameters

PLANNERS = PluginKind(
    noun="planner",
    group="drake_navbench.planners",
    members=("Parameters", "plan"),
    guide="docs/plugins.md",
    parameters=PluginParameters,
    built_in={
        planner.nav2_plugin: planner
        for planner in (
            SmacPlanner2D,
            NavfnPlanner,
            ThetaStarPlanner,
            SmacPlannerHybrid,
            StraightLine,
        )
    },
)
"""The planners by Nav2's plugin type."""

PlannerSettings = plugin_choice(PLANNERS, SmacPlanner2D.nav2_plugin)
"""Parameters of a planner; without `plugin`, of the SmacPlanner2D."""


def make_planner(
    settings: Any,
    *,
    footprint: NDArray[np.float64] | None,
    inflation: InflationLayerParameters | None = None,
) -> Planner:
    """Returns the planner that settings choose; raises InputError where it cannot be made.

    footprint: (K, 2) padded, base frame, m; None where the robot is given by a radius. inflation:
    the inflation layer of the costmaps that it will plan on, where it is known.
    """
    planner = PLANNERS.make(settings.plugin, settings, footprint)
    if isinstance(planner, SmacPlannerHybrid) and inflation is not None:
        return planner.with_inflation(inflation)
    return planner
