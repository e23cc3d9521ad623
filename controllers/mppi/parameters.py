"""MPPI's parameters under Nav2's names, one nested block a critic; the polish is ours."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from drake_navbench.controller import AskedSpeeds
from drake_navbench.controllers.critic_parameters import CriticBlock, ParametersWithCritics
from drake_navbench.controllers.mppi.critics.base import CriticParameters
from drake_navbench.controllers.mppi.critics.registry import CRITICS
from drake_navbench.controllers.mppi.parameter_blocks import (
    DEFAULT_MOTION_MODEL,
    DEFAULT_MOTION_MODEL_PLUGIN,
    MOTION_MODEL_PLUGINS,
    MOTION_MODEL_PLUGINS_SINCE,
    AckermannParameters,
    PolishParameters,
    ValidatorParameters,
    VisualizerParameters,
    resolve_motion_model,
)
from drake_navbench.plugins.kinds import PluginKind
from drake_navbench.plugins.releases import (
    NEWEST_RELEASE,
    ReadBy,
    Release,
    before,
    defaults_in,
    release_in,
    since,
    until,
)
from drake_navbench.typed_files.quantities import (
    Acceleration,
    Angle,
    AngularAcceleration,
    AngularSpeed,
    Count,
    Duration,
    Length,
    Number,
    Period,
    Speed,
    require_order,
)

MIN_TIME_STEPS = 2
MAX_DELAY_S = 10.0
# The most cells of all samples' horizons together; ten arrays of this size take 0.8 GB.
MAX_BATCH_CELLS = 10_000_000
# The parameters that the path handler reads since Lyrical; only `prune_distance` has another
# default there.
OF_OWN_PLAN = (
    "prune_distance",
    "max_robot_pose_search_dist",
    "enforce_path_inversion",
    "inversion_xy_tolerance",
    "inversion_yaw_tolerance",
)
# Jazzy and Lyrical read a parameter of this kind, Kilted does not.
JAZZY_AND_LYRICAL = ReadBy(frozenset({Release.JAZZY, Release.LYRICAL}))


class MppiParameters(ParametersWithCritics):
    """Parameters of Nav2's MPPI since Humble, with Lyrical's defaults, and of the polish.

    `AckermannConstraints` is the block of releases before Lyrical; Lyrical's is named by
    `motion_model`.
    """

    SLIDERS: ClassVar[Mapping[str, tuple[float, float]]] = {
        "vx_max": (0.05, 1.0),
        "wz_max": (0.1, 3.0),
        "temperature": (0.05, 2.0),
        "vx_std": (0.02, 0.6),
        "wz_std": (0.02, 1.2),
        "CostCritic.cost_weight": (0.0, 20.0),
        "ObstaclesCritic.repulsion_weight": (0.0, 10.0),
        "PathAlignCritic.cost_weight": (0.0, 40.0),
        "PathFollowCritic.cost_weight": (0.0, 40.0),
        "PathAngleCritic.cost_weight": (0.0, 20.0),
        "GoalCritic.cost_weight": (0.0, 20.0),
    }

    WITHOUT_EFFECT: ClassVar[frozenset[str]] = frozenset(
        {
            "visualize",
            "publish_optimal_trajectory",
            "publish_critics_stats",
            "critic_index_to_visualize",
            "TrajectoryVisualizer",
            "CostCritic.inflation_layer_name",
            "ObstaclesCritic.inflation_layer_name",
        }
    )
    PATH_HANDLER_NAMES: ClassVar[frozenset[str]] = frozenset(OF_OWN_PLAN)
    READ_WITH: ClassVar[Mapping[str, str]] = {"AckermannConstraints": "motion_model: Ackermann"}
    READ_BY: ClassVar[Mapping[str, ReadBy]] = {
        "ObstaclesCritic.inflation_layer_name": since(Release.IRON),
        "PathAngleCritic.mode": since(Release.IRON),
        "ax_max": since(Release.JAZZY),
        "ax_min": since(Release.JAZZY),
        "ay_max": since(Release.JAZZY),
        "ay_min": since(Release.JAZZY),
        "az_max": since(Release.JAZZY),
        "open_loop": JAZZY_AND_LYRICAL,
        # Before Jazzy: every column counts, and a collision is near from the inscribed cost on.
        "CostCritic.near_collision_cost": since(Release.JAZZY, before(Release.JAZZY, 253)),
        "CostCritic.trajectory_point_step": since(Release.JAZZY, before(Release.JAZZY, 1)),
        "GoalAngleCritic.symmetric_yaw_tolerance": ReadBy(frozenset(Release) - {Release.IRON}),
        "ObstaclesCritic.collision_cost": ReadBy(defaults=before(Release.JAZZY, 1e4)),
        "PathAngleCritic.cost_weight": ReadBy(defaults=before(Release.JAZZY, 2.0)),
        "PathAngleCritic.max_angle_to_furthest": ReadBy(defaults=before(Release.JAZZY, 1.2)),
        "publish_optimal_trajectory": since(Release.KILTED),
        "TrajectoryValidator": since(Release.LYRICAL),
        "clamp_raw_controls": since(Release.LYRICAL),
        "model_delay_vx": since(Release.LYRICAL),
        "model_delay_vy": since(Release.LYRICAL),
        "model_delay_wz": since(Release.LYRICAL),
        "publish_critics_stats": ReadBy(frozenset({Release.KILTED})),
        "critic_index_to_visualize": since(Release.LYRICAL),
        "sgf_order": since(Release.LYRICAL),
        "ObstaclesCritic.cost_scaling_factor": until(Release.HUMBLE),
        "ObstaclesCritic.inflation_radius": until(Release.HUMBLE),
        "PathAngleCritic.forward_preference": until(Release.HUMBLE),
        "reset_period": until(Release.HUMBLE),
        **dict.fromkeys(OF_OWN_PLAN, until(Release.KILTED)),
    }

    CRITICS: ClassVar[PluginKind] = CRITICS
    CRITIC_BLOCK: ClassVar[type[CriticBlock]] = CriticParameters

    time_steps: Count = Field(
        56, ge=MIN_TIME_STEPS, le=10_000, description="Number of steps of the horizon."
    )
    model_dt: Period = Field(0.05, description="Duration of a step of the horizon [s].")
    batch_size: Count = Field(
        1000, ge=1, le=1_000_000, description="Number of sampled trajectories."
    )
    iteration_count: Count = Field(
        1, ge=1, description="Number of optimisation passes in a control cycle."
    )
    temperature: Number = Field(
        0.3, gt=0, description="Temperature of the softmax over sample costs."
    )
    gamma: Number = Field(0.015, ge=0, description="Factor on the cost of the control effort.")
    vx_max: Speed = Field(0.5, description="Largest forward velocity [m/s].")
    vx_min: Speed = Field(-0.35, description="Smallest forward velocity; negative: reverse [m/s].")
    vy_max: Speed = Field(0.5, ge=0, description="Largest sideways velocity [m/s].")
    wz_max: AngularSpeed = Field(1.9, ge=0, description="Largest turn rate [rad/s].")
    ax_max: Acceleration = Field(
        3.0, description="Largest acceleration along x, made positive [m/s^2]."
    )
    ax_min: Acceleration = Field(
        -3.0, description="Largest deceleration along x, made negative [m/s^2]."
    )
    ay_max: Acceleration = Field(
        3.0, description="Largest acceleration along y, made positive [m/s^2]."
    )
    ay_min: Acceleration = Field(
        -3.0, description="Largest deceleration along y, made negative [m/s^2]."
    )
    az_max: AngularAcceleration = Field(3.5, description="Largest angular acceleration [rad/s^2].")
    vx_std: Speed = Field(0.2, gt=0, description="Standard deviation of the sampled vx [m/s].")
    vy_std: Speed = Field(0.2, ge=0, description="Standard deviation of the sampled vy [m/s].")
    wz_std: AngularSpeed = Field(
        0.4, ge=0, description="Standard deviation of the sampled wz [rad/s]."
    )
    model_delay_vx: Duration = Field(
        0.0, ge=0, le=MAX_DELAY_S, description="Delay from a command to the base's vx [s]."
    )
    model_delay_vy: Duration = Field(
        0.0, ge=0, le=MAX_DELAY_S, description="Delay from a command to the base's vy [s]."
    )
    model_delay_wz: Duration = Field(
        0.0, ge=0, le=MAX_DELAY_S, description="Delay from a command to the base's wz [s]."
    )
    reset_period: Duration = Field(
        1.0,
        description="In Humble: a longer pause between cycles resets the optimizer [s]; negative: "
        "every cycle does.",
    )
    clamp_raw_controls: bool = Field(
        False, description="Average the samples after limiting their accelerations, not before."
    )
    open_loop: bool = Field(
        False, description="Start samples from the last command, not from the measured velocity."
    )
    sgf_order: Count = Field(
        2, description="Degree of the smoothing filter: 1 or 2; any other number counts as 2."
    )
    retry_attempt_limit: Count = Field(
        1, ge=0, description="Number of retries after a failed optimisation."
    )
    regenerate_noises: bool = Field(
        False, description="Draw new noise in every pass, not once for the trial."
    )
    nav2_release: Release = Field(NEWEST_RELEASE, description="Nav2 release whose rules apply.")
    prune_distance: Length = Field(
        1.5, ge=0, description="Up to Kilted: arc length of the local plan [m]."
    )
    max_robot_pose_search_dist: Length | None = Field(
        None,
        description="Up to Kilted: arc length that is searched for the closest pose [m]; "
        "null: half the larger side of the local costmap.",
    )
    enforce_path_inversion: bool = Field(
        False, description="Up to Kilted: drive to each cusp of the plan before the part behind it."
    )
    inversion_xy_tolerance: Length = Field(
        0.2,
        ge=0,
        description="Up to Kilted: distance at which the robot has arrived at a cusp [m].",
    )
    inversion_yaw_tolerance: Angle = Field(
        0.4,
        ge=0,
        description="Up to Kilted: heading error at which the robot has arrived at a cusp [rad].",
    )
    motion_model: Literal["DiffDrive", "Omni", "Ackermann"] = Field(
        "DiffDrive",
        description="Motion model: DiffDrive, Omni or Ackermann, or the name of a block with "
        "its plugin.",
    )
    critics: tuple[str, ...] = Field(
        (), description="Names of the critics, in the order in which they score."
    )
    visualize: bool = Field(False, description="Topic output in Nav2; no effect here.")
    publish_optimal_trajectory: bool = Field(
        False, description="Topic output in Nav2; no effect here."
    )
    publish_critics_stats: bool = Field(False, description="Topic output in Nav2; no effect here.")
    critic_index_to_visualize: Count = Field(0, description="Topic output in Nav2; no effect here.")

    AckermannConstraints: AckermannParameters = AckermannParameters()
    TrajectoryValidator: ValidatorParameters = ValidatorParameters()
    TrajectoryVisualizer: VisualizerParameters = VisualizerParameters()
    polish: PolishParameters = PolishParameters()

    def asked_speeds(self) -> AskedSpeeds:
        """Returns the limits of the velocity samples."""
        lateral = self.vy_max if self.motion_model == "Omni" else 0.0
        limits = (self.ax_max, self.az_max) if self.is_read("ax_max", self.nav2_release) else ()
        return AskedSpeeds(self.vx_max, self.vx_min, self.wz_max, lateral, *limits)

    @classmethod
    def doubts(cls, values: Mapping[str, Any]) -> Mapping[str, str]:
        """See the base class; also limits in the wrong order, where Nav2 applies the upper one."""
        fields, doubts = cls.model_fields, super().doubts(values)
        least, most = (values.get(n, fields[n].default) for n in ("vx_min", "vx_max"))
        if not least > most:
            return doubts
        told = f"{least:g}, more than vx_max, {most:g}: the samples all have vx_max"
        return {**doubts, **{name: told for name in ("vx_min", "vx_max") if name in values}}

    def as_read(self) -> Self:
        """See the base class; also sets unread fields of the critics' blocks to their defaults."""
        blocks = {}
        defaults = defaults_in(type(self), self.nav2_release)
        for name in self.critics:
            block = self.critic(name)
            fields = type(block).model_fields
            unread = [f for f in fields if not self.is_read(f"{name}.{f}", self.nav2_release)]
            values = {field: fields[field].get_default() for field in unread}
            given = block.model_fields_set.difference(unread)
            older = {f: v for f in fields if (v := defaults.get(f"{name}.{f}")) is not None}
            values |= {field: value for field, value in older.items() if field not in given}
            blocks[name] = block.model_copy(update=values)
        return super().as_read().model_copy(update=blocks)

    def turns_in_place(self) -> bool:
        """Returns whether it may command a rotation without translation."""
        return self.motion_model != "Ackermann"

    @classmethod
    def registered_name(cls, name: str, block: Any = None) -> str:
        """Returns the name of a critic's block, which in MPPI is the critic's own name."""
        return name

    @classmethod
    def keys_not_read(cls, values: Mapping[str, Any]) -> list[str]:
        """Returns the blocks of critics that are not listed and of other motion models."""
        name = values.get("motion_model", DEFAULT_MOTION_MODEL)
        # Before Lyrical the named models have no blocks.
        has_block = name in list(values) and (
            name not in MOTION_MODEL_PLUGINS.values()
            or release_in(values) >= MOTION_MODEL_PLUGINS_SINCE
        )
        not_read = [key for key in super().keys_not_read(values) if key != name or not has_block]
        if "AckermannConstraints" in values and (name != "Ackermann" or has_block):
            not_read.append("AckermannConstraints")
        return not_read

    @classmethod
    def for_original(cls, values: Mapping[str, Any], release: str) -> dict[str, Any]:
        """Returns values with the motion model as a release names it: a plugin since Lyrical."""
        own = super().for_original(values, release)
        name = own.get("motion_model", DEFAULT_MOTION_MODEL)
        block = own.pop(name) if isinstance(own.get(name), Mapping) else None
        by_name = {short: plugin for plugin, short in MOTION_MODEL_PLUGINS.items()}
        plugin = by_name.get(name, DEFAULT_MOTION_MODEL_PLUGIN)
        block = {"plugin": plugin} | own.pop("AckermannConstraints", {}) | dict(block or {})
        if release < MOTION_MODEL_PLUGINS_SINCE:
            plugin = block.pop("plugin")
            own["motion_model"] = MOTION_MODEL_PLUGINS.get(plugin, plugin)
            return own | ({"AckermannConstraints": block} if block else {})
        return own | {"motion_model": name, name: block}

    @model_validator(mode="before")
    @classmethod
    def _read_motion_model(cls, raw: Any) -> Any:
        """Accepts a motion model's block, before the base class refuses all but critics."""
        if not isinstance(raw, Mapping):
            return raw
        raw = dict(raw)
        resolve_motion_model(raw)
        return raw

    @model_validator(mode="after")
    def _check_together(self) -> MppiParameters:
        if self.polish.enabled:
            require_order(self, "vx_min", "vx_max")
        if self.batch_size * self.time_steps > MAX_BATCH_CELLS:
            raise ValueError(
                f"batch_size: got {self.batch_size} of {self.time_steps} time_steps each, "
                f"expected a product of at most {MAX_BATCH_CELLS}"
            )
        doubled = [name for name, count in Counter(self.critics).items() if count > 1]
        if doubled:
            raise ValueError(f"critics: got {sorted(doubled)} twice, expected each name once")
        if self.polish.enabled and self.motion_model == "Omni":
            raise ValueError("polish.enabled: got true, expected false with motion_model Omni")
        if self.polish.enabled and self.polish.knot_count > self.time_steps:
            raise ValueError(
                f"polish.knot_count: got {self.polish.knot_count}, expected at most time_steps "
                f"{self.time_steps}"
            )
        return self
