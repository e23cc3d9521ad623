"""The path handler cuts the global plan as Nav2's FeasiblePathHandler does."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scenes import straight_plan

from drake_navbench.controller import InvalidPath
from drake_navbench.kernels.grid import Costmap
from drake_navbench.kernels.path_pruning import arc_length
from drake_navbench.navigation.path_handler import PathHandler, PathHandlerParameters

RESOLUTION = 0.0625  # exact in binary, so that moving by whole cells moves every number exactly


def make_costmap(origin_x=-3.0, origin_y=-3.0, cells=96):
    return Costmap(np.zeros((cells, cells), np.uint8), origin_x, origin_y, RESOLUTION)


def handler(**parameters):
    return PathHandler(PathHandlerParameters(**parameters))


def cut(path_handler, plan, pose, costmap=None):
    return path_handler.cut(path_handler.set_plan(plan), np.array(pose), costmap or make_costmap())


def test_local_plan_runs_from_the_closest_pose_over_the_prune_distance():
    local_plan, state = cut(handler(prune_distance=1.0), straight_plan(6.0, 0.25), (0.6, 0.3, 0.0))
    # The closest pose is at 0.5 m; the poses at 0.75, 1.0, 1.25 and 1.5 m lie within 1 m of it.
    np.testing.assert_array_equal(local_plan[:, 0], [0.5, 0.75, 1.0, 1.25, 1.5])
    assert (state.begin, state.end) == (2, 25)


def test_the_later_of_two_equally_close_poses_is_the_closest():
    local_plan, _ = cut(handler(), straight_plan(6.0, 0.25), (0.375, 0.0, 0.0))
    assert local_plan[0, 0] == 0.5


def test_the_last_two_poses_stay_when_the_robot_is_at_the_end():
    local_plan, _ = cut(handler(), straight_plan(1.0, 0.25), (1.1, 0.0, 0.0))
    np.testing.assert_array_equal(local_plan[:, 0], [0.75, 1.0])


def test_local_plan_ends_before_the_first_pose_off_the_costmap():
    # The costmap reaches from -1 m to just below 1 m.
    costmap = make_costmap(-1.0, -1.0, cells=32)
    local_plan, _ = cut(handler(), straight_plan(6.0, 0.25), (0.0, 0.0, 0.0), costmap)
    np.testing.assert_array_equal(local_plan[:, 0], [0.0, 0.25, 0.5, 0.75])


def test_a_plan_that_comes_back_later_is_not_entered_at_its_later_part():
    out = straight_plan(4.0, 0.25)
    back = out[::-1][1:] + np.array([0.0, 0.5, 0.0])
    plan = np.vstack([out, back])
    pose = (0.0, 0.4, 0.0)  # 0.4 m from the first pose, 0.1 m from the last
    near, _ = cut(handler(), plan, pose)  # searches 3 m, half the side of the costmap
    far, _ = cut(handler(max_robot_pose_search_dist=-1.0), plan, pose)
    np.testing.assert_array_equal(near[0, :2], [0.0, 0.0])
    # The closest is the very last pose; the one before it is kept.
    np.testing.assert_array_equal(far[:, :2], [[0.25, 0.5], [0.0, 0.5]])


def test_search_window_leaves_out_the_first_pose_beyond_it():
    # Poses at 0, 0.25 and 0.5 m are within 0.5 m of the start; the pose at 0.75 m is not searched.
    local_plan, _ = cut(
        handler(max_robot_pose_search_dist=0.5), straight_plan(6.0, 0.25), (2.0, 0.0, 0.0)
    )
    assert local_plan[0, 0] == 0.5


def test_passed_poses_are_gone_for_good():
    path_handler = handler()
    _, state = cut(path_handler, straight_plan(6.0, 0.25), (1.0, 0.0, 0.0))
    local_plan, _ = path_handler.cut(state, np.zeros(3), make_costmap())
    assert local_plan[0, 0] == 1.0


def test_cutting_changes_neither_the_plan_nor_the_state():
    path_handler, plan = handler(), straight_plan(6.0, 0.25)
    state = path_handler.set_plan(plan)
    plan[:] = -1.0
    first, _ = path_handler.cut(state, np.array([1.0, 0.0, 0.0]), make_costmap())
    again, _ = path_handler.cut(state, np.array([1.0, 0.0, 0.0]), make_costmap())
    assert first[0, 0] == 1.0
    np.testing.assert_array_equal(first, again)
    with pytest.raises(ValueError, match="read-only"):
        first[0, 0] = 5.0


@pytest.mark.parametrize(
    ("parameters", "plan", "pose", "message"),
    [
        ({}, np.zeros((0, 3)), (0.0, 0.0, 0.0), "found no poses"),
        ({"reject_unit_path": True}, np.zeros((1, 3)), (0.0, 0.0, 0.0), "reject_unit_path"),
        (
            {},
            straight_plan(6.0, 0.25) + np.array([10.0, 0.0, 0.0]),
            (0.0, 0.0, 0.0),
            "outside the local costmap",
        ),
    ],
)
def test_a_plan_with_nothing_to_follow_is_invalid(parameters, plan, pose, message):
    with pytest.raises(InvalidPath, match=message):
        cut(handler(**parameters), plan, pose)


def test_a_plan_of_one_pose_can_be_followed():
    local_plan, _ = cut(handler(), np.array([[0.5, 0.0, 0.0]]), (0.0, 0.0, 0.0))
    assert local_plan.shape == (1, 3)


def test_a_plan_of_another_shape_is_refused():
    with pytest.raises(ValueError, match=r"got an array of shape \(5, 2\), expected \(N, 3\)"):
        handler().set_plan(np.zeros((5, 2)))


# Ahead for 1 m, then back: the cusp is the pose at 1 m, index 4.
CUSP_PLAN = np.array([[0.25 * min(i, 8 - i), 0.02 * i, 0.0] for i in range(9)])


def test_plan_is_followed_to_the_cusp_before_it_turns_back():
    local_plan, state = cut(handler(enforce_path_inversion=True), CUSP_PLAN, (0.0, 0.0, 0.0))
    assert len(local_plan) == 5
    assert local_plan[-1, 0] == 1.0
    assert state.end == 5


def test_cusps_are_ignored_unless_asked_for():
    local_plan, _ = cut(handler(prune_distance=3.0), CUSP_PLAN, (0.0, 0.0, 0.0))
    assert len(local_plan) == 9


def test_the_part_behind_the_cusp_follows_one_cycle_after_arriving():
    path_handler = handler(enforce_path_inversion=True)
    at_cusp = np.array([0.85, 0.08, 0.3])  # 0.15 m and 0.3 rad from the cusp at (1.0, 0.08, 0)
    now, state = cut(path_handler, CUSP_PLAN, at_cusp)
    np.testing.assert_array_equal(now[-1], CUSP_PLAN[4])
    later, _ = path_handler.cut(state, at_cusp, make_costmap())
    np.testing.assert_array_equal(later, CUSP_PLAN[5:])


@pytest.mark.parametrize("pose", [(0.75, 0.08, 0.0), (0.9, 0.08, 0.45)])
def test_a_cusp_holds_until_both_position_and_heading_are_near(pose):
    _, state = cut(handler(enforce_path_inversion=True), CUSP_PLAN, pose)
    assert state.end == 5


def turning_plan(step_rad, steps):
    """Straight for 1 m, a turn in place in equal steps, then straight on for 1 m."""
    before = straight_plan(1.0, 0.25)
    turn = np.repeat(before[-1:], steps, axis=0)
    turn[:, 2] = step_rad * np.arange(1, steps + 1)
    after = before[1:] + np.array([1.0, 0.0, 0.0])
    return np.vstack([before, turn, after])


def test_a_turn_in_place_ends_the_part_before_the_step_that_exceeds_the_angle():
    plan = turning_plan(step_rad=0.3, steps=4)
    local_plan, state = cut(handler(enforce_path_rotation=True), plan, (0.0, 0.0, 0.0))
    # 0.3 + 0.3 = 0.6 is below 0.785, the third step exceeds it: pose 4 + 2 is the last one.
    assert state.end == 7
    assert local_plan[-1, 2] == pytest.approx(0.6)


def test_a_small_turn_in_place_is_driven_through():
    plan = turning_plan(step_rad=0.19, steps=4)  # 0.76 rad in all, below 0.785
    _, state = cut(handler(enforce_path_rotation=True), plan, (0.0, 0.0, 0.0))
    assert state.end == len(plan)


def test_turns_to_either_side_add_up():
    plan = turning_plan(step_rad=0.0, steps=4)
    plan[5:9, 2] = [0.3, 0.0, 0.3, 0.0]
    _, state = cut(handler(enforce_path_rotation=True), plan, (0.0, 0.0, 0.0))
    assert state.end == 7


def test_the_earlier_of_cusp_and_turn_ends_the_part():
    turn_first = np.vstack([turning_plan(0.5, 3), CUSP_PLAN[:0:-1] + np.array([1.0, 0.0, 0.0])])
    both = handler(enforce_path_inversion=True, enforce_path_rotation=True)
    assert both.set_plan(turn_first).end == 6
    assert both.set_plan(np.vstack([CUSP_PLAN, turning_plan(0.5, 3)])).end == 5


def test_a_repeated_pose_does_not_hide_a_cusp():
    plan = np.insert(CUSP_PLAN, 4, CUSP_PLAN[4], axis=0)
    state = handler(enforce_path_inversion=True).set_plan(plan)
    assert state.end == 6


def test_two_poses_have_neither_cusp_nor_turn():
    plan = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 3.0]])
    assert handler(enforce_path_rotation=True).set_plan(plan).end == 2


@given(
    cells=st.tuples(st.integers(-40, 40), st.integers(-40, 40)),
    x=st.floats(-0.5, 2.5),
    y=st.floats(-1.0, 1.0),
)
def test_moving_the_world_by_whole_cells_moves_the_local_plan(cells, x, y):
    shift = RESOLUTION * np.array([cells[0], cells[1], 0])
    pose = np.round(np.array([x, y, 0.0]) * 1024) / 1024  # few bits: the shift is exact
    here, _ = cut(handler(), CUSP_PLAN.round(1), pose)
    there, _ = cut(
        handler(), CUSP_PLAN.round(1) + shift, pose + shift, make_costmap(*(shift[:2] - 3.0))
    )
    assert len(here) == len(there)
    np.testing.assert_allclose(there, here + shift, atol=1e-12)


@given(x=st.floats(-0.5, 1.5), y=st.floats(-1.0, 1.0))
def test_a_mirrored_world_gives_the_mirrored_local_plan(x, y):
    mirror = np.array([1.0, -1.0, -1.0])
    path_handler = handler(enforce_path_inversion=True)
    here, _ = cut(path_handler, CUSP_PLAN, (x, y, 0.1))
    there, _ = cut(path_handler, CUSP_PLAN * mirror, (x, -y, -0.1))
    np.testing.assert_array_equal(there, here * mirror)


def test_arc_length_adds_the_segments():
    assert arc_length(np.array([[0.0, 0.0, 0.0], [3.0, 4.0, 0.0], [3.0, 5.0, 0.0]])) == 6.0
    assert arc_length(np.zeros((1, 3))) == 0.0
