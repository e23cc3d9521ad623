"""Bodies are where their waypoints say, and are met when they arrive."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import WHEELCHAIR

from drake_navbench.kernels.moving_bodies import (
    Tracks,
    clearances_of_bodies,
    place_discs,
    place_edges,
    share_until_contact_with_moving,
)
from drake_navbench.kernels.moving_collision_time import time_to_moving_contact

NO_EDGES, NO_DISCS = np.empty((0, 5)), np.empty((0, 4))
# Along x from 1 s to 3 s at 2 m/s while it turns by a right angle, then along y at 1 m/s.
ROUND_THE_CORNER = np.array(
    [[1.0, 0.0, 0.0, 0.0], [3.0, 4.0, 0.0, np.pi / 2], [5.0, 4.0, 2.0, 0.0]]
)
DISC = np.array([[0.0, 0.0, 0.0, 0.5]])


@pytest.mark.parametrize(
    ("time_s", "pose"),
    [
        (0.0, (0.0, 0.0, 0.0)),
        (1.0, (0.0, 0.0, 0.0)),
        (2.0, (2.0, 0.0, np.pi / 4)),
        (3.0, (4.0, 0.0, np.pi / 2)),
        (4.5, (4.0, 1.5, np.pi / 8)),
        (9.0, (4.0, 2.0, 0.0)),
    ],
)
def test_a_body_is_where_its_waypoints_say(time_s, pose):
    np.testing.assert_allclose(Tracks.of([ROUND_THE_CORNER]).poses_at(time_s), [pose], atol=1e-12)


def test_a_body_that_repeats_is_after_a_period_where_it_was():
    there_and_back = np.array([[1.0, 0.0, 0, 0], [2.0, 3.0, 0, 0], [4.0, 0.0, 0, 0]])
    tracks = Tracks.of([there_and_back], [3.0])
    # Away within 1 s, back within 2 s.
    for time_s, x in ((0.5, 0.0), (1.5, 1.5), (3.0, 1.5), (4.5, 1.5), (7.5, 1.5), (9.0, 1.5)):
        assert tracks.poses_at(time_s)[0, 0] == pytest.approx(x)


def test_joined_tracks_are_those_of_both():
    still = np.array([[0.0, 7.0, 8.0, 0.0]])
    joined = Tracks.of([still]).joined(Tracks.of([ROUND_THE_CORNER, still]))
    np.testing.assert_allclose(joined.poses_at(2.0)[:, 0], [7.0, 2.0, 7.0])


def test_parts_turn_with_their_body():
    poses = np.array([[1.0, 2.0, np.pi / 2]])
    edges = place_edges(np.array([[0.0, 1.0, 0.0, 2.0, 0.0]]), poses)
    np.testing.assert_allclose(edges, [[1.0, 3.0, 1.0, 4.0]], atol=1e-12)
    discs = place_discs(np.array([[0.0, 1.0, 0.0, 0.3]]), poses)
    np.testing.assert_allclose(discs, [[1.0, 3.0, 0.3]], atol=1e-12)


def at_rest(x=0.0):
    return np.array([x, 0.0, 0.0, 0.0, 0.0, 0.0])


def meet(track, *, duration_s=1.0, discs=DISC, edges=NO_EDGES, start=None, end=None):
    tracks = Tracks.of([np.array(track, dtype=float)])
    steps = np.diff(tracks.knots, axis=0)
    speed = (np.hypot(steps[:, 1], steps[:, 2]) / steps[:, 0]).max() + 10.0
    start = at_rest() if start is None else start
    end = start if end is None else end
    return share_until_contact_with_moving(
        np.ascontiguousarray(WHEELCHAIR),
        start,
        end,
        (0.0, duration_s),
        (edges, discs),
        (tracks.knots, tracks.firsts, tracks.periods_s),
        speed,
        1e-6,
    )


def test_a_disc_meets_a_robot_at_rest_when_the_gap_is_closed():
    # From 4.35 m at 5 m/s: its edge is at the front, 0.85 m, after 3 m.
    assert meet([[0, 4.35, 0, 0], [1, -0.65, 0, 0]]) == pytest.approx(0.6, abs=1e-5)


def test_a_disc_that_is_gone_before_the_step_ends_is_met_all_the_same():
    # Across the chair at 100 m/s, in and out within a fifth of the step.
    share = meet([[0, 0.3, -10.0, 0], [0.2, 0.3, 10.0, 0], [1, 0.3, 10.0, 0]])
    assert share == pytest.approx((10.0 - 0.5 - 0.3) / 100.0, abs=1e-5)


def test_a_corner_of_the_way_within_the_step_counts():
    to_the_robot_and_away = [[0, 2.35, 0, 0], [0.5, 1.30, 0, 0], [1, 2.35, 0, 0]]
    # It would touch at 1.35 m, and turns at 1.30 m.
    assert meet(to_the_robot_and_away) == pytest.approx(0.5 * 1.0 / 1.05, abs=1e-5)
    assert math.isinf(meet([[0, 2.35, 0, 0], [0.5, 1.40, 0, 0], [1, 2.35, 0, 0]]))


def test_two_that_drive_apart_do_not_meet():
    start, end = np.array([0, 0, 0, -1.0, 0, 0]), np.array([-1.0, 0, 0, -1.0, 0, 0])
    assert math.isinf(meet([[0, 2.0, 0, 0], [1, 4.0, 0, 0]], start=start, end=end))


def test_clearances_are_told_body_by_body():
    corners = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
    edges = np.insert(np.hstack([corners, np.roll(corners, -1, axis=0)]), 0, 1, axis=1)
    poses = np.array([[2.85, 0.0, 0.0], [0.0, 3.0, 0.0], [50.0, 0.0, 0.0]])
    discs = np.vstack([DISC, [[2.0, 0.0, 0.0, 0.5]]])
    gaps = clearances_of_bodies(
        np.ascontiguousarray(WHEELCHAIR), 0.0, 0.0, 0.0, edges, discs, poses, 5.0
    )
    np.testing.assert_allclose(gaps, [1.5, 2.2, np.inf])


def collision_time(twist, rates, position=(3.35, 0.0), horizon_s=10.0):
    return time_to_moving_contact(
        np.ascontiguousarray(WHEELCHAIR),
        np.zeros(3),
        np.array(twist, dtype=float),
        (NO_EDGES, DISC),
        np.array([[*position, 0.0]]),
        np.array([[*rates, 0.0]]),
        np.array([0.5]),
        horizon_s,
    )


def test_the_time_to_collision_is_the_gap_over_the_closing_speed():
    # The gap is 3.35 - 0.85 - 0.5 = 2 m.
    assert collision_time((0.5, 0, 0), (-0.5, 0.0)) == pytest.approx(2.0, abs=2e-3)
    assert collision_time((0.5, 0, 0), (0.0, 0.0)) == pytest.approx(4.0, abs=4e-3)
    assert math.isinf(collision_time((0.5, 0, 0), (0.6, 0.0)))
    assert math.isinf(collision_time((0.0, 0, 0), (0.0, 0.0)))
    assert math.isinf(collision_time((0.5, 0, 0), (0.0, 0.0), horizon_s=3.9))


@settings(max_examples=60, deadline=None)
@given(
    speed=st.floats(0.05, 1.5),
    bearing=st.floats(-math.pi, math.pi),
    distance_m=st.floats(2.0, 6.0),
    turn=st.floats(-0.5, 0.5),
)
def test_no_contact_comes_before_the_time_to_collision(speed, bearing, distance_m, turn):
    position = distance_m * np.array([math.cos(bearing), math.sin(bearing)])
    rates = -speed * position / distance_m
    time_s = collision_time((0.3, turn, 0.0), rates, position)
    for early_s in np.linspace(0.0, min(time_s, 10.0), 20, endpoint=False):
        yaw = turn * early_s
        x = 0.3 * early_s if abs(turn) < 1e-9 else 0.3 * math.sin(yaw) / turn
        y = 0.0 if abs(turn) < 1e-9 else 0.3 * (1.0 - math.cos(yaw)) / turn
        pose = np.array([[*(position + early_s * rates), 0.0]])
        outline = np.ascontiguousarray(WHEELCHAIR)
        gap = clearances_of_bodies(outline, x, y, yaw, NO_EDGES, DISC, pose, 20.0)[0]
        assert gap > 0.0
