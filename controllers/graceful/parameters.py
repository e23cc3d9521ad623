"""The parameters of the Graceful Controller, under Nav2's names and with Nav2's defaults."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, ClassVar

from pydantic import ConfigDict, Field, model_serializer, model_validator

from drake_navbench.controller import (
    AskedSpeeds,
    ControllerParameters,
)
from drake_navbench.kernels.grid import INSCRIBED
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
    AngularSpeed,
    Length,
    Number,
    Speed,
)

LAMBDA = "lambda"
MIN_LOOKAHEAD = "min_lookahead"
# Since controllers do not cut the plan any more, the path handler has this parameter.
SEARCH_DISTANCE = "max_robot_pose_search_dist"


class GracefulParameters(ControllerParameters):
    """Parameters of nav2_graceful_controller, of all releases that have it.

    Nav2 drops `allow_backward` with a warning where `initial_rotation` is on, and so does this.
    `min_lookahead` is a parameter in Lyrical, too, but nothing reads it. In this model `lambda` is
    called `lambda_`.
    """

    SLIDERS: ClassVar[Mapping[str, tuple[float, float]]] = {
        "v_linear_max": (0.1, 1.0),
        "v_angular_max": (0.2, 3.0),
        "max_lookahead": (0.3, 3.0),
        "slowdown_radius": (0.1, 3.0),
        "k_phi": (0.1, 10.0),
        "k_delta": (0.1, 10.0),
        "beta": (0.0, 2.0),
    }

    PATH_HANDLER_NAMES: ClassVar[frozenset[str]] = frozenset({SEARCH_DISTANCE})
    READ_BY: ClassVar[Mapping[str, ReadBy]] = {
        MIN_LOOKAHEAD: since(Release.IRON),
        "max_lookahead": since(Release.IRON),
        "v_angular_min_in_place": since(Release.IRON),
        "initial_rotation_tolerance": since(Release.IRON),
        "prefer_final_rotation": since(Release.IRON),
        "in_place_collision_resolution": since(Release.IRON),
        "use_collision_detection": since(Release.KILTED),
        "deceleration_max": since(Release.LYRICAL),
        "footprint_scaling_linear_vel": since(Release.LYRICAL),
        "footprint_scaling_factor": since(Release.LYRICAL),
        "footprint_scaling_step": since(Release.LYRICAL),
        "obstacle_cost_margin": since(Release.LYRICAL),
        "final_rotation_search_step": since(Release.LYRICAL),
        "motion_target_dist": until(Release.HUMBLE),
        "initial_rotation_min_angle": until(Release.HUMBLE),
        "final_rotation": until(Release.HUMBLE),
        SEARCH_DISTANCE: until(Release.KILTED),
        "k_phi": ReadBy(defaults=before(Release.IRON, 3.0)),
        "k_delta": ReadBy(defaults=before(Release.IRON, 2.0)),
        "beta": ReadBy(defaults=before(Release.IRON, 0.2)),
    }

    model_config = ConfigDict(populate_by_name=True)

    min_lookahead: Length = Field(
        0.25,
        ge=0.0,
        description="Up to Kilted: least distance of the target along the plan, unless the "
        "plan ends before [m].",
    )
    max_lookahead: Length = Field(
        1.0, ge=0.0, le=100.0, description="Largest distance of the target along the plan [m]."
    )
    k_phi: Number = Field(
        2.0,
        ge=0.0,
        description="Gain k_phi: how soon the robot turns to the target's heading; 0: "
        "straight to the target; Humble: 3.",
    )
    k_delta: Number = Field(
        1.0,
        ge=0.0,
        description="Gain k_delta: how fast the robot turns to the target's heading; Humble: 2.",
    )
    beta: Number = Field(
        0.4,
        ge=0.0,
        description="Gain beta: how much the robot slows down in a curve; Humble: 0.2.",
    )
    lambda_: Number = Field(
        2.0,
        ge=0.0,
        alias=LAMBDA,
        description="Exponent lambda of the curvature: how sharply the speed falls with it.",
    )
    v_linear_min: Speed = Field(0.1, ge=0.0, description="Least speed [m/s].")
    v_linear_max: Speed = Field(0.5, gt=0.0, description="Largest speed [m/s].")
    v_angular_max: AngularSpeed = Field(1.0, ge=0.0, description="Largest turn rate [rad/s].")
    v_angular_min_in_place: AngularSpeed = Field(
        0.25, ge=0.0, description="Least turn rate of a turn in place [rad/s]."
    )
    slowdown_radius: Length = Field(
        1.5, ge=0.0, description="Distance to the target below which the robot slows down [m]."
    )
    deceleration_max: Acceleration = Field(
        2.5, ge=0.0, description="Deceleration towards the target [m/s^2]."
    )
    initial_rotation: bool = Field(
        True, description="Turn in place towards the target of a new plan before driving."
    )
    initial_rotation_tolerance: Angle = Field(
        0.75, ge=0.0, description="Angle to the target at which a turn in place ends [rad]."
    )
    prefer_final_rotation: bool = Field(
        True,
        description="Drive straight to the goal position, then turn in place to the goal's "
        "heading.",
    )
    rotation_scaling_factor: Number = Field(
        0.5,
        ge=0.0,
        le=1e3,
        description="Turn rate of a turn in place over the angle that is left [1/rad].",
    )
    allow_backward: bool = Field(
        False,
        description="Drive backwards to a target behind the robot; excludes initial_rotation.",
    )
    in_place_collision_resolution: Angle = Field(
        0.1, ge=0.001, description="Step of the collision check of a turn at the goal [rad]."
    )
    use_collision_detection: bool = Field(
        True, description="Reject commands that lead to a collision."
    )
    footprint_scaling_linear_vel: Speed = Field(
        0.5, ge=0.0, description="Speed from which the checked footprint is made larger [m/s]."
    )
    footprint_scaling_factor: Number = Field(
        0.25,
        ge=0.0,
        le=100.0,
        description="Growth of the checked footprint at full speed, as a share.",
    )
    footprint_scaling_step: Speed = Field(
        0.1,
        ge=0.01,
        description="Step by which the speed is lowered after a collision is predicted [m/s].",
    )
    obstacle_cost_margin: int = Field(
        1,
        ge=-INSCRIBED,
        le=INSCRIBED,
        description="Cost below lethal from which another heading is tried.",
    )
    final_rotation_search_step: Angle = Field(
        0.1, ge=0.001, description="Step between headings that are tried [rad]."
    )

    nav2_release: Release = Field(
        NEWEST_RELEASE,
        description="Nav2 release whose rules apply; Iron, which has no such controller, "
        "drives by Jazzy's.",
    )
    motion_target_dist: Length = Field(
        0.6, ge=0.0, description="Humble: straight-line distance of the target [m]."
    )
    initial_rotation_min_angle: Angle = Field(
        0.75,
        ge=0.0,
        description="Humble: angle to the target above which the robot turns in place [rad].",
    )
    final_rotation: bool = Field(
        True, description="Humble: turn to the goal's heading at the goal."
    )
    max_robot_pose_search_dist: Length | None = Field(
        None,
        description="Up to Kilted: arc length that is searched for the closest pose [m]; "
        "null: half the local costmap's side; negative: the whole plan.",
    )

    def asked_speeds(self) -> AskedSpeeds:
        """Returns the largest speed, also backwards where allowed, and the largest turn rate."""
        backward = -self.v_linear_max if self.drives_backward else None
        return AskedSpeeds(self.v_linear_max, backward, self.v_angular_max)

    @property
    def drives_backward(self) -> bool:
        """Whether the controller may drive backwards."""
        return self.allow_backward and not self.initial_rotation

    @classmethod
    def keys_not_read(cls, values: Mapping[str, Any]) -> list[str]:
        """Adds `allow_backward` where it is set together with `initial_rotation`."""
        not_read = super().keys_not_read(values)
        turns_first = values.get("initial_rotation", True) is True
        if turns_first and values.get("allow_backward") is True:
            not_read.append("allow_backward")
        return not_read

    @classmethod
    def is_without_effect(cls, name: str, values: Mapping[str, Any] | None = None) -> bool:
        """See the base class; also the least lookahead, which Lyrical reads without effect."""
        release = release_in(values)
        is_idle = name == MIN_LOOKAHEAD and release >= Release.LYRICAL
        return is_idle or super().is_without_effect(name, values)

    @model_validator(mode="before")
    @classmethod
    def _with_defaults_of_release(cls, data: Any) -> Any:
        if isinstance(data, Mapping):
            return {**defaults_in(cls, release_in(data)), **data}
        return data

    @model_serializer(mode="wrap")
    def _under_nav2_names(self, dump: Callable[[Any], dict[str, Any]]) -> dict[str, Any]:
        return {LAMBDA if name == "lambda_" else name: value for name, value in dump(self).items()}
