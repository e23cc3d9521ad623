"""DWB's parameters: Nav2's names, types and defaults; one nested block a critic."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar, Self

import numpy as np
from pydantic import Field, field_validator, model_validator

from drake_navbench.controller import AskedSpeeds
from drake_navbench.controllers.critic_parameters import CriticBlock, ParametersWithCritics
from drake_navbench.controllers.dwb.critics.parameters import CriticParameters
from drake_navbench.controllers.dwb.critics.registry import CRITICS, bare_name
from drake_navbench.errors import nearest_name_hint
from drake_navbench.plugins.kinds import PluginKind
from drake_navbench.plugins.releases import NEWEST_RELEASE, ReadBy, Release, until
from drake_navbench.typed_files.quantities import (
    Acceleration,
    Angle,
    AngularAcceleration,
    AngularSpeed,
    Count,
    Duration,
    Length,
    Speed,
    require_order,
)

STANDARD_GENERATOR = "dwb_plugins::StandardTrajectoryGenerator"
LIMITED_ACCEL_GENERATOR = "dwb_plugins::LimitedAccelGenerator"
GENERATORS = (STANDARD_GENERATOR, LIMITED_ACCEL_GENERATOR)
CLASS_KEY = "class"
# The parameters with which the controller itself cuts the plan, up to Kilted.
OF_ITS_OWN_PLAN = (
    "forward_prune_distance",
    "prune_distance",
    "prune_plan",
    "shorten_transformed_plan",
)
# The most poses of all trajectories of a cycle, which take 0.4 GB.
MAX_POSES = 10_000_000


class DynamicWindowApproachParameters(ParametersWithCritics):
    """All parameters of the controller's namespace in Nav2.

    A critic's parameters are a block under its name, `PathAlign: {scale: 32.0}`.
    """

    SLIDERS: ClassVar[Mapping[str, tuple[float, float]]] = {
        "max_vel_x": (0.05, 1.0),
        "max_vel_theta": (0.1, 3.0),
        "sim_time": (0.5, 4.0),
        "PathAlign.scale": (0.0, 128.0),
        "PathDist.scale": (0.0, 128.0),
        "GoalAlign.scale": (0.0, 128.0),
        "GoalDist.scale": (0.0, 128.0),
        "RotateToGoal.scale": (0.0, 128.0),
        "BaseObstacle.scale": (0.0, 1.0),
        "ObstacleFootprint.scale": (0.0, 1.0),
    }

    WITHOUT_EFFECT: ClassVar[frozenset[str]] = frozenset(
        {
            "debug_trajectory_details",
            "default_critic_namespaces",
            "marker_lifetime",
            "publish_cost_grid_pc",
            "publish_evaluation",
            "publish_global_plan",
            "publish_local_plan",
            "publish_trajectories",
            "publish_transformed_plan",
            "stateful",
            "transform_tolerance",
        }
    )

    READ_BY: ClassVar[Mapping[str, ReadBy]] = {
        "limit_vel_cmd_in_traj": ReadBy(frozenset(Release) - {Release.IRON}),
        **dict.fromkeys(OF_ITS_OWN_PLAN, until(Release.KILTED)),
    }

    CRITICS: ClassVar[PluginKind] = CRITICS
    CRITIC_BLOCK: ClassVar[type[CriticBlock]] = CriticParameters

    critics: tuple[str, ...] = Field(
        min_length=1, description="Names of the critics, in the order in which they score."
    )
    trajectory_generator_name: str = Field(
        STANDARD_GENERATOR,
        description="Generator of the velocity samples. StandardTrajectoryGenerator: "
        "velocities reachable within sim_time; LimitedAccelGenerator: within one "
        "control period.",
    )
    short_circuit_trajectory_evaluation: bool = Field(
        True,
        description="Stop scoring a trajectory as soon as it is worse than the best one so far.",
    )

    min_vel_x: Speed = Field(0.0, description="Lowest forward velocity; negative: backward [m/s].")
    max_vel_x: Speed = Field(0.0, description="Highest forward velocity [m/s].")
    min_vel_y: Speed = Field(0.0, description="Lowest lateral velocity [m/s].")
    max_vel_y: Speed = Field(0.0, description="Highest lateral velocity [m/s].")
    max_vel_theta: AngularSpeed = Field(
        0.0, ge=0.0, description="Highest yaw rate in either direction [rad/s]."
    )
    min_speed_xy: Speed = Field(
        0.0,
        description="Lowest planar speed of a sample that turns slower than min_speed_theta; "
        "negative: none [m/s].",
    )
    max_speed_xy: Speed = Field(0.0, description="Highest planar speed; negative: no limit [m/s].")
    min_speed_theta: AngularSpeed = Field(
        0.0,
        description="Lowest yaw rate of a sample that drives slower than min_speed_xy; "
        "negative: none [rad/s].",
    )
    acc_lim_x: Acceleration = Field(0.0, ge=0.0, description="Forward acceleration limit [m/s^2].")
    acc_lim_y: Acceleration = Field(0.0, ge=0.0, description="Lateral acceleration limit [m/s^2].")
    acc_lim_theta: AngularAcceleration = Field(
        0.0, ge=0.0, description="Yaw acceleration limit [rad/s^2]."
    )
    decel_lim_x: Acceleration = Field(
        0.0, le=0.0, description="Forward deceleration limit [m/s^2]."
    )
    decel_lim_y: Acceleration = Field(
        0.0, le=0.0, description="Lateral deceleration limit [m/s^2]."
    )
    decel_lim_theta: AngularAcceleration = Field(
        0.0, le=0.0, description="Yaw deceleration limit [rad/s^2]."
    )

    vx_samples: Count = Field(
        20, description="Number of forward velocities that are sampled; 1 or less counts as 2."
    )
    vy_samples: Count = Field(
        5, description="Number of lateral velocities that are sampled; 1 or less counts as 2."
    )
    vtheta_samples: Count = Field(
        20, description="Number of yaw rates that are sampled; 1 or less counts as 2."
    )
    sim_period: Duration | None = Field(
        None,
        gt=0.0,
        description="LimitedAccelGenerator: time in which a sample must be reachable; null: "
        "the control period [s].",
    )

    sim_time: Duration = Field(
        1.7, gt=0.0, le=1000.0, description="Duration of a simulated trajectory [s]."
    )
    discretize_by_time: bool = Field(
        False,
        description="Divide trajectories into steps of time_granularity, not by distance and turn.",
    )
    time_granularity: Duration = Field(0.5, ge=0.001, description="Longest time step [s].")
    linear_granularity: Length = Field(0.5, ge=0.001, description="Longest distance of a step [m].")
    angular_granularity: Angle = Field(0.025, ge=0.001, description="Largest turn of a step [rad].")
    include_last_point: bool = Field(
        True, description="Append the end pose to each trajectory once more."
    )
    limit_vel_cmd_in_traj: bool = Field(
        False,
        description="Command the first velocity of the simulated trajectory, not the sampled one.",
    )

    xy_goal_tolerance: Length = Field(
        0.25, ge=0.0, description="RotateToGoal: distance to the goal at which turning begins [m]."
    )
    trans_stopped_velocity: Speed = Field(
        0.25, ge=0.0, description="RotateToGoal: a speed below this counts as stopped [m/s]."
    )

    nav2_release: Release = Field(NEWEST_RELEASE, description="Nav2 release whose rules apply.")
    prune_plan: bool = Field(
        True, description="Up to Kilted: drop passed poses that are farther than prune_distance."
    )
    prune_distance: Length = Field(
        2.0,
        ge=0.0,
        description="Up to Kilted: distance behind the robot at which the local plan begins [m].",
    )
    forward_prune_distance: Length = Field(
        2.0,
        description="Up to Kilted: distance ahead at which the local plan ends; negative: the "
        "costmap's edge [m].",
    )
    shorten_transformed_plan: bool = Field(
        True, description="Up to Kilted: apply forward_prune_distance."
    )

    debug_trajectory_details: bool = Field(
        False,
        description="Nav2: log the reasons of illegal trajectories. Here the error always "
        "counts them.",
    )
    default_critic_namespaces: tuple[str, ...] = Field(
        (),
        description="Nav2: where critic classes are looked up. No effect: critics are found "
        "by entry point.",
    )
    publish_evaluation: bool = Field(True, description="Topic output in Nav2; no effect here.")
    publish_local_plan: bool = Field(True, description="Topic output in Nav2; no effect here.")
    publish_trajectories: bool = Field(True, description="Topic output in Nav2; no effect here.")
    publish_transformed_plan: bool = Field(
        True, description="Parameter of older Nav2; no effect here."
    )
    publish_global_plan: bool = Field(True, description="Parameter of older Nav2; no effect here.")
    publish_cost_grid_pc: bool = Field(False, description="Topic output in Nav2; no effect here.")
    marker_lifetime: Duration = Field(0.1, description="Topic output in Nav2; no effect here [s].")
    stateful: bool = Field(True, description="Parameter of older Nav2; no effect here.")
    transform_tolerance: Duration = Field(
        0.1, description="Parameter of older Nav2; no effect here [s]."
    )

    def asked_speeds(self) -> AskedSpeeds:
        """Returns the limits of the velocity samples, which max_speed_xy bounds, too."""
        most = self.max_speed_xy if self.max_speed_xy > 0.0 else math.inf
        lateral = min(max(abs(self.min_vel_y), abs(self.max_vel_y)), most)
        return AskedSpeeds(
            min(self.max_vel_x, most),
            max(self.min_vel_x, -most),
            self.max_vel_theta,
            lateral,
            self.acc_lim_x,
            self.acc_lim_theta,
        )

    @property
    def cuts_plan(self) -> bool:
        """Whether the controller cuts the plan itself, as Nav2's does up to Kilted."""
        return self.nav2_release != NEWEST_RELEASE

    @property
    def speed_tolerance(self) -> float:
        """The tolerance of `Kinematics`: that of float32 since Jazzy, larger before."""
        is_old = self.nav2_release in (Release.HUMBLE, Release.IRON)
        return 1e-5 if is_old else float(np.finfo(np.float32).eps)

    @property
    def is_patient(self) -> bool:
        """Whether the server's patience applies to an empty plan, as to every error in Humble."""
        return self.nav2_release is Release.HUMBLE

    @property
    def compares_plain_headings(self) -> bool:
        """Whether headings are compared unwrapped: 2 pi counts as a turn, as up to Kilted."""
        return self.nav2_release != NEWEST_RELEASE

    @property
    def uses_standard_generator(self) -> bool:
        """Whether the window spans sim_time and roll-outs obey the acceleration limits."""
        return self.trajectory_generator_name == STANDARD_GENERATOR

    @classmethod
    def registered_name(cls, name: str, block: Any = None) -> str:
        """Returns the name of the critic that a block, by its `class` or its name, is for."""
        class_name = block.get(CLASS_KEY) if isinstance(block, Mapping) else None
        return bare_name(class_name if isinstance(class_name, str) else name)

    @field_validator("trajectory_generator_name")
    @classmethod
    def _check_generator(cls, name: str) -> str:
        for known in GENERATORS:
            if name in (known, known.rpartition("::")[2]):
                return known
        hint = nearest_name_hint(name, GENERATORS)
        raise ValueError(f"got {name!r}, expected a trajectory generator{hint}")

    @model_validator(mode="after")
    def _check_ranges(self) -> Self:
        for axis in ("x", "y"):
            require_order(self, f"min_vel_{axis}", f"max_vel_{axis}")
        if self._most_poses > MAX_POSES:
            raise ValueError(
                f"vx_samples, vtheta_samples, sim_time and granularities: a cycle would roll out "
                f"{self._most_poses:.3g} poses, expected at most {MAX_POSES:.3g}"
            )
        return self

    @property
    def _most_poses(self) -> float:
        """The poses of all trajectories of a cycle, where every twist is within the limits."""
        samples = float(max(2, self.vx_samples) * max(2, self.vtheta_samples))
        if self.max_vel_y > self.min_vel_y:
            samples *= max(2, self.vy_samples)
        if self.discretize_by_time:
            return samples * self.sim_time / self.time_granularity
        fastest = math.hypot(
            max(abs(self.min_vel_x), abs(self.max_vel_x)),
            max(abs(self.min_vel_y), abs(self.max_vel_y)),
        )
        step_rate = max(
            fastest / self.linear_granularity, self.max_vel_theta / self.angular_granularity
        )
        return samples * max(1.0, self.sim_time * step_rate)
