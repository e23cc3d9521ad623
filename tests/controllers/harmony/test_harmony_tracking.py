"""What moves in the costmap, and the last moment at which harmony brakes for it."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from harmony_scenes import costmap_with
from harmony_worlds import BASE, FOOTPRINT, PERIOD_S, controller_with, edges_of, gap_of

from drake_navbench.controller import Observation
from drake_navbench.controllers.harmony import HarmonyParameters
from drake_navbench.controllers.harmony.base_response import follow
from drake_navbench.controllers.harmony.tracking import followed, moving_at, touches

MAP_PERIOD_S = 0.2
HERE = np.zeros(2)


def leg(x, y):
    """A box of 2 x 2 cells about a point that is a corner of cells."""
    return (x - 0.05, y - 0.05, x + 0.05, y + 0.05)


def tracked(boxes_at, updates=6, position=HERE):
    """The things after updates of the map at 0, 0.2, 0.4 s and so on, as `moving_at` has them."""
    tracks = None
    for count in range(updates):
        time_s = count * MAP_PERIOD_S
        seen_map = replace(costmap_with(*boxes_at(time_s)), stamp_s=time_s)
        tracks = followed(tracks, seen_map, position)
    return moving_at(tracks, time_s)


def test_a_pair_of_legs_is_one_body_with_its_speed():
    # The legs are 0.2 m apart; 0.2 m an update is 1 m/s. After 1 s the middle is at 2.5 - 1 m.
    (person,) = tracked(lambda t: (leg(2.5 - t, 0.1), leg(2.5 - t, -0.1)))
    assert person == pytest.approx([1.5, 0.0, -1.0, 0.0, 0.3, 1.0], abs=1e-9)


def test_feet_that_step_by_turns_are_one_body():
    # The feet are 0.2 m ahead and behind by turns, so that each goes to and fro.
    def feet(time_s):
        ahead = 0.2 * (-1) ** round(time_s / MAP_PERIOD_S)
        return leg(2.5 - time_s - ahead, 0.1), leg(2.5 - time_s + ahead, -0.1)

    (person,) = tracked(feet)
    assert person == pytest.approx([1.5, 0.0, -1.0, 0.0, 0.3, 1.0], abs=1e-9)


def hidden(*missing):
    """The legs of somebody at 2.5 m - 1 m/s t, but for some updates of the map."""
    return lambda t: () if round(t / MAP_PERIOD_S) in missing else (leg(2.5 - t, 0.1),)


def test_who_moves_goes_on_for_0_7_s_unseen():
    # Seen at 0.2, 0.4 and 0.6 s, last at 1.9 m; at 1.2 s they are at 1.3 m, at 1.4 s it is 0.8 s.
    missing = (4, 5, 6, 7)
    (person,) = tracked(hidden(*missing), updates=7)
    assert person == pytest.approx([1.3, 0.1, -1.0, 0.0, 0.3, 1.0], abs=1e-9)
    assert len(tracked(hidden(*missing), updates=8)) == 0


def test_who_is_seen_again_is_the_one_that_was_expected():
    # Not seen at 0.8 and 1.0 s: at 1.2 s the velocity is known at once, and nobody is left behind.
    (person,) = tracked(hidden(4, 5), updates=7)
    assert person == pytest.approx([1.3, 0.1, -1.0, 0.0, 0.3, 1.0], abs=1e-9)


def test_who_is_seen_is_not_taken_for_one_who_was_hidden():
    # One comes along y = 0; another nears this line and is hidden from 0.8 s on. At 1.2 s the first
    # one is at y = 0.25 m; 0.35 m from there the other one is expected, within 0.5 + 0.6 m.
    def two(time_s):
        first = leg(2.5 - time_s, 0.25 if time_s > 1.1 else 0.0)
        return (first,) if time_s > 0.7 else (first, leg(2.5 - time_s, 1.5 - 0.75 * time_s))

    first, other = tracked(two, updates=7)
    # Least squares of five places at 0 and one at 0.25 m: 0.25 * 0.5 / 0.7 m/s.
    assert first[2:4] == pytest.approx([-1.0, 0.125 / 0.7])
    assert other == pytest.approx([1.3, 0.6, -1.0, -0.75, 0.3, 1.0], abs=1e-9)


def test_what_is_not_known_to_move_is_lost_at_once():
    # Two places make no velocity; what stands is no longer expected either.
    assert len(tracked(hidden(3), updates=4)) == 0
    assert len(tracked(lambda t: (leg(2.0, 0.0),) if 0.1 < t < 0.7 else (), updates=5)) == 0


def test_what_stands_from_the_first_map_on_is_no_thing():
    assert len(tracked(lambda t: (leg(2.0, 0.0),))) == 0
    # A wall of 2 m is still at once, a leg until it has stood for 0.8 s a thing of no velocity.
    assert len(tracked(lambda t: ((2.0, -1.0, 2.1, 1.0),), updates=3)) == 0
    (thing,) = tracked(lambda t: (leg(2.0, 0.0),), updates=3)
    assert thing == pytest.approx([2.0, 0.0, 0.0, 0.0, 0.3, 0.0])


def test_who_walks_already_in_the_first_map_is_known_after_the_fourth():
    (person,) = tracked(lambda t: (leg(2.5 - t, 0.1), leg(2.5 - t, -0.1)), updates=4)
    assert person == pytest.approx([1.9, 0.0, -1.0, 0.0, 0.3, 1.0], abs=1e-9)


def test_what_has_just_come_and_stands_does_not_move():
    later = tracked(lambda t: (leg(2.0, 0.0),) if t >= 0.3 else ())
    assert later[:, 2:4] == pytest.approx(np.zeros((1, 2)))
    assert not later[:, 5].any()


def test_cells_beside_an_old_thing_are_its_jitter():
    assert len(tracked(lambda t: ((1.0, -1.0, 1.1 + 0.05 * (round(t / 0.2) % 2), 1.0),))) == 0


def test_cells_behind_a_thing_are_what_it_has_left():
    # Somebody comes straight at the lidar by 0.3 m an update and hides what they have left.
    left = tracked(lambda t: [leg(2.5 - 0.3 * k, 0.0) for k in range(round(t / MAP_PERIOD_S) + 1)])
    assert left == pytest.approx(np.array([[1.0, 0.0, -1.5, 0.0, 0.3, 1.0]]), abs=1e-9)


def test_a_wall_that_comes_into_sight_is_no_thing():
    # 2 m of it, then 0.2 m more an update, after a gap of two cells; after one of three it is a new
    # thing.
    def wall(gap_m):
        ends = [-2.0 + 0.2 * k for k in range(15)]
        return lambda t: [
            (2.0, end, 2.1, end + 0.2 - gap_m) for end in ends[: 10 + round(t / MAP_PERIOD_S)]
        ]

    assert len(tracked(wall(0.1))) == 0
    assert len(tracked(wall(0.15))) > 0


@pytest.mark.parametrize("gap_m", [0.15, 0.5])
def test_a_wall_that_comes_into_sight_piece_by_piece_does_not_surely_move(gap_m):
    # Its rear stands; when the first piece is old after 0.8 s, all of it is.
    def wall(time_s):
        return [
            (2.0, start, 2.1, start + 0.1)
            for start in np.arange(-2.0, 2.0, 0.1 + gap_m)[: 1 + round(time_s / MAP_PERIOD_S)]
        ]

    for updates in range(2, 9):
        assert not tracked(lambda t: wall(t) if t > 0.1 else (), updates)[:, 5].any()


def test_one_cell_alone_is_no_thing():
    # As a wall that the beams graze: here and there a cell, not all of them where others were.
    places = [2.0, 2.0, 2.2, 2.7, 2.55, 2.9]
    assert len(tracked(lambda t: ((2.0, y := places[round(t / 0.2)], 2.05, y + 0.05),))) == 0


def test_a_map_that_rolls_on_keeps_what_stands():
    tracks = None
    for count in range(6):
        # The map's origin moves by two cells an update, the box stays where it is in the world.
        left_m = 0.1 * count
        there = replace(
            costmap_with(leg(2.0 - left_m, 0.0)), origin_x=-3.0 + left_m, stamp_s=0.2 * count
        )
        tracks = followed(tracks, there, HERE)
    assert len(tracks.places) == 0


def test_a_touch_is_when_the_discs_meet_the_outline():
    # The front is at 0.86 m, the edge of the disc at 2.0 - 0.3 m: 0.84 m at 1 m/s, less 0.05 m.
    # One who goes by on the side, at 0.31 + 0.3 + 0.05 m and more from the axis, does not touch.
    poses = np.zeros((1, 3))
    people = np.array([[2.0, 0.0, -1.0, 0.0, 0.3, 1.0], [2.0, 0.67, -1.0, 0.0, 0.3, 1.0]])
    assert touches(people, FOOTPRINT, poses, 0.01, 0.05, 0.77).tolist() == [False, False]
    assert touches(people, FOOTPRINT, poses, 0.01, 0.05, 0.81).tolist() == [True, False]
    assert touches(people, FOOTPRINT, poses, 0.01, 0.05, 3.0).tolist() == [True, False]


PLAN = np.column_stack([np.arange(-1.0, 8.0, 0.05), np.zeros(180), np.zeros(180)])


def drive_on(controller, state, boxes_at, cycles, **remembered):
    """Yields the time, s, and the memory after each cycle; the state (5,) changes in place.

    boxes_at: of the map at a time, which comes every fourth cycle. remembered: fields of the memory
    at the start.
    """
    memory = controller.initial_memory()._replace(**remembered)
    for cycle in range(cycles):
        time_s = cycle * PERIOD_S
        if cycle % 4 == 0:
            seen_map = replace(costmap_with(*boxes_at(time_s)), stamp_s=time_s)
        nearest = int(np.argmin(np.abs(PLAN[:, 0] - state[0])))
        seen = Observation(
            time_s=time_s, pose=state[:3].copy(), twist=state[3:].copy(),
            plan=PLAN[nearest : nearest + 41], plan_id=1, costmap=seen_map, goal=PLAN[-1],
        )  # fmt: skip
        command, memory, _ = controller.step(seen, memory)
        for _ in range(5):
            follow(BASE, state, float(command[0]), float(command[1]), 0.01)
        yield time_s, memory


def met(bearing, aside_m=0.0, walking_mps=1.0, speed=0.5, stops=True):
    """The robot's speed each cycle until somebody touches it or 4 s are over, and the last gap, m.

    They walk straight to where its middle would be after 3 s, or pass it aside.
    """
    controller = controller_with(HarmonyParameters(stop_for_moving=stops))
    state = np.array([-1.0, 0.0, 0.0, speed, 0.0])
    meeting = np.array([-1.0 + 3.0 * speed + 0.3, 0.0])
    along = -np.array([math.cos(bearing), math.sin(bearing)])
    aside = np.array([-along[1], along[0]])

    def person_at(time_s):
        return meeting + aside_m * aside + (time_s - 3.0) * walking_mps * along

    def legs_at(time_s):
        return [leg(*np.round(person_at(time_s) + side * aside, 2)) for side in (0.1, -0.1)]

    speeds, gap = [], math.inf
    for time_s, _ in drive_on(controller, state, legs_at, 80):
        at = person_at(time_s)
        gap = gap_of(edges_of(np.array([[*(at - 0.01), *(at + 0.01)]])), state) - 0.3
        speeds.append(float(state[3]))
        if gap <= 0.0:
            break
    return speeds, gap


@pytest.mark.parametrize(
    "bearing_deg", [0, 150, *(pytest.param(deg, marks=pytest.mark.long) for deg in (60, 90))]
)
def test_who_walks_into_it_meets_it_at_rest_and_it_drives_until_the_last_moment(bearing_deg):
    speeds, gap = met(math.radians(bearing_deg))
    assert gap <= 0.0
    assert abs(speeds[-1]) <= 0.02
    # It drives at full speed until 1.2 s before they touch.
    assert speeds[-24] > 0.45


def speed_after_start(hurries):
    """The robot's speed 0.8 s after a start on a straight plan."""
    controller, state = controller_with(HarmonyParameters()), np.zeros(5)
    *_, (_, memory) = drive_on(controller, state, lambda _: (), 16, hurries=hurries)
    assert memory.hurries is False
    return state[3]


def test_after_such_a_stop_it_starts_quickly():
    assert speed_after_start(hurries=True) > 0.45 > 0.4 > speed_after_start(hurries=False)


def test_who_passes_beside_it_does_not_stop_it():
    speeds, gap = met(math.radians(90), aside_m=1.6)
    assert gap > 0.1
    assert speeds == met(math.radians(90), aside_m=1.6, stops=False)[0]


def test_it_backs_up_before_who_comes_and_stands_in_its_way():
    # Between walls 1.4 m apart they walk to 1.3 m at 1 m/s and stand there; its front is at 0.86 m.
    def boxes_at(time_s):
        x = round(max(2.6 - time_s, 1.3), 2)
        walls = (-3.0, 0.7, 3.0, 0.8), (-3.0, -0.8, 3.0, -0.7)
        return *walls, leg(x, 0.1), leg(x, -0.1)

    state, xs = np.zeros(5), []
    for _ in drive_on(controller_with(HarmonyParameters()), state, boxes_at, 100):
        xs.append(float(state[0]))
    # It keeps 1.2 m of free way, and is never as near as it would give up.
    assert xs[-1] < 0.0
