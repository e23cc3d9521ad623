"""Leaves that cut and join paths, on paths along the x axis with a pose every metre."""

import math

import numpy as np
import pytest
from py_trees.common import Status
from scenes import straight_plan

from drake_navbench.navigation.behavior_tree.board import Board, TickInputs
from drake_navbench.navigation.behavior_tree.path_leaves import (
    ConcatenatePaths,
    TruncatePath,
    TruncatePathLocal,
)
from drake_navbench.plugins.releases import Release

TEN = straight_plan(9.0, 1.0)


def board(path, pose=(0.0, 0.0, 0.0), release=Release.LYRICAL) -> Board:
    def nobody(*_):
        raise AssertionError("cutting a path plans nothing")

    made = Board(nobody, nobody, nobody, nobody, release=release)
    made.inputs = TickInputs(now_s=0.0, pose=np.array(pose), global_costmap=None)
    made.write_path("path", path)
    return made


def cut(node_class, path, pose=(0.0, 0.0, 0.0), release=Release.LYRICAL, **arguments):
    shared = board(path, pose, release)
    node = node_class("n", shared, source="path", result="left", **arguments)
    node.tick_once()
    assert node.status == Status.SUCCESS
    assert shared.values.path is path
    return shared.values.paths.get("left")


@pytest.mark.parametrize(
    ("distance_m", "last_x"), [(2.5, 6.0), (2.0, 7.0), (0.0, 9.0), (50.0, 1.0)]
)
def test_the_end_is_cut_up_to_a_pose_that_far_from_the_goal(distance_m, last_x):
    left = cut(TruncatePath, TEN, distance_m=distance_m)
    assert left[0].tolist() == [0.0, 0.0, 0.0]
    assert left[-1].tolist() == [last_x, 0.0, 0.0]


def test_the_last_pose_that_is_left_looks_at_the_goal():
    path = np.array([[0.0, 0.0, 0.3], [1.0, 0.0, 0.3], [1.0, 1.0, 0.3], [0.0, 1.0, 0.3]])
    left = cut(TruncatePath, path, distance_m=1.2)
    assert left[0, 2] == 0.3
    assert left[-1].tolist() == [1.0, 0.0, pytest.approx(math.radians(135.0))]
    assert path[1, 2] == 0.3


def test_an_empty_path_stays_empty():
    assert cut(TruncatePath, None, distance_m=1.0) is None
    assert cut(TruncatePathLocal, None) is None


@pytest.mark.parametrize(
    ("forward_m", "backward_m", "ends"),
    [
        (-1.0, 0.0, (4.0, 9.0)),
        (2.5, 1.0, (3.0, 6.0)),
        (2.0, 0.0, (4.0, 6.0)),
        (50.0, 50.0, (0.0, 9.0)),
    ],
)
def test_what_lies_around_the_robot_is_left(forward_m, backward_m, ends):
    arguments = {"forward_m": forward_m, "backward_m": backward_m}
    left = cut(TruncatePathLocal, TEN, (4.2, 0.5, 0.0), **arguments)
    assert (left[0, 0], left[-1, 0]) == ends


@pytest.mark.parametrize(("release", "count"), [(Release.KILTED, 1), (Release.LYRICAL, 6)])
def test_before_lyrical_a_negative_length_keeps_one_pose(release, count):
    left = cut(TruncatePathLocal, TEN, (4.2, 0.5, 0.0), release, forward_m=-1.0)
    assert left[0, 0] == 4.0
    assert len(left) == count


@pytest.mark.parametrize(("release", "first_x"), [(Release.HUMBLE, 4.0), (Release.IRON, 5.0)])
def test_of_two_poses_as_near_humble_takes_the_first(release, first_x):
    left = cut(TruncatePathLocal, TEN, (4.5, 0.0, 0.0), release, forward_m=0.5)
    assert left[:, 0].tolist() == [first_x]


# Out along the x axis and home again beside it, looking back.
THERE_AND_BACK = np.vstack([TEN, TEN[::-1] + np.array([0.0, 0.4, math.pi])])


@pytest.mark.parametrize(("angle_weight_m", "first_y"), [(0.0, 0.4), (1.0, 0.0)])
def test_a_heading_tells_the_way_out_from_the_way_home(angle_weight_m, first_y):
    left = cut(TruncatePathLocal, THERE_AND_BACK, (4.0, 0.3, 0.0), angle_weight_m=angle_weight_m)
    assert left[0, 1] == first_y


def test_the_robot_is_looked_for_from_where_it_was_last_found():
    shared = board(THERE_AND_BACK)
    node = TruncatePathLocal("n", shared, search_distance_m=3.0)
    firsts = []
    for x in (0.0, 2.0, 4.0, 9.0, 7.0):
        shared.inputs = TickInputs(now_s=0.0, pose=np.array([x, 0.3, 0.0]), global_costmap=None)
        node.tick_once()
        firsts.append(shared.values.paths["remaining_path"][0, :2].tolist())
    # 9 m lies more than 3 m beyond 4 m: the farthest one that is looked at counts.
    assert firsts == [[0.0, 0.0], [2.0, 0.0], [4.0, 0.0], [7.0, 0.0], [7.0, 0.0]]


@pytest.mark.parametrize(("second", "x_m"), [(TEN[:2], [0.0, 1.0, 0.0, 1.0]), (None, [0.0, 1.0])])
def test_paths_are_joined_as_they_are_and_one_may_be_empty(second, x_m):
    shared = board(TEN[:2])
    shared.write_path("second", second)
    node = ConcatenatePaths("n", shared, sources=("path", "second"), result="both")
    node.tick_once()
    assert node.status == Status.SUCCESS
    assert shared.values.paths["both"][:, 0].tolist() == x_m


def test_two_empty_paths_are_no_path():
    shared = board(None)
    node = ConcatenatePaths("n", shared, sources=("path", "second"), result="both")
    node.tick_once()
    assert node.status == Status.FAILURE
