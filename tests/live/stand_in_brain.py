"""A stand-in for a navigation stack: plans on /map and follows the path; numpy alone.

It is no controller of the benchmark and is not meant to drive well: it is the other side of the
tests of `drake_navbench.ros2.live`, once over Cyclone DDS and once as nodes of the real rclpy.
"""

from __future__ import annotations

import heapq
import math

import numpy as np

OCCUPIED = 65
LOOKAHEAD_M = 0.5
SPEED_MPS, TURN_RADPS = 0.5, 1.2
NEAR_M, NEAR_RAD = 0.12, 0.15
CYCLE_S = 0.05
EXECUTING, SUCCEEDED, ABORTED = 2, 4, 6


def planned(occupancy, origin, resolution, start, goal, radius_m):
    """Returns (N, 2) positions from start to goal round the occupied cells, None without a way."""
    blocked = dilated(occupancy >= OCCUPIED, math.ceil(radius_m / resolution))
    rows, columns = blocked.shape

    def cell(point):
        return tuple(
            int(np.clip((point[axis] - origin[axis]) / resolution, 0, (columns, rows)[axis] - 1))
            for axis in (0, 1)
        )

    first, last = cell(start), cell(goal)
    came = {first: first}
    cost = {first: 0.0}
    queue = [(0.0, first)]
    while queue:
        _, here = heapq.heappop(queue)
        if here == last:
            break
        for dx, dy in ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1)):
            x, y = here[0] + dx, here[1] + dy
            if not (0 <= x < columns and 0 <= y < rows) or blocked[y, x]:
                continue
            total = cost[here] + math.hypot(dx, dy)
            if total < cost.get((x, y), math.inf):
                cost[x, y], came[x, y] = total, here
                ahead = math.hypot(last[0] - x, last[1] - y)
                heapq.heappush(queue, (total + ahead, (x, y)))
    if last not in came:
        return None
    cells = [last]
    while cells[-1] != first:
        cells.append(came[cells[-1]])
    path = (np.array(cells[::-1]) + 0.5) * resolution + np.asarray(origin)
    path[-1] = goal[:2]
    return path


def dilated(mask, count):
    """Returns a mask grown by `count` cells in a square."""
    for _ in range(count):
        padded = np.pad(mask, 1)
        mask = padded[1:-1, 1:-1] | padded[2:, 1:-1] | padded[:-2, 1:-1]
        padded = np.pad(mask, 1)
        mask = padded[1:-1, 1:-1] | padded[1:-1, 2:] | padded[1:-1, :-2]
    return mask


def wrapped(angle):
    """Returns an angle between -pi and pi."""
    return math.atan2(math.sin(angle), math.cos(angle))


class Brain:
    """The stack: it is told map, pose, goal and clock, and says commands and the goal's state."""

    def __init__(self, radius_m=0.3):
        self._radius_m = radius_m
        self._map = None
        self.pose = None
        self.goal = None
        self.path = None
        self.state = None
        self._last_cycle_s = -math.inf

    def take_map(self, occupancy, origin, resolution):
        self._map = occupancy, origin, resolution

    def take_goal(self, goal):
        """Takes a goal x, y, yaw; returns whether a path leads there."""
        self.goal, self.state, self.path = goal, EXECUTING, None
        if self._map is not None and self.pose is not None:
            self.path = planned(*self._map, self.pose, goal, self._radius_m)
        if self.path is None:
            self.state = ABORTED
        return self.path is not None

    def tick(self, time_s):
        """Returns the command (v, w) of a cycle, None where none is due or there is no goal."""
        if time_s < self._last_cycle_s:
            self._last_cycle_s = -math.inf
        if self.state != EXECUTING or self.pose is None:
            return None
        if time_s - self._last_cycle_s < CYCLE_S - 1e-6:
            return None
        self._last_cycle_s = time_s
        return self._command()

    def _command(self):
        x, y, yaw = self.pose
        goal_x, goal_y, goal_yaw = self.goal
        if math.hypot(goal_x - x, goal_y - y) < NEAR_M:
            left = wrapped(goal_yaw - yaw)
            if abs(left) < NEAR_RAD:
                self.state = SUCCEEDED
                return 0.0, 0.0
            return 0.0, float(np.clip(2.0 * left, -TURN_RADPS, TURN_RADPS))
        away = np.hypot(*(self.path - (x, y)).T)
        nearest = int(np.argmin(away))
        beyond = np.flatnonzero(away[nearest:] >= LOOKAHEAD_M)
        target = self.path[nearest + beyond[0] if len(beyond) else -1]
        bearing = wrapped(math.atan2(target[1] - y, target[0] - x) - yaw)
        turn = float(np.clip(2.5 * bearing, -TURN_RADPS, TURN_RADPS))
        if abs(bearing) > 0.7:
            return 0.0, turn
        return SPEED_MPS * max(0.2, math.cos(bearing) ** 2), turn
