"""The gatekeeper: what it predicts, what it lets through, and that no drive ends in a contact."""

from __future__ import annotations

import math
import os

import numpy as np
import pytest
from harmony_scenes import costmap_with
from harmony_worlds import ERROR_M, digest_of_code, drive, drive_worlds

from drake_navbench.controllers.harmony.base_response import (
    Response,
    command_of,
    follow_then_brake,
)
from drake_navbench.controllers.harmony.gatekeeper import (
    gap_at,
    is_clear,
    lethal_edges,
)
from drake_navbench.controllers.harmony.motion import ANGULAR_JERK, JERK, A, V, W, roll_out
from drake_navbench.kernels.read_only import read_only

WHEELCHAIR = Response(0.1, 2.5, 3.0)
OUTLINE = read_only([[0.85, 0.3], [0.85, -0.3], [-0.25, -0.3], [-0.25, 0.3]])
REACH_M = math.hypot(0.85, 0.3)
WALL = (1.5, -1.0, 1.6, 1.0)
# Nothing moves.
DT, PERIOD_S = 0.1, 0.05


def edges_with(*boxes):
    return lethal_edges(costmap_with(*boxes).grid, 0.0, 0.0, 3.0)


def straight_plan(v, steps=30):
    plan = np.zeros((steps + 1, 9))
    plan[:, V] = v
    plan[:, 0] = v * DT * np.arange(steps + 1)
    return plan


def test_a_box_of_cells_has_the_edges_of_its_outside():
    # 4 x 2 cells: 12 sides to the outside, and the 4 sides of the map.
    assert len(edges_with((0.0, 0.0, 0.2, 0.1))) == 16


def test_the_gap_is_that_of_the_exact_outline():
    edges = edges_with(WALL)
    placed = np.empty_like(OUTLINE)
    # The front is 0.85 m ahead, the wall 1.5 m; a corner turned by 45 degrees reaches farther.
    assert gap_at(edges, OUTLINE, 0.3, 0.0, 0.0, placed) == pytest.approx(0.35)
    turned = 0.3 + (0.85 + 0.3) / math.sqrt(2.0)
    assert gap_at(edges, OUTLINE, 0.3, 0.0, math.pi / 4, placed) == pytest.approx(1.5 - turned)


def test_braking_takes_the_way_of_a_first_order_response_with_a_limit():
    # From 0.5 m/s at 2.5 m/s^2 to 0.25 m/s: 0.0375 m; then 0.25 m/s decays with 0.1 s: 0.025 m.
    state = np.array([0.0, 0.0, 0.0, 0.5, 0.0])
    poses = follow_then_brake(WHEELCHAIR, state, straight_plan(0.5), DT, PERIOD_S, 0)
    assert poses[-1, 0] == pytest.approx(0.0625, abs=1e-3)


def test_a_base_with_a_time_constant_drives_the_plan_itself():
    # From a turn to the left to one to the right while speeding up; then on at constant velocity.
    plan = np.zeros((31, 9))
    plan[0, V], plan[0, W] = 0.2, 0.4
    plan[2, JERK], plan[4, JERK] = 2.0, -2.0
    plan[2, ANGULAR_JERK], plan[12, ANGULAR_JERK] = -8.0, 8.0
    roll_out(plan, DT)
    state = np.array([0.0, 0.0, 0.0, 0.2, 0.4])
    poses = follow_then_brake(WHEELCHAIR, state, plan, DT, PERIOD_S, 60)
    for stage in (5, 15, 25):
        np.testing.assert_allclose(poses[10 * stage], plan[stage, :3], atol=4e-3)


def test_a_plan_commands_no_more_than_the_base_may_be_told():
    plan = straight_plan(0.4)
    plan[:, A] = 0.8
    response = WHEELCHAIR._replace(most_v=0.42)
    assert command_of(WHEELCHAIR, plan, DT, PERIOD_S, 0)[0] > 0.45
    assert command_of(response, plan, DT, PERIOD_S, 0)[0] == 0.42


def test_a_way_between_two_poses_counts():
    edges = edges_with((0.9, 0.0, 1.0, 0.1))
    # Before and behind the box, nothing in between: the outline would have to jump.
    poses = np.array([[-0.5, 0.0, 0.0], [2.0, 0.0, 0.0]])
    assert not is_clear(edges, OUTLINE, REACH_M, poses, 0.02)


@pytest.mark.parametrize("gap", [0.1, 0.03])
def test_a_drive_beside_a_wall_is_let_through_where_the_gap_is_above_the_bound(gap):
    y0 = round((0.3 + gap) / 0.05) * 0.05
    edges = edges_with((-2.0, y0, 2.5, y0 + 0.1))
    x = np.linspace(0.0, 1.0, 100)
    poses = np.column_stack([x, np.full(100, y0 - 0.3 - gap), np.zeros(100)])
    assert is_clear(edges, OUTLINE, REACH_M, poses, gap - 0.006)
    assert not is_clear(edges, OUTLINE, REACH_M, poses, gap + 0.001)


def is_accepted(plan, state, bound):
    poses = follow_then_brake(WHEELCHAIR, state, plan, DT, PERIOD_S, 1)
    return is_clear(edges_with(WALL), OUTLINE, REACH_M, poses, bound)


@pytest.mark.parametrize(
    ("distance_m", "bound", "passes"),
    [(0.14, 0.03, True), (0.1, 0.03, False), (0.14, 0.06, False)],
)
def test_a_plan_into_a_wall_passes_as_long_as_braking_after_a_cycle_helps(
    distance_m, bound, passes
):
    # At 0.5 m/s one cycle takes 0.025 m, braking 0.0625 m.
    state = np.array([1.5 - 0.85 - distance_m, 0.0, 0.0, 0.5, 0.0])
    assert is_accepted(straight_plan(0.5), state, bound) is passes


def test_a_plan_is_refused_where_only_braking_after_its_first_cycle_comes_too_near():
    # Beside the wall's end, turning away from it: what is driven sooner or later clears it by more
    # than a stop right after the first cycle does.
    plan = np.zeros((31, 9))
    plan[0, V], plan[0, W] = 0.5, 0.4
    plan[0, ANGULAR_JERK], plan[2, ANGULAR_JERK] = 20.0, -20.0
    plan[0, JERK], plan[2, JERK] = -20.0, 20.0
    roll_out(plan, DT)
    state = np.array([0.451, 1.0, 0.3, 0.5, 0.4])
    edges, placed = edges_with(WALL), np.empty_like(OUTLINE)
    least = {
        cycles: min(
            gap_at(edges, OUTLINE, *pose, placed)
            for pose in follow_then_brake(WHEELCHAIR, state, plan, DT, PERIOD_S, cycles)
        )
        for cycles in (1, 3, 7)
    }
    assert 0.08 < least[1] < 0.09 < 0.1 < min(least[3], least[7])
    assert not is_accepted(plan, state, 0.09)
    assert is_accepted(plan, state, 0.08)


# In the first one the drive ends 1 mm in front of a box, in the second it arrives; in the last one
# it touches a box where the bound is 0.
TELLING_WORLDS = (8, 32, 41)


@pytest.mark.parametrize(
    "worlds",
    [
        pytest.param(TELLING_WORLDS, id="some"),
        *(
            pytest.param(range(first, first + 20), id=str(first), marks=pytest.mark.long)
            for first in range(0, 200, 20)
        ),
    ],
)
def test_no_drive_ends_in_a_contact_while_errors_are_within_the_bound(worlds):
    assert pytest.approx(0.03) == ERROR_M
    found = [drive(seed) for seed in worlds]
    assert all(one.end != "contact" and one.least_gap_m > 0.0 for one in found)
    # Who does not move meets nothing.
    assert "arrived" in {one.end for one in found}


def test_with_a_bound_of_zero_drives_do_end_in_contacts():
    no_bound = {"localization_error": 0.0, "tracking_error": 0.0, "response_error": 0.0}
    assert drive(TELLING_WORLDS[-1], **no_bound).end == "contact"


@pytest.mark.long
@pytest.mark.parametrize(("slowness", "strength"), [(0.7, 1.3), (1.3, 0.7)])
def test_a_base_that_is_wrong_by_30_percent_ends_in_no_contact_under_default_bounds(
    slowness, strength
):
    found = [drive(s, slowness=slowness, strength=strength) for s in TELLING_WORLDS[1:]]
    assert all(one.end != "contact" and one.least_gap_m > 0.0 for one in found)
    assert "arrived" in {one.end for one in found}


def test_driving_many_worlds_goes_on_where_the_file_ends(tmp_path):
    path = tmp_path / "worlds.csv"
    # Another machine drives the worlds before.
    assert len(drive_worlds(path, 1, jobs=1, hours=1.0, first=3)) == 1
    first = path.read_text()
    assert first.startswith("3,")
    # The time is over with the first one.
    assert len(drive_worlds(path, 9, jobs=1, hours=0.0, first=3)) == 2
    assert path.read_text().startswith(first)
    assert path.read_text().splitlines()[1].startswith("4,")


@pytest.mark.long
def test_no_drive_of_ten_thousand_ends_in_a_contact(request):
    """About two hours of one core; goes on where an earlier run of the same code was stopped."""
    path = request.config.cache.mkdir("harmony_worlds") / f"{digest_of_code()}.csv"
    ends = drive_worlds(path, 10_000, jobs=os.cpu_count() or 1, hours=6.0)
    assert len(ends) == 10_000
    assert "contact" not in ends
