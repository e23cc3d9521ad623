"""harmony follows what moves in the costmap."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from harmony_worlds import FOOTPRINT, costmap_around

from drake_navbench.controllers.harmony.gatekeeper import is_clear_of_moving
from drake_navbench.controllers.harmony.tracking import NO_TRACKS, followed, moving_things

UPDATE_S = 0.2
HERE = np.zeros(2)


def box(x: float, y: float, half_x: float = 0.2, half_y: float = 0.2) -> list[float]:
    return [x - half_x, y - half_y, x + half_x, y + half_y]


def tracks_of(boxes_by_update):
    """Returns the tracks after updates 0.2 s apart, each with boxes (K, 4)."""
    tracks = NO_TRACKS
    for number, boxes in enumerate(boxes_by_update):
        costmap = costmap_around(np.reshape(boxes, (-1, 4)), 0.0, 0.0)
        tracks = followed(tracks, replace(costmap, stamp_s=UPDATE_S * number), HERE)
    return tracks


def test_who_walks_at_one_metre_a_second_is_found_with_place_and_velocity():
    tracks = tracks_of([[box(-1.0 + 0.2 * n, 0.5)] for n in range(6)])
    # The last update was at 1.0 s, with the middle at x = 0; 0.1 s later they are 0.1 m farther.
    ((x, y, along_x, along_y, radius),) = moving_things(tracks, 1.1)
    assert (x, y) == pytest.approx((0.1, 0.5), abs=0.03)
    assert (along_x, along_y) == pytest.approx((1.0, 0.0), abs=0.05)
    assert radius == pytest.approx(math.hypot(0.2, 0.2), abs=0.06)


def test_who_stops_is_no_longer_moving_after_a_second():
    walked = [[box(-1.0 + 0.2 * n, 0.5)] for n in range(6)]
    assert len(moving_things(tracks_of(walked), 1.0)) == 1
    assert len(moving_things(tracks_of(walked + [[box(0.0, 0.5)]] * 5), 2.0)) == 0


def test_a_still_thing_of_which_more_and_more_is_seen_does_not_move():
    seen = [[box(-0.3 + 0.05 * n, 1.0, half_x=0.05 + 0.05 * n, half_y=0.05)] for n in range(7)]
    assert len(moving_things(tracks_of(seen), 1.2)) == 0


def test_a_wall_is_no_moving_thing():
    walls = [[box(0.2 * n, 1.0, half_x=1.0, half_y=0.05)] for n in range(6)]
    assert len(moving_things(tracks_of(walls), 1.0)) == 0


def test_two_who_pass_each_other_keep_their_directions():
    tracks = tracks_of([[box(-1.0 + 0.2 * n, 0.6), box(1.0 - 0.2 * n, -0.6)] for n in range(9)])
    things = moving_things(tracks, 1.6)
    assert sorted(things[:, 2]) == pytest.approx([-1.0, 1.0], abs=0.05)
    assert things[np.argmax(things[:, 2]), 1] == pytest.approx(0.6, abs=0.03)


def test_the_cells_that_a_person_hides_are_not_taken_for_the_person():
    # They walk at the robot, at 1 m/s; where they were stays lethal behind them, as thin arcs.
    backs = [box(2.5 - 0.2 * n, 0.0, 0.03, 0.2) for n in range(6)]
    tracks = tracks_of([backs[: n + 1] for n in range(6)])
    ((x, y, along_x, along_y, _),) = moving_things(tracks, 1.0)
    assert (x, y) == pytest.approx((1.5, 0.0), abs=0.03)
    assert (along_x, along_y) == pytest.approx((-1.0, 0.0), abs=0.05)


def test_who_is_hidden_goes_on_for_a_moment():
    walked = [[box(-1.0 + 0.2 * n, 0.5)] for n in range(6)]
    ((x, *_),) = moving_things(tracks_of([*walked, [], []]), 1.4)
    assert x == pytest.approx(0.4, abs=0.05)
    assert len(moving_things(tracks_of([*walked, [], [], [], [], []]), 2.0)) == 0


def test_a_costmap_that_is_no_newer_changes_nothing():
    tracks = tracks_of([[box(0.0, 0.5)]])
    again = replace(costmap_around(np.array([box(1.0, 0.5)]), 0.0, 0.0), stamp_s=0.0)
    assert followed(tracks, again, HERE) is tracks


@pytest.mark.parametrize(("growth", "clear_s"), [(0.0, 0.68), (0.5, 0.45)])
def test_a_robot_at_rest_is_clear_until_a_disc_can_have_come(growth, clear_s):
    """From y = 1.21 m at 1 m/s a disc of 0.2 m has 0.68 m to go to the bound of 2 cm."""
    moving = np.array([[0.3, 1.21, 0.0, -1.0, 0.2, growth]])
    for duration_s, is_clear in ((clear_s - 0.02, True), (clear_s + 0.02, False)):
        poses = np.zeros((round(duration_s / 0.01) + 1, 3))
        assert is_clear_of_moving(moving, FOOTPRINT, poses, 0.01, 0.02) is is_clear


def test_without_anything_that_moves_all_poses_are_clear():
    assert is_clear_of_moving(np.empty((0, 6)), FOOTPRINT, np.zeros((3, 3)), 0.01, 0.02)
