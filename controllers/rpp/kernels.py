"""The parts of one cycle of Regulated Pure Pursuit, in the order in which they run.

Source: nav2_regulated_pure_pursuit_controller and nav2_util's controller_utils, branch lyrical;
the differences of earlier releases are in `releases`. Poses are (x m, y m, yaw rad); `poses_B` (M,
3) is the local plan in the robot's base frame. v is in m/s, w in rad/s, curvatures in 1/m.
"""

from __future__ import annotations

import math

from numba import njit
from numba.extending import register_jitable

from drake_navbench.kernels.collision_check import distance_from_cost
from drake_navbench.kernels.grid import FREE, MAX_NON_OBSTACLE, NO_INFORMATION

# A carrot nearer than this has no curvature: squared distance, m^2.
LEAST_SQUARED_CARROT_DISTANCE = 0.001
# Slower than this, an axis may accelerate either way.
STANDSTILL_SPEED = 1e-3
# Below this curvature the path counts as straight, 1/m.
STRAIGHT_CURVATURE = 1e-3
# Corners whose distances to the line w = curvature v differ by less count as equally far.
DISTANCE_TIE = 1e-3


@njit(cache=True)
def lookahead_distance(settings, measured_v):
    """Returns the arc length to the carrot, m."""
    if not settings.use_velocity_scaled_lookahead_dist:
        return settings.lookahead_dist
    distance = abs(measured_v) * settings.lookahead_time
    return min(max(distance, settings.min_lookahead_dist), settings.max_lookahead_dist)


@register_jitable
def point_along(poses_B, distance):
    """Returns (x, y, beyond): the point `distance` m along a plan, measured from its first pose, m.

    Where the plan is shorter, (x, y) is its last pose, and `beyond` is the missing length, m; else
    0.
    """
    last = poses_B.shape[0] - 1
    travelled = 0.0
    for i in range(1, last + 1):
        delta_x = poses_B[i, 0] - poses_B[i - 1, 0]
        delta_y = poses_B[i, 1] - poses_B[i - 1, 1]
        length = math.hypot(delta_x, delta_y)
        if length > 0.0 and travelled + length >= distance:
            ratio = (distance - travelled) / length
            return poses_B[i - 1, 0] + ratio * delta_x, poses_B[i - 1, 1] + ratio * delta_y, 0.0
        travelled += length
    return poses_B[last, 0], poses_B[last, 1], distance - travelled


@register_jitable
def point_beyond(poses_B, distance):
    """Returns (x, y) `distance` m beyond a plan of two or more poses, along its last segment, m."""
    x, y = poses_B[-1, 0], poses_B[-1, 1]
    direction = math.atan2(y - poses_B[-2, 1], x - poses_B[-2, 0])
    return x + distance * math.cos(direction), y + distance * math.sin(direction)


@register_jitable
def curvature_towards(x, y):
    """Returns the curvature of the circle through the robot, along its heading, to (x, y) m.

    2 y / (x^2 + y^2): Coulter, Implementation of the Pure Pursuit Path Tracking Algorithm (1992).
    """
    squared_distance = x * x + y * y
    if squared_distance > LEAST_SQUARED_CARROT_DISTANCE:
        return 2.0 * y / squared_distance
    return 0.0


@register_jitable
def turn_rate_in_place(settings, angle, measured_w):
    """Returns w for turning in place by `angle` rad: as fast as can still be stopped in time.

    The last bound ignores the acceleration limit, as in Nav2.
    """
    sign = 1.0 if angle > 0.0 else -1.0
    change = settings.max_angular_accel * settings.control_period_s
    w = sign * settings.rotate_to_heading_angular_vel
    w = min(max(w, measured_w - change), measured_w + change)
    if not settings.release.stops_in_time:
        return w
    stoppable = math.sqrt(2.0 * settings.max_angular_accel * abs(angle))
    return sign * stoppable if abs(w) > stoppable else w


@register_jitable
def speed_in_curve(settings, v, curvature):
    """Returns v, reduced in proportion to the radius where that is tight."""
    min_radius = settings.regulated_linear_scaling_min_radius
    radius = abs(1.0 / curvature) if curvature != 0.0 else math.inf
    if radius < min_radius:
        return v * (1.0 - abs(radius - min_radius) / min_radius)
    return v


@register_jitable
def speed_near_obstacle(settings, v, centre_cost):
    """Returns v, reduced in proportion to the obstacle distance that the centre's cost encodes."""
    factor = settings.inflation_cost_scaling_factor
    if factor <= 0.0 or centre_cost in (FREE, NO_INFORMATION):
        return v
    if settings.release.decays_from_252:
        share = centre_cost / MAX_NON_OBSTACLE
        distance = (-1.0 / factor) * math.log(share) + settings.inscribed_radius_m
    else:
        distance = distance_from_cost(centre_cost, settings.inscribed_radius_m, factor)
    if distance < settings.cost_scaling_dist:
        return v * (settings.cost_scaling_gain * distance / settings.cost_scaling_dist)
    return v


@register_jitable
def regulated_speed(settings, max_linear_vel, curvature, centre_cost, plan_length, end_distance):
    """Returns (v, in_curve, near_obstacle): the speed to track with, and its two first bounds.

    plan_length: arc length of the local plan, m. end_distance: robot to its last pose, m.
    """
    in_curve = near_obstacle = max_linear_vel
    if settings.use_regulated_linear_velocity_scaling:
        in_curve = speed_in_curve(settings, max_linear_vel, curvature)
    if settings.use_cost_regulated_linear_velocity_scaling:
        near_obstacle = speed_near_obstacle(settings, max_linear_vel, centre_cost)
    v = max(min(in_curve, near_obstacle), settings.regulated_linear_scaling_min_speed)
    if plan_length < settings.approach_velocity_scaling_dist:
        slowed = v * (end_distance / settings.approach_velocity_scaling_dist)
        v = min(v, max(slowed, settings.min_approach_linear_velocity))
    return min(abs(v), max_linear_vel), in_curve, near_obstacle


@register_jitable
def arc_limits(settings, v, carrot_distance, plan_length):
    """Returns (time s, distance m) up to which a command is checked.

    carrot_distance: straight from the robot, m. plan_length: arc length of the local plan, m.
    """
    time_limit = settings.max_allowed_time_to_collision_up_to_carrot
    clearance = settings.min_distance_to_obstacle
    if clearance <= 0.0:
        return time_limit, carrot_distance
    slowest = max(abs(v), settings.min_approach_linear_velocity)
    time_limit = max(time_limit, clearance / slowest if slowest > 0.0 else math.inf)
    if settings.release.bounds_time_only or not settings.use_velocity_scaled_lookahead_dist:
        return time_limit, carrot_distance
    if not settings.allow_obstacle_checking_beyond_goal:
        clearance = min(clearance, plan_length)
    return time_limit, min(max(carrot_distance, clearance), settings.max_lookahead_dist)


# The dynamic window option: the speeds that the acceleration limits let pass. Source: Nav2's
# dynamic_window_pure_pursuit_functions. A window is a range of v and one of w; the command is the
# point in it that follows the curvature best. Speeds in m/s and rad/s.
@njit(cache=True)
def axis_window(current, lowest, highest, acceleration, deceleration, period):
    """Returns (low, high): the speeds of one axis that can be reached within a period.

    acceleration > 0 bounds the change away from zero, deceleration < 0 the change towards it.
    lowest, highest: bounds on the speed itself.
    """
    low = current - acceleration * period
    high = current + acceleration * period
    if current > STANDSTILL_SPEED:
        low = current + deceleration * period
    elif current < -STANDSTILL_SPEED:
        high = current - deceleration * period
    return max(low, lowest), min(high, highest)


@njit(cache=True)
def cut_to_speed(low, high, speed):
    """Returns the window (low, high) of v cut to the range between zero and a regulated speed.

    An empty cut collapses to the edge of the window nearest to that range.
    """
    cut_low = max(low, min(0.0, speed))
    cut_high = min(high, max(0.0, speed))
    if cut_low > cut_high:
        if cut_low > max(0.0, speed):
            cut_high = cut_low
        else:
            cut_low = cut_high
    return cut_low, cut_high


@register_jitable
def _straight_command(low, high, turn_low, turn_high, sign):
    """Returns (v, w) for a straight path: the fastest v, the w nearest to zero."""
    v = high if sign >= 0.0 else low
    if turn_low <= 0.0 <= turn_high:
        return v, 0.0
    return v, (turn_low if abs(turn_low) <= abs(turn_high) else turn_high)


@register_jitable
def _nearest_corner(low, high, turn_low, turn_high, curvature, sign):
    """Returns the corner (v, w) of the window nearest to the line w = curvature v."""
    corners = ((low, turn_low), (low, turn_high), (high, turn_low), (high, turn_high))
    scale = math.sqrt(curvature * curvature + 1.0)
    least = math.inf
    best_v, best_w = low, turn_low
    for v, w in corners:
        distance = abs(curvature * v - w) / scale
        is_tie = abs(distance - least) <= DISTANCE_TIE
        if distance < least or (is_tie and v * sign > best_v * sign):
            least, best_v, best_w = distance, v, w
    return best_v, best_w


@njit(cache=True)
def command_in_window(low, high, turn_low, turn_high, curvature, sign):
    """Returns (v, w) in the window [low, high] x [turn_low, turn_high] for a curvature 1/m.

    Where the line w = curvature v crosses the window: its fastest point in the direction `sign`.
    Elsewhere the corner nearest to the line.
    """
    if abs(curvature) < STRAIGHT_CURVATURE:
        return _straight_command(low, high, turn_low, turn_high, sign)
    crossings = (
        (low, curvature * low),
        (high, curvature * high),
        (turn_low / curvature, turn_low),
        (turn_high / curvature, turn_high),
    )
    fastest = -math.inf
    best_v, best_w = 0.0, 0.0
    for v, w in crossings:
        is_inside = low <= v <= high and turn_low <= w <= turn_high
        if is_inside and v * sign > fastest:
            fastest, best_v, best_w = v * sign, v, w
    if fastest > -math.inf:
        return best_v, best_w
    return _nearest_corner(low, high, turn_low, turn_high, curvature, sign)


# The carrot up to Kilted: at a straight distance, on the circle about the robot. `poses_B` (M, 3)
# is the local plan in the robot's base frame: x m, y m, yaw rad.
@register_jitable
def point_on_circle(x1, y1, x2, y2, radius):
    """Returns (x, y), m, where the line from inside to outside crosses the circle about (0, 0).

    (x1, y1) lies within `radius` m, (x2, y2) does not. Weisstein: Circle-Line Intersection.
    """
    dx, dy = x2 - x1, y2 - y1
    squared = dx * dx + dy * dy
    cross = x1 * y2 - x2 * y1
    farther = (x2 * x2 + y2 * y2) - (x1 * x1 + y1 * y1)
    root = math.copysign(1.0, farther) * math.sqrt(radius * radius * squared - cross * cross)
    return (cross * dy + dx * root) / squared, (-cross * dx + dy * root) / squared


@njit(cache=True)
def point_at(poses_B, distance, interpolates, goes_beyond):
    """Returns (x, y), m, of the first place of a plan that is `distance` m from the robot.

    interpolates: the place may lie between two poses; otherwise it is the farther of them.
    goes_beyond: a plan that ends nearer than `distance` goes on along its last segment; otherwise,
    and for a plan of one pose, the place is the last pose.
    """
    last = poses_B.shape[0] - 1
    for i in range(last + 1):
        x, y = poses_B[i, 0], poses_B[i, 1]
        if math.hypot(x, y) >= distance:
            if i == 0 or not interpolates:
                return x, y
            return point_on_circle(poses_B[i - 1, 0], poses_B[i - 1, 1], x, y, distance)
    x, y = poses_B[last, 0], poses_B[last, 1]
    if not goes_beyond or last == 0:
        return x, y
    direction = math.atan2(y - poses_B[last - 1, 1], x - poses_B[last - 1, 0])
    beyond_x = x + math.cos(direction) * distance
    beyond_y = y + math.sin(direction) * distance
    return point_on_circle(x, y, beyond_x, beyond_y, distance)


@njit(cache=True)
def distance_to_cusp(poses_B, heeds_turns):
    """Returns the straight distance from the robot to the plan's first cusp, m; inf without a cusp.

    A cusp is a pose at which the plan turns by more than a right angle; with heeds_turns also a
    pose whose neighbour has the same place, but another heading.
    """
    for i in range(1, poses_B.shape[0] - 1):
        to_x, to_y = poses_B[i, 0] - poses_B[i - 1, 0], poses_B[i, 1] - poses_B[i - 1, 1]
        on_x, on_y = poses_B[i + 1, 0] - poses_B[i, 0], poses_B[i + 1, 1] - poses_B[i, 1]
        is_cusp = to_x * on_x + to_y * on_y < 0.0
        if heeds_turns:
            is_cusp |= to_x == 0.0 and to_y == 0.0 and poses_B[i - 1, 2] != poses_B[i, 2]
            is_cusp |= on_x == 0.0 and on_y == 0.0 and poses_B[i, 2] != poses_B[i + 1, 2]
        if is_cusp:
            return math.hypot(poses_B[i, 0], poses_B[i, 1])
    return math.inf
