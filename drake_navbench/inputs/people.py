"""People in a scenario, who walk by a model or as recorded."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any, ClassVar, Literal, NamedTuple

import numpy as np
from pydantic import Field, field_validator, model_validator

from drake_navbench.kernels import walking
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.noise import NoiseKey, NoiseStream
from drake_navbench.typed_files.quantities import Angle, Duration, Length, Size
from drake_navbench.typed_files.typed_yaml import FrozenModel, QuietModel, tuples_for_lists

MAX_PEOPLE = 200
# Heights of the body as a scan sees it: shins below the hip, the trunk above, m.
HIP_HEIGHT_M, LEG_RADIUS_M, TRUNK_RADIUS_M = 0.85, 0.06, 0.18
HIP_HALF_WIDTH_M = 0.11
# The length of two steps of a person of middle height, and the largest distance of a foot ahead,
# at 1 m/s and more.
STRIDE_M, SWING_M = 1.3, 0.28
REACTIONS = {
    "regular": walking.REGULAR,
    "impassive": walking.IMPASSIVE,
    "surprised": walking.SURPRISED,
    "scared": walking.SCARED,
    "curious": walking.CURIOUS,
    "threatening": walking.THREATENING,
    "oblivious": walking.OBLIVIOUS,
}
# The reactions that only change a person's way.
REACTIONS_WITH_ORCA = ("regular", "impassive", "oblivious")
# Spread of the angle between a person's desired direction and that to the goal, with ORCA, so that
# two who meet exactly head on do not stand still before each other.
ASIDE_STD_RAD = 0.02
# The number of draws for a person whose start is taken, before the file's own start is used.
MAX_STARTS = 20


class Person(FrozenModel):
    """A person who walks from goal to goal, and reacts to the robot."""

    name: str = Field("", description="Name of the person in reports and replays.")
    start: tuple[Length, Length] = Field(description="Start position [m].")
    yaw_rad: Angle = Field(0.0, description="Start heading [rad].")
    goals: list[tuple[Length, Length]] = Field(
        default_factory=list,
        max_length=1000,
        description="Goals in order, each reached within 0.3 m; none: the person stays [m].",
    )
    repeats: bool = Field(True, description="Start over with the first goal after the last one.")
    speed_mps: float = Field(1.0, gt=0.0, le=2.0, description="Desired walking speed [m/s].")
    radius_m: Size = Field(
        0.3,
        le=1.0,
        description="Radius of the disc that stands for the body, for touches and forces [m].",
    )
    reaction: Literal[
        "regular", "impassive", "surprised", "scared", "curious", "threatening", "oblivious"
    ] = Field("regular", description="Reaction to the robot; see docs/living_world.md.")
    group: int | None = Field(
        None,
        ge=0,
        le=1000,
        description="Name of the group that the person belongs to; null: no group.",
    )

    @property
    def ways(self) -> list[tuple[tuple[float, float], tuple[float, float]]]:
        """The straight ways along which the person means to go."""
        places = [self.start, *self.goals]
        if self.repeats and len(self.goals) > 1:
            places.append(self.goals[0])
        return list(pairwise(places))


class OrcaSettings(FrozenModel):
    """Settings of optimal reciprocal collision avoidance."""

    time_horizon_s: Duration = Field(
        3.0, gt=0.0, le=60.0, description="Time ahead for which other people are avoided [s]."
    )
    obstacle_time_horizon_s: Duration = Field(
        1.0, gt=0.0, le=60.0, description="Time ahead for which standing obstacles are avoided [s]."
    )
    neighbour_distance_m: Length = Field(
        10.0, gt=0.0, description="Distance within which other people are avoided [m]."
    )
    max_neighbours: int = Field(
        10, ge=0, le=1000, description="Number of nearest people that are avoided."
    )
    max_speed_ratio: float = Field(
        1.5, ge=1.0, le=5.0, description="Largest speed over the desired speed."
    )
    margin_m: Length = Field(
        0.1,
        ge=0.0,
        le=2.0,
        description="Gap that people keep between two bodies where they can [m].",
    )

    @property
    def as_array(self) -> Array:
        """The settings as (6,), in the order of `kernels.orca`."""
        return np.array(
            [
                *(self.time_horizon_s, self.obstacle_time_horizon_s),
                *(self.neighbour_distance_m, self.max_neighbours),
                *(self.max_speed_ratio, self.margin_m),
            ],
            dtype=float,
        )


class Recording(FrozenModel):
    """A recording of people in a file: they walk as recorded, whatever the robot does."""

    file: str = Field(min_length=1, description="Path of the recording from the scenario's folder.")
    format: Literal["csv", "eth_ucy"] = Field(
        "csv",
        description="Format of the recording. csv: a header and rows time_s,person,x_m,y_m. "
        "eth_ucy: rows of frame, person, x, y separated by blanks, as in the ETH "
        "and UCY recordings.",
    )
    frame_rate_hz: float | None = Field(
        None, gt=0.0, le=1000.0, description="Frame rate of an eth_ucy recording [Hz]."
    )
    start_time_s: float = Field(
        0.0, description="Time of the recording at which the trial begins [s]."
    )
    origin: tuple[Length, Length] = Field(
        (0.0, 0.0), description="Position of the recording's origin in the world frame [m]."
    )
    yaw_rad: Angle = Field(
        0.0, description="Angle of the recording's axes in the world frame [rad]."
    )
    max_gap_s: Duration = Field(
        2.0,
        gt=0.0,
        description="Time between two rows above which a person counts as absent in between [s].",
    )
    max_speed_mps: float = Field(
        5.0,
        gt=0.0,
        le=15.0,
        description="Speed above which a person counts as wrongly tracked, which is an error "
        "[m/s].",
    )
    radius_m: Size = Field(
        0.3, le=1.0, description="Radius of the disc that stands for a body [m]."
    )
    groups: tuple[tuple[str, ...], ...] = Field(
        (), max_length=1000, description="Groups: lists of names as in the recording."
    )

    @model_validator(mode="after")
    def _check_frame_rate(self) -> Recording:
        if (self.format == "eth_ucy") != (self.frame_rate_hz is not None):
            expected = "the frames a second" if self.format == "eth_ucy" else "none"
            raise ValueError(
                f"frame_rate_hz: expected {expected} with format {self.format}, got "
                f"{self.frame_rate_hz}"
            )
        return self


class People(QuietModel):
    """The people of a world, who walk by a model or as recorded."""

    quiet: ClassVar = frozenset({"model", "orca", "recording", "time_gap_s"})

    model: Literal["social_force", "orca"] = Field(
        "social_force", description="Model by which people walk; see docs/living_world.md."
    )
    orca: OrcaSettings | None = Field(
        None, description="Settings of the model orca; null: its defaults."
    )
    recording: Recording | None = Field(
        None, description="Path or settings of a recording, in place of persons."
    )
    persons: list[Person] = Field(
        default_factory=list, max_length=MAX_PEOPLE, description="The persons."
    )
    start_xy_std_m: float = Field(
        0.0,
        ge=0.0,
        le=1.0,
        description="Standard deviation of the start positions, drawn for each trial [m].",
    )
    speed_std_mps: float = Field(
        0.0,
        ge=0.0,
        le=1.0,
        description="Standard deviation of the desired speeds, drawn for each trial [m/s].",
    )

    time_gap_s: float = Field(
        0.0,
        ge=0.0,
        le=5.0,
        description="Time gap that people keep to whoever walks ahead, so that dense crowds "
        "are slower; 0: none, as in HuNavSim [s].",
    )

    @field_validator("recording", mode="before")
    @classmethod
    def _accept_file(cls, value: Any) -> Any:
        """Accepts the name of a file in place of settings."""
        return {"file": value} if isinstance(value, str) else tuples_for_lists(value)

    @model_validator(mode="after")
    def _check(self) -> People:
        if self.recording is not None:
            for name, field in type(self).model_fields.items():
                default = field.get_default(call_default_factory=True)
                if name != "recording" and getattr(self, name) != default:
                    raise ValueError(f"{name}: has no effect on recorded people; leave it out")
            return self
        if not self.persons:
            raise ValueError("persons: expected at least one person, or a recording")
        if self.model == "orca":
            for index, person in enumerate(self.persons):
                if person.reaction not in REACTIONS_WITH_ORCA:
                    raise ValueError(
                        f"persons[{index}].reaction: with model orca expected one of "
                        f"{', '.join(REACTIONS_WITH_ORCA)}, got {person.reaction}"
                    )
        elif self.orca is not None:
            raise ValueError(f"orca: expected model orca, got {self.model}")
        return self


class Crowd(NamedTuple):
    """People as the kernels take them; see `kernels.walking`.

    state: (P, 8) at the beginning. traits: (P, 9). goals: (G, 2) m, of all persons.
    """

    state: Array
    traits: Array
    goals: Array


@dataclass(frozen=True)
class WalkingPeople:
    """The people of a world who walk by a model."""

    people: People | None = None

    def __len__(self) -> int:
        return len(self.persons)

    @property
    def persons(self) -> tuple[Person, ...]:
        """The people, one after another."""
        return () if self.people is None else tuple(self.people.persons)

    @cached_property
    def radii_m(self) -> Array:
        """(P,) the radii of the discs that stand for the people's bodies, m."""
        return np.array([person.radius_m for person in self.persons])

    @property
    def names(self) -> list[str]:
        """The people's names: the given one, else the place in the file."""
        return [p.name or f"persons[{index}]" for index, p in enumerate(self.persons)]

    @property
    def groups(self) -> list[int]:
        """The group of each person; -1 for one alone."""
        return [-1 if person.group is None else person.group for person in self.persons]

    @property
    def top_speed_mps(self) -> float:
        """An upper bound of the people's speed, m/s."""
        return walking.TOP_SPEED_MPS if self.persons else 0.0

    def crowd(self, seed: int, is_free: Callable[[Array, float], bool] | None = None) -> Crowd:
        """Returns the people at the start of the trial with this seed, for any controller.

        is_free: whether a disc at (2,) m of a radius m is clear of all bodies. A person whose drawn
        start is not free draws again, up to MAX_STARTS times, and then begins at the file's start.
        """
        states: list[list[float]] = []
        traits: list[list[float]] = []
        goals: list[tuple[float, float]] = []
        for index, person in enumerate(self.persons):
            assert self.people is not None
            generator = NoiseKey(seed, NoiseStream.PEOPLE, index).generator()
            draws = generator.standard_normal(3)
            std_m = self.people.start_xy_std_m
            start = np.array(person.start) + std_m * draws[:2]
            speed = person.speed_mps + self.people.speed_std_mps * draws[2]
            speed = float(np.clip(speed, 0.2 * person.speed_mps, 2.0))
            is_orca = self.people.model == "orca"
            aside = ASIDE_STD_RAD * generator.standard_normal() if is_orca else 0.0
            if std_m > 0.0 and is_free is not None:
                start = _free_start(person, start, std_m, generator, is_free)
            own = person.goals or [(float(start[0]), float(start[1]))]
            states.append([*start, person.yaw_rad, 0.0, 0.0, 0.0, 0.0, 0.0])
            first = len(goals)
            goals += own
            traits.append(
                [
                    *(speed, person.radius_m, REACTIONS[person.reaction], self.groups[index]),
                    *(first, len(goals), person.repeats, aside, self.people.time_gap_s),
                ]
            )
        return Crowd(
            np.array(states, dtype=float).reshape(-1, walking.STATE_SIZE),
            np.array(traits, dtype=float).reshape(-1, walking.TRAIT_SIZE),
            np.array(goals, dtype=float).reshape(-1, 2),
        )


NOBODY = WalkingPeople()


def _free_start(
    person: Person,
    start: Array,
    std_m: float,
    generator: np.random.Generator,
    is_free: Callable[[Array, float], bool],
) -> Array:
    """Returns a person's start (2,), m: `start` where it is free, else another draw that is."""
    for _ in range(MAX_STARTS):
        if is_free(start, person.radius_m):
            return start
        start = np.array(person.start) + std_m * generator.standard_normal(2)
    return np.array(person.start)


def foot_offsets_m(walked_m: Array, speed_mps: Array) -> Array:
    """Returns (P,) the left shin's distance ahead of the trunk, m; the right one is as far behind.

    walked_m: (P,) the way so far, which gives the phase of the stride. speed_mps: (P,); below 1 m/s
    steps are shorter, and a standing person has both feet side by side.
    """
    swing_m = SWING_M * np.minimum(speed_mps, 1.0)
    return swing_m * np.sin(2.0 * np.pi / STRIDE_M * walked_m)


def scanned_discs(poses: Array, walked_m: Array, speed_mps: Array, height_m: float) -> Array:
    """Returns (D, 3) x, y, radius m of people's sections at a height over the floor.

    poses: (P, 3). Two shins each below the hip, else one trunk.
    """
    if height_m >= HIP_HEIGHT_M:
        return np.column_stack([poses[:, :2], np.full(len(poses), TRUNK_RADIUS_M)])
    ahead = foot_offsets_m(walked_m, speed_mps)
    cos_yaw, sin_yaw = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    discs = np.empty((2 * len(poses), 3))
    for row, side in enumerate((1.0, -1.0)):
        left = side * HIP_HALF_WIDTH_M
        discs[row::2, 0] = poses[:, 0] + side * ahead * cos_yaw - left * sin_yaw
        discs[row::2, 1] = poses[:, 1] + side * ahead * sin_yaw + left * cos_yaw
        discs[row::2, 2] = LEG_RADIUS_M
    return discs
