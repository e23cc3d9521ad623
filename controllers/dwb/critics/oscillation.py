"""Oscillation: once a velocity has changed its sign, it may not change back at once.

Nav2's OscillationCritic. The ban ends when the robot has moved, turned or waited enough.
"""

from __future__ import annotations

from typing import ClassVar, NamedTuple

import numpy as np
from pydantic import Field

from drake_navbench.controllers.dwb.critics.base import Critic, Verdict
from drake_navbench.controllers.dwb.critics.parameters import CriticParameters
from drake_navbench.controllers.dwb.scene import Scene, Situation
from drake_navbench.kernels.angles import wrap
from drake_navbench.kernels.arrays import Array
from drake_navbench.typed_files.quantities import Angle, Duration, Length, Speed

NANOSECONDS_PER_SECOND = 1e9


class OscillationParameters(CriticParameters):
    """Parameters of Oscillation; a negative condition is switched off."""

    oscillation_reset_dist: Length = Field(
        0.05, description="Distance after which a ban on a direction ends [m]."
    )
    oscillation_reset_angle: Angle = Field(
        0.2, description="Turn after which a ban on a direction ends [rad]."
    )
    oscillation_reset_time: Duration = Field(
        -1.0, description="Time after which a ban on a direction ends [s]."
    )
    x_only_threshold: Speed = Field(
        0.05,
        description="Sideways motion and turning are watched only below this |vx|; negative: "
        "at any speed [m/s].",
    )


class Trend(NamedTuple):
    """The direction in which one axis last moved, and the directions banned for it.

    sign: sign of the last velocity that was not zero; 0 before there was one.
    positive_only, negative_only: the axis may not go the other way.
    """

    sign: int = 0
    positive_only: bool = False
    negative_only: bool = False

    @property
    def is_restricted(self) -> bool:
        """Whether a direction is banned."""
        return self.positive_only or self.negative_only

    def flips_with(self, velocity: float) -> bool:
        """Tells whether a velocity goes against the last one."""
        return velocity * self.sign < 0.0

    def followed_by(self, velocity: float) -> Trend:
        """Returns the trend after one more command."""
        if velocity == 0.0:
            return self
        flips = self.flips_with(velocity)
        return Trend(
            sign=1 if velocity > 0.0 else -1,
            positive_only=self.positive_only or (flips and velocity > 0.0),
            negative_only=self.negative_only or (flips and velocity < 0.0),
        )


class OscillationMemory(NamedTuple):
    """Trends of x, y and theta; pose and time (whole nanoseconds) of the last change of sign."""

    trends: tuple[Trend, ...] = (Trend(), Trend(), Trend())
    flip_pose: tuple[float, float, float] = (0.0, 0.0, 0.0)
    flip_time_ns: int = 0


class Oscillation(Critic):
    """score = 0; a velocity in a banned direction is illegal."""

    Parameters: ClassVar[type[CriticParameters]] = OscillationParameters
    reasons: ClassVar[tuple[str, ...]] = ("Trajectory is oscillating.",)

    def initial_memory(self) -> OscillationMemory:
        """Returns the memory without trends."""
        return OscillationMemory()

    def reset(self, memory: OscillationMemory) -> OscillationMemory:
        """Forgets the trends; pose and time of the last change of sign stay."""
        return memory._replace(trends=OscillationMemory().trends)

    def score(self, scene: Scene, memory: OscillationMemory) -> Verdict:
        """Returns zeros, and which commands go in a banned direction."""
        velocities = scene.trajectories.velocities
        banned = np.zeros(len(velocities), dtype=np.uint8)
        for axis, trend in enumerate(memory.trends):
            if trend.positive_only:
                banned |= velocities[:, axis] < 0.0
            if trend.negative_only:
                banned |= velocities[:, axis] > 0.0
        return Verdict(np.zeros(len(velocities)), banned)

    def debrief(
        self, situation: Situation, command: Array, memory: OscillationMemory
    ) -> OscillationMemory:
        """Returns the memory after `command`: new bans, or none where they may end."""
        threshold = self._parameters.x_only_threshold
        vx, vy, wz = command.tolist()
        watches_all = threshold < 0.0 or abs(vx) <= threshold
        watched = (vx, vy, wz) if watches_all else (vx, 0.0, 0.0)
        pairs = list(zip(memory.trends, watched, strict=True))
        trends = tuple(trend.followed_by(velocity) for trend, velocity in pairs)
        memory = memory._replace(trends=trends)
        if any(trend.flips_with(velocity) for trend, velocity in pairs):
            memory = memory._replace(
                flip_pose=situation.pose, flip_time_ns=_nanoseconds(situation.time_s)
            )
        if any(trend.is_restricted for trend in trends) and self._may_reset(situation, memory):
            return self.reset(memory)
        return memory

    def _may_reset(self, situation: Situation, memory: OscillationMemory) -> bool:
        """Tells whether the robot has moved, turned or waited enough since the change of sign."""
        x, y, yaw = situation.pose
        flip_x, flip_y, flip_yaw = memory.flip_pose
        least_m = self._parameters.oscillation_reset_dist
        least_rad = self._parameters.oscillation_reset_angle
        moved = (x - flip_x) ** 2 + (y - flip_y) ** 2 > least_m**2
        # As Nav2 reads them from quaternions, both headings lie within half a turn.
        turn = wrap(flip_yaw) - wrap(yaw)
        if not self._controller_parameters.compares_plain_headings:
            turn = wrap(turn)
        turned = abs(turn) > least_rad
        # Nav2 cuts its parameter to whole nanoseconds.
        reset_time_ns = int(self._parameters.oscillation_reset_time * NANOSECONDS_PER_SECOND)
        waited = _nanoseconds(situation.time_s) - memory.flip_time_ns > reset_time_ns
        return (
            (least_m >= 0.0 and moved)
            or (least_rad >= 0.0 and turned)
            or (reset_time_ns >= 0 and waited)
        )


def _nanoseconds(time_s: float) -> int:
    return round(time_s * NANOSECONDS_PER_SECOND)
