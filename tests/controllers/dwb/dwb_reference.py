"""DWB read off its specification, one trajectory and one pose at a time, with nothing shared.

Slow and plain on purpose: what the fused kernels are held against.
"""

from __future__ import annotations

import math
from collections import deque
from itertools import pairwise

import numpy as np

LETHAL, UNKNOWN, INSCRIBED = 254, 255, 253


class Illegal(Exception):
    """A trajectory breaks a rule."""


def cell_of(costmap, x, y):
    """Returns (column, row), or None off the map."""
    rows, columns = costmap.costs.shape
    if x < costmap.origin_x or y < costmap.origin_y:
        return None
    column = int((x - costmap.origin_x) / costmap.resolution)
    row = int((y - costmap.origin_y) / costmap.resolution)
    return (column, row) if column < columns and row < rows else None


def project(velocity, accel, decel, duration_s, target):
    """Returns the velocity after approaching the target for a while."""
    if velocity < target:
        return min(target, velocity + accel * duration_s)
    return max(target, velocity + decel * duration_s)


def roll_out(pose, twist, sample, p):
    """Returns (velocity, poses) of one sample."""
    steps = max(
        math.hypot(sample[0], sample[1]) * p.sim_time / p.linear_granularity,
        abs(sample[2]) * p.sim_time / p.angular_granularity,
    )
    steps = max(1, math.ceil(steps))
    step_s = p.sim_time / steps
    x, y, yaw = pose
    vx, vy, wz = twist
    poses = [(x, y, yaw)]
    for _ in range(steps):
        vx = project(vx, p.acc_lim_x, p.decel_lim_x, step_s, sample[0])
        vy = project(vy, p.acc_lim_y, p.decel_lim_y, step_s, sample[1])
        wz = project(wz, p.acc_lim_theta, p.decel_lim_theta, step_s, sample[2])
        x += (vx * math.cos(yaw) + vy * math.cos(math.pi / 2 + yaw)) * step_s
        y += (vx * math.sin(yaw) + vy * math.sin(math.pi / 2 + yaw)) * step_s
        yaw += wz * step_s
        poses.append((x, y, yaw))
    return sample, [*poses, poses[-1]]


def densify(points, resolution):
    """Returns the plan's points with the larger holes filled."""
    dense = [points[0]]
    for (x0, y0), (x1, y1) in pairwise(points):
        distance = math.dist((x0, y0), (x1, y1))
        if distance > 2 * resolution:
            k = int((distance - 2 * resolution) / resolution) - 1
            dense += [(x0 + j * (x1 - x0) / k, y0 + j * (y1 - y0) / k) for j in range(1, k)]
        dense.append((x1, y1))
    return dense


def first_run(points, costmap):
    """Returns the cells of the first run of points on known cells."""
    run = []
    for x, y in densify(points, costmap.resolution):
        cell = cell_of(costmap, x, y)
        if cell is not None and costmap.costs[cell[1], cell[0]] != UNKNOWN:
            run.append(cell)
        elif run:
            break
    return run


def flood(costmap, seeds):
    """Returns the distance of every cell by breadth-first search from the seeds."""
    rows, columns = costmap.costs.shape
    distances = np.full((rows, columns), rows * columns + 1)
    queue = deque(dict.fromkeys(seeds))
    for column, row in queue:
        distances[row, column] = 0
    while queue:
        column, row = queue.popleft()
        for dc, dr in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            c, r = column + dc, row + dr
            if 0 <= c < columns and 0 <= r < rows and distances[r, c] > rows * columns:
                distances[r, c] = distances[row, column] + 1
                queue.append((c, r))
    return distances


def line(start, end):
    """Yields the cells of Bresenham's line."""
    (x, y), (x1, y1) = start, end
    dx, dy = abs(x1 - x), abs(y1 - y)
    sx, sy = (1 if x1 >= x else -1), (1 if y1 >= y else -1)
    major, minor = max(dx, dy), min(dx, dy)
    error = major // 2
    for _ in range(major + 1):
        yield x, y
        error += minor
        steps_minor = error >= major
        error -= major if steps_minor else 0
        x += sx if dx >= dy or steps_minor else 0
        y += sy if dx < dy or steps_minor else 0


def centre_cost(poses, costmap):
    """BaseObstacle: the cost at the last pose."""
    for x, y, _ in poses:
        cell = cell_of(costmap, x, y)
        if cell is None:
            raise Illegal("Trajectory Goes Off Grid.")
        cost = int(costmap.costs[cell[1], cell[0]])
        if cost >= INSCRIBED:
            raise Illegal("Trajectory Hits Obstacle.")
    return cost


def outline_cost(poses, costmap, footprint):
    """ObstacleFootprint: the largest cost under the outline at the last pose."""
    for x, y, yaw in poses:
        if cell_of(costmap, x, y) is None:
            raise Illegal("Trajectory Goes Off Grid.")
        c, s = math.cos(yaw), math.sin(yaw)
        corners = [(x + fx * c - fy * s, y + fx * s + fy * c) for fx, fy in footprint]
        largest = 0
        for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
            ends = cell_of(costmap, *a), cell_of(costmap, *b)
            if None in ends:
                raise Illegal("Footprint Goes Off Grid.")
            for column, row in line(*ends):
                cost = int(costmap.costs[row, column])
                if cost == LETHAL:
                    raise Illegal("Trajectory Hits Obstacle.")
                if cost == UNKNOWN:
                    raise Illegal("Trajectory Hits Unknown Region.")
                largest = max(largest, cost)
    return largest


def grid_value(poses, costmap, distances, *, forward_m=0.0, reads_all):
    """The map grid critics: the distance at the last pose's (forward) point."""
    for x, y, yaw in poses if reads_all else poses[-1:]:
        cell = cell_of(costmap, x + forward_m * math.cos(yaw), y + forward_m * math.sin(yaw))
        if cell is None:
            raise Illegal("Trajectory Goes Off Grid.")
        value = distances[cell[1], cell[0]]
        if reads_all and value == distances.size + 1:
            raise Illegal("Trajectory Hits Unreachable Area.")
    return float(value)


def critics_of(situation, p, footprint):
    """Returns {name: (scale, function of poses)} for the obstacle and map grid critics."""
    costmap, goal, pose = situation.costmap, situation.goal, situation.pose
    xy = [tuple(point) for point in situation.plan[:, :2].tolist()]
    half_cell = costmap.resolution * 0.5
    to_path = flood(costmap, first_run(xy, costmap))
    to_end = flood(costmap, first_run(xy, costmap)[-1:])
    nose_m = p.critic("GoalAlign").forward_point_distance
    bearing = math.atan2(goal[1] - pose[1], goal[0] - pose[0])
    moved = (xy[-1][0] + nose_m * math.cos(bearing), xy[-1][1] + nose_m * math.sin(bearing))
    to_nose_end = flood(costmap, first_run([*xy[:-1], moved], costmap)[-1:])
    path_nose_m = p.critic("PathAlign").forward_point_distance

    def grid(distances, **kwargs):
        return lambda poses: grid_value(poses, costmap, distances, **kwargs)

    return {
        "BaseObstacle": (p.critic("BaseObstacle").scale, lambda q: centre_cost(q, costmap)),
        "ObstacleFootprint": (
            costmap.resolution * p.critic("ObstacleFootprint").scale,
            lambda q: outline_cost(q, costmap, footprint),
        ),
        "PathDist": (half_cell * p.critic("PathDist").scale, grid(to_path, reads_all=True)),
        "GoalDist": (half_cell * p.critic("GoalDist").scale, grid(to_end, reads_all=True)),
        "PathAlign": (
            half_cell * p.critic("PathAlign").scale,
            grid(to_path, forward_m=path_nose_m, reads_all=False),
        ),
        "GoalAlign": (
            half_cell * p.critic("GoalAlign").scale,
            grid(to_nose_end, forward_m=nose_m, reads_all=False),
        ),
    }


def evaluate(situation, samples, p, footprint):
    """Returns (best index or -1, float32 totals, reasons or None), one trajectory at a time."""
    critics = critics_of(situation, p, footprint)
    best, best_total = -1, np.float32(-1.0)
    totals, reasons = [], []
    for k, sample in enumerate(samples):
        _, poses = roll_out(situation.pose, situation.twist, sample, p)
        total = np.float32(0.0)
        try:
            for name in p.critics:
                scale = np.float32(critics[name][0])
                if scale == 0.0:
                    continue
                total = np.float32(float(total) + critics[name][1](poses) * float(scale))
                stops_early = p.short_circuit_trajectory_evaluation
                if stops_early and best_total > 0.0 and total > best_total:
                    break
        except Illegal as illegal:
            totals.append(np.float32(-1.0))
            reasons.append(f"{name}/{illegal}")
            continue
        totals.append(total)
        reasons.append(None)
        if best_total < 0.0 or total < best_total:
            best, best_total = k, total
    return best, np.array(totals), reasons
