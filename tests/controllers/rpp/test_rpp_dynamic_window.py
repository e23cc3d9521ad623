"""The dynamic window option, by hand."""

from __future__ import annotations

import pytest

from drake_navbench.controllers.rpp.controller import RppMemory
from drake_navbench.controllers.rpp.kernels import (
    axis_window,
    command_in_window,
    cut_to_speed,
)

ACCELERATION, DECELERATION, PERIOD = 2.0, -4.0, 0.1


@pytest.mark.parametrize(
    ("current", "expected"),
    [
        (0.3, (-0.1, 0.5)),  # 0.3 - 0.4, 0.3 + 0.2
        (-0.3, (-0.5, 0.1)),
        (0.0, (-0.2, 0.2)),  # from rest it accelerates either way
        (0.0005, (-0.1995, 0.2005)),
        (0.9, (0.5, 1.0)),  # 1.1 is above the limit
    ],
)
def test_window_reaches_as_far_as_the_accelerations(current, expected):
    window = axis_window(current, -1.0, 1.0, ACCELERATION, DECELERATION, PERIOD)
    assert window == pytest.approx(expected)


@pytest.mark.parametrize(
    ("window", "speed", "expected"),
    [
        ((0.1, 0.5), 0.3, (0.1, 0.3)),
        ((-0.2, 0.2), 0.3, (0.0, 0.2)),
        ((-0.2, 0.2), -0.1, (-0.1, 0.0)),
        ((0.2, 0.5), 0.1, (0.2, 0.2)),  # too fast: the slow edge
        ((-0.5, -0.2), 0.1, (-0.2, -0.2)),  # the wrong way: the slow edge
    ],
)
def test_regulation_cuts_the_window(window, speed, expected):
    assert cut_to_speed(*window, speed) == expected


@pytest.mark.parametrize(
    ("curvature", "sign", "expected"),
    [
        (0.0, 1.0, (0.4, 0.0)),
        (0.0, -1.0, (0.1, 0.0)),
        (0.25, 1.0, (0.4, 0.1)),  # the line leaves through the fast edge
        (1.0, 1.0, (0.2, 0.2)),  # through the edge of most turning
        (1.0, -1.0, (0.1, 0.1)),  # backwards the slow end is the fast one
        (-1.0, 1.0, (0.2, -0.2)),
        (3.0, 1.0, (0.1, 0.2)),  # it misses the window: the nearest corner
    ],
)
def test_command_follows_the_curvature_as_fast_as_the_window_lets(curvature, sign, expected):
    command = command_in_window(0.1, 0.4, -0.2, 0.2, curvature, sign)
    assert command == pytest.approx(expected)


@pytest.mark.parametrize(("window", "expected"), [((0.1, 0.3), 0.1), ((-0.3, -0.1), -0.1)])
def test_on_a_straight_path_turning_stops_as_soon_as_it_can(window, expected):
    assert command_in_window(0.1, 0.4, *window, 0.0, 1.0) == (0.4, expected)


def test_of_equally_near_corners_the_fastest_wins():
    # The line w = 2 v passes above both corners at w = 0.1 where the window has no width.
    assert command_in_window(0.2, 0.2004, 0.05, 0.1, 2.0, 1.0) == (0.2004, 0.1)


# Window of the worked examples: v in [0.175, 0.425], w in [-0.16, 0.16] after the command (0.3, 0).
@pytest.mark.parametrize(
    ("y", "expected"),
    [
        (0.0, (0.425, 0.0)),
        (0.3, (0.175, 0.16)),  # curvature 4/3: no crossing, the nearest corner
        (0.1, (0.16 * 0.37 / 0.2, 0.16)),  # curvature 0.2 / 0.37: 0.296 m/s at w = 0.16
    ],
)
def test_controller_starts_its_window_at_its_last_command(make_controller, observe, y, expected):
    controller = make_controller(use_dynamic_window=True, rotate_to_heading_min_angle=3.0)
    plan = [[0.1 * i, y, 0.0] for i in range(20)]
    decision = controller.step(observe(plan, twist=(0.0, 1.0)), RppMemory(last_v=0.3, last_w=0.0))
    assert decision.command == pytest.approx(expected)
    assert decision.memory[:2] == tuple(decision.command)


def test_turning_in_place_ignores_the_window_but_the_next_window_starts_there(
    make_controller, observe
):
    controller = make_controller(use_dynamic_window=True)
    behind = [[-0.1 * i, 0.0, 0.0] for i in range(20)]
    turning = controller.step(observe(behind, twist=(0.0, 1.0)), RppMemory(last_v=0.5))
    assert turning.command == pytest.approx([0.0, 1.16])
    ahead = [[0.1 * i, 0.0, 0.0] for i in range(20)]
    tracking = controller.step(observe(ahead), turning.memory)
    # v <= 0 + 2.5 * 0.05; w >= 1.16 - 3.2 * 0.05
    assert tracking.command == pytest.approx([0.125, 1.0])
