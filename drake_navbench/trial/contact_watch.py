"""The robot's first touch of a body: the truth, at every instant of a simulation."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely

from drake_navbench.inputs.drive import Drive
from drake_navbench.inputs.moving_obstacles import circle, with_people
from drake_navbench.inputs.recorded_people import RecordedPeople
from drake_navbench.inputs.world import World
from drake_navbench.kernels.arrays import Array
from drake_navbench.kernels.moving_bodies import (
    FAR_AWAY_M,
    Tracks,
    clearances_of_bodies,
    share_until_contact_with_moving,
)
from drake_navbench.kernels.poses import place_outline
from drake_navbench.kernels.swept_contact import (
    clearance_at,
    covers,
    pose_within_step,
    share_until_contact,
    soonest_contact_s,
)

# The search for the instant of the touch ends at this gap, m.
TOUCHING_M = 1e-5
# Bodies beyond this distance, m, are not checked; the robot needs seconds to get there.
REACH_M = 5.0
# An integrator may make a step longer than its limit, by this factor, to meet an event.
STEP_STRETCH = 1.1
# The time up to a touch over which the velocity of a body is measured, s.
VELOCITY_WINDOW_S = 1e-3


@dataclass(frozen=True)
class Contact:
    """The first touch of a trial.

    time_s: its time. state: (6,) of the robot, x m, y m, yaw rad, v m/s, w rad/s, vy m/s. body: the
    index of the moving body that was touched; None for a standing obstacle.
    """

    time_s: float
    state: Array
    body: int | None = None


@dataclass(frozen=True)
class _Look:
    """A state (6,) of the robot that touches nothing, and the time until which none is possible."""

    time_s: float
    state: Array
    free_until_s: float


class ContactWatch:
    """Finds the robot's first touch of a body, for a Simulator's monitor.

    From the clearance and the limits of the drive follows a time before which a touch is
    impossible; until then nothing is computed. A step in which a touch is possible is searched by
    conservative advancement along the dense output of the integrator, so that no touch of the
    simulated motion is missed, however thin and however short. Bodies less than TOUCHING_M apart
    touch. For moving bodies the limit is the speed at which they and the robot can close the gap.

    drive: its limits bound the speed of the outline. footprint: (K, 2) true outline, base frame, m.
    max_step_s: the integrator's.

    contact: the first touch, None before it. moving: the moving bodies, None without any.
    idle_until_s: no touch is possible before this time.
    """

    def __init__(self, drive: Drive, world: World, *, footprint: Array, max_step_s: float) -> None:
        self.contact: Contact | None = None
        self.idle_until_s = -math.inf
        self._footprint = np.ascontiguousarray(footprint)
        self._edges, self._circles = world.segments, world.circles
        self.moving = MovingContact(world, self._footprint) if world.moving_count else None
        self._look_ahead_s = STEP_STRETCH * max_step_s
        self._radius_m = float(np.hypot(*footprint.T).max())
        bounds = drive.true_bounds
        self._acceleration_mps2 = self._outline_rate(
            bounds.acceleration_mps2, bounds.yaw_acceleration_radps2
        )
        self._top_speed_mps = self._outline_rate(bounds.speed_mps, bounds.yaw_rate_radps)
        self._last: _Look | None = None
        self._floor_changes = 0

    def come_to_floor(self, number: int) -> None:
        """Starts anew on another floor: a lift changes the pose at once, with no motion to search.

        number: number of the changes of floor so far.
        """
        if number != self._floor_changes:
            self._floor_changes = number
            self._last, self.idle_until_s = None, -math.inf

    def look(self, time_s: float, state: Array, people: Array | None = None) -> None:
        """Looks for a touch at the end of a step, at `state` (6,), and within it if need be.

        people: (P, 3) x m, y m, yaw rad at the end of the step; during it they walk straight.
        """
        if self.moving is not None:
            self.moving.note_people(time_s, people)
        if self._last is not None and time_s > self._last.free_until_s:
            self.contact = self._contact_since(self._last, time_s, state)
        if self.contact is not None:
            return
        x, y, yaw = state[:3]
        gap_m = clearance_at(self._footprint, x, y, yaw, self._edges, self._circles, REACH_M)
        # Later in a trial no way leads into an obstacle but through its edge.
        starts_inside = self._last is None and covers(self._edges, self._circles, *state[:2])
        if gap_m <= TOUCHING_M or starts_inside:
            self.contact = Contact(time_s, state)
            return
        v, w, vy = state[3:]
        speed_mps = self._outline_rate(math.hypot(v, vy), w)
        free_s = soonest_contact_s(
            min(gap_m, REACH_M) - TOUCHING_M,
            speed_mps=speed_mps,
            acceleration_mps2=self._acceleration_mps2,
            top_speed_mps=max(self._top_speed_mps, speed_mps),
        )
        if self.moving is not None:
            gaps_m = self.moving.gaps_m(time_s, state, REACH_M)
            nearest = int(np.argmin(gaps_m))
            is_within = self._last is None and self.moving.covers(time_s, state)
            if gaps_m[nearest] <= TOUCHING_M or is_within:
                self.contact = Contact(time_s, state, nearest)
                return
            free_s = min(
                free_s, self._free_of_moving_s(self.moving, time_s, gaps_m[nearest], speed_mps)
            )
        self._last = _Look(time_s, state, time_s + free_s)
        self.idle_until_s = time_s + free_s - self._look_ahead_s

    def _contact_since(self, last: _Look, time_s: float, state: Array) -> Contact | None:
        """Returns the first touch between the last look and now."""
        duration_s = time_s - last.time_s
        share = share_until_contact(
            self._footprint,
            last.state,
            state,
            duration_s,
            self._edges,
            self._circles,
            TOUCHING_M,
        )
        moving_share = math.inf
        if self.moving is not None:
            moving_share = self.moving.share_until_contact(
                last.time_s, last.state, time_s, state, touching_m=TOUCHING_M
            )
        if math.isinf(min(share, moving_share)):
            return None
        hits_moving, share = moving_share < share, min(share, moving_share)
        pose = pose_within_step(last.state, state, duration_s, share)
        twist = (1.0 - share) * last.state[3:] + share * state[3:]
        met_s, met = last.time_s + share * duration_s, np.concatenate([pose, twist])
        if self.moving is None or not hits_moving:
            return Contact(met_s, met)
        return Contact(met_s, met, int(np.argmin(self.moving.gaps_m(met_s, met, REACH_M))))

    def _free_of_moving_s(
        self, moving: MovingContact, time_s: float, gap_m: float, speed_mps: float
    ) -> float:
        """Returns the time for which the robot cannot meet any moving body, s."""
        moving_mps = moving.top_speed_mps
        soonest_s = soonest_contact_s(
            min(gap_m, REACH_M) - TOUCHING_M,
            speed_mps=speed_mps + moving_mps,
            acceleration_mps2=self._acceleration_mps2,
            top_speed_mps=max(self._top_speed_mps, speed_mps) + moving_mps,
        )
        return min(soonest_s, moving.until_next_appears_s(time_s))

    def _outline_rate(self, linear: float, angular: float) -> float:
        """Returns a bound of a rate of the outline's points, by rates of the base, in SI units."""
        return abs(linear) + self._radius_m * abs(angular)


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
        """Notes the poses (P, 3) of people, and with them their motion since the last look."""
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
            (start_s, end_s - start_s),
            (bodies.edges, bodies.discs),
            (tracks.knots, tracks.firsts, tracks.periods_s),
            self.top_speed_mps,
            touching_m,
        )

    def covers(self, time_s: float, state: Array) -> bool:
        """Returns whether the robot's reference point lies inside a body."""
        return covers(*self._bodies.placed(self._tracks.poses_at(time_s)), *state[:2])

    def facts(self, body: int, time_s: float, state: Array) -> dict[str, Any]:
        """Returns the body that was met, and the closing speeds of robot and body, as plain data.

        `robot_closing_mps` is the velocity, towards the body, of the robot's point that touches,
        `other_closing_mps` that of the body's point towards the robot; negative: it went away.
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
