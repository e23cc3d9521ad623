"""The parameters of the Graceful Controller, under Nav2's names and with Nav2's defaults."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, ClassVar

from pydantic import ConfigDict, Field, model_serializer, model_validator

from drake_navbench.controller import (
    AskedSpeeds,
    ControllerParameters,
)
from drake_navbench.kernels.grid import INSCRIBED
from drake_navbench.releases import NEWEST_RELEASE, ReadBy, Release, release_in, since, until
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
# The search distance is the path handler's since the controllers do not cut the plan any more.
SEARCH_DISTANCE = "max_robot_pose_search_dist"
HUMBLE_DEFAULTS = MappingProxyType({"k_phi": 3.0, "k_delta": 2.0, "beta": 0.2})


class GracefulParameters(ControllerParameters):
    """Parameters of nav2_graceful_controller, of all releases that have it.

    Nav2 drops `allow_backward` with a warning where `initial_rotation` is on, and so does this.
    `min_lookahead` is a parameter in Lyrical, too, but nothing reads it. In this model `lambda` is
    called `lambda_`.
    """

    PATH_HANDLER_NAMES: ClassVar[frozenset[str]] = frozenset({SEARCH_DISTANCE})
    READ_BY: ClassVar[Mapping[str, ReadBy]] = MappingProxyType(
        {
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
        }
    )

    model_config = ConfigDict(populate_by_name=True)

    min_lookahead: Length = Field(
        0.25, ge=0.0, description="Up to Kilted: nearest target before the plan's end [m]."
    )
    max_lookahead: Length = Field(
        1.0, ge=0.0, le=100.0, description="Farthest target along the plan [m]."
    )
    k_phi: Number = Field(
        2.0,
        ge=0.0,
        description="How soon to turn to the target's heading; 0: drive straight; Humble: 3 [-].",
    )
    k_delta: Number = Field(1.0, ge=0.0, description="How fast to turn to it; Humble: 2 [-].")
    beta: Number = Field(0.4, ge=0.0, description="How much a curve slows down; Humble: 0.2 [-].")
    lambda_: Number = Field(
        2.0, ge=0.0, alias=LAMBDA, description="How sharply: exponent of the curvature [-]."
    )
    v_linear_min: Speed = Field(0.1, ge=0.0, description="Least speed [m/s].")
    v_linear_max: Speed = Field(0.5, gt=0.0, description="Largest speed [m/s].")
    v_angular_max: AngularSpeed = Field(1.0, ge=0.0, description="Largest turn rate [rad/s].")
    v_angular_min_in_place: AngularSpeed = Field(
        0.25, ge=0.0, description="Least turn rate in place [rad/s]."
    )
    slowdown_radius: Length = Field(
        1.5, ge=0.0, description="Distance to the target below which to slow down [m]."
    )
    deceleration_max: Acceleration = Field(
        2.5, ge=0.0, description="Braking to the target [m/s^2]."
    )
    initial_rotation: bool = Field(True, description="Turn in place to the target of a new plan.")
    initial_rotation_tolerance: Angle = Field(
        0.75, ge=0.0, description="Angle to the target below which it drives [rad]."
    )
    prefer_final_rotation: bool = Field(
        True, description="Drive straight to the goal, and turn to its heading there."
    )
    rotation_scaling_factor: Number = Field(
        0.5, ge=0.0, le=1e3, description="Turn rate in place over the angle left [1/rad]."
    )
    allow_backward: bool = Field(
        False, description="Drive backwards to a target behind; needs initial_rotation off."
    )
    in_place_collision_resolution: Angle = Field(
        0.1, ge=0.001, description="Step at which the turn at the goal is checked [rad]."
    )
    use_collision_detection: bool = Field(True, description="Refuse drives that collide.")
    footprint_scaling_linear_vel: Speed = Field(
        0.5, ge=0.0, description="Speed from which the outline is widened [m/s]."
    )
    footprint_scaling_factor: Number = Field(
        0.25, ge=0.0, le=100.0, description="By how much at full speed, as a part [-]."
    )
    footprint_scaling_step: Speed = Field(
        0.1, ge=0.01, description="How much slower a drive that collides is tried again [m/s]."
    )
    obstacle_cost_margin: int = Field(
        1,
        ge=-INSCRIBED,
        le=INSCRIBED,
        description="Below the cost of an obstacle by this much, look for another heading [-].",
    )
    final_rotation_search_step: Angle = Field(
        0.1, ge=0.001, description="Step at which headings are tried [rad]."
    )

    nav2_release: Release = Field(
        NEWEST_RELEASE,
        description="Release whose rules hold; Iron has no such controller: Jazzy's.",
    )
    motion_target_dist: Length = Field(
        0.6, ge=0.0, description="Humble: straight distance of the target [m]."
    )
    initial_rotation_min_angle: Angle = Field(
        0.75, ge=0.0, description="Humble: angle to the target beyond which to turn in place [rad]."
    )
    final_rotation: bool = Field(True, description="Humble: turn to the goal's heading there.")
    max_robot_pose_search_dist: Length | None = Field(
        None,
        description="Up to Kilted: arc length searched for the closest pose [m]; null: half the "
        "local costmap's side; negative: all of the plan.",
    )

    def asked_speeds(self) -> AskedSpeeds:
        """Returns the largest speed, backwards too where it may, and the largest turn rate."""
        backward = -self.v_linear_max if self.drives_backward else None
        return AskedSpeeds(self.v_linear_max, backward, self.v_angular_max)

    @property
    def drives_backward(self) -> bool:
        """Whether it may drive backwards."""
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
        is_idle = name == MIN_LOOKAHEAD and release == NEWEST_RELEASE
        return is_idle or super().is_without_effect(name, values)

    @classmethod
    def path_handler_fields(cls, given: Mapping[str, Any]) -> dict[str, str]:
        """See the base class; up to Kilted the controller has no path handler before it."""
        if release_in(given) != NEWEST_RELEASE:
            return {}
        return super().path_handler_fields(given)

    @model_validator(mode="before")
    @classmethod
    def _with_defaults_of_release(cls, data: Any) -> Any:
        if isinstance(data, Mapping) and release_in(data) is Release.HUMBLE:
            return {**HUMBLE_DEFAULTS, **data}
        return data

    @model_serializer(mode="wrap")
    def _under_nav2_names(self, dump: Callable[[Any], dict[str, Any]]) -> dict[str, Any]:
        return {LAMBDA if name == "lambda_" else name: value for name, value in dump(self).items()}
