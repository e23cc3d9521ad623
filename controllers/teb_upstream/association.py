"""The attachment of obstacles and via-points to the poses of a band.

As teb_local_planner's AddEdgesObstacles, AddEdgesObstaclesLegacy and AddEdgesViaPoints
(ros2-master), with their apparent mistakes: the side of an obstacle is judged from the origin of
the map, and the legacy strategy attaches an obstacle to its nearest pose three times.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numba.extending import register_jitable

from drake_navbench.controllers.teb_upstream.penalties import Attached
from drake_navbench.controllers.teb_upstream.robot_models import model_distance


@njit(cache=True, error_model="numpy")
def attach(poses, count, around, record):
    """Returns the `Attached` obstacles and via-points of the first `count` poses (C, 3).

    record: (1,) the parameters' `kernel_record`. Obstacles nearer than `include_at` m are all
    attached, and none beyond `cut_off_at` m; of the rest the nearest on the left and on the right
    are. With `legacy_obstacle_association` an obstacle is attached to poses around its nearest one
    instead. The first pose gets obstacles only with `with_first_pose`.
    """
    terms = record[0]
    if terms.legacy_obstacle_association:
        pairs = _attach_around_nearest(poses, count, around, terms)
    else:
        pairs = _attach_by_distance(poses, count, around, terms)
    via_poses = _attach_via_points(poses, count, around, terms)
    return Attached(pairs[0], pairs[1], via_poses)


@register_jitable(error_model="numpy")
def _attach_by_distance(poses, count, around, terms):
    obstacles = around.obstacles
    number = obstacles.shape[0]
    capacity = count * (min(number, 16) + 2)
    pose_indices = np.empty(capacity, dtype=np.int64)
    indices = np.empty(capacity, dtype=np.int64)
    used = 0
    for i in range(0 if terms.with_first_pose else 1, count - 1):
        if used + number + 2 > capacity:
            capacity = 2 * capacity + number + 2
            wider_poses = np.empty(capacity, dtype=np.int64)
            wider = np.empty(capacity, dtype=np.int64)
            for pair in range(used):
                wider_poses[pair], wider[pair] = pose_indices[pair], indices[pair]
            pose_indices, indices = wider_poses, wider
        x, y = poses[i, 0], poses[i, 1]
        cos_yaw, sin_yaw = math.cos(poses[i, 2]), math.sin(poses[i, 2])
        left, right = -1, -1
        left_distance = right_distance = math.inf
        for k in range(number):
            point_x, point_y = obstacles[k, 0], obstacles[k, 1]
            is_left = cos_yaw * point_y - sin_yaw * point_x > 0.0
            # No robot's shape reaches beyond this circle, so that most need no closer look.
            dx, dy = point_x - x, point_y - y
            enough = max(terms.include_at, left_distance if is_left else right_distance)
            enough = min(enough, terms.cut_off_at) + around.robot.reach
            if dx * dx + dy * dy > enough * enough:
                continue
            distance = model_distance(around.robot, x, y, cos_yaw, sin_yaw, point_x, point_y)[0]
            if distance < terms.include_at:
                pose_indices[used], indices[used] = i, k
                used += 1
            elif distance > terms.cut_off_at:
                continue
            elif is_left:
                if distance < left_distance:
                    left_distance, left = distance, k
            elif distance < right_distance:
                right_distance, right = distance, k
        for k in (left, right):
            if k >= 0:
                pose_indices[used], indices[used] = i, k
                used += 1
    return pose_indices[:used].copy(), indices[:used].copy()


@register_jitable(error_model="numpy")
def _nearest_pose(poses, begin, count, x, y):
    """Returns the index of the first pose nearest to a point, from `begin` on; -1 without one."""
    best, nearest = math.inf, -1
    for i in range(begin, count):
        squared = (x - poses[i, 0]) ** 2 + (y - poses[i, 1]) ** 2
        if squared < best:
            best, nearest = squared, i
    return nearest


@register_jitable(error_model="numpy")
def _attach_around_nearest(poses, count, around, terms):
    obstacles = around.obstacles
    reach = terms.obstacle_poses_affected // 2
    pose_indices = np.empty(obstacles.shape[0] * (2 * reach + 1), dtype=np.int64)
    indices = np.empty(pose_indices.shape[0], dtype=np.int64)
    used = 0
    for k in range(obstacles.shape[0]):
        if terms.obstacle_poses_affected >= count:
            index = count // 2
        else:
            index = _nearest_pose(poses, np.int64(0), count, obstacles[k, 0], obstacles[k, 1])
        if index <= 1 or index > count - 2:
            continue
        pose_indices[used], indices[used] = index, k
        used += 1
        for offset in range(reach):
            for pose in (index + offset, index - offset):
                # Edges of the fixed ends change nothing.
                if 0 < pose < count - 1:
                    pose_indices[used], indices[used] = pose, k
                    used += 1
    return pose_indices[:used].copy(), indices[:used].copy()


@register_jitable(error_model="numpy")
def _attach_via_points(poses, count, around, terms):
    via_poses = np.full(around.via_points.shape[0], -1)
    if count < 3:
        return via_poses
    begin = 0
    for k in range(via_poses.shape[0]):
        index = _nearest_pose(poses, begin, count, around.via_points[k, 0], around.via_points[k, 1])
        if terms.via_points_ordered:
            begin = index + 2
        index = min(index, count - 2)
        if index < 1 and terms.via_points_ordered:
            index = 1
        if index >= 1:
            via_poses[k] = index
    return via_poses
