"""The last part of a Hybrid-A* path in one curve: the car's shortest way from a state to the goal.

The tries are fewer in earlier releases of Nav2: wider turns since Jazzy, since Kilted changes of
direction count. Source: nav2_smac_planner (AnalyticExpansion), branches humble to lyrical.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from drake_navbench.kernels.car_curves import (
    curve_knots,
    direction_changes,
    pose_on_curve,
    shortest_curve,
)
from drake_navbench.kernels.curve_pieces import PIECES
from drake_navbench.kernels.hybrid_graph import (
    NO_INDEX,
    NO_STATE,
    index_of,
    is_free,
    new_state,
    parent_of,
    set_pose,
    state_at,
)
from drake_navbench.kernels.hybrid_releases import IRON, JAZZY, KILTED

F32 = np.float32
SQRT_2 = F32(math.sqrt(2.0))
WORST = F32(np.finfo(np.float32).max)
# The number of times, and of states each time, by which a curve may begin earlier than where it was
# tried.
EARLIER_TRIES, EARLIER_STATES = 8, 5
WIDEST, WIDENING = F32(4.0), F32(0.5)


class ExpansionRules(NamedTuple):
    """Parameters of Nav2 by their names; the length in cells, as float32.

    columns: width of the grid, cells. cost_penalty: the search's own. release: the release of Nav2
    that searches.
    """

    ratio: np.float32
    max_length: np.float32
    max_cost: np.float32
    max_cost_override: bool
    cost_penalty: np.float32
    columns: int
    release: int


class Curve(NamedTuple):
    """The states on a curve, without the state at which it begins.

    states: (n,) int64. poses: (n, 3) float32. changes: number of changes of direction.
    """

    states: NDArray[np.int64]
    poses: NDArray[np.float32]
    changes: int


@njit(cache=True)
def no_curve():
    """Returns a curve without states."""
    return Curve(np.empty(0, np.int64), np.empty((0, 3), np.float32), 0)


@njit(cache=True)
def longest_curve(rules):
    """Returns the largest possible number of a curve's states."""
    return math.floor(rules.max_length / SQRT_2) + 1


@njit(cache=True)
def _pose_of(graph, motions, number):
    """Returns (x, y, yaw) of a state, at the beginning of its bin."""
    state = graph.states[number]
    yaw = np.float64(F32(F32(int(state.heading)) * motions.bin_size))
    return np.float64(state.x), np.float64(state.y), yaw


@njit(cache=True)
def _bin_of(angle, motions, release):
    """Returns the bin of an angle in [0, 2 pi), float32; before Jazzy a whole one."""
    if release >= JAZZY:
        return F32(angle / float(motions.bin_size))
    if release >= IRON:
        return F32(math.floor(angle / float(motions.bin_size)) % motions.bins)
    nearest = math.floor(F32(F32(angle) / motions.bin_size) + 0.5)
    return F32(nearest if nearest < motions.bins else 0)


@njit(cache=True)
def curve_to(graph, body, motions, rules, state, goal, radius):
    """Returns the curve from a state to a goal; none where it is too long, blocked or too costly.

    There must be room in the graph for `longest_curve` states.
    """
    bins = motions.bins
    start, end = _pose_of(graph, motions, state), _pose_of(graph, motions, goal)
    kinds, lengths = np.empty(PIECES, np.int64), np.empty(PIECES)
    length = F32(shortest_curve(start, end, radius, motions.reverses, kinds, lengths))
    if length > rules.max_length or length < SQRT_2:
        return no_curve()
    count = math.floor(F32(length / SQRT_2))
    knots, pose = curve_knots(start[2], kinds, lengths), np.empty(3)
    states = np.empty(count, np.int64)
    own, kept = np.empty((count, 3), np.float32), np.empty((count, 3), np.float32)
    found, previous, fits = 0, state, True
    for k in range(1, count + 1):
        share = float(F32(F32(k) / F32(count)))
        pose_on_curve(start, end, radius, kinds, lengths, knots, share, pose)
        angle = pose[2] + 2.0 * math.pi if pose[2] < 0.0 else pose[2]
        angle = angle - 2.0 * math.pi if angle > 2.0 * math.pi else angle
        x, y, heading = F32(pose[0]), F32(pose[1]), _bin_of(angle, motions, rules.release)
        following = state_at(graph, index_of(pose[0], pose[1], heading, rules.columns, bins))
        if following == NO_STATE:
            fits = False
            break
        was = graph.states[following]
        before = was.x, was.y, was.heading
        set_pose(graph, following, x, y, heading)
        fits = is_free(graph, body, following) and following != previous
        if not fits:
            set_pose(graph, following, *before)
            break
        states[found] = following
        own[found, 0], own[found, 1], own[found, 2] = x, y, heading
        kept[found, 0], kept[found, 1], kept[found, 2] = before
        found += 1
        previous = following
    fits = fits and _is_cheap(graph, motions, rules, states[:found], length)
    # The search keeps its own poses.
    for k in range(found):
        set_pose(graph, states[k], kept[k, 0], kept[k, 1], kept[k, 2])
    if not fits:
        return no_curve()
    counts_changes = motions.reverses and rules.release >= KILTED
    changes = direction_changes(lengths) if counts_changes else 0
    return Curve(states[:found], own[:found], changes)


@njit(cache=True)
def _is_cheap(graph, motions, rules, states, length):
    """Tells whether a curve has low costs; only its end may lie in high ones."""
    has_left = False
    for k in range(states.size - 1, -1, -1):
        cost = graph.states[states[k]].cost
        if cost <= rules.max_cost:
            has_left = True
        elif has_left:
            near = float(length) < 2.0 * math.pi * float(motions.radius)
            return rules.max_cost_override and near
    return True


@njit(cache=True)
def _score(graph, rules, curve):
    """Returns the cost of a curve by the rule of the search; WORST for less than two states."""
    if curve.states.size < 2:
        return WORST
    dx = float(F32(curve.poses[1, 0] - curve.poses[0, 0]))
    dy = float(F32(curve.poses[1, 1] - curve.poses[0, 1]))
    distance = F32(math.sqrt(dx * dx + dy * dy))
    score = F32(0.0)
    for state in curve.states:
        share = F32(graph.states[state].cost / F32(252.0))
        # Nav2 adds the 1 in double precision.
        factor = 1.0 + float(F32(rules.cost_penalty * share))
        score = F32(float(score) + float(distance) * factor)
    return score


@njit(cache=True)
def refined(graph, body, motions, rules, state, goal, curve):
    """Returns a curve that begins earlier or turns wider where that is better.

    Returns its score, the state that it begins at, and the curve. There must be room for
    `longest_curve` states a try.
    """
    tried = state
    for _ in range(EARLIER_TRIES):
        earlier = tried
        for _ in range(EARLIER_STATES):
            if earlier != NO_STATE:
                earlier = parent_of(graph, earlier)
        if earlier == NO_STATE:
            break
        tried = earlier
        other = curve_to(graph, body, motions, rules, tried, goal, np.float64(motions.radius))
        if other.states.size == 0:
            break
        if other.changes <= curve.changes:
            curve, state = other, tried
    original = best = _score(graph, rules, curve)
    radius, widest = motions.radius, F32(WIDEST * motions.radius)
    while radius < widest and rules.release >= JAZZY:
        radius = F32(radius + WIDENING)
        other = curve_to(graph, body, motions, rules, state, goal, np.float64(radius))
        score = _score(graph, rules, other)
        is_better = score <= best and other.changes <= curve.changes
        if is_better or (score <= original and other.changes < curve.changes):
            curve, best = other, score
    return best, state, curve


@njit(cache=True)
def joined(graph, state, goal, curve):
    """Makes a curve part of the graph: from `state` over its states to the goal, which it returns.

    A state that was visited on another way keeps that way; the curve gets a new state there.
    """
    previous = state
    for k in range(curve.states.size):
        node = curve.states[k]
        if graph.states[node].place == graph.states[goal].place:
            continue
        if graph.states[node].is_visited:
            node = new_state(graph, np.int64(NO_INDEX))
        set_pose(graph, node, curve.poses[k, 0], curve.poses[k, 1], curve.poses[k, 2])
        graph.states[node].parent = previous
        graph.states[node].is_visited = True
        previous = node
    if goal != previous:
        graph.states[goal].parent = previous
        graph.states[goal].is_visited = True
    return goal
