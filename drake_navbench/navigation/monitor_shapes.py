"""The parameters of the collision monitor, and of the shapes around the robot that it looks at.

Source: nav2_collision_monitor, branches humble to lyrical.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from drake_navbench.navigation.monitor_sources import THE_SCAN, MonitorSource
from drake_navbench.plugins.releases import NEWEST_RELEASE, ReadBy, Release, since
from drake_navbench.typed_files.quantities import (
    Angle,
    AngularSpeed,
    Count,
    Duration,
    Period,
    Point,
    Size,
    Speed,
)
from drake_navbench.typed_files.typed_yaml import FrozenModel, QuietModel
from drake_navbench.typed_files.usual_values import Usual

# v m/s, w rad/s, vy m/s.
Command = tuple[float, float, float]
Corners = Annotated[tuple[Point, ...], Field(min_length=4)]


class _Shape(QuietModel):
    quiet: ClassVar = frozenset({"sources_names"})

    READ_BY: ClassVar[Mapping[str, ReadBy]] = {
        "min_points": since(Release.IRON),
        "sources_names": since(Release.JAZZY),
        "linear_limit": since(Release.IRON),
        "angular_limit": since(Release.IRON),
        "trigger_consecutive_points": since(Release.LYRICAL),
        "release_consecutive_points": since(Release.LYRICAL),
    }

    action_type: Literal["stop", "slowdown", "limit", "approach", "none"] = Field(
        "approach", description="Action when at least min_points points are inside the shape."
    )
    min_points: Annotated[Count, Usual("the shape acts all the time", low=1.0)] = Field(
        4, description="Number of points from which the shape acts."
    )
    slowdown_ratio: float = Field(
        0.5, ge=0.0, le=1.0, description="Factor on the command while slowing down."
    )
    linear_limit: Speed = Field(0.5, ge=0.0, description="Largest speed while limiting [m/s].")
    angular_limit: AngularSpeed = Field(
        0.5, ge=0.0, description="Largest turn rate while limiting [rad/s]."
    )
    time_before_collision: Duration = Field(
        2.0, gt=0.0, description="Time before a collision that an approach keeps [s]."
    )
    simulation_time_step: Period = Field(
        0.1, description="Time step in which an approach simulates the motion [s]."
    )
    trigger_consecutive_points: Count = Field(
        1, ge=1, description="Number of cycles after which the shape begins to act."
    )
    release_consecutive_points: Count = Field(
        1, ge=1, description="Number of cycles after which the shape ceases to act."
    )
    enabled: bool = Field(True, description="Use this shape.")
    sources_names: tuple[str, ...] | None = Field(
        None, description="Names of the sources whose points count for the shape; null: all."
    )


class MonitorPolygon(_Shape):
    """A polygon; without points, an approach takes the robot's padded footprint."""

    type: Literal["polygon"]
    points: Corners | None = Field(
        None, description="Corners of the polygon in the base frame [m]."
    )

    @model_validator(mode="after")
    def _check(self) -> MonitorPolygon:
        if self.points is None and self.action_type != "approach":
            raise ValueError(f"points: missing, but required for action_type {self.action_type!r}")
        return self


class MonitorCircle(_Shape):
    """A circle about the base origin."""

    type: Literal["circle"]
    radius: Size = Field(description="Radius of the circle around the base origin [m].")


class SubPolygon(FrozenModel):
    """The polygon for a range of commands."""

    points: Corners = Field(description="Corners of the polygon in the base frame [m].")
    linear_min: Speed = Field(
        description="Lowest v, or speed of a holonomic base, at which the polygon applies [m/s]."
    )
    linear_max: Speed = Field(
        description="Highest v, or speed of a holonomic base, at which the polygon applies [m/s]."
    )
    theta_min: AngularSpeed = Field(description="Lowest w at which the polygon applies [rad/s].")
    theta_max: AngularSpeed = Field(description="Highest w at which the polygon applies [rad/s].")

    direction_start_angle: Angle = Field(
        -math.pi,
        description="Holonomic base: first direction of motion at which the polygon applies, "
        "counter-clockwise [rad].",
    )
    direction_end_angle: Angle = Field(
        math.pi,
        description="Holonomic base: last direction of motion at which the polygon applies [rad].",
    )

    def covers(self, command: Command, *, holonomic: bool, release: Release) -> bool:
        """Tells whether the sub-polygon applies to a command, bounds included.

        A holonomic base at rest moves in the direction 0. In Kilted v alone, not the speed, must
        lie between linear_min and linear_max, whatever the base.
        """
        v, w, vy = command
        speed = math.hypot(v, vy)
        is_by_speed = holonomic and release is not Release.KILTED
        is_in_range = self.linear_min <= (speed if is_by_speed else v) <= self.linear_max
        if not (is_in_range and self.theta_min <= w <= self.theta_max):
            return False
        if not holonomic:
            return True
        direction = 0.0 if is_by_speed and speed == 0.0 else math.atan2(vy, v)
        start, end = self.direction_start_angle, self.direction_end_angle
        is_after_start, is_before_end = direction >= start, direction <= end
        # A range of directions may contain the direction straight back.
        if start > end:
            return is_after_start or is_before_end
        return is_after_start and is_before_end


class VelocityPolygon(_Shape):
    """A polygon that depends on the command: the first sub-polygon that applies.

    Where no sub-polygon applies, the last one stays.
    """

    type: Literal["velocity_polygon"]
    holonomic: bool = Field(
        False, description="Choose sub-polygons by speed and direction of motion, not by v."
    )
    velocity_polygons: dict[str, SubPolygon] = Field(
        min_length=1, description="Sub-polygons; the first that applies to the command is used."
    )


MonitorShape = Annotated[
    MonitorPolygon | MonitorCircle | VelocityPolygon, Field(discriminator="type")
]


class CollisionMonitorParameters(QuietModel):
    """Parameters of nav2_collision_monitor."""

    READ_BY: ClassVar[Mapping[str, ReadBy]] = {"enabled": since(Release.LYRICAL)}

    quiet: ClassVar = frozenset({"observation_sources", "nav2_release"})

    nav2_release: Release = Field(
        NEWEST_RELEASE,
        description="Nav2 release whose rules apply. Up to Iron a source without current data "
        "stops nothing; Humble's approach needs one point less inside the shape; Iron "
        "limits v and w separately; Kilted chooses sub-polygons of a holonomic base "
        "by v; Lyrical keeps the range before one that is not finite.",
    )

    polygons: dict[str, MonitorShape] = Field(
        min_length=1, description="Shapes by name, in the order in which they are tested."
    )
    enabled: bool = Field(
        True,
        description="Use the shapes; a source without current data stops the robot in any case.",
    )
    source_timeout: Duration = Field(
        2.0,
        ge=0.0,
        description="Age of a source's data above which the robot is stopped [s]; 0: never.",
    )
    base_shift_correction: bool = Field(
        True, description="Correct the scan by the robot's motion since it was taken."
    )
    observation_sources: dict[str, MonitorSource] = Field(
        default_factory=lambda: dict(THE_SCAN),
        min_length=1,
        description="Observation sources, in order.",
    )

    @model_validator(mode="after")
    def _check(self) -> CollisionMonitorParameters:
        for name, shape in self.polygons.items():
            for source in shape.sources_names or ():
                if source not in self.observation_sources:
                    expected = ", ".join(self.observation_sources)
                    raise ValueError(
                        f"polygons.{name}.sources_names: got {source!r}, expected some of "
                        f"observation_sources: {expected}"
                    )
        return self
