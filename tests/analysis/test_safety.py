"""Metrics of safety against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic_logs import FOOTPRINT, log_times, make_log, straight_log

from drake_navbench.analysis.metrics import Undefined, safety
from drake_navbench.analysis.metrics.collision_time import times_to_collision

CAR = np.array(FOOTPRINT)
POINT_LIKE = 1e-6 * np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, -1.0], [-1.0, 1.0]])


def box_edges(x0, y0, x1, y1):
    corners = np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])
    return np.hstack([corners, np.roll(corners, -1, axis=0)])


def sideless(twists):
    """Returns twists [v, w] as (T, 3), without any sideways velocity; [v, w, vy] as they are."""
    twists = np.array(twists, dtype=float)
    return np.pad(twists, ((0, 0), (0, 3 - twists.shape[1])))


def time_to_collision(pose, twist, footprint, edges):
    """Returns the time to collision of a single pose and twist."""
    return times_to_collision(np.array([pose]), sideless([twist]), footprint, edges)[0]


def with_box(log, low, high):
    log.info["scenario"]["world"]["obstacles"] = [{"type": "box", "min": low, "max": high}]
    return log


def test_min_clearance_may_be_negative_and_ignores_what_is_out_of_reach():
    clearance = np.full(51, np.inf)
    clearance[10:13] = [0.5, -0.02, 0.3]
    assert safety.min_clearance_m(make_log(log_times(1.0), clearance_m=clearance)) == -0.02
    with pytest.raises(Undefined, match="no obstacle came within"):
        safety.min_clearance_m(straight_log())


def test_the_distance_to_a_cells_centre_has_a_name_of_its_own():
    log = make_log(
        log_times(1.0),
        obstacle_cell_distance_m=np.linspace(2.0, 1.3, 51),
        obstacle_corner_distance_m=1.0,
    )
    assert safety.min_cell_centre_distance_m(log) == pytest.approx(1.3)
    with pytest.raises(Undefined, match="no obstacle"):
        safety.min_cell_centre_distance_m(straight_log())


def test_clearance_percentile_of_an_even_approach():
    log = make_log(log_times(2.0), clearance_m=np.linspace(0.0, 1.0, 101))
    assert safety.clearance_p05_m(log) == pytest.approx(0.05)


def test_danger_time_counts_an_interval_that_is_open_at_the_end():
    time_s = log_times(10.0)
    log = make_log(time_s, clearance_m=np.where(time_s < 4.99, 1.0, 0.1))
    assert safety.danger_time_ratio(log) == pytest.approx(0.5, abs=0.003)


def test_time_to_a_wall_ahead_is_the_gap_by_the_speed():
    # Front at 0.85 m, wall at 1.85 m, 0.5 m/s.
    moment = time_to_collision(np.zeros(3), (0.5, 0.0), CAR, box_edges(1.85, -2, 2, 2))
    assert moment == pytest.approx(2.0)


def test_time_to_a_wall_behind_counts_when_backing():
    edges = box_edges(-1.5, -2, -1.25, 2)
    assert time_to_collision(np.zeros(3), (-0.5, 0.0), CAR, edges) == pytest.approx(2.0)
    assert time_to_collision(np.zeros(3), (0.5, 0.0), CAR, edges) == math.inf


def test_a_pillar_thinner_than_the_robot_is_met_by_its_front_edge():
    moment = time_to_collision(np.zeros(3), (0.5, 0.0), CAR, box_edges(1.85, -0.01, 1.87, 0.01))
    assert moment == pytest.approx(2.0)


def test_passing_by_is_no_collision_though_the_distance_shrinks():
    edges = box_edges(2.0, 0.31, 3.0, 1.0)
    assert time_to_collision(np.zeros(3), (0.5, 0.0), CAR, edges) == math.inf


def test_a_point_on_a_circle_meets_a_wall_where_the_circle_does():
    # Circle of radius 2 around (0, 2) meets the line x = sqrt(3) first at 60 degrees; w = 0.25.
    edges = np.array([[math.sqrt(3.0), -10.0, math.sqrt(3.0), 10.0]])
    moment = time_to_collision(np.zeros(3), (0.5, 0.25), POINT_LIKE, edges)
    assert moment == pytest.approx(math.radians(60.0) / 0.25, abs=1e-4)


def test_turning_on_the_spot_sweeps_the_corners():
    # The front left corner (0.85, 0.3) at 19.44 degrees meets the wall y = 0.5, |corner| = 0.9014.
    edges = np.array([[-5.0, 0.5, 5.0, 0.5]])
    radius, bearing = math.hypot(0.85, 0.3), math.atan2(0.3, 0.85)
    expected = (math.asin(0.5 / radius) - bearing) / 0.5
    moment = time_to_collision(np.zeros(3), (0.0, 0.5), CAR, edges)
    assert moment == pytest.approx(expected)


def test_standing_still_meets_nothing():
    assert time_to_collision(np.zeros(3), (0.0, 0.0), CAR, box_edges(1, -1, 2, 1)) == math.inf


def test_almost_straight_and_straight_agree():
    edges = box_edges(1.85, -2, 2, 2)
    straight = time_to_collision(np.zeros(3), (0.5, 0.0), CAR, edges)
    bent = time_to_collision(np.zeros(3), (0.5, 1e-5), CAR, edges)
    assert bent == pytest.approx(straight, abs=1e-4)


@settings(max_examples=50, deadline=None)
@given(
    v=st.floats(-0.5, 0.5),
    w=st.floats(-1.0, 1.0),
    x=st.floats(-10.0, 10.0),
    y=st.floats(-10.0, 10.0),
    yaw=st.floats(-3.0, 3.0),
)
def test_time_to_collision_does_not_depend_on_the_frame(v, w, x, y, yaw):
    edges = box_edges(1.3, -0.4, 2.0, 1.0)
    cos_yaw, sin_yaw = math.cos(yaw), math.sin(yaw)
    rotation = np.array([[cos_yaw, sin_yaw], [-sin_yaw, cos_yaw]])
    moved = (edges.reshape(-1, 2) @ rotation + [x, y]).reshape(-1, 4)
    here = time_to_collision(np.zeros(3), (v, w), CAR, edges)
    there = time_to_collision(np.array([x, y, yaw]), (v, w), CAR, moved)
    grazing = math.isinf(here) != math.isinf(there)
    if not grazing:
        assert there == pytest.approx(here, abs=1e-4, rel=1e-6)


def test_mirrored_world_and_turn_give_the_same_time():
    left = time_to_collision(np.zeros(3), (0.4, 0.3), CAR, box_edges(1.3, 0.2, 2.0, 1.0))
    right = time_to_collision(np.zeros(3), (0.4, -0.3), CAR, box_edges(1.3, -1.0, 2.0, -0.2))
    assert left < 10.0
    assert right == pytest.approx(left)


def test_a_robot_that_goes_sideways_meets_what_is_beside_it():
    # The left side at 0.3 m, the box from 0.8 m on: 0.5 m at 0.25 m/s.
    beside = box_edges(-1.0, 0.8, 1.0, 1.5)
    assert time_to_collision(np.zeros(3), (0.0, 0.0, 0.25), CAR, beside) == pytest.approx(2.0)
    assert time_to_collision(np.zeros(3), (0.0, 0.0, -0.25), CAR, beside) == np.inf
    # Diagonally the corner ahead meets it after as long.
    assert time_to_collision(np.zeros(3), (0.1, 0.0, 0.25), CAR, beside) == pytest.approx(2.0)


@pytest.mark.parametrize("turn", [0.0, 0.3, -0.7])
def test_a_collision_does_not_depend_on_how_the_base_frame_is_turned(turn):
    box = box_edges(1.3, -0.4, 2.0, 1.0)
    plain = time_to_collision(np.zeros(3), (0.4, turn), CAR, box)
    for angle in (0.5, 2.0, -1.57):
        back = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        v, vy = back @ [0.4, 0.0]
        turned = time_to_collision((0.0, 0.0, angle), (v, turn, vy), CAR @ back.T, box)
        assert turned == pytest.approx(plain, rel=1e-9)


def test_batches_of_many_edges_give_the_same_as_each_pose_alone():
    edges = np.vstack([box_edges(3.0 + 0.01 * i, -1.0, 4.0, 1.0) for i in range(600)])
    poses = np.column_stack([np.linspace(0.0, 1.0, 60), np.zeros(60), np.zeros(60)])
    twists = sideless(np.column_stack([np.full(60, 0.5), np.linspace(-0.2, 0.2, 60)]))
    together = times_to_collision(poses, twists, CAR, edges)
    alone = [time_to_collision(p, t, CAR, edges) for p, t in zip(poses, twists, strict=True)]
    assert list(together) == alone
    assert np.isfinite(together).any()


def test_a_horizon_misses_only_what_lies_beyond_it():
    edges = np.vstack([box_edges(x, y, x + 0.5, y + 0.5) for x in range(-9, 9) for y in (-3, 1, 4)])
    poses = np.column_stack([np.zeros(40), np.full(40, -1.0), np.linspace(-3.0, 3.0, 40)])
    twists = np.column_stack([np.linspace(-0.5, 0.5, 40), np.tile([0.0, 0.05, -0.3, 1.0], 10)])
    twists = sideless(twists)
    whole = times_to_collision(poses, twists, CAR, edges)
    for horizon_s in (1.0, 4.0, 20.0):
        limited = times_to_collision(poses, twists, CAR, edges, horizon_s=horizon_s)
        early = whole <= horizon_s
        np.testing.assert_array_equal(limited[early], whole[early])
        assert (limited[~early] > horizon_s).all()
    assert (whole <= 4.0).any()
    assert (whole > 4.0).any()


def test_collision_time_of_a_trial_is_its_shortest():
    # Starts 4.15 m from the wall at 0.5 m/s; after 3 s the gap is 2.65 m: 5.3 s.
    log = with_box(straight_log(end_time_s=3.0), [5.0, -1.0], [6.0, 1.0])
    assert safety.time_to_collision_min_s(log) == pytest.approx(5.3)


def test_obstacles_beyond_the_horizon_change_nothing():
    near = {"type": "box", "min": [5.0, -1.0], "max": [6.0, 1.0]}
    far = {"type": "box", "min": [50.0, -1.0], "max": [51.0, 1.0]}
    log = straight_log(end_time_s=3.0, info={"obstacles": [near, far]})
    assert safety.time_to_collision_min_s(log) == pytest.approx(5.3)
    with pytest.raises(Undefined, match="no course met"):
        safety.time_to_collision_min_s(straight_log(info={"obstacles": [far]}))


def test_collision_time_without_a_collision_course_is_undefined_and_no_sentinel():
    with pytest.raises(Undefined, match="there is no obstacle"):
        safety.time_to_collision_min_s(straight_log())
    with pytest.raises(Undefined, match="no course met"):
        safety.time_to_collision_min_s(with_box(straight_log(), [1.0, 2.0], [2.0, 3.0]))
