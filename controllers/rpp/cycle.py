"""One cycle of Regulated Pure Pursuit as a single kernel.

The call of a kernel takes about as long as a cycle's computation, so the parts are put together
here.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numba.extending import register_jitable

from drake_navbench.controllers.rpp.kernels import (
    arc_limits,
    axis_window,
    command_in_window,
    curvature_towards,
    cut_to_speed,
    distance_to_cusp,
    lookahead_distance,
    point_along,
    point_at,
    point_beyond,
    regulated_speed,
    turn_rate_in_place,
)
from drake_navbench.kernels.angles import wrap
from drake_navbench.kernels.command_arc import arc_period, first_collision, project_arc
from drake_navbench.kernels.grid import OFF_MAP, cost_at
from drake_navbench.kernels.path_pruning import arc_length
from drake_navbench.kernels.poses import to_robot_frame

# The values of `Command.branch`, the branch that a cycle took.
TRACK, ROTATE_TO_GOAL, ROTATE_TO_PATH, CENTRE_OFF_MAP = range(4)
NO_COLLISION = -1


class Aim(NamedTuple):
    """The aim of a cycle's steering, in the base frame: m, rad, 1/m.

    lookahead: distance to the carrot (carrot_x, carrot_y), along the plan or straight. curvature:
    of the arc to the point that the robot steers to. slowing_curvature: of the arc that slows the
    robot down. heading_error: angle to the point that the robot steers to, turned by pi where it
    reverses. sign: -1 for reversing, else 1. plan_length: arc length of the local plan.
    end_distance: straight distance to the plan's last pose. goal_angle: heading of that pose.
    """

    lookahead: float
    carrot_x: float
    carrot_y: float
    curvature: float
    slowing_curvature: float
    heading_error: float
    sign: float
    plan_length: float
    end_distance: float
    goal_angle: float


class Command(NamedTuple):
    """The command of a cycle, before the collision check.

    v m/s, w rad/s. branch: TRACK, ROTATE_TO_GOAL, ROTATE_TO_PATH or CENTRE_OFF_MAP.
    regulated_v, curve_v, obstacle_v: the speed to track with and its bounds by curvature and by
    cost, m/s; 0 in other branches. has_stopped: cancelling has come to rest.
    """

    v: float
    w: float
    branch: int
    regulated_v: float
    curve_v: float
    obstacle_v: float
    has_stopped: bool


class Cycle(NamedTuple):
    """The outcome of one cycle.

    period s, time_limit s, distance_limit m: of the projected arc, as `project_arc` takes them.
    collision: index of the first pose of that arc that collides, or NO_COLLISION.
    """

    aim: Aim
    command: Command
    period: float
    time_limit: float
    distance_limit: float
    collision: int


@register_jitable
def points_along(settings, poses_B, lookahead):
    """Returns (x, y, x, y): the carrot, and the point to steer by, by lengths along the plan, m."""
    carrot_x, carrot_y, _ = point_along(poses_B, lookahead)
    steer_x, steer_y = carrot_x, carrot_y
    if settings.use_fixed_curvature_lookahead:
        steer_x, steer_y, beyond = point_along(poses_B, settings.curvature_lookahead_dist)
        if settings.interpolate_curvature_after_goal and beyond > 0.0:
            steer_x, steer_y = point_beyond(poses_B, beyond)
    return carrot_x, carrot_y, steer_x, steer_y


@register_jitable
def points_ahead(settings, poses_B, lookahead):
    """Returns (lookahead, carrot x, carrot y, x, y), m; at x, y is the point to slow down by.

    Where the robot may reverse, neither point lies beyond a cusp of the plan.
    """
    curvature_lookahead = settings.curvature_lookahead_dist
    interpolates = settings.use_interpolation
    if settings.allow_reversing:
        cusp = distance_to_cusp(poses_B, settings.release.heeds_turns_in_place)
        lookahead = min(lookahead, cusp)
        if not settings.release.steers_by_carrot:
            curvature_lookahead = min(curvature_lookahead, cusp)
    carrot_x, carrot_y = point_at(poses_B, lookahead, interpolates, np.bool_(False))
    if not settings.use_fixed_curvature_lookahead:
        return lookahead, carrot_x, carrot_y, carrot_x, carrot_y
    beyond = settings.interpolate_curvature_after_goal
    slow_x, slow_y = point_at(poses_B, curvature_lookahead, interpolates, beyond)
    return lookahead, carrot_x, carrot_y, slow_x, slow_y


@register_jitable
def take_aim(settings, plan, pose, measured_v):
    """Returns the Aim for a local plan (M, 3) and a robot's pose, both in the odometry frame."""
    poses_B = to_robot_frame(plan, *pose)
    lookahead = lookahead_distance(settings, measured_v)
    if settings.release.cuts_plan:
        lookahead, carrot_x, carrot_y, slow_x, slow_y = points_ahead(settings, poses_B, lookahead)
    else:
        carrot_x, carrot_y, slow_x, slow_y = points_along(settings, poses_B, lookahead)
    steer_x, steer_y = slow_x, slow_y
    if settings.release.steers_by_carrot:
        steer_x, steer_y = carrot_x, carrot_y
    sign = -1.0 if settings.allow_reversing and carrot_x < 0.0 else 1.0
    heading_error = math.atan2(steer_y, steer_x)
    if sign < 0.0:
        heading_error = wrap(heading_error + math.pi)
    return Aim(
        lookahead,
        carrot_x,
        carrot_y,
        curvature_towards(steer_x, steer_y),
        curvature_towards(slow_x, slow_y),
        heading_error,
        sign,
        arc_length(poses_B),
        math.hypot(poses_B[-1, 0], poses_B[-1, 1]),
        poses_B[-1, 2],
    )


@register_jitable
def cancelling_speed(settings, measured_v, sign):
    """Returns (v, has_stopped): the measured speed, braked for one period, never past zero."""
    v = measured_v - sign * settings.control_period_s * settings.cancel_deceleration
    if v * sign <= 0.0:
        return 0.0, True
    return v, False


@register_jitable
def command_within_accelerations(settings, max_linear_vel, v, curvature, sign, last_command):
    """Returns (v, w) that follows a curvature at up to `v`, reachable from the last command."""
    last_v, last_w = last_command
    low, high = axis_window(
        last_v,
        settings.min_linear_vel,
        max_linear_vel,
        settings.max_linear_accel,
        settings.max_linear_decel,
        settings.control_period_s,
    )
    turn_low, turn_high = axis_window(
        last_w,
        settings.min_angular_vel,
        settings.max_angular_vel,
        settings.max_angular_accel,
        settings.max_angular_decel,
        settings.control_period_s,
    )
    low, high = cut_to_speed(low, high, v)
    return command_in_window(low, high, turn_low, turn_high, curvature, sign)


@register_jitable
def choose_command(
    settings,
    aim,
    max_linear_vel,
    twist,
    goal_xy_reached,
    is_cancelling,
    last_command,
    centre_cost,
):
    """Returns the Command of a cycle; arguments as of `run_cycle`.

    centre_cost: cost of the cell at the robot's position; OFF_MAP outside of the map.
    """
    measured_v, measured_w = twist
    if settings.use_rotate_to_heading:
        if goal_xy_reached:
            w = turn_rate_in_place(settings, aim.goal_angle, measured_w)
            return Command(0.0, w, ROTATE_TO_GOAL, 0.0, 0.0, 0.0, False)
        if abs(aim.heading_error) > settings.rotate_to_heading_min_angle:
            w = turn_rate_in_place(settings, aim.heading_error, measured_w)
            return Command(0.0, w, ROTATE_TO_PATH, 0.0, 0.0, 0.0, False)
    if centre_cost == OFF_MAP:
        return Command(0.0, 0.0, CENTRE_OFF_MAP, 0.0, 0.0, 0.0, False)
    speed, curve_v, obstacle_v = regulated_speed(
        settings,
        max_linear_vel,
        aim.slowing_curvature,
        centre_cost,
        aim.plan_length,
        aim.end_distance,
    )
    regulated_v = v = aim.sign * speed
    has_stopped = False
    if is_cancelling:
        v, has_stopped = cancelling_speed(settings, measured_v, aim.sign)
    if settings.use_dynamic_window:
        v, w = command_within_accelerations(
            settings, max_linear_vel, v, aim.curvature, aim.sign, last_command
        )
    else:
        w = v * aim.curvature
    return Command(v, w, TRACK, regulated_v, curve_v, obstacle_v, has_stopped)


@njit(cache=True)
def run_cycle(
    settings_record, plan, motion, max_linear_vel, goal, is_cancelling, costmap, footprint
):
    """Returns the Cycle for one observation.

    settings_record: (1,) `parameters.as_record`. plan: (M, 3) local plan. motion: the robot's pose
    (x, y, yaw), in the plan's odometry frame, m and rad, its measured twist (v, w) and the last
    command (v, w), m/s and rad/s. max_linear_vel: cruise speed under the speed limit, m/s. goal:
    whether the robot turns to the goal's heading, and the distance of the carrot, m, below which it
    does so, too, up to Kilted. costmap: (grid, tracks_unknown). footprint: (K, 2) m.
    """
    settings = settings_record[0]
    (pose, twist, last_command), (goal_xy_reached, end_tolerance) = motion, goal
    (x, y, yaw), (grid, tracks_unknown) = pose, costmap
    aim = take_aim(settings, plan, pose, twist[0])
    carrot_distance = math.hypot(aim.carrot_x, aim.carrot_y)
    if settings.release.cuts_plan:
        goal_xy_reached |= carrot_distance < end_tolerance
    command = choose_command(
        settings,
        aim,
        max_linear_vel,
        twist,
        goal_xy_reached,
        is_cancelling,
        last_command,
        cost_at(grid, x, y),
    )
    period = arc_period(settings.circumscribed_radius_m, grid.resolution, command.v, command.w)
    time_limit, distance_limit = arc_limits(settings, command.v, carrot_distance, aim.plan_length)
    collision = NO_COLLISION
    if settings.use_collision_detection and command.branch != CENTRE_OFF_MAP:
        arc = project_arc(x, y, yaw, command.v, command.w, period, time_limit, distance_limit)
        collision = first_collision(grid, tracks_unknown, footprint, arc)
    return Cycle(aim, command, period, time_limit, distance_limit, collision)
