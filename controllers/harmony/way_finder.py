"""The choice of a cycle's way: along the path, past the obstacle on it, or up to that."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_navbench.controller import ControllerSetup, Observation
from drake_navbench.controllers.harmony.detour import (
    Keeping,
    beyond_map,
    distances_at,
    find_detour,
    is_connected,
    is_good,
    joined,
    still_ahead,
    whole_plan,
)
from drake_navbench.controllers.harmony.discs import half_width
from drake_navbench.controllers.harmony.memory import HarmonyMemory
from drake_navbench.controllers.harmony.parameters import HarmonyParameters
from drake_navbench.controllers.harmony.way import (
    LEADS_BACK_RAD,
    Way,
    along_itself,
    around,
    driving_on,
    must_back_up,
    straight,
    turn_at,
    turn_towards,
    up_to_blocked,
    way_along,
)
from drake_navbench.kernels.distance_field import DistanceField, path_clearance
from drake_navbench.kernels.path_geometry import path_from_polyline, path_length
from drake_navbench.kernels.read_only import read_only

Array = NDArray[np.float64]

# On a blocked way plans end this much beyond the point where the robot gives up, m, so that it gets
# there. If give_up_distance is smaller than this, they end inside the obstacle.
SLOW_AT_M = 0.2
# A way past an obstacle is at most twice the robot's radius plus this, or plus the length of plans
# if that is larger, m. It must not be longer: a costmap shows no obstacles beyond its
# obstacle_max_range, so there is nearly always a way around the seen part of a wall.
LOOK_PAST_M = 1.5
# Ways past keep off obstacles over so many m where they keep to the plan, and where they do not.
NEAR_PLAN_M, AMPLE = 0.3, Keeping(0.4, np.inf)
# Where nothing leads past and something has moved within MET_S, s, the robot drives away until its
# way is free for GIVES_WAY_M, m.
MET_S, GIVES_WAY_M = 10.0, 1.2
# Plans come to rest behind the goal by this share of its tolerance.
DRIVES_ON_SHARE = 0.6
# In the middle of a gap the distance field is too small by this, m.
ROOM_IN_GAPS_M = 0.02


class FoundWay(NamedTuple):
    """The way of a cycle, whether it leads on, and the detour (M, 3) that it begins with, if any.

    blocked_m: along the path to where the robot has no room, inf where it has; see `Way`.
    """

    way: Way
    is_open: bool
    detour: Array | None
    blocked_m: float


class WayFinder:
    """Finds the way of a cycle. discs: (D, 2) of the robot, m. clearance: of plans, m.

    longest_m: the length up to which ways past an obstacle are looked for.
    """

    def __init__(
        self, parameters: HarmonyParameters, setup: ControllerSetup, discs: Array, clearance: float
    ) -> None:
        self._parameters = parameters
        self._discs = discs
        self._clearance = clearance
        self._half_width = half_width(setup)
        self._back_m = parameters.max_vel_x_backwards * parameters.horizon
        reach_m = max(parameters.top_speed * parameters.horizon, LOOK_PAST_M)
        self.longest_m = 2.0 * (reach_m + setup.circumscribed_radius_m)
        self._near_plan = Keeping(NEAR_PLAN_M, setup.circumscribed_radius_m + clearance)
        self._detour_clearance = float(discs[:, 1].max()) + clearance + ROOM_IN_GAPS_M

    def find(
        self,
        observation: Observation,
        memory: HarmonyMemory,
        start: Array,
        field: DistanceField,
        reach_m: float,
    ) -> FoundWay:
        """Returns the way that plans from a start (9,) follow, as far as `reach_m`."""
        if observation.goal_xy_reached:
            return FoundWay(turn_at(start, observation.goal), True, None, np.inf)
        way = self._along(observation.plan, observation, field, reach_m)
        detour = self._detour_so_far(observation, memory, way, field)
        if detour is None:
            is_open = self._is_open(observation, way, field)
            if is_open and (memory.is_trapped or self._leads_inside(observation, field)):
                detour = self._new_detour(observation, memory, way, field)
            if detour is None and not is_open:
                if self._gives_way(observation, memory, way):
                    is_ahead = abs(turn_towards(way, start)) < LEADS_BACK_RAD
                    away = straight(start, -self._back_m if is_ahead else self._back_m)
                    return FoundWay(away, True, None, way.blocked_m)
                stop_m = self._parameters.give_up_distance - SLOW_AT_M
                return FoundWay(up_to_blocked(way, stop_m), False, None, way.blocked_m)
        if detour is None:
            on_m = DRIVES_ON_SHARE * observation.goal_xy_tolerance_m
            past = driving_on(around(way), on_m)
            if memory.is_trapped or memory.backs_up:
                past = self._backed_up(past, start, field, is_backing=memory.backs_up)
            return FoundWay(past, True, None, way.blocked_m)
        whole = joined(detour, observation.plan, observation.global_plan)
        past = self._along(whole, observation, field, reach_m)
        # On a detour that ends in the goal, the detour's heading counts until the robot is there.
        nears_goal = past.nears_goal and len(whole) > len(detour)
        past = past._replace(blocked_m=np.inf, behind=None, nears_goal=nears_goal, is_detour=True)
        past = self._backed_up(past, start, field, is_backing=memory.backs_up)
        return FoundWay(past, True, detour, way.blocked_m)

    def _backed_up(self, way: Way, start: Array, field: DistanceField, *, is_backing: bool) -> Way:
        """Returns the way, or one straight back if the robot has no room to turn towards it."""
        room = field, self._discs, self._clearance
        if self._back_m > 0.0 and must_back_up(way, start, *room, is_backing):
            return straight(start, -self._back_m)
        return way

    def _gives_way(self, observation: Observation, memory: HarmonyMemory, way: Way) -> bool:
        """Returns whether the robot drives away from somebody in its way."""
        least_m = GIVES_WAY_M if memory.backs_up else self._parameters.give_up_distance
        has_met = observation.time_s - memory.met_s <= MET_S
        return has_met and way.blocked_m <= least_m and self._back_m > 0.0

    def _along(
        self, plan: Array, observation: Observation, field: DistanceField, reach_m: float
    ) -> Way:
        return way_along(
            plan, observation.goal, reach_m, field, self._discs, observation.global_plan
        )

    def _is_open(self, observation: Observation, way: Way, field: DistanceField) -> bool:
        """Returns whether the path is free, or the map has a short way past the obstacle on it."""
        if way.behind is None:
            return True
        position = observation.pose[:2]
        known = beyond_map(field)
        return bool(is_connected(known, self._half_width, self.longest_m, position, way.behind))

    def _leads_inside(self, observation: Observation, field: DistanceField) -> bool:
        """Returns whether the plan leads into an obstacle, where no heading has room."""
        whole = whole_plan(observation.plan, observation.global_plan)
        return bool((distances_at(field, whole) < self._half_width).any())

    def _detour_so_far(
        self, observation: Observation, memory: HarmonyMemory, way: Way, field: DistanceField
    ) -> Array | None:
        """Returns the rest of the present detour, or a new one where that one no longer works.

        None if the map no longer shows a short way past, as it shows more of what blocks the path.
        """
        if memory.detour is None:
            return None
        position = observation.pose[:2]
        rest = still_ahead(memory.detour, position, observation.plan, observation.global_plan)
        if not len(rest):
            return None
        if is_good(rest, position, field, self._detour_clearance):
            return rest
        anew = self._new_detour(observation, memory, way, field)
        is_short = anew is not None and path_length(anew) <= self.longest_m
        return anew if is_short or self._is_open(observation, way, field) else None

    def _has_room_along(self, detour: Array, field: DistanceField) -> bool:
        """Returns whether the robot has room on a detour (M, 3), turned to where it leads."""
        poses = along_itself(detour)
        room = path_clearance(beyond_map(field), self._discs, poses)
        return bool(room.min() >= self._clearance)

    def _new_detour(
        self, observation: Observation, memory: HarmonyMemory, way: Way, field: DistanceField
    ) -> Array | None:
        """Returns a way past the place where the plan has no room, or None.

        It keeps to the plan, unless the robot has no room along such a way.
        For a robot that is stuck near the goal it is the straight line to the goal.
        """
        position, goal = observation.pose[:2], observation.goal[:2]
        whole = whole_plan(observation.plan, observation.global_plan)
        for keeping in (self._near_plan, AMPLE):
            detour = find_detour(whole, field, self._detour_clearance, position, keeping)
            if detour is None or self._has_room_along(detour, field):
                break
        is_stuck = memory.is_trapped and way.nears_goal
        if detour is None and is_stuck and np.hypot(*(goal - position)) > field.resolution:
            return read_only(path_from_polyline(np.stack([position, goal]), field.resolution))
        return detour
