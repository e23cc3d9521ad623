"""MPPI's parameters under Nav2's names, nested by critic; the polish is ours."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any, ClassVar, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from drake_navbench.controller import AskedSpeeds, ControllerParameters
from drake_navbench.quantities import (
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
)
from drake_navbench.typed_yaml import tuples_for_lists, unknown_field

MOTION_MODEL_PLUGINS = {
    "mppi::DiffDriveMotionModel": "DiffDrive",
    "mppi::OmniMotionModel": "Omni",
    "mppi::AckermannMotionModel": "Ackermann",
}
DEFAULT_MOTION_MODEL = "diff_drive"
DEFAULT_MOTION_MODEL_PLUGIN = "mppi::DiffDriveMotionModel"
DEFAULT_VALIDATOR = "mppi::DefaultOptimalTrajectoryValidator"
# The cubic B-spline of the polish needs as many knots as its order.
MIN_KNOT_COUNT = 4
MIN_TIME_STEPS = 2
MAX_DELAY_S = 10.0
# Of the horizons of all samples together; ten arrays of it take 0.8 GB.
MAX_BATCH_CELLS = 10_000_000


class Block(BaseModel):
    """Base of the nested blocks: unknown names refused, frozen."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class CriticBlock(Block):
    """What every critic has."""

    enabled: bool = Field(True, description="whether the critic scores at all")
    cost_power: Count = Field(1, ge=1, description="power of the weighted term")


class ConstraintParameters(CriticBlock):
    """ConstraintCritic."""

    cost_weight: Number = Field(4.0, description="weight of the excess velocity [1/m]")


class GoalParameters(CriticBlock):
    """GoalCritic."""

    cost_weight: Number = Field(5.0, description="weight of the mean goal distance [1/m]")
    threshold_to_consider: Length = Field(1.4, ge=0, description="longest plan it acts on [m]")


class GoalAngleParameters(CriticBlock):
    """GoalAngleCritic."""

    cost_weight: Number = Field(3.0, description="weight of the mean yaw error [1/rad]")
    threshold_to_consider: Length = Field(0.5, ge=0, description="longest plan it acts on [m]")
    symmetric_yaw_tolerance: bool = Field(False, description="also accept the reversed goal yaw")


class PreferForwardParameters(CriticBlock):
    """PreferForwardCritic."""

    cost_weight: Number = Field(5.0, description="weight of the distance in reverse [1/m]")
    threshold_to_consider: Length = Field(0.5, ge=0, description="shortest plan it acts on [m]")


class TwirlingParameters(CriticBlock):
    """TwirlingCritic."""

    cost_weight: Number = Field(10.0, description="weight of the mean turn rate [s/rad]")


class VelocityDeadbandParameters(CriticBlock):
    """VelocityDeadbandCritic."""

    cost_weight: Number = Field(35.0, description="weight of the deadband shortfall [1/m]")
    deadband_velocities: tuple[float, float, float] = Field(
        (0.0, 0.0, 0.0), description="least usable |vx|, |vy|, |wz| [m/s, m/s, rad/s]"
    )


class CostParameters(CriticBlock):
    """CostCritic."""

    cost_weight: Number = Field(3.81, description="weight of the mean cell cost [1]")
    critical_cost: Number = Field(300.0, description="score of a near-collision column [1]")
    near_collision_cost: int = Field(253, ge=0, le=255, description="cell cost that is one [1]")
    collision_cost: Number = Field(1e6, description="score of a colliding sample [1]")
    consider_footprint: bool = Field(False, description="check the outline, not the centre alone")
    near_goal_distance: Length = Field(0.5, ge=0, description="plan length without cell costs [m]")
    trajectory_point_step: Count = Field(2, ge=1, description="columns from one check to the next")
    inflation_layer_name: str = Field("", description="kept for Nav2's files; there is one layer")


class ObstaclesParameters(CriticBlock):
    """ObstaclesCritic."""

    repulsion_weight: Number = Field(1.5, description="weight of the inflation shortfall [1/m]")
    critical_weight: Number = Field(20.0, description="weight of the margin shortfall [1/m]")
    collision_cost: Number = Field(1e5, description="margin shortfall of a colliding sample [m]")
    collision_margin_distance: Length = Field(0.10, ge=0, description="distance to keep [m]")
    near_goal_distance: Length = Field(0.5, ge=0, description="plan length without repulsion [m]")
    consider_footprint: bool = Field(False, description="check the outline, not the centre alone")
    inflation_layer_name: str = Field("", description="kept for Nav2's files; there is one layer")


class PathAlignParameters(CriticBlock):
    """PathAlignCritic."""

    cost_weight: Number = Field(10.0, description="weight of the mean path distance [1/m]")
    max_path_occupancy_ratio: Number = Field(
        0.07, ge=0, description="share of occupied path points that turns it off [1]"
    )
    offset_from_furthest: Count = Field(20, ge=0, description="least furthest path point [index]")
    trajectory_point_step: Count = Field(4, ge=1, description="columns from one check to the next")
    threshold_to_consider: Length = Field(0.5, ge=0, description="shortest plan it acts on [m]")
    use_path_orientations: bool = Field(False, description="add the yaw error to the distance")


class PathFollowParameters(CriticBlock):
    """PathFollowCritic."""

    cost_weight: Number = Field(5.0, description="weight of the carrot distance [1/m]")
    offset_from_furthest: Count = Field(6, ge=0, description="carrot ahead of furthest [index]")
    threshold_to_consider: Length = Field(1.4, ge=0, description="shortest plan it acts on [m]")


class PathAngleParameters(CriticBlock):
    """PathAngleCritic."""

    cost_weight: Number = Field(2.2, description="weight of the angle to the carrot [1/rad]")
    offset_from_furthest: Count = Field(4, ge=0, description="carrot ahead of furthest [index]")
    threshold_to_consider: Length = Field(0.5, ge=0, description="shortest plan it acts on [m]")
    max_angle_to_furthest: Angle = Field(0.785398, ge=0, description="least angle to act on [rad]")
    mode: Literal[0, 1, 2] = Field(
        0, description="0 forward preference, 1 none, 2 by the path's own orientations"
    )


class AckermannParameters(Block):
    """What the Ackermann motion model adds."""

    min_turning_r: Length = Field(0.2, ge=0, description="least turning radius; 0: no limit [m]")


class ValidatorParameters(Block):
    """TrajectoryValidator: the last check of the averaged trajectory."""

    plugin: Literal["mppi::DefaultOptimalTrajectoryValidator"] = Field(
        DEFAULT_VALIDATOR, description="the only validator there is"
    )
    collision_lookahead_time: Duration = Field(2.0, ge=0, description="time checked [s]")
    consider_footprint: bool = Field(False, description="check the outline, not the centre alone")


class VisualizerParameters(Block):
    """TrajectoryVisualizer: accepted from Nav2's files, of no effect on the command."""

    trajectory_step: Count = Field(5, ge=1, description="every how many samples are kept to draw")
    time_step: Count = Field(3, ge=1, description="every how many columns Nav2 draws")


class PolishParameters(Block):
    """The nonlinear program that refines the sampled sequence. Not part of Nav2."""

    enabled: bool = Field(False, description="whether to refine; Nav2 does not")
    knot_count: Count = Field(8, ge=MIN_KNOT_COUNT, description="B-spline knots each for v and w")
    max_iterations: Count = Field(5, ge=1, description="IPOPT's iteration limit")
    carrot_offset: Count = Field(5, ge=0, description="carrot ahead of the sampled end [index]")
    path_weight: Number = Field(20.0, ge=0, description="of the mean squared path distance [1/m^2]")
    heading_weight: Number = Field(2.0, ge=0, description="of the mean of 1 - cos(yaw error) [1]")
    obstacle_weight: Number = Field(2.0, ge=0, description="of the mean squared cell cost [1]")
    progress_weight: Number = Field(2.0, ge=0, description="of the end's carrot distance [1/m]")
    deviation_weight: Number = Field(
        0.5, ge=0, description="of the mean squared deviation over the sampling variance [1]"
    )
    jerk_weight: Number = Field(0.2, ge=0, description="of the mean squared jerk [s^6/m^2]")
    angular_jerk_weight: Number = Field(
        0.002, ge=0, description="of the mean squared angular jerk [s^6/rad^2]"
    )


def _resolve_motion_model(raw: dict[str, Any]) -> None:
    """Replaces Nav2's `motion_model: name` and its block `name: {plugin: ...}` by the model."""
    name = raw.get("motion_model", DEFAULT_MOTION_MODEL)
    if not isinstance(name, str):
        return
    if not isinstance(raw.get(name), Mapping):
        if name == DEFAULT_MOTION_MODEL:
            raw["motion_model"] = MOTION_MODEL_PLUGINS[DEFAULT_MOTION_MODEL_PLUGIN]
        elif name not in MOTION_MODEL_PLUGINS.values():
            known = ", ".join(MOTION_MODEL_PLUGINS.values())
            raise ValueError(
                f"motion_model: found {name!r}, expected one of {known}, or a block of that name"
            )
        return
    block = raw.pop(name)
    plugin = block.get("plugin")
    if not isinstance(plugin, str) or plugin not in MOTION_MODEL_PLUGINS:
        known = ", ".join(MOTION_MODEL_PLUGINS)
        raise ValueError(f"{name}.plugin: found {plugin!r}, expected one of {known}")
    raw["motion_model"] = MOTION_MODEL_PLUGINS[plugin]
    values = {key: value for key, value in block.items() if key != "plugin"}
    if raw["motion_model"] == "Ackermann":
        raw["AckermannConstraints"] = values
    elif values:
        hint = f"unknown field: {raw['motion_model']} has no parameters"
        faults = [unknown_field(hint, (name, key), value) for key, value in values.items()]
        raise ValidationError.from_exception_data("motion model", faults)


def _listed_critics(values: Mapping[str, Any]) -> list[str]:
    """Returns the names in `critics`, as far as they are names."""
    critics = values.get("critics")
    critics = critics if isinstance(critics, list | tuple) else ()
    return [name for name in critics if isinstance(name, str)]


class MppiParameters(ControllerParameters):
    """Parameters of Nav2's MPPI (branch lyrical), with its defaults, and of the polish.

    `AckermannConstraints` is where releases before Lyrical had what is now in the block that
    `motion_model` names.
    """

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
    PATH_HANDLER_NAMES: ClassVar[frozenset[str]] = frozenset(
        {
            "prune_distance",
            "max_robot_pose_search_dist",
            "enforce_path_inversion",
            "inversion_xy_tolerance",
            "inversion_yaw_tolerance",
        }
    )

    time_steps: Count = Field(
        56, ge=MIN_TIME_STEPS, le=10_000, description="columns of the horizon"
    )
    model_dt: Period = Field(0.05, description="step of the horizon [s]")
    batch_size: Count = Field(1000, ge=1, le=1_000_000, description="sampled trajectories")
    iteration_count: Count = Field(1, ge=1, description="optimisation passes a cycle")
    temperature: Number = Field(0.3, gt=0, description="softmax temperature [1]")
    gamma: Number = Field(0.015, ge=0, description="factor of the control cost [1]")
    vx_max: Speed = Field(0.5, description="largest forward velocity [m/s]")
    vx_min: Speed = Field(-0.35, description="smallest (reverse) velocity [m/s]")
    vy_max: Speed = Field(0.5, ge=0, description="largest sideways velocity [m/s]")
    wz_max: AngularSpeed = Field(1.9, ge=0, description="largest turn rate [rad/s]")
    ax_max: Acceleration = Field(
        3.0, description="largest acceleration along x, made positive [m/s^2]"
    )
    ax_min: Acceleration = Field(-3.0, description="largest deceleration, made negative [m/s^2]")
    ay_max: Acceleration = Field(
        3.0, description="largest acceleration along y, made positive [m/s^2]"
    )
    ay_min: Acceleration = Field(-3.0, description="largest deceleration, made negative [m/s^2]")
    az_max: AngularAcceleration = Field(3.5, description="largest angular acceleration [rad/s^2]")
    vx_std: Speed = Field(0.2, gt=0, description="sampling deviation of vx [m/s]")
    vy_std: Speed = Field(0.2, ge=0, description="sampling deviation of vy [m/s]")
    wz_std: AngularSpeed = Field(0.4, ge=0, description="sampling deviation of wz [rad/s]")
    model_delay_vx: Duration = Field(
        0.0, ge=0, le=MAX_DELAY_S, description="actuation delay of vx [s]"
    )
    model_delay_vy: Duration = Field(
        0.0, ge=0, le=MAX_DELAY_S, description="actuation delay of vy [s]"
    )
    model_delay_wz: Duration = Field(
        0.0, ge=0, le=MAX_DELAY_S, description="actuation delay of wz [s]"
    )
    clamp_raw_controls: bool = Field(False, description="average rate-limited, not raw, samples")
    open_loop: bool = Field(False, description="start from the last command, not the measurement")
    sgf_order: Count = Field(2, description="degree of the smoothing filter, 1 or 2 (else 2)")
    retry_attempt_limit: Count = Field(1, ge=0, description="new attempts after a failed one")
    regenerate_noises: bool = Field(False, description="new noise every pass, not one for all")
    motion_model: Literal["DiffDrive", "Omni", "Ackermann"] = Field(
        "DiffDrive", description="motion model, or the name of a block that gives its plugin"
    )
    critics: tuple[str, ...] = Field((), description="critics in the order of scoring")
    visualize: bool = Field(False, description="output only, of no effect here")
    publish_optimal_trajectory: bool = Field(False, description="output only, of no effect here")
    publish_critics_stats: bool = Field(False, description="output only, of no effect here")
    critic_index_to_visualize: Count = Field(0, description="output only, of no effect here")

    AckermannConstraints: AckermannParameters = AckermannParameters()
    TrajectoryValidator: ValidatorParameters = ValidatorParameters()
    TrajectoryVisualizer: VisualizerParameters = VisualizerParameters()
    ConstraintCritic: ConstraintParameters = ConstraintParameters()
    CostCritic: CostParameters = CostParameters()
    GoalCritic: GoalParameters = GoalParameters()
    GoalAngleCritic: GoalAngleParameters = GoalAngleParameters()
    ObstaclesCritic: ObstaclesParameters = ObstaclesParameters()
    PathAlignCritic: PathAlignParameters = PathAlignParameters()
    PathAngleCritic: PathAngleParameters = PathAngleParameters()
    PathFollowCritic: PathFollowParameters = PathFollowParameters()
    PreferForwardCritic: PreferForwardParameters = PreferForwardParameters()
    TwirlingCritic: TwirlingParameters = TwirlingParameters()
    VelocityDeadbandCritic: VelocityDeadbandParameters = VelocityDeadbandParameters()
    user_critics: dict[str, dict[str, Any]] = Field(
        default_factory=dict, description="parameter blocks of critics found by entry point"
    )
    polish: PolishParameters = PolishParameters()

    def asked_speeds(self) -> AskedSpeeds:
        """Returns the limits of its samples."""
        return AskedSpeeds(self.vx_max, self.vx_min, self.wz_max)

    @classmethod
    def keys_not_read(cls, values: Mapping[str, Any]) -> list[str]:
        """Returns blocks of critics that are not listed, and another motion model's parameters."""
        listed = _listed_critics(values)
        not_read = {
            name
            for name, field in cls.model_fields.items()
            if isinstance(field.default, CriticBlock) and name not in listed
        }
        name = values.get("motion_model")
        if name != "Ackermann" or name in values:
            not_read.add("AckermannConstraints")
        return [name for name in values if name in not_read]

    @model_validator(mode="before")
    @classmethod
    def _from_nav2(cls, raw: Any) -> Any:
        """Accepts the block of a motion model, and blocks of users' critics."""
        if not isinstance(raw, Mapping):
            return raw
        raw = dict(raw)
        _resolve_motion_model(raw)
        users = raw.pop("user_critics", {})
        for name in _listed_critics(raw):
            if name not in cls.model_fields and name in raw:
                users = {**users, name: raw.pop(name)}
        return {**tuples_for_lists(raw), "user_critics": users}

    @model_validator(mode="after")
    def _check_together(self) -> MppiParameters:
        if self.vx_min > self.vx_max:
            raise ValueError(f"vx_min: found {self.vx_min}, expected at most vx_max {self.vx_max}")
        if self.batch_size * self.time_steps > MAX_BATCH_CELLS:
            raise ValueError(
                f"batch_size: found {self.batch_size} of {self.time_steps} time_steps each, "
                f"expected a product of at most {MAX_BATCH_CELLS}"
            )
        doubled = [name for name, count in Counter(self.critics).items() if count > 1]
        if doubled:
            raise ValueError(f"critics: found {sorted(doubled)} twice, expected each name once")
        if self.polish.enabled and self.motion_model == "Omni":
            raise ValueError("polish.enabled: found true, expected false with motion_model Omni")
        if self.polish.enabled and self.polish.knot_count > self.time_steps:
            raise ValueError(
                f"polish.knot_count: found {self.polish.knot_count}, expected at most time_steps "
                f"{self.time_steps}"
            )
        return self
