"""People in a scenario: those who walk by a model, and those of a recording."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from drake_navbench.kernels import social_force
from drake_navbench.noise import NoiseKey, NoiseStream
from drake_navbench.typed_files.quantities import Angle, Length, Size
from drake_navbench.typed_files.typed_yaml import FrozenModel

Array = NDArray[np.float64]

MAX_PEOPLE = 200
# What a scan sees of somebody: the shins below the hip, the trunk above.
HIP_HEIGHT_M, LEG_RADIUS_M, TRUNK_RADIUS_M = 0.85, 0.06, 0.18
HIP_HALF_WIDTH_M = 0.11
# Two steps of somebody of middle height, and how far a foot is ahead at most, at 1 m/s and more.
STRIDE_M, SWING_M = 1.3, 0.28
REACTIONS = {
    "regular": social_force.REGULAR,
    "impassive": social_force.IMPASSIVE,
    "surprised": social_force.SURPRISED,
    "scared": social_force.SCARED,
    "curious": social_force.CURIOUS,
    "threatening": social_force.THREATENING,
}


class Person(FrozenModel):
    """Somebody who walks from goal to goal, and reacts to the robot."""

    name: str = Field("", description="What reports and replays call them.")
    start: tuple[Length, Length] = Field(description="Where they begin [m].")
    yaw_rad: Angle = Field(0.0, description="Their heading at the beginning [rad].")
    goals: list[tuple[Length, Length]] = Field(
        default_factory=list,
        max_length=1000,
        description="Where they go, one after another, each within 0.3 m; none: they stay [m].",
    )
    repeats: bool = Field(True, description="Whether they go on with the first goal again.")
    speed_mps: float = Field(1.0, gt=0.0, le=2.0, description="How fast they want to go [m/s].")
    radius_m: Size = Field(
        0.3, le=1.0, description="Of the disc that stands for the body, in contacts and forces [m]."
    )
    reaction: Literal["regular", "impassive", "surprised", "scared", "curious", "threatening"] = (
        Field("regular", description="What they do about the robot; see docs/living_world.md.")
    )
    group: int | None = Field(None, ge=0, le=1000, description="Who belongs together; null: alone.")

    @property
    def ways(self) -> list[tuple[tuple[float, float], tuple[float, float]]]:
        """The straight ways that they mean to go."""
        places = [self.start, *self.goals]
        if self.repeats and len(self.goals) > 1:
            places.append(self.goals[0])
        return list(pairwise(places))


class People(FrozenModel):
    """Those who walk by the social force model."""

    persons: list[Person] = Field(min_length=1, max_length=MAX_PEOPLE, description="Who there is.")
    start_xy_std_m: float = Field(
        0.0, ge=0.0, le=1.0, description="Spread of where they begin, from trial to trial [m]."
    )
    speed_std_mps: float = Field(
        0.0, ge=0.0, le=1.0, description="Spread of how fast they want to go [m/s]."
    )


class Crowd(NamedTuple):
    """People as `kernels.social_force` takes them.

    state: (P, 8) at the beginning. traits: (P, 7). goals: (G, 2) m, of all persons.
    """

    state: Array
    traits: Array
    goals: Array


@dataclass(frozen=True)
class WalkingPeople:
    """Everybody in a world who walks by a model."""

    people: People | None = None

    def __len__(self) -> int:
        return len(self.persons)

    @property
    def persons(self) -> tuple[Person, ...]:
        """Each of them."""
        return () if self.people is None else tuple(self.people.persons)

    @cached_property
    def radii_m(self) -> Array:
        """(P,) of the discs that stand for their bodies, m."""
        return np.array([person.radius_m for person in self.persons])

    @property
    def names(self) -> list[str]:
        """What each is called: the name, else the place in the file."""
        return [p.name or f"persons[{index}]" for index, p in enumerate(self.persons)]

    def crowd(self, seed: int) -> Crowd:
        """Returns them as they begin the trial with this seed, the same for all controllers."""
        states: list[list[float]] = []
        traits: list[list[float]] = []
        goals: list[tuple[float, float]] = []
        for index, person in enumerate(self.persons):
            assert self.people is not None
            draws = NoiseKey(seed, NoiseStream.PEOPLE, index).generator().standard_normal(3)
            start = np.array(person.start) + self.people.start_xy_std_m * draws[:2]
            speed = person.speed_mps + self.people.speed_std_mps * draws[2]
            speed = float(np.clip(speed, 0.2 * person.speed_mps, 2.0))
            own = person.goals or [(float(start[0]), float(start[1]))]
            states.append([*start, person.yaw_rad, 0.0, 0.0, 0.0, 0.0, 0.0])
            group = -1 if person.group is None else person.group
            first = len(goals)
            goals += own
            traits.append(
                [
                    *(speed, person.radius_m, REACTIONS[person.reaction], group),
                    *(first, len(goals), person.repeats),
                ]
            )
        return Crowd(
            np.array(states, dtype=float).reshape(-1, social_force.STATE_SIZE),
            np.array(traits, dtype=float).reshape(-1, social_force.TRAIT_SIZE),
            np.array(goals, dtype=float).reshape(-1, 2),
        )


NOBODY = WalkingPeople()


def foot_offsets_m(walked_m: Array, speed_mps: Array) -> Array:
    """Returns (P,) how far the left shin is ahead of the trunk, the right one as far behind it.

    walked_m: (P,) the way so far, which tells where in a stride they are. speed_mps: (P,); below
    1 m/s steps are shorter, and who stands has both feet side by side.
    """
    swing_m = SWING_M * np.minimum(speed_mps, 1.0)
    return swing_m * np.sin(2.0 * np.pi / STRIDE_M * walked_m)


def scanned_discs(poses: Array, walked_m: Array, speed_mps: Array, height_m: float) -> Array:
    """Returns (D, 3) x, y, radius m of what a plane at some height sees of people.

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
