"""The robot's distance from moving bodies, its contact with one, and which of the two drove."""

from __future__ import annotations

from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from drake_navbench.inputs.moving_obstacles import circle, with_people
from drake_navbench.inputs.recorded_people import RecordedPeople
from drake_navbench.inputs.world import World
from drake_navbench.kernels.moving_bodies import (
    FAR_AWAY_M,
    Tracks,
    clearances_of_bodies,
    share_until_contact_with_moving,
)
from drake_navbench.kernels.poses import place_outline
from drake_navbench.kernels.swept_contact import covers

Array = NDArray[np.float64]

# The time up to a contact over which the velocity of a body is measured, s.
VELOCITY_WINDOW_S = 1e-3


class MovingContact:
    """The moving bodies, for a ContactWatch.

    footprint: (K, 2) true outline, base frame, m. States are (6,) x m, y m, yaw rad, v m/s, w
    rad/s, vy m/s. top_speed_mps: an upper bound of the speed of any point of a body.
    """

    def __init__(self, world: World, footprint: Array) -> None:
        self._things, self._people = world.moving, world.people
        self._footprint = footprint
        self._bodies = with_people(world.moving.bodies, world.people.radii_m)
        self._tracks = world.moving.tracks
        self._last: tuple[float, Array] | None = None
        self._appearances_s = np.empty(0)
        self._are_recorded = isinstance(world.people, RecordedPeople)
        if isinstance(world.people, RecordedPeople):
            self._tracks = self._tracks.joined(world.people.tracks)
            self._appearances_s = world.people.appearances_s
        self.top_speed_mps = max(world.moving.top_speed_mps, world.people.top_speed_mps)

    def note_people(self, time_s: float, people: Array | None) -> None:
        """Notes the places (P, 3) to which people have come since the last look."""
        if self._are_recorded or people is None or not len(people):
            return
        knots = np.empty((2 * len(people), 4))
        knots[1::2, 0], knots[1::2, 1:] = time_s, people
        before = self._last or (time_s - VELOCITY_WINDOW_S, people)
        knots[::2, 0], knots[::2, 1:] = before
        # People are discs, so that their headings do not matter.
        knots[:, 3] = 0.0
        firsts = np.arange(0, 2 * len(people) + 1, 2)
        own = Tracks(knots, firsts, np.zeros(len(people)))
        self._tracks = self._things.tracks.joined(own)
        self._last = (time_s, people)

    def until_next_appears_s(self, time_s: float) -> float:
        """Returns the time until the next person appears in the world, s; inf if none does."""
        later = np.searchsorted(self._appearances_s, time_s, side="right")
        return float(np.append(self._appearances_s, np.inf)[later] - time_s)

    def gaps_m(self, time_s: float, state: Array, reach_m: float) -> Array:
        """Returns (B,) the distance from the outline to each body, m; inf beyond `reach_m`."""
        x, y, yaw = state[:3]
        bodies, poses = self._bodies, self._tracks.poses_at(time_s)
        return clearances_of_bodies(
            self._footprint, x, y, yaw, bodies.edges, bodies.discs, poses, reach_m
        )

    def share_until_contact(
        self, start_s: float, start: Array, end_s: float, end: Array, *, touching_m: float
    ) -> float:
        """Returns the share of a step between two states until a body is met; inf where none is."""
        bodies, tracks = self._bodies, self._tracks
        return share_until_contact_with_moving(
            self._footprint,
            start,
            end,
            start_s,
            end_s - start_s,
            bodies.edges,
            bodies.discs,
            tracks.knots,
            tracks.firsts,
            tracks.periods_s,
            self.top_speed_mps,
            touching_m,
        )

    def covers(self, time_s: float, state: Array) -> bool:
        """Returns whether the robot's reference point lies inside a body."""
        return covers(*self._bodies.placed(self._tracks.poses_at(time_s)), *state[:2])

    def account(self, body: int, time_s: float, state: Array) -> dict[str, Any]:
        """Returns the body that was met, and the closing speeds of robot and body, as plain data.

        `robot_closing_mps` is the velocity of the robot's point of contact towards the body,
        `other_closing_mps` that of the body's towards the robot; a negative one went away.
        """
        tracks = self._tracks
        now, before = tracks.poses_at(time_s)[body], tracks.poses_at(time_s - VELOCITY_WINDOW_S)
        rates = (now - before[body]) / VELOCITY_WINDOW_S
        if before[body, 0] >= FAR_AWAY_M:
            # The person has just come into the world, and has no place before.
            rates = np.zeros(3)
        outline = shapely.Polygon(place_outline(self._footprint, state[:3]))
        shape = shapely.Polygon(place_outline(self._outline(body), now))
        near = shapely.get_coordinates(shapely.shortest_line(outline, shape))
        v, w, vy = state[3:]
        cos_yaw, sin_yaw = np.cos(state[2]), np.sin(state[2])
        base_rates = np.array([v * cos_yaw - vy * sin_yaw, v * sin_yaw + vy * cos_yaw, w])
        towards = _direction(near, outline, shape)
        return {
            "name": [*self._things.names, *self._people.names][body],
            "kind": "moving_obstacle" if body < len(self._things) else "person",
            "robot_closing_mps": float(_point_rate(base_rates, near[0] - state[:2]) @ towards),
            "other_closing_mps": float(-_point_rate(rates, near[1] - now[:2]) @ towards),
        }

    def _outline(self, body: int) -> Array:
        """Returns (K, 2) the outline of a body in its own frame, m."""
        if body < len(self._things):
            return self._things.things[body].outline
        return circle(self._people.radii_m[body - len(self._things)])


def _direction(near: Array, outline: shapely.Polygon, shape: shapely.Polygon) -> Array:
    """Returns (2,) the unit vector from the robot to the body at their nearest points (2, 2)."""
    apart = near[1] - near[0]
    if np.hypot(*apart) < 1e-9:
        centres = [shapely.get_coordinates(part.centroid)[0] for part in (outline, shape)]
        apart = centres[1] - centres[0]
    return apart / max(np.hypot(*apart), 1e-12)


def _point_rate(rates: Array, offset: Array) -> Array:
    """Returns (2,) m/s, the velocity of a point `offset` (2,) m from where rates (3,) hold."""
    return rates[:2] + rates[2] * np.array([-offset[1], offset[0]])
