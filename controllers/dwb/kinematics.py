"""The velocity limits of the base: Nav2's kinematic parameters, scaled by a speed limit."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from drake_navbench.controller import SpeedLimit
from drake_navbench.controllers.dwb.parameters import DynamicWindowApproachParameters
from drake_navbench.kernels.speed_limit import NO_SPEED_LIMIT, limited_speed


class Kinematics(NamedTuple):
    """Limits of the velocity, m/s and rad/s, and of its rate of change, m/s^2 and rad/s^2.

    Names and meaning are those of the parameters. Passed whole to the kernels. speed_tolerance: how
    far a twist may be beyond the limits of speed: m^2/s^2 for the planar ones, which are compared
    squared, rad/s for min_speed_theta.
    """

    min_vel_x: float
    max_vel_x: float
    min_vel_y: float
    max_vel_y: float
    max_vel_theta: float
    min_speed_xy: float
    max_speed_xy: float
    min_speed_theta: float
    acc_lim_x: float
    acc_lim_y: float
    acc_lim_theta: float
    decel_lim_x: float
    decel_lim_y: float
    decel_lim_theta: float
    speed_tolerance: float

    @classmethod
    def from_parameters(cls, parameters: DynamicWindowApproachParameters) -> Kinematics:
        """Returns the limits as configured, before any speed limit."""
        return cls(*(float(getattr(parameters, name)) for name in cls._fields))

    def limited(self, base: Kinematics, speed_limit: SpeedLimit | None) -> Kinematics:
        """Returns these limits after a message of the speed filter (Nav2's KinematicsHandler).

        A percentage scales the four upper limits of `base`. A speed in m/s below `base`'s planar
        speed scales them in proportion; at or above it the present limits stay. No limit restores
        `base`. Lower limits are never touched.
        """
        if speed_limit is None or speed_limit.value == NO_SPEED_LIMIT or speed_limit.is_percentage:
            return self._with_upper_limits_of(base, lambda speed: limited_speed(speed, speed_limit))
        if speed_limit.value < base.max_speed_xy:
            ratio = speed_limit.value / base.max_speed_xy
            limited = self._with_upper_limits_of(base, lambda speed: speed * ratio)
            return limited._replace(max_speed_xy=speed_limit.value)
        return self

    def _with_upper_limits_of(
        self, base: Kinematics, scaled: Callable[[float], float]
    ) -> Kinematics:
        return self._replace(
            max_vel_x=scaled(base.max_vel_x),
            max_vel_y=scaled(base.max_vel_y),
            max_vel_theta=scaled(base.max_vel_theta),
            max_speed_xy=scaled(base.max_speed_xy),
        )
