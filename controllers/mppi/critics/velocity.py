"""Critics that look at velocities alone: Constraint, PreferForward, Twirling, VelocityDeadband."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numba import njit
from numba.extending import register_jitable
from pydantic import Field

from drake_navbench.controllers.mppi.critics.base import (
    Critic,
    CriticParameters,
    PointwiseCritic,
    TermParameters,
    Trajectories,
)
from drake_navbench.controllers.mppi.critics.batch import Scene
from drake_navbench.controllers.mppi.float32_math import F32, ZERO
from drake_navbench.controllers.mppi.lanes import LANES, Lanes
from drake_navbench.controllers.mppi.motion_models import MotionModel
from drake_navbench.controllers.mppi.releases import RULES, Rules
from drake_navbench.typed_files.quantities import Length, Number

# Ackermann's turning radius |vx| / |wz| is cut off where the robot does not turn.
_LEAST_TURN_RATE = F32(1e-6)


class ConstraintParameters(TermParameters):
    """Parameters of ConstraintCritic."""

    cost_weight: Number = Field(
        4.0, description="Weight of the speed beyond the limits, summed over the sample [1/m]."
    )


class ConstraintCritic(PointwiseCritic):
    """Velocity outside the limits, integrated over time; a speed limit does not count."""

    Parameters: ClassVar[type[CriticParameters]] = ConstraintParameters
    is_integral = True

    @classmethod
    def of_release(cls, release: Rules) -> type[Critic]:
        """Returns the class that scores as a release of Nav2 does."""
        return cls if release.limits_axes else SpeedConstraintCritic

    def begin(self, scene: Scene, blocks: int) -> tuple[Any, ...]:
        limits = self.context.limits
        return limits.vx_max, limits.vx_min, limits.vy_max, F32(self.context.min_turning_r)

    def add(
        self, cycle: tuple[Any, ...], chunk: Trajectories, sums: Lanes, *, first_block: int
    ) -> None:
        vx_max, vx_min, vy_max, min_turning_r = cycle
        add_excess(chunk.vx, vx_min, vx_max, sums)
        if self.context.motion_model is MotionModel.OMNI:
            add_excess(chunk.vy, -vy_max, vy_max, sums)
        if self.context.motion_model is MotionModel.ACKERMANN:
            add_tight_turns(chunk.vx, chunk.wz, (min_turning_r, _LEAST_TURN_RATE, False), sums)


class SpeedConstraintCritic(ConstraintCritic):
    """ConstraintCritic up to Kilted: limits the speed, signed as vx, by sqrt(vx_max^2 + vy_max^2).

    The bound is the same for a base that cannot move sideways.
    """

    def begin(self, scene: Scene, blocks: int) -> tuple[Any, ...]:
        limits = self.context.limits
        vy_squared = limits.vy_max * limits.vy_max
        highest = np.sqrt(limits.vx_max * limits.vx_max + vy_squared)
        lowest = np.sqrt(limits.vx_min * limits.vx_min + vy_squared)
        sign = F32(1.0) if limits.vx_min > 0 else F32(-1.0)
        spoils = RULES[self.context.nav2_release].standing_spoils
        return highest, sign * lowest, (F32(self.context.min_turning_r), ZERO, spoils)

    def add(
        self, cycle: tuple[Any, ...], chunk: Trajectories, sums: Lanes, *, first_block: int
    ) -> None:
        highest, lowest, turns = cycle
        if self.context.motion_model is MotionModel.OMNI:
            speeds = np.sqrt(chunk.vx * chunk.vx + chunk.vy * chunk.vy)
            signed = np.where(chunk.vx > 0, speeds, -speeds)
            add_excess(np.ascontiguousarray(signed, dtype=np.float32), lowest, highest, sums)
        else:
            add_excess(chunk.vx, lowest, highest, sums)
        if self.context.motion_model is MotionModel.ACKERMANN:
            add_tight_turns(chunk.vx, chunk.wz, turns, sums)


@njit(cache=True)
def add_excess(velocities, lowest, highest, sums):
    """Adds sum_t (v - highest)+ + (lowest - v)+."""
    for block in range(velocities.shape[0]):
        for t in range(velocities.shape[1]):
            _excess_row(velocities[block, t], lowest, highest, sums[block])


@register_jitable
def _excess_row(velocities, lowest, highest, sums):
    for lane in range(LANES):
        v = velocities[lane]
        sums[lane] += max(v - highest, ZERO) + max(lowest - v, ZERO)


@njit(cache=True, error_model="numpy")
def add_tight_turns(vx, wz, turns, sums):
    """Adds sum_t (r_min - |vx| / max(|wz|, least_turn_rate))+.

    turns: r_min m, least_turn_rate rad/s, standing_spoils. A step that stands still costs r_min.
    With a least turn rate of 0 it has no radius, 0 / 0, and costs nothing, or spoils the sample's
    cost.
    """
    min_turning_r, least_turn_rate, standing_spoils = turns
    for block in range(vx.shape[0]):
        for t in range(vx.shape[1]):
            for lane in range(LANES):
                turn_rate = max(np.abs(wz[block, t, lane]), least_turn_rate)
                tightness = min_turning_r - np.abs(vx[block, t, lane]) / turn_rate
                if tightness > ZERO or (standing_spoils and np.isnan(tightness)):
                    sums[block, lane] += tightness


class PreferForwardParameters(TermParameters):
    """Parameters of PreferForwardCritic."""

    cost_weight: Number = Field(5.0, description="Weight of the distance driven in reverse [1/m].")
    threshold_to_consider: Length = Field(
        0.5, ge=0, description="Length of the remaining plan below which the critic is idle [m]."
    )


class PreferForwardCritic(PointwiseCritic):
    """Distance driven backward, while the goal is far."""

    Parameters: ClassVar[type[CriticParameters]] = PreferForwardParameters
    is_integral = True

    def begin(self, scene: Scene, blocks: int) -> tuple[Any, ...] | None:
        near = scene.way_left < F32(self.parameters.threshold_to_consider)
        return None if near else ()

    def add(
        self, cycle: tuple[Any, ...], chunk: Trajectories, sums: Lanes, *, first_block: int
    ) -> None:
        add_excess(chunk.vx, ZERO, F32(np.inf), sums)


class TwirlingParameters(TermParameters):
    """Parameters of TwirlingCritic."""

    cost_weight: Number = Field(10.0, description="Weight of a sample's mean turn rate [s/rad].")


class TwirlingCritic(PointwiseCritic):
    """Mean |wz|, while the goal tolerance is not reached."""

    Parameters: ClassVar[type[CriticParameters]] = TwirlingParameters
    is_mean = True

    def begin(self, scene: Scene, blocks: int) -> tuple[Any, ...] | None:
        return None if float(scene.way_left) < scene.goal_xy_tolerance_m else ()

    def add(
        self, cycle: tuple[Any, ...], chunk: Trajectories, sums: Lanes, *, first_block: int
    ) -> None:
        add_excess(chunk.wz, ZERO, ZERO, sums)


class VelocityDeadbandParameters(TermParameters):
    """Parameters of VelocityDeadbandCritic."""

    cost_weight: Number = Field(
        35.0,
        description="Weight of the speed missing to leave the deadband, summed over the "
        "sample [1/m].",
    )
    deadband_velocities: tuple[float, float, float] = Field(
        (0.0, 0.0, 0.0),
        description="Smallest |vx|, |vy|, |wz| that the base answers [m/s, m/s, rad/s].",
    )


class VelocityDeadbandCritic(PointwiseCritic):
    """Velocities too small for the drives to follow, integrated over time."""

    Parameters: ClassVar[type[CriticParameters]] = VelocityDeadbandParameters
    is_integral = True

    def begin(self, scene: Scene, blocks: int) -> tuple[Any, ...]:
        return tuple(F32(abs(v)) for v in self.parameters.deadband_velocities)

    def add(
        self, cycle: tuple[Any, ...], chunk: Trajectories, sums: Lanes, *, first_block: int
    ) -> None:
        vx, vy, wz = cycle
        add_shortfall(chunk.vx, vx, sums)
        if self.context.holonomic:
            add_shortfall(chunk.vy, vy, sums)
        add_shortfall(chunk.wz, wz, sums)


@njit(cache=True)
def add_shortfall(velocities, deadband, sums):
    """Adds sum_t (deadband - |v|)+."""
    for block in range(velocities.shape[0]):
        for t in range(velocities.shape[1]):
            for lane in range(LANES):
                sums[block, lane] += max(deadband - np.abs(velocities[block, t, lane]), ZERO)
