"""Signatures, graphs, and which bands a cycle keeps."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from upstream_scenes import POINT, straight

from drake_navbench.controllers.teb_upstream.band import band_command
from drake_navbench.controllers.teb_upstream.classes import ClassSearch
from drake_navbench.controllers.teb_upstream.exploration import (
    Graph,
    keypoint_graph,
    roadmap,
    walk_of,
    walk_on,
)
from drake_navbench.controllers.teb_upstream.memory import PlannerState, Trajectory
from drake_navbench.controllers.teb_upstream.parameters import TebUpstreamParameters
from drake_navbench.controllers.teb_upstream.planner import (
    Planned,
    Scene,
    TebPlanner,
)
from drake_navbench.controllers.teb_upstream.signatures import (
    ClassRules,
    is_wanted,
    same_class,
    signature,
    signature_in_time,
)

NOTHING = np.empty((0, 2))


def past(side_m: float):
    """Returns poses and time steps of a detour of so many metres to the left."""
    poses = straight(2.0, 0.25)
    poses[1:-1, 1] = side_m * np.sin(np.pi * poses[1:-1, 0] / 2.0)
    return poses, np.full(8, 0.5)


@pytest.mark.parametrize("in_time", [True, False])
def test_signatures_tell_the_sides_of_an_obstacle(in_time):
    rules = ClassRules(in_time, prescaler=1.0, threshold=0.1, most_of_best=1)
    left, farther_left, right = (
        signature(*past(side_m), np.array([[1.0, 0.0]]), rules) for side_m in (0.5, 0.7, -0.5)
    )
    assert same_class(left, farther_left, rules)
    assert not same_class(left, right, rules)


def test_an_obstacle_to_the_left_has_a_positive_signature():
    poses, steps = past(0.0)
    left, right, far = signature_in_time(poses, steps, np.array([[1, 0.5], [1, -0.5], [1, 90.0]]))
    assert left > 0.1
    assert right == pytest.approx(-left)
    # A far one does not reach the threshold, so that it separates no classes.
    assert 0.0 < far < 0.1


def test_one_band_is_wanted_of_each_class_and_several_of_the_best_ones():
    rules = ClassRules(True, prescaler=1.0, threshold=0.1, most_of_best=2)
    left, right, between = np.array([0.5, 0.5]), np.array([-0.5, -0.5]), np.array([0.5, -0.5])
    nothing = np.empty((0, 0))
    assert is_wanted(left, nothing, nothing, rules)
    assert is_wanted(between, np.array([left, right]), nothing, rules)
    assert not is_wanted(left, np.array([right, left]), nothing, rules)
    assert not is_wanted(left, np.array([right, left]), right[None], rules)
    assert is_wanted(left, np.array([right, left]), left[None], rules)
    assert not is_wanted(left, np.array([left, right, left]), left[None], rules)
    # The best one's class is of a cycle with another number of obstacles: none is like it.
    assert not is_wanted(left, np.array([left]), np.array([[0.5]]), rules)
    assert not is_wanted(np.array([0.5, np.nan]), nothing, nothing, rules)


def paths_of(graph):
    """Returns all paths from the start to the goal as the walk finds them."""
    walk, length, goal, paths = walk_of(graph), 0, len(graph.points) - 1, []
    while length := walk_on(graph.edges, walk, length):
        if graph.edges[walk.path[length - 1], goal]:
            paths.append([*walk.path[:length].tolist(), goal])
    return paths


def simple_paths(edges, path):
    """Yields the same by the definition: the goal first, then on from each point not visited."""
    goal = len(edges) - 1
    if edges[path[-1], goal]:
        yield [*path, goal]
    for point in range(goal):
        if edges[path[-1], point] and point not in path:
            yield from simple_paths(edges, [*path, point])


def test_paths_come_depth_first_and_the_goal_first_at_each_point():
    edges = np.zeros((4, 4), dtype=bool)
    edges[0, 1] = edges[0, 2] = edges[1, 2] = edges[1, 3] = edges[2, 3] = edges[2, 1] = True
    graph = Graph(np.zeros((4, 2)), edges)
    assert paths_of(graph) == [[0, 1, 3], [0, 1, 2, 3], [0, 2, 3], [0, 2, 1, 3]]


@given(st.integers(2, 6), st.integers(0, 2**36 - 1))
def test_a_walk_finds_every_simple_path_once(count, bits):
    edges = np.array([bits >> k & 1 for k in range(count * count)], dtype=bool)
    graph = Graph(np.zeros((count, 2)), edges.reshape(count, count))
    assert paths_of(graph) == list(simple_paths(graph.edges, [0]))


def test_a_roadmap_leads_ahead_and_keeps_its_distance():
    rng = np.random.default_rng(1)
    start, goal = np.zeros(3), np.array([2.0, 0.0, 0.0])
    obstacle = np.array([[1.0, 0.0]])
    graph = roadmap(
        start,
        goal,
        obstacle,
        samples=rng.random((15, 2)),
        width_m=6.0,
        length_ratio=1.0,
        clearance_m=0.3,
        least_cosine=0.45,
    )
    assert not graph.edges[0, -1]
    assert np.all(np.abs(graph.points[:, 1]) <= 3.0)
    for i, j in np.argwhere(graph.edges):
        way = graph.points[j] - graph.points[i]
        assert way[0] > 0.45 * np.hypot(*way)
        shares = np.linspace(0.0, 1.0, 200)[:, None]
        line = graph.points[i] + shares * way
        assert np.hypot(*(line - obstacle).T).min() > 0.3 - 1e-9


def test_keypoints_lie_beside_obstacles_ahead():
    graph = keypoint_graph(
        np.zeros(3),
        np.array([2.0, 0.0, 0.0]),
        np.array([[1.0, 0.0], [-1.0, 0.0]]),
        clearance_m=0.4,
        least_cosine=0.45,
    )
    np.testing.assert_allclose(graph.points, [[0, 0], [1, 0.4], [1, -0.4], [2, 0]], atol=1e-12)
    assert paths_of(graph) == [[0, 1, 3], [0, 2, 3]]


def scene(obstacles, *, time_s=0.0, samples=NOTHING):
    return Scene(straight(), np.zeros(2), obstacles, NOTHING, samples, np.zeros(5), 0.25, time_s)


def test_both_ways_past_an_obstacle_are_planned_as_by_the_original():
    """Costs and the command are those of teb_local_planner (ros2-master) with g2o."""
    parameters = TebUpstreamParameters(simple_exploration=True, min_obstacle_dist=0.3)
    planner = TebPlanner(parameters, POINT)
    settings = planner.settings(None)
    seen = scene(np.array([[1.0, 0.02]]))._replace(twist=np.array([0.2, 0.0]))
    planned = planner.plan(PlannerState(), seen, settings)
    costs = [band.cost for band in planned.state.trajectories]
    assert costs == pytest.approx([6.6906548809, 7.7358369967], rel=1e-4)
    _, speed, rate = band_command(planned.best.poses, planned.best.time_steps, 1, 0.3)
    assert (speed, rate) == pytest.approx((0.0251053905, -0.2251786267), abs=1e-4)
    again = planner.plan(planned.state, seen, settings)
    costs = [band.cost for band in again.state.trajectories]
    assert costs == pytest.approx([7.3231234802, 7.2318604957], rel=1e-3)


def test_no_more_bands_are_looked_for_than_allowed():
    parameters = TebUpstreamParameters(
        simple_exploration=True, min_obstacle_dist=0.3, max_number_classes=1
    )
    planner = TebPlanner(parameters, POINT)
    planned = planner.plan(PlannerState(), scene(np.array([[1.0, 0.02]])), planner.settings(None))
    assert len(planned.state.trajectories) == 1


def test_without_room_the_plan_keeps_the_class_of_an_earlier_cycle():
    parameters = TebUpstreamParameters(
        simple_exploration=True, min_obstacle_dist=0.3, max_number_classes=1
    )
    planner = TebPlanner(parameters, POINT)
    seen, settings = scene(np.array([[1.0, 0.02]])), planner.settings(None)
    first = planner.plan(PlannerState(), seen, settings)
    second = planner.plan(first.state, seen, settings)
    assert first.plan_numbers[0] == first.state.best
    assert second.plan_numbers == (first.state.best,)


def test_a_change_of_band_waits_for_the_blocking_period():
    parameters = TebUpstreamParameters(switching_blocking_period=2.0)
    planner = TebPlanner(parameters, POINT)
    bands = tuple(Trajectory(k, *past(0.0), cost=cost) for k, cost in ((3, 2.0), (4, 1.0)))
    planned = Planned(PlannerState(bands, switched_s=5.0), previous=3)
    assert planner.select(planned, 6.9).state.best == 3
    changed = planner.select(planned, 7.1).state
    assert (changed.best, changed.switched_s) == (4, 7.1)


def test_hysteresis_and_the_plans_class_count_in_the_choice():
    parameters = TebUpstreamParameters(selection_cost_hysteresis=0.5)
    planner = TebPlanner(parameters, POINT)
    costs = (1.9, 1.0, 1.04)
    bands = tuple(Trajectory(k, *past(0.0), cost=cost) for k, cost in enumerate(costs))
    state = PlannerState(bands)
    assert planner.select(Planned(state, previous=0), 9.0).state.best == 0
    assert planner.select(Planned(state, plan_numbers=(2,)), 9.0).state.best == 2
    # Band 7 was the plan's, and is gone; 2 is another one of the plan's class.
    assert planner.select(Planned(state, plan_numbers=(7, 2)), 9.0).state.best == 2
    assert planner.select(Planned(state), 9.0).state.best == 1


def test_detours_are_dropped_and_the_best_band_stays():
    def search(*bands):
        found = ClassSearch(TebUpstreamParameters(), NOTHING, bands, PlannerState(bands, best=0))
        found._bands = list(bands)
        found._classes = [np.empty(0) for _ in bands]
        found.drop_detours()
        return [band.number for band, _ in found.candidates()]

    poses, steps = past(0.0)
    best = Trajectory(0, poses, steps, cost=1.0, is_optimized=True)
    backwards = best._replace(number=1, poses=poses * [-1.0, 1.0, 1.0])
    failed = best._replace(number=2, is_optimized=False)
    slow = best._replace(number=3, time_steps=4.0 * steps)
    other = best._replace(number=4, time_steps=2.0 * steps)
    assert search(best, backwards, failed, slow, other) == [0, 4]
