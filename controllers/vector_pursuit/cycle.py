"""One cycle of Vector Pursuit as a single kernel, and the screw that it steers by.

Source: vector_pursuit_controller, branches master at 3f1b30a and jazzy-devel at 1285f07. v is in
m/s, w in rad/s.
"""

from __future__ import annotations

import math
import sys
from typing import NamedTuple

from numba import njit

from drake_navbench.controllers.vector_pursuit.aim import cusp_distance, pose_ahead
from drake_navbench.kernels.angles import TWO_PI, wrap
from drake_navbench.kernels.command_arc import arc_period, first_collision, project_arc
from drake_navbench.kernels.grid import FREE, INSCRIBED, NO_INFORMATION, OFF_MAP, cost_at
from drake_navbench.kernels.path_pruning import arc_length
from drake_navbench.kernels.poses import to_robot_frame

# The values of `Command.branch`, the branch that a cycle took.
TRACK, ROTATE_TO_GOAL, ROTATE_TO_PATH, CENTRE_OFF_MAP = range(4)
NO_COLLISION = -1
# A target less than this beside the robot's axis is straight ahead, m.
STRAIGHT_AHEAD_M = 1e-6
# The screw turns by no less than this, rad.
LEAST_SCREW_ANGLE = 1e-9
# The radius of a straight line, m.
STRAIGHT_RADIUS_M = sys.float_info.max


class Command(NamedTuple):
    """The command of a cycle, before the collision check.

    v, w; branch: TRACK, ROTATE_TO_GOAL, ROTATE_TO_PATH or CENTRE_OFF_MAP. radius: radius of the
    curve, m.
    lookahead: straight distance to the target, which is (target_x, target_y) m, target_yaw in the
    base frame.
    """

    v: float
    w: float
    branch: int
    radius: float
    lookahead: float
    target_x: float
    target_y: float
    target_yaw: float


class Cycle(NamedTuple):
    """The outcome of one cycle.

    period: step of the projected arc, s. collision: index of its first pose that collides, or
    NO_COLLISION.
    """

    command: Command
    period: float
    collision: int


@njit(cache=True, error_model="numpy")
def turning_radius(settings, x, y, yaw):
    """Returns the radius of the curve to a target pose in the base frame, m.

    Two screws are added: one that moves the robot onto the target, one that turns it to the
    target's heading, k times as slowly (Wit, Crane, Armstrong: Autonomous Ground Vehicle Path
    Tracking, 2004). In Humble the angle of the first counts from 0 to 2 pi on either side, so that
    curves to the right come out wider than the same ones to the left.
    """
    if not (settings.allow_reversing or x >= 0.0):
        return settings.min_turning_radius
    radius = STRAIGHT_RADIUS_M
    if abs(y) > STRAIGHT_AHEAD_M:
        distance = math.hypot(x, y)
        squared_distance = distance * distance
        circle = squared_distance / (2.0 * y)
        angle = math.atan2(2.0 * (y * y) - squared_distance, 2.0 * x * y)
        if settings.is_mirrored:
            angle = wrap(angle - math.atan2(squared_distance, 2.0 * y))
        else:
            angle -= math.atan2(circle, 0.0)
            if angle < 0.0:
                angle += TWO_PI
            angle = max(angle, LEAST_SCREW_ANGLE)
        radius = abs(settings.k * angle / ((settings.k - 1.0) * angle + wrap(yaw)) * circle)
    return settings.min_turning_radius if radius < settings.min_turning_radius else radius


@njit(cache=True)
def turn_rate_in_place(settings, angle, last_w):
    """Returns w for turning in place by an angle, reachable from the last command."""
    change = settings.max_angular_accel * settings.control_period_s
    w = settings.rotate_to_heading_angular_vel * (1.0 if angle > 0.0 else -1.0)
    return min(max(w, last_w - change), last_w + change)


@njit(cache=True)
def speed_near_obstacle(settings, v, centre_cost):
    """Returns v, reduced in proportion to the obstacle distance that the centre's cost encodes."""
    factor = settings.inflation_cost_scaling_factor
    if not settings.use_cost_regulated_linear_velocity_scaling or factor <= 0.0:
        return v
    if centre_cost in (FREE, NO_INFORMATION):
        return v
    # The decay starts at 252, as in the inflation layer.
    decay = math.log(centre_cost / (INSCRIBED - 1))
    distance = (-1.0 / factor) * decay + settings.inscribed_radius_m
    if distance < settings.cost_scaling_dist:
        return v * (settings.cost_scaling_gain * distance / settings.cost_scaling_dist)
    return v


@njit(cache=True, error_model="numpy")
def constrained_speed(settings, max_v, radius, last_v, centre_cost, plan_length, end_distance):
    """Returns the speed on a curve: the least by curve, cost, acceleration and approach.

    plan_length: length of the local plan, m; end_distance: from the robot to its last pose, m.
    """
    curve_v = math.sqrt(settings.max_lateral_accel / abs(1.0 / radius))
    reachable_v = abs(last_v) + settings.max_linear_accel * settings.control_period_s
    v = min(max_v, curve_v, speed_near_obstacle(settings, max_v, centre_cost), reachable_v)
    scaling = 1.0
    if plan_length < settings.approach_velocity_scaling_dist:
        scaling = end_distance / settings.approach_velocity_scaling_dist
    approach_v = max(max_v * scaling, settings.min_approach_linear_velocity)
    return max(min(v, approach_v), settings.min_linear_velocity)


@njit(cache=True, error_model="numpy")
def choose_command(settings, poses, max_v, last_v, last_w, centre_cost, goal_tolerance):
    """Returns the Command for a plan (M, 3) in the base frame; arguments as of `run_cycle`."""
    lookahead = settings.lookahead_dist
    if settings.use_velocity_scaled_lookahead_dist:
        lookahead = abs(last_v) * settings.lookahead_time
        lookahead = min(max(lookahead, settings.min_lookahead_dist), settings.max_lookahead_dist)
    lookahead = min(lookahead, cusp_distance(poses))
    x, y, yaw = pose_ahead(
        poses, lookahead, settings.use_interpolation, settings.use_heading_from_path
    )
    distance = math.hypot(x, y)
    sign = -1.0 if settings.allow_reversing and x < 0.0 else 1.0
    heading_error = math.atan2(y, x)
    if sign < 0.0:
        heading_error = wrap(heading_error + math.pi)
    if settings.use_rotate_to_heading and distance < goal_tolerance:
        w = turn_rate_in_place(settings, poses[-1, 2], last_w)
        return Command(0.0, w, ROTATE_TO_GOAL, 0.0, distance, x, y, yaw)
    if settings.use_rotate_to_heading and abs(heading_error) > settings.rotate_to_heading_min_angle:
        w = turn_rate_in_place(settings, heading_error, last_w)
        return Command(0.0, w, ROTATE_TO_PATH, 0.0, distance, x, y, yaw)
    radius = turning_radius(settings, x, y, yaw)
    if centre_cost == OFF_MAP:
        return Command(0.0, 0.0, CENTRE_OFF_MAP, radius, distance, x, y, yaw)
    end_distance = math.hypot(poses[-1, 0], poses[-1, 1])
    v = sign * constrained_speed(
        settings, max_v, radius, last_v, centre_cost, arc_length(poses), end_distance
    )
    w = v / radius
    if y < 0.0:
        w = -w
    return Command(v, w, TRACK, radius, distance, x, y, yaw)


@njit(cache=True)
def run_cycle(settings_record, plan, pose, max_v, last, goal_tolerance, costmap, footprint):
    """Returns the Cycle for one observation.

    settings_record: (1,) `parameters.as_record`. plan: (M, 3) local plan; pose: (x, y, yaw) of the
    robot, both in the odometry frame, m and rad. max_v: desired speed under the speed limit. last:
    (v, w) of the last command. goal_tolerance: tolerance of the goal checker, m. costmap: (grid,
    tracks_unknown). footprint: (K, 2) m.
    """
    (x, y, yaw), (last_v, last_w), (grid, tracks_unknown) = pose, last, costmap
    settings = settings_record[0]
    poses = to_robot_frame(plan, x, y, yaw)
    command = choose_command(
        settings, poses, max_v, last_v, last_w, cost_at(grid, x, y), goal_tolerance
    )
    period = arc_period(settings.circumscribed_radius_m, grid.resolution, command.v, command.w)
    collision = NO_COLLISION
    if settings.use_collision_detection and command.branch != CENTRE_OFF_MAP:
        arc = project_arc(
            x,
            y,
            yaw,
            command.v,
            command.w,
            period,
            settings.max_allowed_time_to_collision_up_to_target,
            command.lookahead,
        )
        collision = first_collision(grid, tracks_unknown, footprint, arc)
    return Cycle(command, period, collision)
