"""Blocks of MPPI's parameters: motion model, trajectory validator, visualizer, polish."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from drake_navbench.plugins.releases import Release
from drake_navbench.typed_files.quantities import (
    Count,
    Duration,
    Length,
    Number,
)
from drake_navbench.typed_files.typed_yaml import unknown_field

MOTION_MODEL_PLUGINS = {
    "mppi::DiffDriveMotionModel": "DiffDrive",
    "mppi::OmniMotionModel": "Omni",
    "mppi::AckermannMotionModel": "Ackermann",
}
DEFAULT_MOTION_MODEL = "diff_drive"
# The first release in which a motion model is a plugin; before it, it is a name.
MOTION_MODEL_PLUGINS_SINCE = Release.LYRICAL
DEFAULT_MOTION_MODEL_PLUGIN = "mppi::DiffDriveMotionModel"
DEFAULT_VALIDATOR: Final = "mppi::DefaultOptimalTrajectoryValidator"
# The cubic B-spline of the polish needs as many knots as its order.
MIN_KNOT_COUNT = 4


class Block(BaseModel):
    """Base of the nested blocks: unknown names refused, frozen."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class AckermannParameters(Block):
    """The parameters that the Ackermann motion model adds."""

    min_turning_r: Length = Field(
        0.2, gt=0, description="Least turning radius of the Ackermann model [m]."
    )


class ValidatorParameters(Block):
    """TrajectoryValidator: the last check of the averaged trajectory."""

    plugin: Literal["mppi::DefaultOptimalTrajectoryValidator"] = Field(
        DEFAULT_VALIDATOR,
        description="Validator of the chosen trajectory; Nav2 ships this one only.",
    )
    collision_lookahead_time: Duration = Field(
        2.0, ge=0, description="Duration of the trajectory that is checked [s]."
    )
    consider_footprint: bool = Field(
        False, description="Check the footprint, not the centre alone."
    )


class VisualizerParameters(Block):
    """TrajectoryVisualizer: accepted from Nav2's files, of no effect on the command."""

    trajectory_step: Count = Field(5, ge=1, description="Draw every n-th sampled trajectory.")
    time_step: Count = Field(3, ge=1, description="Draw every n-th step of a trajectory.")


class PolishParameters(Block):
    """The nonlinear program that refines the sampled sequence. Not part of Nav2."""

    enabled: bool = Field(
        False, description="Refine the averaged commands by a nonlinear program; Nav2 does not."
    )
    knot_count: Count = Field(
        8, ge=MIN_KNOT_COUNT, description="Number of B-spline knots for v and as many for w."
    )
    max_iterations: Count = Field(5, ge=1, description="Iteration limit of IPOPT.")
    carrot_offset: Count = Field(
        5, ge=0, description="Path points from the trajectory's end to the carrot."
    )
    path_weight: Number = Field(
        20.0, ge=0, description="Weight of the mean squared path distance [1/m^2]."
    )
    heading_weight: Number = Field(
        2.0, ge=0, description="Weight of the mean of 1 - cos(yaw error)."
    )
    obstacle_weight: Number = Field(2.0, ge=0, description="Weight of the mean squared cell cost.")
    progress_weight: Number = Field(
        2.0, ge=0, description="Weight of the end's distance to the carrot [1/m]."
    )
    deviation_weight: Number = Field(
        0.5,
        ge=0,
        description="Weight of the mean squared distance to the averaged commands, over the "
        "sampling variance.",
    )
    jerk_weight: Number = Field(0.2, ge=0, description="Weight of the mean squared jerk [s^6/m^2].")
    angular_jerk_weight: Number = Field(
        0.002, ge=0, description="Weight of the mean squared angular jerk [s^6/rad^2]."
    )


def resolve_motion_model(raw: dict[str, Any]) -> None:
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
                f"motion_model: got {name!r}, expected one of {known}, or a block of that name"
            )
        return
    block = raw.pop(name)
    plugin = block.get("plugin")
    if not isinstance(plugin, str) or plugin not in MOTION_MODEL_PLUGINS:
        known = ", ".join(MOTION_MODEL_PLUGINS)
        raise ValueError(f"motion_model: {name}.plugin: got {plugin!r}, expected one of {known}")
    raw["motion_model"] = MOTION_MODEL_PLUGINS[plugin]
    values = {key: value for key, value in block.items() if key != "plugin"}
    is_car = raw["motion_model"] == "Ackermann"
    fields = AckermannParameters.model_fields if is_car else {}
    unknown = [key for key in values if key not in fields]
    if unknown:
        text = f"unknown field, {plugin} has {', '.join(fields) or 'none'}"
        faults = [unknown_field(text, (name, key), values[key]) for key in unknown]
        raise ValidationError.from_exception_data("motion model", faults)
    if is_car:
        raw["AckermannConstraints"] = values
