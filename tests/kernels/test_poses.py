"""Poses: outlines placed by one, what is seen from one, two in a row."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scenes import WHEELCHAIR

from drake_navbench.kernels.poses import (
    carrier_pose,
    compose,
    place_outline,
    place_point,
    see_point,
    to_robot_frame,
)
from drake_navbench.kernels.read_only import read_only

COORDINATES = st.floats(-5.0, 5.0)
POSES = st.tuples(COORDINATES, COORDINATES, st.floats(-3.0, 3.0))


def test_an_outline_is_turned_then_moved():
    outline = place_outline(np.array([[2.0, 1.0]]), (10.0, 20.0, math.pi / 2))
    np.testing.assert_allclose(outline, [[9.0, 22.0]])


@given(pose=POSES)
def test_an_outline_has_its_points_where_each_is_placed_by_itself_to_the_last_bit(pose):
    turn = (math.cos(pose[2]), math.sin(pose[2]))
    one_by_one = [place_point(x, y, *pose[:2], *turn) for x, y in WHEELCHAIR]
    np.testing.assert_array_equal(place_outline(WHEELCHAIR, pose), one_by_one)


@given(point=st.tuples(COORDINATES, COORDINATES), pose=POSES)
def test_a_placed_point_is_seen_where_it_was_given(point, pose):
    turn = (math.cos(pose[2]), math.sin(pose[2]))
    placed = place_point(*point, *pose[:2], *turn)
    np.testing.assert_allclose(see_point(*placed, *pose[:2], *turn), point, atol=1e-12)


def test_a_pose_is_seen_from_a_robot_that_faces_left():
    # Robot at (1, 2), facing +y: the point one ahead of it and two to its right.
    seen = to_robot_frame(read_only([[3.0, 3.0, 0.0]]), 1.0, 2.0, math.pi / 2.0)
    np.testing.assert_allclose(seen, [[1.0, -2.0, -math.pi / 2.0]], atol=1e-15)


@given(pose=POSES)
def test_distances_from_the_robot_are_kept(pose):
    x, y, yaw = pose
    poses = np.array([[1.0, 2.0, 0.3], [-2.0, 0.5, -3.0]])
    seen = to_robot_frame(poses, x, y, yaw)
    expected = np.hypot(poses[:, 0] - x, poses[:, 1] - y)
    np.testing.assert_allclose(np.hypot(seen[:, 0], seen[:, 1]), expected, atol=1e-12)
    assert np.all(np.abs(seen[:, 2]) <= math.pi)


def test_a_lidar_ahead_and_left_of_a_base_that_faces_left_and_itself_backward():
    mount = (0.4, 0.1, math.pi)
    seen = compose((1.0, 2.0, math.pi / 2), mount)
    np.testing.assert_allclose(seen, [0.9, 2.4, 1.5 * math.pi])


@given(base=POSES, mount=POSES)
def test_the_carrier_is_where_what_it_carries_says(base, mount):
    np.testing.assert_allclose(carrier_pose(compose(base, mount), mount), base, atol=1e-12)
