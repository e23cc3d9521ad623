"""Hybrid-A*: a search over poses of a car, cell by cell and heading bin by heading bin.

A state keeps the cheapest pose that was found in it; now and then the shortest curve to the goal is
tried (`hybrid_expansion`). Costs are float32, and ties are broken as inside Nav2, so that the path
is the same. Nothing here reads a clock: a time limit enters as a number of expansions.
Earlier releases of Nav2 have rules of their own: a test of `release` names the first without one.
Sources: D. Dolgov et al., "Path planning for autonomous vehicles in unknown semi-structured
environments", 2010; nav2_smac_planner (AStarAlgorithm, NodeHybrid, AnalyticExpansion), branches
humble to lyrical.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from drake_navbench.kernels.astar import (
    EXACT_TOLERANCE,
    EXPANSION_BUDGET_SPENT,
    FOUND,
    GOAL_OCCUPIED,
    ITERATION_LIMIT,
    OPEN_SET_EMPTY,
    START_OCCUPIED,
)
from drake_navbench.kernels.hybrid_expansion import (
    EARLIER_TRIES,
    WIDENING,
    WIDEST,
    WORST,
    curve_to,
    joined,
    longest_curve,
    no_curve,
    refined,
)
from drake_navbench.kernels.hybrid_graph import (
    NO_MOTION,
    NO_STATE,
    check,
    index_of,
    is_free,
    look_at,
    new_graph,
    parent_of,
    set_pose,
    state_at,
    with_room,
)
from drake_navbench.kernels.hybrid_heuristics import free_way, way_round
from drake_navbench.kernels.hybrid_motion import FORWARD, REVERSE, REVERSE_LEFT, REVERSE_RIGHT
from drake_navbench.kernels.hybrid_queue import dequeue, enqueue, queue_from, with_queue_room
from drake_navbench.kernels.hybrid_releases import JAZZY, KILTED, LYRICAL

F32 = np.float32
FARTHEST = F32(np.finfo(np.float32).max)
MAX_COST = F32(252.0)
LARGEST_COUNT = 2**31 - 1


class SearchRules(NamedTuple):
    """Parameters of Nav2 by their names, float32; the tolerance in cells.

    travel_distance_reward: 1 - retrospective_penalty. expansion_budget: the time limit, checked
    every terminal_checking_interval expansions. coarse_search_resolution: every n-th goal is tried
    before the others. release: the release of Nav2 that searches.
    """

    tolerance: np.float32
    non_straight_penalty: np.float32
    change_penalty: np.float32
    reverse_penalty: np.float32
    cost_penalty: np.float32
    travel_distance_reward: np.float32
    use_quadratic_cost_penalty: bool
    max_iterations: int
    max_on_approach_iterations: int
    terminal_checking_interval: int
    expansion_budget: int
    coarse_search_resolution: int
    release: int


@njit(cache=True)
def _look_ahead(reached, ways, motions, goals, state, columns):
    """Writes the heuristic of a state: the larger of the way round obstacles and the car's way."""
    bins, index = motions.bins, state.place
    column, row, heading = index // bins % columns, index // (bins * columns), index % bins
    around = way_round(reached, column, row)
    free = FARTHEST
    for k in range(goals.shape[0]):
        free = min(free, free_way(ways, motions, column, row, heading, goals[k], around))
    state.ahead = max(around, free)


@njit(cache=True)
def _step_cost(motions, rules, before, child):
    """Returns the cost of the motion to a state, after the motion `before`."""
    if before == NO_MOTION and rules.release < LYRICAL:
        return motions.travel_costs[0]
    share = F32(child.cost / MAX_COST)
    motion = child.motion
    direction = motions.directions[motion]
    penalty = F32(rules.cost_penalty * share)
    if rules.use_quadratic_cost_penalty:
        penalty = F32(penalty * share)
    cost = F32(motions.travel_costs[motion] * F32(rules.travel_distance_reward + penalty))
    if direction not in (FORWARD, REVERSE) and before != NO_MOTION:
        if motions.directions[before] == direction:
            cost = F32(cost * rules.non_straight_penalty)
        else:
            cost = F32(cost * F32(rules.non_straight_penalty + rules.change_penalty))
    if direction in (REVERSE, REVERSE_LEFT, REVERSE_RIGHT):
        cost = F32(cost * rules.reverse_penalty)
    return cost


@njit(cache=True)
def _is_any_free_near(body, x, y, radius):
    """Tells whether the robot fits, heading along x, anywhere within a radius in cells."""
    if radius < 1.0:
        return False
    rows, columns = body.grid.costs.shape
    for column in range(
        max(0, math.floor(x - radius)), min(columns - 1, math.ceil(x + radius)) + 1
    ):
        for row in range(max(0, math.floor(y - radius)), min(rows - 1, math.ceil(y + radius)) + 1):
            dx, dy = F32(F32(column) - x), F32(F32(row) - y)
            if F32(F32(dx * dx) + F32(dy * dy)) > F32(radius * radius):
                continue
            if look_at(body, F32(column), F32(row), F32(0.0))[1]:
                return True
    return False


@njit(cache=True)
def _neighbours(graph, body, motions, state, columns, neighbours):
    """Writes the free states that one motion leads to and were not visited; returns how many."""
    count = 0
    from_x, from_y = float(graph.states[state].x), float(graph.states[state].y)
    from_heading = graph.states[state].heading
    heading = int(from_heading)
    for m in range(motions.turn_bins.size):
        turned = F32(from_heading + motions.turn_bins[m])
        if turned < 0.0:
            turned = F32(turned + F32(motions.bins))
        if turned >= F32(motions.bins):
            turned = F32(turned - F32(motions.bins))
        x = F32(motions.step_x[m, heading] + from_x)
        y = F32(motions.step_y[m, heading] + from_y)
        other = state_at(graph, index_of(x, y, turned, columns, motions.bins))
        if other == NO_STATE or graph.states[other].is_visited:
            continue
        was = graph.states[other]
        before = was.x, was.y, was.heading
        set_pose(graph, other, x, y, turned)
        if np.isnan(was.cost) or body.release < JAZZY:
            check(body, was)
        if was.is_free:
            graph.states[other].motion = m
            neighbours[count] = other
            count += 1
        else:
            set_pose(graph, other, *before)
    return count


@njit(cache=True)
def _path(graph, motions, state):
    """Returns the poses from the start to a state, (N, 3) float32 x and y in cells, yaw in rad.

    N is at least 2, or 0 where the state is the start.
    """
    count, node = 1, state
    while parent_of(graph, node) != NO_STATE:
        node = parent_of(graph, node)
        count += 1
    path = np.empty((count if count > 1 else 0, 3), np.float32)
    node = state
    for k in range(path.shape[0] - 1, -1, -1):
        pose = graph.states[node]
        path[k, 0], path[k, 1] = pose.x, pose.y
        path[k, 2] = F32(F32(int(pose.heading)) * motions.bin_size)
        node = parent_of(graph, node)
    return path


@njit(cache=True)
def _best_curve(graph, body, motions, expansion, state, goals, coarse):
    """Returns the cheapest curve to any goal, its first state and its goal, NO_STATE for none.

    Before Kilted, where there is one goal, the curve may be without states of its own.
    """
    best, best_score, best_start, best_goal = no_curve(), WORST, NO_STATE, NO_STATE
    has_any = False
    for is_fine in (False, True):
        if is_fine and not has_any:
            break
        for k in range(goals.size):
            if (coarse[k] != 0) != is_fine:
                continue
            curve = curve_to(
                graph, body, motions, expansion, state, goals[k], np.float64(motions.radius)
            )
            if curve.states.size == 0:
                continue
            has_any = True
            score, start, curve = refined(graph, body, motions, expansion, state, goals[k], curve)
            if score < best_score or expansion.release < KILTED:
                best, best_score, best_start, best_goal = curve, score, start, goals[k]
    return best, best_start, best_goal


@njit(cache=True)
def _may_be_goal(graph, body, rules, node):
    """Tells whether the robot fits at a goal, or near enough to it."""
    is_exact = rules.tolerance < F32(EXACT_TOLERANCE)
    if rules.release < KILTED:
        return not is_exact or is_free(graph, body, node)
    if rules.release < LYRICAL:
        return is_free(graph, body, node) or not is_exact
    pose = graph.states[node]
    return is_free(graph, body, node) or _is_any_free_near(body, pose.x, pose.y, rules.tolerance)


@njit(cache=True)
def _limit_reached(rules, expansions):
    """Returns the status of a limit that is reached, OPEN_SET_EMPTY for none."""
    if expansions >= rules.max_iterations:
        return ITERATION_LIMIT
    is_check = expansions % rules.terminal_checking_interval == 0
    if is_check and expansions >= rules.expansion_budget:
        return EXPANSION_BUDGET_SPENT
    return OPEN_SET_EMPTY


@njit(cache=True)
def _tries_apart(least, ratio):
    """Returns the number of expansions between two curves, for the least cost ahead so far."""
    return max(int(F32(F32(least) / ratio)), math.ceil(ratio))


@njit(cache=True)
def _state_of(graph, body, bins, pose):
    """Returns the state of a pose (3,) float32 in cells and bins, which it gets."""
    columns = body.grid.costs.shape[1]
    state = state_at(graph, index_of(pose[0], pose[1], pose[2], columns, bins))
    set_pose(graph, state, pose[0], pose[1], pose[2])
    return state


@njit(cache=True)
def _possible_goals(graph, body, rules, goal, goal_bins, bins):
    """Returns (states, poses (G, 3), coarse) of the goals that the robot may reach.

    coarse: (G,), 0 for the goals that are tried first.
    """
    columns = body.grid.costs.shape[1]
    states, coarse = np.empty(goal_bins.size, np.int64), np.zeros(goal_bins.size, np.int64)
    poses = np.empty((goal_bins.size, 3), np.float32)
    count = 0
    for k in range(goal_bins.size):
        node = state_at(graph, index_of(goal[0], goal[1], F32(goal_bins[k]), columns, bins))
        set_pose(graph, node, goal[0], goal[1], F32(goal_bins[k]))
        if _may_be_goal(graph, body, rules, node):
            states[count], coarse[count] = node, k % rules.coarse_search_resolution
            poses[count, 0], poses[count, 1], poses[count, 2] = goal[0], goal[1], goal_bins[k]
            count += 1
    return states[:count], poses[:count], coarse[:count]


@njit(cache=True)
def _most_new_states(motions, expansion, goal_count):
    """Returns the most states that one expansion adds: neighbours, and curves to all goals."""
    tries = EARLIER_TRIES + 2 + math.ceil((WIDEST - 1.0) * motions.radius / WIDENING)
    return (tries * goal_count + 1) * longest_curve(expansion) + motions.turn_bins.size


@njit(cache=True)
def search(body, motions, rules, expansion, heuristics, start, goal, slots):
    """Returns (status, path (N, 3) float32 in cells and rad, expansions).

    FOUND with an empty path means that the start is a goal; that counts as no path. heuristics: for
    this goal, a point's ways round obstacles and a car's ways on an empty floor; both are filled in
    as the search needs them. start: (3,) float32, cells and bin. goal: its place, (2,) float32, and
    the headings that it may have, (G,) int64 in Nav2's order. slots: (columns * rows * bins,)
    int32, all 0, written.
    """
    graph = new_graph(slots)
    first = _state_of(graph, body, motions.bins, start)
    goals = _possible_goals(graph, body, rules, goal[0], goal[1], motions.bins)
    nothing = np.empty((0, 3), np.float32)
    if goals[0].size == 0:
        return GOAL_OCCUPIED, nothing, 0
    if rules.release < JAZZY and not is_free(graph, body, first):
        return START_OCCUPIED, nothing, 0
    queue = queue_from(graph, first)
    status, graph, end, expansions = _searched(
        body, motions, rules, expansion, heuristics, graph, queue, goals
    )
    return status, _path(graph, motions, end) if status == FOUND else nothing, expansions


@njit(cache=True)
def _searched(body, motions, rules, expansion, heuristics, graph, queue, possible_goals):
    """Returns (status, graph, last state of the path, expansions) after `search`'s loop."""
    reached, ways = heuristics
    goals, poses, coarse = possible_goals
    columns = body.grid.costs.shape[1]
    room = _most_new_states(motions, expansion, goals.size)
    neighbours = np.empty(motions.turn_bins.size, np.int64)
    # Not the constant itself, for which numba would compile the path a second time.
    nearest, nearest_heuristic = np.int64(NO_STATE), FARTHEST
    expansions, on_approach, until_curve, least = 0, 0, 0, LARGEST_COUNT
    status = OPEN_SET_EMPTY
    while queue.counts[0] > 0:
        status = _limit_reached(rules, expansions)
        if status != OPEN_SET_EMPTY:
            break
        state = dequeue(queue, graph)
        if graph.states[state].is_visited:
            continue
        expansions += 1
        graph.states[state].is_visited = True
        if graph.counts[0] + room > graph.states.size:
            graph = with_room(graph, room)
        if queue.counts[1] + neighbours.size > queue.entries.size:
            queue = with_queue_room(queue, neighbours.size)
        # Here and below: a call hands on a dozen arrays, which takes longer than this test. So the
        # loop stays whole: with its part over neighbours in a function, a search takes a fifth
        # longer.
        if np.isnan(graph.states[state].ahead):
            _look_ahead(reached, ways, motions, poses, graph.states[state], columns)
        least = min(least, int(graph.states[state].ahead))
        until_curve = min(until_curve, _tries_apart(least, expansion.ratio))
        if until_curve <= 0:
            until_curve = _tries_apart(least, expansion.ratio)
            curve, begin, end = _best_curve(graph, body, motions, expansion, state, goals, coarse)
            if end != NO_STATE:
                return FOUND, graph, joined(graph, begin, end, curve), expansions
        until_curve -= 1
        for goal in goals:
            if goal == state:
                return FOUND, graph, state, expansions
        if nearest_heuristic < rules.tolerance:
            on_approach += 1
            if on_approach >= rules.max_on_approach_iterations:
                return FOUND, graph, nearest, expansions
        found = _neighbours(graph, body, motions, state, columns, neighbours)
        way_here, motion_here = graph.states[state].way, graph.states[state].motion
        for k in range(found):
            other = graph.states[neighbours[k]]
            way = F32(way_here + _step_cost(motions, rules, motion_here, other))
            if way < other.way:
                other.way, other.parent = way, state
                if np.isnan(other.ahead):
                    _look_ahead(reached, ways, motions, poses, other, columns)
                if other.ahead < nearest_heuristic:
                    nearest, nearest_heuristic = neighbours[k], other.ahead
                enqueue(queue, graph, neighbours[k], F32(way + other.ahead))
    counts_nearest = status != EXPANSION_BUDGET_SPENT or rules.release >= LYRICAL
    is_near = counts_nearest and nearest_heuristic < rules.tolerance
    return FOUND if is_near else status, graph, nearest, expansions
