"""The walking of people by a model: its inputs, made of the world and the robot."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from drake_navbench.inputs.moving_obstacles import MovingBox
from drake_navbench.inputs.people import Crowd, OrcaSettings, WalkingPeople
from drake_navbench.inputs.world import World
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.orca import step_orca
from drake_navbench.kernels.orca_edges import linked_edges
from drake_navbench.kernels.poses import place_outline
from drake_navbench.kernels.social_force import step_people

# The time between two choices of people's velocities, s.
PEOPLE_PERIOD_S = 0.05
# The time over which a moving obstacle's velocity is measured, s.
VELOCITY_WINDOW_S = 1e-3


class SeenRobot(NamedTuple):
    """The robot as people see it.

    centre: (3,) x m, y m, yaw rad of its outline's middle, and velocity: (2,) m/s of that point, in
    the world's frame. outline: (K, 2) m. half_length_m, radius_m: extents of the outline about its
    middle.
    """

    centre: Array
    velocity: Array
    outline: Array
    half_length_m: float
    radius_m: float


class Sight:
    """Computes the robot as people see it; footprint: (K, 2) base frame, m."""

    def __init__(self, footprint: Array) -> None:
        low, high = footprint.min(axis=0), footprint.max(axis=0)
        self._middle = 0.5 * (low + high)
        self._points = np.vstack([footprint, self._middle])
        self._half_length_m = 0.5 * (high[0] - low[0])
        self._radius_m = float(np.hypot(*(footprint - self._middle).T).max())

    def of(self, state: Array) -> SeenRobot:
        """Returns the robot as people see it in a state (6,)."""
        placed = place_outline(self._points, state[:3])
        _, _, yaw, v, w, vy = state
        # The velocity of the outline's centre.
        ahead, aside = v - w * self._middle[1], vy + w * self._middle[0]
        cos_yaw, sin_yaw = np.cos(yaw), np.sin(yaw)
        velocity = (ahead * cos_yaw - aside * sin_yaw, ahead * sin_yaw + aside * cos_yaw)
        return SeenRobot(
            np.array([*placed[-1], yaw]),
            np.array(velocity),
            placed[:-1],
            self._half_length_m,
            self._radius_m,
        )


class SocialForceWalk:
    """Moves people by the social force model; moving obstacles are walls to them."""

    def __init__(self, world: World, footprint: Array) -> None:
        self._standing, self._things = (world.segments, world.circles), world.moving
        self._sight = Sight(footprint)

    def step(
        self, people: Array, crowd: Crowd, time_s: float, state: Array, step_s: float
    ) -> Array:
        """Returns (P, 8) the people `step_s` later, at time_s; state: (6,) of the robot."""
        edges, circles = self._standing
        if len(self._things):
            moving = self._things.bodies.placed(self._things.tracks.poses_at(time_s))
            edges, circles = np.vstack([edges, moving[0]]), np.vstack([circles, moving[1]])
        seen = self._sight.of(state)
        robot = np.array([*seen.centre, *seen.velocity, seen.half_length_m])
        robot_edges = np.empty((len(seen.outline), 4))
        robot_edges[:, :2] = seen.outline
        robot_edges[:-1, 2:], robot_edges[-1, 2:] = seen.outline[1:], seen.outline[0]
        return step_people(
            people, crowd.traits, crowd.goals, edges, circles, robot, robot_edges, step_s
        )


class OrcaWalk:
    """Moves people by ORCA; they know that moving obstacles do not give way."""

    def __init__(self, world: World, footprint: Array, settings: OrcaSettings) -> None:
        self._standing, self._things = linked_edges(world.free_rings), world.moving
        self._sight, self._settings = Sight(footprint), settings.as_array

    def step(
        self, people: Array, crowd: Crowd, time_s: float, state: Array, step_s: float
    ) -> Array:
        """Returns (P, 8) the people `step_s` later, at time_s; state: (6,) of the robot."""
        seen = self._sight.of(state)
        robot = np.array([*seen.centre[:2], *seen.velocity, seen.radius_m])
        return step_orca(
            people,
            crowd.traits,
            crowd.goals,
            self._with_things(time_s),
            robot,
            self._settings,
            step_s,
            PEOPLE_PERIOD_S,
        )

    def _with_things(self, time_s: float) -> tuple[Array, Array]:
        """Returns edges (N, 9) of all obstacles, and discs (M, 5) of moving ones."""
        if not len(self._things):
            return self._standing, np.empty((0, 5))
        tracks = self._things.tracks
        here = tracks.poses_at(time_s)
        rates = (tracks.poses_at(time_s + VELOCITY_WINDOW_S) - here) / VELOCITY_WINDOW_S
        rings, velocities, discs = [], [], []
        for thing, pose, rate in zip(self._things.things, here, rates, strict=True):
            if isinstance(thing, MovingBox):
                rings.append(place_outline(thing.outline, pose))
                velocities.append(rate[:2])
            else:
                discs.append([*pose[:2], *rate[:2], thing.radius_m])
        moving = linked_edges(rings, velocities)
        moving[:, 4:6] += len(self._standing)
        return np.vstack([self._standing, moving]), np.array(discs).reshape(-1, 5)


def walk_of(world: World, footprint: Array) -> SocialForceWalk | OrcaWalk | None:
    """Returns the model that moves the world's people, None where no one walks by a model.

    footprint: (K, 2) of the robot, base frame, m.
    """
    people = world.people
    if not isinstance(people, WalkingPeople) or people.people is None:
        return None
    if people.people.model == "orca":
        return OrcaWalk(world, footprint, people.people.orca or OrcaSettings())
    return SocialForceWalk(world, footprint)
