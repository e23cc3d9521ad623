"""The planner as a whole: the path of a request, or its typed failure."""

import math

import numpy as np
import pytest
from planner_requests import answer, digest, random_requests
from pydantic import ValidationError

from drake_navbench.kernels.footprint import circle_footprint
from drake_navbench.kernels.grid import NO_INFORMATION, Costmap
from drake_navbench.navigation.planner import (
    GoalOccupied,
    NoValidPathCouldBeFound,
    PlannerTimedOut,
    StartOccupied,
)
from drake_navbench.navigation.smac_planner_2d import SmacPlanner2D, downsample, plan_path
from drake_navbench.navigation.smac_planner_2d_parameters import (
    SmacPlanner2DParameters as Parameters,
)

RESOLUTION_M = 0.05
LETHAL, UNKNOWN = 254, 255
OURS = Parameters()
CLASSIC = Parameters.nav2_classic()


def make_map(costs, origin=(0.0, 0.0)):
    return Costmap(np.asarray(costs, dtype=np.uint8), *origin, RESOLUTION_M)


def empty_map(columns=200, rows=100, origin=(0.0, 0.0)):
    return make_map(np.zeros((rows, columns)), origin)


def cell_of(point):
    return tuple(np.floor(np.asarray(point[:2]) / RESOLUTION_M + 1e-6).astype(int))


def centre(column, row):
    return (column + 0.5) * RESOLUTION_M, (row + 0.5) * RESOLUTION_M


def walled_map():
    """10 x 5 m, a wall at x = 5 m from the bottom up to y = 4 m."""
    costs = np.zeros((100, 200), dtype=np.uint8)
    costs[:80, 100] = LETHAL
    return make_map(costs)


@pytest.mark.parametrize("origin", [(-1.0, -2.5), (-1.025, -2.475), (-0.99, -2.51)])
def test_a_plan_along_a_row_is_a_straight_line_at_the_spacing_of_the_cells(origin):
    # Wherever start and goal lie within their cells, 7.5 m are 150 cells.
    path = plan_path(empty_map(origin=origin), (0.0, 0.0, 0.0), (7.5, 0.0, 0.0), OURS)
    assert len(path) == 151
    np.testing.assert_array_equal(path[:, 1:], np.zeros((151, 2)))
    np.testing.assert_allclose(path[:, 0], RESOLUTION_M * np.arange(151), atol=1e-12)


def test_a_plan_along_a_column_heads_along_y():
    path = plan_path(empty_map(), (1.025, 1.025, 0.0), (1.025, 4.025, 0.0), OURS)
    np.testing.assert_array_equal(path[:, 0], np.full(61, 1.025))
    np.testing.assert_array_equal(path[:-1, 2], np.full(60, math.pi / 2))
    assert path[-1, 2] == 0.0


def test_a_plan_along_a_diagonal_is_straight():
    path = plan_path(empty_map(), (1.025, 1.025, 0.0), (4.025, 4.025, 0.0), OURS)
    np.testing.assert_allclose(path[:, 0], path[:, 1], atol=1e-12)
    np.testing.assert_allclose(path[:-1, 2], math.pi / 4, atol=1e-9)


def test_our_plan_starts_and_ends_exactly_where_it_was_asked_to():
    start, goal = (0.511, 0.237, 1.0), (8.013, 4.444, -1.0)
    path = plan_path(empty_map(), start, goal, OURS)
    assert tuple(path[0, :2]) == start[:2]
    assert tuple(path[-1]) == goal


def test_blending_the_end_points_leaves_every_pose_in_its_cell():
    unsmoothed = {"smoother": {"max_iterations": 0}}
    start, goal = (0.511, 0.237, 1.0), (8.013, 3.444, -1.0)
    cells = plan_path(
        empty_map(), start, goal, Parameters(use_exact_end_points=False, **unsmoothed)
    )
    blended = plan_path(empty_map(), start, goal, Parameters(**unsmoothed))
    assert [cell_of(p) for p in blended] == [cell_of(p) for p in cells]


def test_nav2s_plan_lies_half_a_cell_low_and_ends_in_the_goal_with_a_kink():
    start, goal = (*centre(20, 50), 0.0), (*centre(150, 50), 0.5)
    path = plan_path(empty_map(), start, goal, CLASSIC)
    assert path[0] == pytest.approx([1.0, 2.5, 0.0])
    np.testing.assert_allclose(path[:-1, 1], 2.5)
    assert path[-1] == pytest.approx([*centre(150, 50), 0.5])
    # The last pose but one lies in the corner of cell 149: 7.45 m, a step of (0.075, 0.025) m.
    assert path[-1, :2] - path[-2, :2] == pytest.approx([0.075, 0.025])


def test_nav2_rounds_the_origin_to_float32():
    path = plan_path(
        empty_map(origin=(0.1, 0.1)), (1.125, 2.125, 0.0), (4.125, 2.125, 0.0), CLASSIC
    )
    # Cell 20 lies at 0.1 (as float32) + 20 x 0.05.
    assert path[0, 0] == float(np.float32(0.1)) + 20 * RESOLUTION_M


@pytest.mark.parametrize(("steps", "is_headed"), [(10, False), (11, True)])
def test_nav2_leaves_headings_at_zero_up_to_eleven_poses(steps, is_headed):
    start, goal = (*centre(20, 50), 0.0), (*centre(20, 50 + steps), 0.0)
    classic = plan_path(empty_map(), start, goal, CLASSIC)
    ours = plan_path(empty_map(), start, goal, OURS)
    assert len(classic) == len(ours) == steps + 1
    assert classic[:-2, 2] == pytest.approx([math.pi / 2 if is_headed else 0.0] * (steps - 1))
    assert ours[:-1, 2] == pytest.approx([math.pi / 2] * steps)


def test_a_plan_of_two_poses_has_headings():
    path = plan_path(empty_map(), (*centre(20, 50), 0.0), (*centre(20, 51), 0.0), OURS)
    assert path[:, 2] == pytest.approx([math.pi / 2, 0.0])


@pytest.mark.parametrize(("final_approach", "yaw"), [(False, 1.5), (True, 0.3)])
def test_start_and_goal_in_one_cell_give_one_pose(final_approach, yaw):
    parameters = Parameters(use_final_approach_orientation=final_approach)
    path = plan_path(empty_map(), (1.01, 1.01, 0.3), (1.04, 1.03, 1.5), parameters)
    np.testing.assert_array_equal(path, [[1.04, 1.03, yaw]])


def test_a_plan_goes_round_a_wall_without_touching_it():
    costmap = walled_map()
    for parameters in (OURS, CLASSIC):
        path = plan_path(costmap, (3.025, 2.025, 0.0), (7.025, 2.025, 0.0), parameters)
        assert np.max(path[:, 1]) >= 4.0
        for point in path:
            column, row = cell_of(point)
            assert costmap.costs[row, column] < 253


def test_a_goal_in_an_obstacle_is_approached_within_the_tolerance_or_refused():
    costs = np.zeros((100, 200), dtype=np.uint8)
    costs[:, 98:103] = LETHAL
    goal = (*centre(100, 50), 0.7)
    # The nearest free cells, 97 and 103, lie 3 cells = 0.15 m from the goal.
    path = plan_path(make_map(costs), (1.025, 2.525, 0.0), goal, Parameters(tolerance=0.16))
    assert path[-1] == pytest.approx([*centre(97, 50), 0.7])
    with pytest.raises(GoalOccupied) as caught:
        plan_path(make_map(costs), (1.025, 2.525, 0.0), goal, Parameters(tolerance=0.14))
    assert caught.value.code == 206


def test_nav2_measures_the_tolerance_from_the_corners_of_cells():
    costs = np.zeros((100, 200), dtype=np.uint8)
    costs[:, 98:103] = LETHAL
    left, right = (1.025, 2.525, 0.0), (9.025, 2.525, 0.0)
    goal = (*centre(100, 50), 0.0)
    # From (100.5, 50.5) the index 103 is 2.55 cells away, and 97 is 3.54: a side of the wall
    # counts for the admission of the goal, and only from there it is reached.
    classic = Parameters.nav2_classic(tolerance=0.14)
    assert plan_path(make_map(costs), right, goal, classic)[-1, 0] == pytest.approx(5.15)
    with pytest.raises(NoValidPathCouldBeFound):
        plan_path(make_map(costs), left, goal, classic)


def test_an_enclosed_start_is_occupied_and_a_start_on_an_obstacle_may_leave_it():
    costs = np.zeros((100, 200), dtype=np.uint8)
    costs[49:52, 19:22] = LETHAL
    start, goal = (*centre(20, 50), 0.0), (*centre(60, 50), 0.0)
    with pytest.raises(StartOccupied) as caught:
        plan_path(make_map(costs), start, goal, OURS)
    assert caught.value.code == 205
    costs[50, 21] = 0
    assert len(plan_path(make_map(costs), start, goal, OURS)) == 41


def test_a_goal_behind_a_closed_wall_cannot_be_reached():
    costs = np.zeros((100, 200), dtype=np.uint8)
    costs[:, 100] = LETHAL
    with pytest.raises(NoValidPathCouldBeFound) as caught:
        plan_path(make_map(costs), (1.0, 1.0, 0.0), (9.0, 1.0, 0.0), OURS)
    assert caught.value.code == 208


def test_running_out_of_iterations_is_a_timeout():
    parameters = Parameters(max_iterations=50)
    with pytest.raises(PlannerTimedOut, match="max_iterations = 50") as caught:
        plan_path(empty_map(), (1.0, 1.0, 0.0), (9.0, 1.0, 0.0), parameters)
    assert caught.value.code == 207


@pytest.mark.parametrize(
    ("release", "error"), [("iron", PlannerTimedOut), ("jazzy", StartOccupied)]
)
def test_the_end_after_one_iteration_is_a_blocked_start_since_jazzy(release, error):
    parameters = Parameters(max_iterations=1, nav2_release=release)
    with pytest.raises(error, match="max_iterations = 1"):
        plan_path(empty_map(), (1.0, 1.0, 0.0), (9.0, 1.0, 0.0), parameters)


@pytest.mark.parametrize(
    ("make", "error"),
    [
        (Parameters, PlannerTimedOut),
        (Parameters.nav2_classic, NoValidPathCouldBeFound),
    ],
)
def test_running_out_of_planning_time_counts_expansions(make, error):
    limits = {"expansions_per_second": 1000.0, "terminal_checking_interval": 10}
    start, goal = (1.025, 1.025, 0.0), (9.025, 1.025, 0.0)
    # 160 cells along a row take 161 expansions: 0.161 s at 1000 a second.
    with pytest.raises(error, match="max_planning_time"):
        plan_path(empty_map(), start, goal, make(max_planning_time=0.1, **limits))
    assert len(plan_path(empty_map(), start, goal, make(max_planning_time=0.2, **limits))) == 161


def test_a_gap_of_one_diagonal_is_passed_only_in_classic_mode():
    costs = np.zeros((100, 100), dtype=np.uint8)
    costs[50, :51] = LETHAL
    costs[:50, 51] = LETHAL
    start, goal = (*centre(10, 10), 0.0), (*centre(90, 90), 0.0)
    assert len(plan_path(make_map(costs), start, goal, CLASSIC)) > 80
    with pytest.raises(NoValidPathCouldBeFound):
        plan_path(make_map(costs), start, goal, OURS)


@pytest.mark.parametrize("factor", [2, 3, 4])
def test_downsampling_takes_the_largest_cost_and_rounds_the_size_up(factor):
    costs = np.arange(7 * 10, dtype=np.uint8).reshape(7, 10)
    coarse = downsample(make_map(costs, (1.0, 2.0)), factor)
    rows, columns = math.ceil(7 / factor), math.ceil(10 / factor)
    expected = [
        [costs[r * factor : (r + 1) * factor, c * factor : (c + 1) * factor].max()
         for c in range(columns)]
        for r in range(rows)
    ]  # fmt: skip
    np.testing.assert_array_equal(coarse.costs, expected)
    assert (coarse.origin_x, coarse.origin_y) == (1.0, 2.0)
    assert coarse.resolution == factor * RESOLUTION_M


def test_an_unknown_cell_hides_a_wall_from_nav2s_downsampling_but_not_from_ours():
    costs = np.array([[UNKNOWN, LETHAL, UNKNOWN, UNKNOWN], [0, 0, UNKNOWN, UNKNOWN]])
    np.testing.assert_array_equal(downsample(make_map(costs), 2).costs, [[LETHAL, UNKNOWN]])
    np.testing.assert_array_equal(
        downsample(make_map(costs), 2, known_cells=False).costs, [[UNKNOWN, UNKNOWN]]
    )


def test_a_wall_beside_unknown_cells_is_crossed_only_in_classic_mode():
    costs = np.zeros((100, 200), dtype=np.uint8)
    costs[:, 100] = LETHAL
    costs[:, 101:110] = UNKNOWN
    coarse = {"downsample_costmap": True, "downsampling_factor": 2}
    start, goal = (1.0, 1.0, 0.0), (9.0, 1.0, 0.0)
    classic = Parameters.nav2_classic(**coarse)
    # Cells 100 (lethal) and 101 (unknown) merge into an unknown one.
    assert plan_path(make_map(costs), start, goal, classic)[-1, 0] == 9.0
    with pytest.raises(NoValidPathCouldBeFound):
        plan_path(make_map(costs), start, goal, Parameters(**coarse))


def test_a_coarse_plan_has_coarse_spacing_and_exact_ends():
    parameters = Parameters(downsample_costmap=True, downsampling_factor=4)
    path = plan_path(empty_map(), (1.0, 1.0, 0.0), (9.0, 1.0, 0.0), parameters)
    # 8 m at 0.2 m.
    np.testing.assert_allclose(np.diff(path[:, 0]), np.full(40, 0.2), atol=1e-12)
    assert tuple(path[-1]) == (9.0, 1.0, 0.0)


def test_moving_the_map_by_whole_cells_moves_the_plan():
    costs = walled_map().costs
    here = plan_path(make_map(costs), (3.01, 2.03, 0.0), (7.02, 2.04, 0.0), OURS)
    there = plan_path(make_map(costs, (-4.0, 8.0)), (-0.99, 10.03, 0.0), (3.02, 10.04, 0.0), OURS)
    np.testing.assert_allclose(there[:, :2], here[:, :2] + [-4.0, 8.0], atol=1e-9)


def test_a_weighted_corridor_is_driven_in_its_middle():
    columns = 200
    profile = np.array([LETHAL, 253, 200, 120, 60, 10, 60, 120, 200, 253, LETHAL])
    costs = np.full((100, columns), LETHAL)
    costs[40:51] = profile[:, None]
    start, goal = (*centre(5, 43), 0.0), (*centre(190, 43), 0.0)
    weighted = plan_path(make_map(costs), start, goal, Parameters(cost_travel_multiplier=3.0))
    shortest = plan_path(make_map(costs), start, goal, Parameters(cost_travel_multiplier=0.0))
    np.testing.assert_allclose(weighted[20:-20, 1], centre(0, 45)[1], atol=1e-3)
    np.testing.assert_allclose(shortest[:, 1], centre(0, 43)[1], atol=1e-12)


def test_the_footprint_check_refuses_a_path_the_robot_is_too_wide_for():
    costs = np.zeros((100, 200), dtype=np.uint8)
    costs[:, 100] = LETHAL
    costs[48:53, 100] = 0
    start, goal = (1.025, 2.525, 0.0), (9.025, 2.525, 0.0)
    # The gap is 5 cells = 0.25 m wide, the robot 0.6 m.
    robot = circle_footprint(0.3)
    checked = Parameters(check_footprint=True)
    assert len(plan_path(make_map(costs), start, goal, OURS, footprint=robot)) == 161
    with pytest.raises(NoValidPathCouldBeFound, match="footprint meets a cell of cost 254"):
        plan_path(make_map(costs), start, goal, checked, footprint=robot)
    assert len(plan_path(empty_map(), start, goal, checked, footprint=robot)) == 161


def test_the_footprint_check_looks_under_the_centre_of_a_robot_given_by_a_radius():
    # A wall two cells thick across the map, every second row of it unknown: Nav2 merges it to
    # unknown cells, which may be entered.
    costs = np.zeros((100, 200), dtype=np.uint8)
    costs[:, 100:102] = LETHAL
    costs[1::2, 100:102] = NO_INFORMATION
    start, goal = (1.025, 2.525, 0.0), (9.025, 2.525, 0.0)
    merging = {"downsample_costmap": True, "downsampling_factor": 2}
    through = Parameters.nav2_classic(**merging)
    assert plan_path(make_map(costs), start, goal, through)[-1, 0] == 9.025
    checked = Parameters.nav2_classic(check_footprint=True, **merging)
    with pytest.raises(NoValidPathCouldBeFound, match="centre meets a cell of cost 254"):
        plan_path(make_map(costs), start, goal, checked)
    assert plan_path(empty_map(), start, goal, checked)[-1, 0] == 9.025


@pytest.mark.parametrize(
    "wrong",
    [
        {"tolerence": 0.1},
        {"tolerance": -0.1},
        {"downsampling_factor": 0},
        {"terminal_checking_interval": 0},
        {"smoother": {"w_data": -1.0}},
        {"smoother": {"max_its": 5}},
        {"max_planning_time": math.inf},
    ],
)
def test_wrong_parameters_are_refused(wrong):
    with pytest.raises(ValidationError):
        Parameters(**wrong)


def test_the_defaults_are_nav2s():
    assert (OURS.tolerance, OURS.cost_travel_multiplier, OURS.max_iterations) == (0.125, 1.0, 10**6)
    assert (OURS.smoother.w_data, OURS.smoother.w_smooth) == (0.2, 0.3)
    assert (OURS.smoother.tolerance, OURS.smoother.refinement_num) == (1e-10, 2)


def test_classic_mode_can_be_changed_switch_by_switch():
    parameters = Parameters.nav2_classic(use_cell_centres=True, tolerance=0.5)
    assert parameters.use_cell_centres
    assert not parameters.use_exact_end_points
    assert parameters.tolerance == 0.5


# Releases before Lyrical


def of_release(release, **parameters):
    return Parameters.nav2_classic(nav2_release=release, **parameters)


@pytest.mark.parametrize(
    ("release", "end"),
    [("humble", (6.025, 2.025)), ("iron", (5.975, 1.975)), ("kilted", (6.0, 2.0))],
)
def test_up_to_kilted_a_path_ends_at_a_place_in_the_goals_cell(release, end):
    # The goal's cell is (120, 40) of 0.05 m.
    path = plan_path(empty_map(), (1.01, 2.01, 0.0), (6.04, 2.03, 0.5), of_release(release))
    np.testing.assert_allclose(path[-1], (*end, 0.5), atol=1e-9)
    lyrical = plan_path(empty_map(), (1.01, 2.01, 0.0), (6.04, 2.03, 0.5), CLASSIC)
    np.testing.assert_allclose(lyrical[-1], (6.04, 2.03, 0.5))


def test_up_to_kilted_a_path_within_one_cell_takes_the_starts_position():
    start, goal = (1.01, 2.01, 0.3), (1.04, 2.02, 0.7)
    for release, place in (("kilted", start), ("lyrical", goal)):
        path = plan_path(empty_map(), start, goal, of_release(release))
        np.testing.assert_array_equal(path, [[*place[:2], 0.7]])


def test_up_to_iron_a_blocked_start_is_refused_also_in_the_goals_cell():
    costs = np.zeros((100, 200), dtype=np.uint8)
    costs[40, 20] = LETHAL
    for goal in ((6.0, 2.0, 0.0), (1.04, 2.04, 0.0)):
        with pytest.raises(StartOccupied):
            plan_path(make_map(costs), (1.01, 2.01, 0.0), goal, of_release("iron"))
        assert len(plan_path(make_map(costs), (1.01, 2.01, 0.0), goal, of_release("jazzy")))


def test_up_to_kilted_a_blocked_goal_is_searched_for_wherever_there_is_a_tolerance():
    costs = np.zeros((100, 200), dtype=np.uint8)
    costs[30:50, 110:130] = LETHAL
    start, goal = (1.0, 2.0, 0.0), (6.0, 2.0, 0.0)
    with pytest.raises(NoValidPathCouldBeFound):
        plan_path(make_map(costs), start, goal, of_release("kilted", tolerance=0.25))
    for release, tolerance in (("kilted", 0.0), ("lyrical", 0.25)):
        with pytest.raises(GoalOccupied):
            plan_path(make_map(costs), start, goal, of_release(release, tolerance=tolerance))


def test_up_to_kilted_a_late_path_is_none_also_within_the_tolerance():
    # 100 expansions along a row end 1 cell before the goal.
    late = {
        "max_planning_time": 100.0,
        "expansions_per_second": 1.0,
        "terminal_checking_interval": 1,
        "tolerance": 0.2,
        "cost_travel_multiplier": 0.0,
    }
    corridor = np.full((3, 200), LETHAL, dtype=np.uint8)
    corridor[1] = 0
    start, goal = (0.0, 0.06, 0.0), (5.06, 0.06, 0.0)
    path = plan_path(make_map(corridor), start, goal, of_release("lyrical", **late))
    np.testing.assert_allclose(path[-1, 0], 5.0)
    with pytest.raises(NoValidPathCouldBeFound):
        plan_path(make_map(corridor), start, goal, of_release("kilted", **late))


def test_up_to_kilted_the_smoother_tests_no_footprint():
    # The path rises by 1 m on 4 m; a wall lies 0.2 m below its beginning, the robot reaches 0.3 m.
    costs = np.zeros((100, 200), dtype=np.uint8)
    costs[34:36, 50:75] = LETHAL
    robot, start, goal = circle_footprint(0.3), (3.0, 2.0, 0.0), (7.0, 3.0, 0.0)
    smoothed, raw = (
        plan_path(make_map(costs), start, goal, of_release(release), footprint=robot)
        for release in ("kilted", "lyrical")
    )
    # Raw positions are corners of cells.
    assert np.abs(raw[1:-1, :2] / RESOLUTION_M % 1.0 - 0.5).min() > 0.49
    assert np.abs(smoothed[1:-1, :2] / RESOLUTION_M % 1.0 - 0.5).min() < 0.4


@pytest.mark.parametrize(
    ("release", "undefined", "expected"),
    [
        # Starts and goals off the map; Humble has no codes.
        (
            "humble",
            {1, 17, 29, 54},
            "96aab2567e46efe259db254fc92d230d03cee9a8ce6c5e57cf257e74f2888a78",
        ),
        # Iron's smoother reads at an index that it never set.
        ("iron", {10, 56, 57}, "5d1dfaeb5505fc748469fa5b7172f4ce871727121fac44b7ec801ca8c5905353"),
        ("jazzy", set(), "4a8f6c48c8c0f98fbeead51f577239696128ef88b0ccd8ed25ccbc2149641b05"),
        ("kilted", set(), "4a8f6c48c8c0f98fbeead51f577239696128ef88b0ccd8ed25ccbc2149641b05"),
        ("lyrical", set(), "7d66c14ba2f99b2fae2b4b2abd4dd4f3a7f705eec9847b0f0bfe6fc9697712c6"),
    ],
)
def test_answers_are_those_of_nav2_of_each_release(release, undefined, expected):
    def answer_to(request):
        n = request.number
        parameters = of_release(
            release,
            tolerance=(0.125, 0.0, 0.4)[n % 3],
            allow_unknown=n % 4 < 3,
            cost_travel_multiplier=(1.0, 0.0, 2.0)[n % 3],
            downsample_costmap=n % 5 == 0,
            downsampling_factor=2,
            smoother={"refinement_num": 4 if release == "humble" else 2},
        )
        code, path = answer(SmacPlanner2D(parameters, None), request)
        return 0 if release == "humble" else code, path

    requests = (r for r in random_requests(60) if r.number not in undefined)
    assert digest(answer_to(request) for request in requests) == expected
