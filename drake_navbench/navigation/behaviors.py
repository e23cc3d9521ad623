"""Nav2's behaviours: spin, back up, drive on a heading, wait; pure functions of immutable states.

A behaviour starts from a goal and is then asked once a cycle for a command, until it ends. A
behaviour that would collide, or takes too long, ends with Nav2's error code. Motion is measured in
the odometry frame. Source: nav2_behaviors, branch lyrical; humble to jazzy for driving without
limits.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import ClassVar, NamedTuple

from drake_navbench.kernels.angles import wrap
from drake_navbench.kernels.arrays import Array
from drake_navbench.navigation.behavior import (
    BEHAVIORS,
    Behavior,
    BehaviorServerParameters,
    DriveLimits,
    Step,
    Surroundings,
)

# A spin is over when less than this is left of it, rad.
NEGLIGIBLE_ANGLE_RAD = 1e-6
NANOSECOND_DIGITS = 9
# A command: v m/s, w rad/s.
STOP = (0.0, 0.0)


def _is_out_of_time(time_s: float, start_s: float, allowance_s: float) -> bool:
    """Tells whether a time allowance is spent; 0 or less is unlimited."""
    spent_s = round(time_s - start_s, NANOSECOND_DIGITS)
    return allowance_s > 0.0 and spent_s > allowance_s


class SpinState(NamedTuple):
    """target_yaw: signed turn, rad. previous_yaw: wrapped, rad. turned: so far, rad."""

    target_yaw: float
    time_allowance: float
    start_s: float
    previous_yaw: float
    turned: float = 0.0


class Spin:
    """Turns in place by a signed angle.

    As in Nav2, the look-ahead reaches only as far as the robot has already turned, so that the
    first cycle is not checked at all and a wall may be met before it is seen; a fast spin needs
    more room than its angle asks for.
    """

    TIMEOUT = 701
    COLLISION_AHEAD = 703
    invalid_input_code: ClassVar[int] = 700

    def __init__(self, parameters: BehaviorServerParameters) -> None:
        self._parameters = parameters

    def start(self, arguments: Mapping[str, float], pose: Array, time_s: float) -> SpinState:
        """arguments: target_yaw rad, time_allowance s."""
        return SpinState(
            target_yaw=arguments["target_yaw"],
            time_allowance=arguments.get("time_allowance", 0.0),
            start_s=time_s,
            previous_yaw=wrap(float(pose[2])),
        )

    def step(
        self, state: SpinState, pose: Array, time_s: float, surroundings: Surroundings
    ) -> Step:
        """Returns the turn rate: braking towards the target, within the limits."""
        if _is_out_of_time(time_s, state.start_s, state.time_allowance):
            reason = f"spin: exceeded the time allowance of {state.time_allowance:g} s"
            return Step(state, STOP, error_code=self.TIMEOUT, reason=reason)
        parameters = self._parameters
        yaw = wrap(float(pose[2]))
        turn = yaw - state.previous_yaw
        if abs(turn) > math.pi:
            # Nav2 takes the sign from the yaw before; right as long as yaw and turn have one sign.
            turn = math.copysign(2.0 * math.pi - abs(turn), state.previous_yaw)
        state = state._replace(turned=state.turned + turn, previous_yaw=yaw)
        remaining = abs(state.target_yaw) - abs(state.turned)
        if remaining < NEGLIGIBLE_ANGLE_RAD:
            return Step(state, STOP, is_done=True)
        rate = math.sqrt(2.0 * parameters.rotational_acc_lim * remaining)
        rate = min(max(rate, parameters.min_rotational_vel), parameters.max_rotational_vel)
        rate = math.copysign(rate, state.target_yaw)
        if not self._is_way_free(pose, rate, state.turned, surroundings):
            reason = f"spin: collision ahead after {state.turned:.2f} rad"
            return Step(state, STOP, error_code=self.COLLISION_AHEAD, reason=reason)
        return Step(state, (0.0, rate))

    def _is_way_free(
        self, pose: Array, rate: float, turned: float, surroundings: Surroundings
    ) -> bool:
        frequency = self._parameters.cycle_frequency
        x, y, yaw = (float(value) for value in pose)
        for k in range(int(frequency * self._parameters.simulate_ahead_time)):
            turn = rate * (k / frequency)
            if abs(turned) - abs(turn) <= 0.0:
                break
            if not surroundings.is_free(x, y, yaw + turn):
                return False
        return True


class DriveState(NamedTuple):
    """target_x m and speed m/s, both signed; last_speed: of the cycle before, m/s."""

    target_x: float
    speed: float
    time_allowance: float
    start_s: float
    start_x: float
    start_y: float
    last_speed: float = 0.0


class DriveOnHeading:
    """Drives a distance straight ahead or back, with a ramp at both ends where it has limits."""

    TIMEOUT = 721
    COLLISION_AHEAD = 723
    NAME: ClassVar[str] = "drive_on_heading"
    invalid_input_code: ClassVar[int] = 724

    def __init__(self, parameters: BehaviorServerParameters) -> None:
        self._parameters = parameters
        self._limits: DriveLimits = getattr(parameters, self.NAME)

    def start(self, arguments: Mapping[str, float], pose: Array, time_s: float) -> DriveState:
        """arguments: target_x m, speed m/s, of one sign; time_allowance s."""
        target_x, speed = arguments["target_x"], arguments["speed"]
        if (target_x > 0.0) != (speed > 0.0):
            raise ValueError(
                f"{self.NAME}: target_x {target_x} m and speed {speed} m/s differ in sign"
            )
        return DriveState(
            target_x=target_x,
            speed=speed,
            time_allowance=arguments.get("time_allowance", 0.0),
            start_s=time_s,
            start_x=float(pose[0]),
            start_y=float(pose[1]),
        )

    def step(
        self, state: DriveState, pose: Array, time_s: float, surroundings: Surroundings
    ) -> Step:
        """Returns the speed: along the ramp, slow enough to stop at the target."""
        if _is_out_of_time(time_s, state.start_s, state.time_allowance):
            reason = f"{self.NAME}: exceeded the time allowance of {state.time_allowance:g} s"
            return Step(state, STOP, error_code=self.TIMEOUT, reason=reason)
        driven = math.hypot(pose[0] - state.start_x, pose[1] - state.start_y)
        remaining = abs(state.target_x) - driven
        if remaining <= 0.0:
            return Step(state, STOP, is_done=True)
        speed = self._speed(state, remaining)
        if not self._is_way_free(pose, speed, remaining, surroundings):
            reason = f"{self.NAME}: collision ahead after {driven:.2f} m"
            return Step(state, STOP, error_code=self.COLLISION_AHEAD, reason=reason)
        return Step(state._replace(last_speed=speed), (speed, 0.0))

    def _speed(self, state: DriveState, remaining: float) -> float:
        """Returns the signed speed, computed in the direction of travel."""
        limits, frequency = self._limits, self._parameters.cycle_frequency
        # As in Nav2, a speed of 0 is one backwards.
        direction = 1.0 if state.speed > 0.0 else -1.0
        last, wanted = direction * state.last_speed, direction * state.speed
        if limits.acceleration_limit is None or limits.deceleration_limit is None:
            return direction * max(wanted, limits.minimum_speed)
        lowest = last + limits.deceleration_limit / frequency
        highest = last + limits.acceleration_limit / frequency
        speed = min(max(wanted, lowest), highest)
        speed = min(abs(speed), math.sqrt(-2.0 * limits.deceleration_limit * remaining))
        return direction * max(speed, limits.minimum_speed)

    def _is_way_free(
        self, pose: Array, speed: float, remaining: float, surroundings: Surroundings
    ) -> bool:
        frequency = self._parameters.cycle_frequency
        x, y, yaw = (float(value) for value in pose)
        for k in range(int(frequency * self._parameters.simulate_ahead_time)):
            shift = speed * (k / frequency)
            if remaining - abs(shift) <= 0.0:
                break
            if not surroundings.is_free(x + shift * math.cos(yaw), y + shift * math.sin(yaw), yaw):
                return False
        return True


class BackUp(DriveOnHeading):
    """Drives a distance backwards, whatever the signs of distance and speed."""

    TIMEOUT = 711
    COLLISION_AHEAD = 714
    NAME = "backup"
    invalid_input_code: ClassVar[int] = 713

    def start(self, arguments: Mapping[str, float], pose: Array, time_s: float) -> DriveState:
        """arguments: target_x m, speed m/s, time_allowance s."""
        backward = {name: -abs(arguments[name]) for name in ("target_x", "speed")}
        return super().start({**arguments, **backward}, pose, time_s)


class WaitState(NamedTuple):
    """The end of the wait, s."""

    end_s: float


class Wait:
    """Does nothing for a while, and publishes no command."""

    invalid_input_code: ClassVar[int] = 740

    def __init__(self, parameters: BehaviorServerParameters) -> None:
        pass

    def start(self, arguments: Mapping[str, float], pose: Array, time_s: float) -> WaitState:
        """arguments: time s, of which the magnitude counts."""
        return WaitState(round(time_s + abs(arguments["time"]), NANOSECOND_DIGITS))

    def step(
        self, state: WaitState, pose: Array, time_s: float, surroundings: Surroundings
    ) -> Step:
        """Tells whether the time is over."""
        return Step(state, is_done=round(time_s, NANOSECOND_DIGITS) >= state.end_s)


DEFAULT_BEHAVIORS: Mapping[str, Callable[[BehaviorServerParameters], Behavior]] = {
    "spin": Spin,
    "backup": BackUp,
    "drive_on_heading": DriveOnHeading,
    "wait": Wait,
}
"""The behaviours by the name of Nav2's default plugin list."""


def make_behaviors(server: BehaviorServerParameters) -> dict[str, Behavior]:
    """Returns the behaviours of a server by name; a plugin replaces the built-in one of its name.

    Raises InputError where a third-party behaviour cannot be made.
    """
    ours: dict[str, Behavior] = {
        name: behavior(server) for name, behavior in DEFAULT_BEHAVIORS.items()
    }
    theirs = {
        name: BEHAVIORS.make(parameters.plugin, parameters, server)
        for name, parameters in server.plugin_blocks.items()
    }
    return ours | theirs
