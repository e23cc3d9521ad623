"""Faults of a scenario: the fields of the robot that change, from when and for how long."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

from pydantic import Field, model_validator

from drake_navbench.errors import InputError
from drake_navbench.inputs.actuators import ActuatorSettings
from drake_navbench.inputs.lidar import LidarSettings
from drake_navbench.inputs.localization import LocalizationSettings
from drake_navbench.inputs.timeline import Timeline, timeline
from drake_navbench.inputs.timing import TimingSettings
from drake_navbench.kernels.immutable import Immutable
from drake_navbench.typed_files.quantities import Duration
from drake_navbench.typed_files.typed_yaml import FrozenModel, validate

if TYPE_CHECKING:
    from drake_navbench.inputs.robot import Robot

PARTS = ("lidar", "localization", "actuators", "timing")


class Fault(FrozenModel):
    """Fields of the robot's parts that have other values for a while.

    Where several faults overlap and give the same field, the later one in the list holds.
    """

    at_s: Duration = Field(ge=0.0, description="Time at which the fault begins [s].")
    duration_s: Duration | None = Field(
        None, gt=0.0, description="Duration of the fault [s]; null: until the end of the trial."
    )
    lidar: dict[str, Any] = Field(
        default_factory=dict, description="Fields of the robot's lidar that change."
    )
    localization: dict[str, Any] = Field(
        default_factory=dict, description="Fields of the robot's localization that change."
    )
    actuators: dict[str, Any] = Field(
        default_factory=dict, description="Fields of the robot's actuators that change."
    )
    timing: dict[str, Any] = Field(
        default_factory=dict, description="Fields of the robot's timing that change."
    )

    @model_validator(mode="after")
    def _check(self) -> Fault:
        if not any(getattr(self, part) for part in PARTS):
            raise ValueError(f"expected fields of one of {', '.join(PARTS)}, found none")
        return self

    @property
    def end_s(self) -> float:
        """The end of the fault, s; inf where it does not end."""
        return math.inf if self.duration_s is None else self.at_s + self.duration_s


@dataclass(frozen=True)
class Conditions(Immutable):
    """The settings of the robot's parts at each time of a trial, with the scenario's faults.

    relocalizes: whether the robot is localized with an error after a lift.
    """

    lidar: Timeline[LidarSettings]
    localization: Timeline[LocalizationSettings]
    actuators: Timeline[ActuatorSettings]
    timing: Timeline[TimingSettings]
    relocalizes: bool = False

    @property
    def are_plain(self) -> bool:
        """Whether actuators are ideal, no message is late, and odometry and map frame are one."""
        return not (
            self.has_frames
            or self.actuators.any(lambda part: part.touches_wheels or part.limits_force)
            or self.timing.any(lambda part: part != TimingSettings())
        )

    @property
    def has_frames(self) -> bool:
        """Whether the odometry frame and the map frame ever differ."""
        return self.relocalizes or self.localization.any(lambda settings: settings.has_frames)


Part = TypeVar("Part", bound=Any)


def conditions_of(robot: Robot, faults: Sequence[Fault] = (), source: str = "faults") -> Conditions:
    """Returns the conditions of a robot with these faults; raises InputError.

    source: the name of the faults in errors.
    """
    parts: dict[str, Any] = {
        part: _timeline(getattr(robot, part), faults, part, source) for part in PARTS
    }
    return Conditions(**parts)


def _timeline(usual: Part, faults: Sequence[Fault], part: str, source: str) -> Timeline[Part]:
    changes = [
        (fault.at_s, fault.end_s, _change(getattr(fault, part), f"{source}[{index}].{part}"))
        for index, fault in enumerate(faults)
        if getattr(fault, part)
    ]
    return timeline(usual, changes) if changes else Timeline.constant(usual)


def _change(fields: Mapping[str, Any], source: str) -> Callable[[Part], Part]:
    def changed(usual: Part) -> Part:
        for name in fields:
            if name in usual.constant:
                raise InputError(f"{source}: {name}: cannot change during a trial")
        data = usual.model_dump(mode="json", exclude_unset=True)
        return validate(type(usual), {**data, **fields}, source)

    return changed
