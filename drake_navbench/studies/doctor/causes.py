"""Causes of a symptom: a parameter and a direction, or a thing outside the file."""

from __future__ import annotations

from enum import StrEnum
from typing import Any, NamedTuple

# First parts of places that no change of the file mends.
OUTSIDE = "outside"
RELEASE = "release"
# What things outside of the file are called.
OUTSIDE_TOLD = {
    "clock": "the clocks: use_sim_time, time synchronisation",
    "compute": "the computer: build type, load, processor",
    "deadband": "the drives: the least command that moves them",
    "enable_stamped_cmd_vel": "the type of the command message that the base listens for",
    "frames": "the tree of frames (TF)",
    "imu_frame": "the frame of the IMU in the robot's description",
    "lag": "the base: how late it answers commands",
    "localization": "the localization: pose jumps, drift, map",
    "odometry": "the odometry: slip, delay, scale",
    "rear_sensor": "the sensors: nothing looks behind",
    "sensor_frame": "the sensor's frame in the robot's description",
}


class Direction(StrEnum):
    """The direction in which a parameter is to change."""

    UP = "up"
    DOWN = "down"
    SET = "set"
    ADD = "add"
    UPGRADE = "upgrade"


class Cause(NamedTuple):
    """A culprit with the direction of its cure.

    place: as of `Facts`, with '*' for any name; 'outside.<thing>'; 'release'. to: the value of the
    cure where it is known, else None. why: one sentence.
    """

    place: str
    direction: Direction
    to: Any = None
    why: str = ""
    source: str = ""

    @property
    def is_outside(self) -> bool:
        """Whether no change of the file mends it."""
        return self.place.partition(".")[0] in (OUTSIDE, RELEASE)

    @property
    def key(self) -> tuple[str, Direction]:
        """Place and direction, by which two causes are the same."""
        return self.place, self.direction

    @property
    def told(self) -> str:
        """The culprit and its cure in words."""
        if self.place == RELEASE:
            return f"release: {self.to or 'upgrade to a newer one'}"
        first, _, rest = self.place.partition(".")
        if first == OUTSIDE:
            return f"outside the file: {OUTSIDE_TOLD.get(rest, rest)}"
        place = self.place.removeprefix("controller.")
        if self.direction is Direction.ADD:
            return f"{place}: add one"
        if self.to is not None:
            return f"{place}: {self.direction} to {self.to}" if self.is_number else self._set_told
        return f"{place}: {'check and set' if self.direction is Direction.SET else self.direction}"

    @property
    def is_number(self) -> bool:
        """Whether the cure's value is a number with a direction."""
        return self.direction in (Direction.UP, Direction.DOWN)

    @property
    def _set_told(self) -> str:
        value = str(self.to).lower() if isinstance(self.to, bool) else self.to
        place = self.place.removeprefix("controller.")
        return f"{place}: {'add ' if place == 'critics' else ''}{value}"
