"""People who walk by the social force model.

Form and constants are those of HuNavSim's model, lightsfm (robotics-upo/lightsfm, sfm.hpp): a
desired force towards the goal, the social force of Moussaid et al. 2009 between people, an
exponential repulsion from standing obstacles, and the group forces of Moussaid et al. 2010. The
reactions to a robot are those of HuNavSim's agent manager (Perez-Higueras et al., "HuNavSim: A ROS
2 Human Navigation Simulator for Benchmarking Human-Aware Robot Navigation", 2023). Where we differ:

- The wall's repulsion is that of the nearest point of all walls and obstacles, so that it does not
    depend on the number of pieces of a map.
- The robot's outline repels people as a wall does, as its centre alone says little of a long robot.
    A person who walks straight into it steps aside, to the side of its centre on which the person
    is.
- A threatening person walks to a point ahead of the robot; HuNavSim confuses sine and cosine there.

People are rows as in `kernels.walking`.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from drake_navbench.kernels.angles import wrap
from drake_navbench.kernels.walking import (
    CURIOUS,
    GOAL_RADIUS_M,
    GROUP,
    OBLIVIOUS,
    RADIUS,
    REACTED,
    REACTION,
    REGULAR,
    SCARED,
    SPEED,
    SURPRISED,
    THREATENING,
    TIME_GAP,
    TOP_SPEED_MPS,
    VX,
    VY,
    WALKING_MPS,
    YAW,
    X,
    Y,
    own_goal,
    pace_behind_others,
    people_after,
    put_velocities,
    turned_towards,
)

DESIRED_FACTOR, RELAXATION_S = 2.0, 0.5
OBSTACLE_FACTOR, OBSTACLE_SIGMA_M = 10.0, 0.2
# HuNavSim sets 5.0 where lightsfm has 2.1; with 2.1, bodies of 0.3 m that meet head on overlap.
SOCIAL_FACTOR = 5.0
LAMBDA, GAMMA_M, ANGULAR, ANGULAR_ALONG = 2.0, 0.35, 2.0, 3.0
GAZE_FACTOR, COHERENCE_FACTOR, REPULSION_FACTOR = 3.0, 2.0, 1.0
# The range and half angle within which a person sees the robot, and the longest reaction, by
# reaction.
SIGHT_M = np.array([0.0, 0.0, 4.0, 3.0, 10.0, 4.0, 0.0])
SIGHT_HALF_ANGLE_RAD = 0.5 * math.pi + 0.17
PATIENCE_S = np.array([0.0, 0.0, 30.0, 40.0, 30.0, 40.0, 0.0])
SCARED_SPEED_MPS, SCARED_FACTOR = 0.6, 20.0
CURIOUS_SPEED_MPS, CURIOUS_SIGHT_M, CURIOUS_DISTANCE_M = 1.8, 10.0, 1.5
THREAT_SPEED_MPS, THREAT_AHEAD_M, THREAT_RADIUS_M = 2.0, 1.1, 0.05


@njit(cache=True)
def social_force(x, y, vx, vy, other_x, other_y, other_vx, other_vy):
    """Returns the social force (fx, fy) m/s^2 of another person on one at (x, y), at factor 1."""
    diff_x, diff_y = other_x - x, other_y - y
    distance = math.hypot(diff_x, diff_y)
    if distance < 1e-9:
        return 0.0, 0.0
    towards_x, towards_y = diff_x / distance, diff_y / distance
    interaction_x = LAMBDA * (vx - other_vx) + towards_x
    interaction_y = LAMBDA * (vy - other_vy) + towards_y
    length = math.hypot(interaction_x, interaction_y)
    if length < 1e-9:
        return 0.0, 0.0
    along_x, along_y = interaction_x / length, interaction_y / length
    theta = math.atan2(
        along_x * towards_y - along_y * towards_x, along_x * towards_x + along_y * towards_y
    )
    reach = GAMMA_M * length
    slowing = -math.exp(-distance / reach - (ANGULAR_ALONG * reach * theta) ** 2)
    turning = -np.sign(theta) * math.exp(-distance / reach - (ANGULAR * reach * theta) ** 2)
    return slowing * along_x - turning * along_y, slowing * along_y + turning * along_x


@njit(cache=True)
def nearest_point(x, y, edges, circles):
    """Returns (x, y, distance) m of the nearest point of edges (N, 4) and circles (M, 3)."""
    best_x, best_y, best = 0.0, 0.0, math.inf
    for n in range(edges.shape[0]):
        x0, y0 = edges[n, 0], edges[n, 1]
        along_x, along_y = edges[n, 2] - x0, edges[n, 3] - y0
        squared = along_x * along_x + along_y * along_y
        share = 0.0
        if squared > 0.0:
            share = min(max(((x - x0) * along_x + (y - y0) * along_y) / squared, 0.0), 1.0)
        near_x, near_y = x0 + share * along_x, y0 + share * along_y
        distance = math.hypot(x - near_x, y - near_y)
        if distance < best:
            best_x, best_y, best = near_x, near_y, distance
    for m in range(circles.shape[0]):
        off_x, off_y = x - circles[m, 0], y - circles[m, 1]
        centre = max(math.hypot(off_x, off_y), 1e-9)
        distance = abs(centre - circles[m, 2])
        if distance < best:
            scale = circles[m, 2] / centre
            best_x, best_y = circles[m, 0] + scale * off_x, circles[m, 1] + scale * off_y
            best = distance
    return best_x, best_y, best


@njit(cache=True)
def _repulsion(x, y, radius, edges, circles):
    """Returns (fx, fy) m/s^2 away from the nearest point of obstacles and walls."""
    near_x, near_y, distance = nearest_point(x, y, edges, circles)
    if math.isinf(distance) or distance < 1e-9:
        return 0.0, 0.0
    size = OBSTACLE_FACTOR * math.exp(-(distance - radius) / OBSTACLE_SIGMA_M) / distance
    return size * (x - near_x), size * (y - near_y)


@njit(cache=True)
def _group_force(index, people, traits, goal_x, goal_y):
    """Returns (fx, fy) m/s^2 that keeps a group together and its members in each other's sight."""
    group = traits[index, GROUP]
    if group < 0:
        return 0.0, 0.0
    x, y = people[index, X], people[index, Y]
    count, sum_x, sum_y, force_x, force_y = 0, 0.0, 0.0, 0.0, 0.0
    for other in range(people.shape[0]):
        if traits[other, GROUP] != group:
            continue
        count += 1
        sum_x += people[other, X]
        sum_y += people[other, Y]
        off_x, off_y = x - people[other, X], y - people[other, Y]
        near = traits[index, RADIUS] + traits[other, RADIUS]
        if other != index and math.hypot(off_x, off_y) < near:
            force_x += REPULSION_FACTOR * off_x
            force_y += REPULSION_FACTOR * off_y
    if count < 2:
        return 0.0, 0.0
    to_x, to_y = sum_x / count - x, sum_y / count - y
    distance = math.hypot(to_x, to_y)
    soft = 0.5 * COHERENCE_FACTOR * (math.tanh(distance - 0.5 * (count - 1)) + 1.0)
    force_x += soft * to_x
    force_y += soft * to_y
    # The others' centre is behind: a person who cannot see them slows down.
    others_x = (sum_x - x) / (count - 1) - x
    others_y = (sum_y - y) / (count - 1) - y
    behind = goal_x * others_x + goal_y * others_y
    if behind < 0.0:
        force_x += GAZE_FACTOR * behind * goal_x
        force_y += GAZE_FACTOR * behind * goal_y
    return force_x, force_y


@njit(cache=True)
def _reacts(person, reaction, robot_distance, bearing, step):
    """Returns whether a person reacts to a robot at a distance [m] and bearing [rad].

    Adds `step` to the person's time of reacting.
    """
    is_seen = (
        robot_distance <= SIGHT_M[reaction]
        and abs(wrap(bearing - person[YAW])) <= SIGHT_HALF_ANGLE_RAD
    )
    reacts = is_seen and person[REACTED] < PATIENCE_S[reaction]
    if reacts:
        person[REACTED] += step
    elif reaction == SCARED and not is_seen:
        person[REACTED] = 0.0
    return reacts


@njit(cache=True)
def _intention(person, traits, goals, reaction, robot, robot_distance):
    """Returns a person's (x m, y m, radius m, speed m/s): the target, its radius, the speed.

    reaction: the person's present reaction, REGULAR without one.
    """
    goal_x, goal_y = own_goal(person, traits, goals)
    if reaction == SCARED:
        return goal_x, goal_y, GOAL_RADIUS_M, SCARED_SPEED_MPS
    if reaction == CURIOUS:
        speed = CURIOUS_SPEED_MPS * robot_distance / CURIOUS_SIGHT_M
        return robot[0], robot[1], CURIOUS_DISTANCE_M, speed
    if reaction == THREATENING:
        ahead = robot[5] + THREAT_AHEAD_M
        ahead_x = robot[0] + ahead * math.cos(robot[2])
        ahead_y = robot[1] + ahead * math.sin(robot[2])
        return ahead_x, ahead_y, THREAT_RADIUS_M, THREAT_SPEED_MPS
    return goal_x, goal_y, GOAL_RADIUS_M, traits[SPEED]


@njit(cache=True)
def _round_robot(x, y, radius, to_robot_x, to_robot_y, to_x, to_y, robot_edges):
    """Returns (fx, fy) m/s^2 off the robot's outline, turned aside for a person walking into it.

    to_x, to_y: unit vector in which the person walks, or zeros.
    """
    fx, fy = _repulsion(x, y, radius, robot_edges, np.empty((0, 3)))
    into = -(fx * to_x + fy * to_y)
    if into > 0.0:
        size = math.hypot(fx, fy)
        side = 1.0 if fx * to_robot_y - fy * to_robot_x <= 0.0 else -1.0
        fx, fy = fx - side * into * fy / size, fy + side * into * fx / size
    return fx, fy


@njit(cache=True)
def _chosen_velocity(vx, vy, force_x, force_y, speed, step):
    """Returns (vx, vy) m/s after the forces; as in lightsfm, at most the person's desired speed."""
    new_vx, new_vy = vx + step * force_x, vy + step * force_y
    limit = min(speed, TOP_SPEED_MPS)
    size = math.hypot(new_vx, new_vy)
    if size > limit:
        new_vx, new_vy = new_vx * limit / size, new_vy * limit / size
    return new_vx, new_vy


@njit(cache=True)
def _desired_force(vx, vy, speed, to_x, to_y):
    """Returns (fx, fy) m/s^2 towards a goal in a direction; for (0, 0), at the goal, it brakes."""
    if to_x == 0.0 and to_y == 0.0:
        return -vx / RELAXATION_S, -vy / RELAXATION_S
    force_x = DESIRED_FACTOR * (speed * to_x - vx) / RELAXATION_S
    force_y = DESIRED_FACTOR * (speed * to_y - vy) / RELAXATION_S
    return force_x, force_y


@njit(cache=True)
def _add_social_forces(force_x, force_y, index, people, robot, takes_robot_for_one):
    """Returns a force m/s^2 with those of all others, and of a robot that is taken for one."""
    x, y, vx, vy = people[index, X], people[index, Y], people[index, VX], people[index, VY]
    for other in range(people.shape[0]):
        if other == index:
            continue
        fx, fy = social_force(
            x, y, vx, vy, people[other, X], people[other, Y], people[other, VX], people[other, VY]
        )
        force_x += SOCIAL_FACTOR * fx
        force_y += SOCIAL_FACTOR * fy
    if takes_robot_for_one:
        fx, fy = social_force(x, y, vx, vy, robot[0], robot[1], robot[3], robot[4])
        force_x += SOCIAL_FACTOR * fx
        force_y += SOCIAL_FACTOR * fy
    return force_x, force_y


@njit(cache=True)
def step_people(people, traits, goals, edges, circles, robot, robot_edges, step):
    """Returns (P, 8) the people `step` s later, with the velocities that they then choose.

    people: (P, 8), traits: (P, 9), goals: (G, 2) m of all. edges, circles: edges and circles of
    standing and of moving obstacles. robot: (6,) x m, y m, yaw rad of its outline's centre, vx m/s,
    vy m/s in the world frame, and its half length, m. robot_edges: (K, 4) its outline there, m.
    """
    after = people_after(people, step)
    chosen = np.empty((people.shape[0], 2))
    for i in range(people.shape[0]):
        x, y, yaw = after[i, X], after[i, Y], after[i, YAW]
        radius, reaction = traits[i, RADIUS], int(traits[i, REACTION])
        to_robot_x, to_robot_y = robot[0] - x, robot[1] - y
        robot_distance = max(math.hypot(to_robot_x, to_robot_y), 1e-9)
        bearing = math.atan2(to_robot_y, to_robot_x)
        reacts = _reacts(after[i], reaction, robot_distance, bearing, step)
        shown = reaction if reacts else REGULAR
        goal_x, goal_y, goal_radius, speed = _intention(
            after[i], traits[i], goals, shown, robot, robot_distance
        )
        to_x, to_y = goal_x - x, goal_y - y
        distance = math.hypot(to_x, to_y)
        stops, is_there = shown == SURPRISED, distance <= goal_radius
        if is_there or stops:
            to_x, to_y = 0.0, 0.0
        else:
            to_x, to_y = to_x / distance, to_y / distance
        speed = pace_behind_others(i, after, traits[i, TIME_GAP], to_x, to_y, speed)

        force_x, force_y = _desired_force(after[i, VX], after[i, VY], speed, to_x, to_y)
        force_x, force_y = _add_social_forces(
            force_x, force_y, i, after, robot, reaction == REGULAR
        )
        if shown == SCARED:
            size = SCARED_FACTOR * OBSTACLE_SIGMA_M / max(robot_distance - radius, 0.1)
            force_x -= size * to_robot_x / robot_distance
            force_y -= size * to_robot_y / robot_distance
        fx, fy = _repulsion(x, y, radius, edges, circles)
        force_x, force_y = force_x + fx, force_y + fy
        if reaction != OBLIVIOUS:
            fx, fy = _round_robot(x, y, radius, to_robot_x, to_robot_y, to_x, to_y, robot_edges)
            force_x, force_y = force_x + fx, force_y + fy
        fx, fy = _group_force(i, after, traits, to_x, to_y)
        force_x, force_y = force_x + fx, force_y + fy

        vx, vy = 0.0, 0.0
        if not stops:
            vx, vy = _chosen_velocity(after[i, VX], after[i, VY], force_x, force_y, speed, step)
        chosen[i, 0], chosen[i, 1] = vx, vy
        if stops or (reacts and is_there):
            after[i, YAW] = turned_towards(yaw, bearing, step)
        elif math.hypot(vx, vy) > WALKING_MPS:
            after[i, YAW] = turned_towards(yaw, math.atan2(vy, vx), step)
    put_velocities(after, chosen)
    return after
