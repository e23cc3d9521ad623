"""The ride in a lift that a robot asks for: the lift comes, late or not at all, and takes time.

A ride is a pure function of the lift's times, the trial's seed and the number of the leg, so that
every controller meets the same ride whenever it gets to the lift.
"""

from __future__ import annotations

from dataclasses import dataclass

from pydantic import Field, model_validator

from drake_navbench.kernels.immutable import Immutable
from drake_navbench.kernels.noise import NoiseKey, NoiseStream
from drake_navbench.typed_files.quantities import Angle, Duration, Length, Period
from drake_navbench.typed_files.typed_yaml import FrozenModel

# With more requests a robot would ask for days on end.
MAX_REQUESTS = 1000


class LiftTimes(FrozenModel):
    """The durations of a lift's ride, its failures, and the error of the robot's pose afterwards.

    By default the ride takes no time and does not fail: it is a door between two maps.
    """

    door_s: Duration = Field(
        0.0, ge=0.0, description="Time for the doors, at both ends together [s]."
    )
    travel_s: Duration = Field(0.0, ge=0.0, description="Time from one floor to the other [s].")
    travel_std_s: Duration = Field(0.0, ge=0.0, description="Standard deviation of travel_s [s].")
    late_mean_s: Duration = Field(
        0.0,
        ge=0.0,
        description="Mean waiting time for the lift, which is drawn from an exponential "
        "distribution [s].",
    )
    refused_probability: float = Field(
        0.0, ge=0.0, le=1.0, description="Probability that a request is refused."
    )
    patience_s: Duration | None = Field(
        None,
        ge=0.0,
        description="Longest time that the robot waits for the lift and repeats refused "
        "requests [s]; null: as long as the trial lasts, with a single request.",
    )
    retry_s: Period = Field(5.0, description="Time from a refused request to the next one [s].")
    xy_std_m: Length = Field(
        0.0,
        ge=0.0,
        description="Standard deviation of the localized position on x and y after the ride [m].",
    )
    yaw_std_rad: Angle = Field(
        0.0, ge=0.0, description="Standard deviation of the localized heading after the ride [rad]."
    )

    @model_validator(mode="after")
    def _check_requests(self) -> LiftTimes:
        if self.patience_s is not None and self.patience_s > MAX_REQUESTS * self.retry_s:
            raise ValueError(
                f"retry_s: expected at most {MAX_REQUESTS} requests within patience_s of "
                f"{self.patience_s:g} s, got one every {self.retry_s:g} s"
            )
        return self

    @property
    def errs(self) -> bool:
        """Whether the robot is localized with an error after a ride."""
        return self.xy_std_m > 0.0 or self.yaw_std_rad > 0.0


@dataclass(frozen=True)
class Ride(Immutable):
    """The ride of a robot from its request of the lift.

    events: (s since the request, event): 'requested', 'refused', 'came', 'arrived', 'gave up'.
    duration_s: until the robot stands on the other floor, or gives up. failure: the reason for
    giving up, or ''. error: m, m, rad, in the map, of the pose at which the robot is localized
    then.
    """

    events: tuple[tuple[float, str], ...]
    duration_s: float
    failure: str = ""
    error: tuple[float, float, float] = (0.0, 0.0, 0.0)


def draw_ride(times: LiftTimes, seed: int, leg: int) -> Ride:
    """Returns the ride of a leg, counted from 0, in the trial with this seed."""
    events: list[tuple[float, str]] = []
    now_s, patience_s = 0.0, times.patience_s
    for request in range(MAX_REQUESTS + 1):
        events.append((now_s, "requested"))
        step = (MAX_REQUESTS + 1) * leg + request
        generator = NoiseKey(seed, NoiseStream.LIFT, step).generator()
        refusal, lateness, travel = (
            generator.random(),
            generator.standard_exponential(),
            generator.standard_normal(),
        )
        if refusal >= times.refused_probability:
            came_s = now_s + times.late_mean_s * lateness
            if patience_s is not None and came_s > patience_s:
                events.append((patience_s, "gave up"))
                return Ride(tuple(events), patience_s, f"did not come within {patience_s:g} s")
            travel_s = max(0.0, times.travel_s + times.travel_std_s * travel)
            arrived_s = came_s + times.door_s + travel_s
            events += [(came_s, "came"), (arrived_s, "arrived")]
            return Ride(tuple(events), arrived_s, error=_error(times, seed, leg))
        events.append((now_s, "refused"))
        if patience_s is None:
            return Ride((*events, (now_s, "gave up")), now_s, "was refused")
        if now_s + times.retry_s > patience_s:
            break
        now_s += times.retry_s
    assert patience_s is not None
    count = sum(name == "refused" for _, name in events)
    failure = f"was refused {count} times within {patience_s:g} s"
    return Ride((*events, (patience_s, "gave up")), patience_s, failure)


def _error(times: LiftTimes, seed: int, leg: int) -> tuple[float, float, float]:
    normals = NoiseKey(seed, NoiseStream.LIFT_LOCALIZATION, leg).generator().standard_normal(3)
    x, y, yaw = normals.tolist()
    return times.xy_std_m * x, times.xy_std_m * y, times.yaw_std_rad * yaw
