"""The settings of a robot's navigation stack: Nav2's servers, one block each."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

from pydantic import (
    Field,
    SerializerFunctionWrapHandler,
    model_serializer,
    model_validator,
)

from drake_navbench.errors import nearest_name_hint
from drake_navbench.navigation.behavior import BehaviorServerParameters
from drake_navbench.navigation.behavior_tree.settings import (
    RECOVERY_ACTIONS,
    BehaviorTreeSettings,
)
from drake_navbench.navigation.checker_settings import (
    GoalCheckerSettings,
    ProgressCheckerSettings,
)
from drake_navbench.navigation.costmaps.costmap_settings import (
    GlobalCostmapSettings,
    LocalCostmapSettings,
)
from drake_navbench.navigation.goal_checkers import SimpleGoalCheckerParameters
from drake_navbench.navigation.monitor_shapes import CollisionMonitorParameters
from drake_navbench.navigation.path_handler import PathHandlerParameters
from drake_navbench.navigation.planner_settings import PlannerSettings
from drake_navbench.navigation.progress_checkers import SimpleProgressCheckerParameters
from drake_navbench.navigation.smac_planner_2d_parameters import SmacPlanner2DParameters
from drake_navbench.navigation.smoother_parameters import SimpleSmootherParameters
from drake_navbench.navigation.smoother_settings import SmootherSettings
from drake_navbench.navigation.velocity_smoother import VelocitySmootherParameters
from drake_navbench.navigation.waypoint_follower import WaypointFollowerParameters
from drake_navbench.plugins.releases import NEWEST_RELEASE, ReadBy, Release, before, since, until
from drake_navbench.typed_files.quantities import (
    AngularSpeed,
    Duration,
    Frequency,
    Speed,
)
from drake_navbench.typed_files.typed_yaml import FrozenModel
from drake_navbench.typed_files.usual_values import Usual, not_negative

# A failure tolerance, s.
PATIENT_FOR_EVER = -1.0


class ControllerServerSettings(FrozenModel):
    """Nav2's controller server."""

    READ_BY: ClassVar[Mapping[str, ReadBy]] = {
        # This default counts also where the file has no controller server, see `navigation_of`.
        "costmap_update_timeout": since(Release.JAZZY, before(Release.JAZZY, 0.0)),
        "path_handler_plugins": since(Release.LYRICAL),
        "progress_checker_plugin": until(Release.IRON),
        "progress_checker_plugins": since(Release.IRON),
    }

    nav2_release: Release = Field(
        NEWEST_RELEASE,
        description="Nav2 release whose order of a cycle applies: Jazzy and Lyrical test the goal "
        "first, the others after progress and command.",
    )
    controller_frequency: Frequency = Field(20.0, description="Rate of the control cycles [Hz].")
    failure_tolerance: Annotated[
        Duration, Usual("as 0, a failed cycle ends the task", 0.0, others=(PATIENT_FOR_EVER,))
    ] = Field(
        0.0,
        description="Time for which failing control cycles are tolerated [s]; 0: none, -1: "
        "for ever.",
    )
    costmap_update_timeout: Annotated[Duration, not_negative("as 0")] = Field(
        0.30,
        description="Time for which the controller waits for a current costmap [s]; 0: up to Iron "
        "wait for ever, Jazzy and Kilted give up at once, Lyrical drives on with an "
        "old one.",
    )
    min_x_velocity_threshold: Annotated[Speed, not_negative("no velocity counts as 0")] = Field(
        0.0001, description="Measured |v| below which the velocity counts as 0 [m/s]."
    )
    min_y_velocity_threshold: Annotated[Speed, not_negative("no velocity counts as 0")] = Field(
        0.0001, description="Measured |vy| below which the velocity counts as 0 [m/s]."
    )
    min_theta_velocity_threshold: Annotated[
        AngularSpeed, not_negative("no velocity counts as 0")
    ] = Field(0.0001, description="Measured |w| below which the turn rate counts as 0 [rad/s].")

    @model_serializer(mode="wrap")
    def _as_plain(self, plain: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leaves out the release, and a field for bases that move sideways, if not given."""
        values: dict[str, Any] = plain(self)
        for name in ("min_y_velocity_threshold", "nav2_release"):
            if name not in self.model_fields_set:
                values.pop(name, None)
        return values

    @property
    def longest_wait_s(self) -> float:
        """The longest time without a current costmap, s; infinite where it has no end."""
        is_endless = self.costmap_update_timeout <= 0.0 and self.nav2_release < Release.JAZZY
        return math.inf if is_endless else self.costmap_update_timeout

    @property
    def takes_old_costmaps(self) -> bool:
        """Whether a cycle does not wait for a current costmap."""
        return self.costmap_update_timeout <= 0.0 and self.nav2_release >= Release.LYRICAL

    @property
    def tests_goal_first(self) -> bool:
        """Whether a cycle at the goal ends without a command."""
        return self.nav2_release in (Release.JAZZY, Release.LYRICAL)


class NavigationSettings(FrozenModel):
    """The settings of the navigation stack around the controller, under Nav2's names."""

    controller_server: ControllerServerSettings = Field(default_factory=ControllerServerSettings)
    path_handler: PathHandlerParameters = Field(default_factory=PathHandlerParameters)
    goal_checker: GoalCheckerSettings = Field(default_factory=SimpleGoalCheckerParameters)
    progress_checker: ProgressCheckerSettings = Field(
        default_factory=SimpleProgressCheckerParameters
    )
    local_costmap: LocalCostmapSettings = Field(default_factory=LocalCostmapSettings)
    global_costmap: GlobalCostmapSettings = Field(default_factory=GlobalCostmapSettings)
    planner: PlannerSettings = Field(default_factory=SmacPlanner2DParameters)
    smoother: SmootherSettings = Field(
        default_factory=SimpleSmootherParameters,
        description="Smoother of a behaviour tree's SmoothPath node; the default trees have none.",
    )
    behavior_tree: BehaviorTreeSettings = Field(default_factory=BehaviorTreeSettings)
    behavior_server: BehaviorServerParameters = Field(default_factory=BehaviorServerParameters)
    waypoint_follower: WaypointFollowerParameters = Field(
        default_factory=WaypointFollowerParameters
    )
    velocity_smoother: VelocitySmootherParameters | None = Field(
        None, description="Velocity smoother, which limits every command; null: none."
    )
    collision_monitor: CollisionMonitorParameters | None = Field(
        None,
        description="Collision monitor, which checks every command against the sensors; null: "
        "none.",
    )

    @model_validator(mode="after")
    def _check_recovery_actions(self) -> NavigationSettings:
        nodes, behaviors = self.behavior_tree.plugin_blocks, self.behavior_server.plugin_blocks
        for name in nodes:
            if name in behaviors:
                raise ValueError(
                    f"behavior_tree.{name}: found a behaviour of this name in behavior_server as "
                    "well, expected one of the two"
                )
        known = (*RECOVERY_ACTIONS, *nodes, *behaviors)
        for name in self.behavior_tree.recovery_actions:
            if name not in known:
                raise ValueError(
                    f"behavior_tree.recovery_actions: unknown behaviour {name!r}"
                    f"{nearest_name_hint(name, known)}"
                )
        return self
