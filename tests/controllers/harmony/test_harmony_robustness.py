"""harmony with robots, plans and maps that are not those it was made with."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from harmony_scenes import costmap_with, straight
from harmony_worlds import FOOTPRINT
from test_harmony_controller import decide, seen, setup_for

from drake_navbench.controller import CollisionAhead
from drake_navbench.controllers.harmony import Harmony, HarmonyParameters
from drake_navbench.controllers.harmony.base_response import (
    Response,
    braking_time,
    command_of,
    follow,
    follow_then_brake,
    response_of,
)
from drake_navbench.controllers.harmony.gatekeeper import is_clear, is_on_free_cell, lethal_edges
from drake_navbench.controllers.harmony.motion import V, plan_of_velocities, stage_at
from drake_navbench.controllers.harmony.scene import make_start
from drake_navbench.controllers.harmony.way import along_itself
from drake_navbench.errors import InputError
from drake_navbench.inputs.presets import load_preset
from drake_navbench.kernels.grid import LETHAL, Costmap
from drake_navbench.kernels.poses import place_outline

WHEELCHAIR = Response(0.1, 2.5, 3.0)
# 4 cm ahead of the outline, with a bound of 10.5 cm.
NEAR, TIGHT = (0.9, -0.5, 1.0, 0.5), {"localization_error": 0.1, "give_up_distance": 0.0}


def test_a_plan_without_headings_leads_through_a_corridor():
    # 1.2 m wide, across x: a robot at heading 0 would be 0.86 m long to one side.
    walls = ((-0.7, -3.0, -0.6, 3.0), (0.6, -3.0, 0.7, 3.0))
    plan = np.column_stack([np.zeros(41), 0.05 * np.arange(41), np.zeros(41)])
    decision = decide(*walls, plan=plan, pose=(0.0, 0.0, math.pi / 2), twist=(0.3, 0.0))
    assert decision.command[0] > 0.3
    assert decision.diagnostics["blocked_m"] is None


def test_a_path_is_driven_along_its_points():
    points = [[0.0, 0.0], [0.0, 0.0], [1.0, 0.0], [1.0, 2.0], [1.0, 2.0]]
    path = np.column_stack([points, np.full(5, 9.0)])
    np.testing.assert_allclose(
        along_itself(path)[:, 2], [0.0, 0.0, math.pi / 2, math.pi / 2, math.pi / 2]
    )
    # A single pose leads nowhere else.
    np.testing.assert_array_equal(along_itself(path[:1]), path[:1])


def test_giving_up_lasts_while_nothing_is_accepted():
    controller = Harmony(HarmonyParameters(**TIGHT, patience=0.2), setup_for())
    memory, ends = controller.initial_memory(), []
    for cycle in range(12):
        now = replace(seen(NEAR), time_s=0.05 * cycle)
        try:
            decision = controller.step(now, memory)
            memory = decision.memory
            ends.append(decision.diagnostics["accepted"])
            np.testing.assert_array_equal(decision.command, [0.0, 0.0])
        except CollisionAhead as error:
            memory = error.memory
            ends.append("given up")
    assert ends == ["stop"] * 4 + ["given up"] * 8
    # What the base was told all the time is known.
    assert len(memory.sent.commands) == 12
    # A way out ends it.
    out = controller.step(replace(seen(), time_s=0.6), memory)
    assert out.diagnostics["accepted"].startswith("plan")
    assert out.memory.refused_since_s is None


def test_how_the_base_answers_is_known_of_the_robot():
    agv = setup_for(
        response_time_constant_s=0.15,
        max_linear_acceleration_mps2=0.8,
        max_angular_acceleration_radps2=1.6,
    )
    assert response_of(agv)[:3] == (0.15, 0.8, 1.6)
    # Motors that are simulated take time besides what the robot's file says.
    quick = setup_for(response_time_constant_s=0.07)
    assert response_of(quick).time_constant_s == 0.1


def test_a_base_that_brakes_weakly_is_kept_farther_off():
    # From 0.5 m/s it takes 0.5^2 / (2 * 0.5) = 0.25 m, where the wheelchair takes 0.06 m.
    weak = setup_for(max_linear_acceleration_mps2=0.5, wants_diagnostics=True)
    box = (1.2, -0.5, 1.3, 0.5)
    controllers = [Harmony(HarmonyParameters(), setup) for setup in (setup_for(), weak)]
    commands = [
        c.step(seen(box, twist=(0.5, 0.0)), c.initial_memory()).command[0] for c in controllers
    ]
    assert commands[0] > 0.0
    assert commands[1] == 0.0


def test_the_time_to_brake_is_that_of_the_prediction():
    for response in (WHEELCHAIR, Response(0.5, 0.3, 3.0), Response(0.0, 0.5, 1.0)):
        state = np.array([0.0, 0.0, 0.0, 0.5, 0.4])
        poses = follow_then_brake(response, state, np.zeros((31, 9)), 0.1, 0.05, 0)
        assert braking_time(response, 0.5, 0.4) == pytest.approx(0.01 * len(poses), abs=0.06)


def stop_of(told, true, state, plan):
    """Returns (4, 2) m the corners at rest, after one cycle of a plan and the brake."""
    v, w = command_of(told, plan, 0.1, 0.05, 0)
    moved = state.copy()
    for k in range(300):
        follow(true, moved, v if k < 5 else 0.0, w if k < 5 else 0.0, 0.01)
    return place_outline(FOOTPRINT, moved[:3])


@pytest.mark.parametrize(
    ("time_constant_s", "ratio", "most_m"),
    [(0.1, 0.7, 0.012), (0.2, 1.3, 0.046)],
)
def test_a_wrong_time_constant_puts_the_stop_off_by_the_way_driven_in_its_error(
    time_constant_s, ratio, most_m
):
    told = Response(time_constant_s, 2.5, 3.0)
    true = told._replace(time_constant_s=ratio * time_constant_s)
    random, reach_m, worst_m = np.random.default_rng(0), math.hypot(0.86, 0.31), 0.0
    for _ in range(500):
        v, w, a, alpha = random.uniform([-0.2, -1.0, -0.8, -1.5], [0.5, 1.0, 0.8, 1.5])
        if abs(v * w) > 0.18 or abs(v) + 0.25 * abs(w) > 0.7:
            continue
        velocities = np.array([[v, w]]) + 0.1 * np.arange(4)[:, None] * np.array([[a, alpha]])
        plan = plan_of_velocities(velocities, 0.1, make_start(np.zeros(3), v, w))
        state = np.array([0.0, 0.0, 0.0, v, w])
        stops = [stop_of(told, base, state, plan) for base in (told, true)]
        off_m = float(np.hypot(*(stops[0] - stops[1]).T).max())
        # The farthest corner's speed at the end of the cycle, as the plan speeds up meanwhile.
        speed = abs(v) + 0.05 * 0.8 + reach_m * (abs(w) + 0.05 * 1.5)
        assert off_m <= abs(1.0 - ratio) * time_constant_s * speed
        worst_m = max(worst_m, off_m)
    assert 0.8 * most_m < worst_m <= most_m


def test_a_base_that_does_not_come_to_rest_is_refused():
    with pytest.raises(InputError, match=r"brakes for 10\.\d s, expected at most 5 s"):
        Harmony(HarmonyParameters(), setup_for(max_linear_acceleration_mps2=0.05))
    state = np.array([0.0, 0.0, 0.0, 0.5, 0.0])
    poses = follow_then_brake(Response(5.0, 2.5, 3.0), state, np.zeros((31, 9)), 0.1, 0.05, 0)
    assert len(poses) == 0
    edges = lethal_edges(costmap_with().grid, 0.0, 0.0, 3.0)
    assert not is_clear(edges, setup_for().footprint, 0.92, poses, 0.0)


def test_nothing_that_is_no_number_is_clear():
    edges = lethal_edges(costmap_with().grid, 0.0, 0.0, 3.0)
    assert is_clear(edges, setup_for().footprint, 0.92, np.zeros((2, 3)), 0.1)
    poses = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, np.nan]])
    assert not is_clear(edges, setup_for().footprint, 0.92, poses, 0.1)


@pytest.mark.parametrize(
    ("costs", "position"),
    [
        pytest.param(np.full((120, 120), LETHAL, np.uint8), (0.0, 0.0), id="all of it lethal"),
        pytest.param(np.zeros((120, 120), np.uint8), (4.0, 0.0), id="off the map"),
    ],
)
def test_nothing_is_accepted_where_the_robot_is_not_on_the_map(costs, position):
    costmap = Costmap(costs, -3.0, -3.0, 0.05)
    assert not is_on_free_cell(costmap.grid, *position)
    controller = Harmony(HarmonyParameters(give_up_distance=0.0, patience=9.0), setup_for())
    plan = straight(2.0) + np.array([*position, 0.0])
    now = replace(seen(pose=(*position, 0.0), plan=plan), costmap=costmap)
    try:
        command = controller.step(now, controller.initial_memory()).command
    except CollisionAhead:
        command = np.zeros(2)
    np.testing.assert_array_equal(command, [0.0, 0.0])


def test_the_faster_direction_counts():
    parameters = HarmonyParameters(max_vel_x=0.1, max_vel_x_backwards=0.4, latency_error=0.1)
    assert parameters.top_speed == 0.4
    # 5 mm, 25 mm, and what it drives in 0.1 s.
    assert parameters.error_bound_m == pytest.approx(0.07)


@pytest.mark.parametrize(
    ("values", "told"),
    [
        ({"max_vel_x_backwards": 2.0, "horizon": 1.2}, "stopping time from max_vel_x_backwards"),
        # 2.1 s would do, but 1.6 s are left of it: two steps of 0.8 s.
        ({"horizon": 0.7, "time_step": 0.128}, r"horizon \(0.64 s in whole steps\)"),
        ({"localization_error": 0.55}, "got a bound of 0.555 m, expected less than 0.5 m"),
    ],
)
def test_a_wrong_combination_is_told_in_one_line(values, told):
    column = "harmony:" + ":".join(f"{name}={value}" for name, value in values.items())
    with pytest.raises(InputError, match=told) as refused:
        load_preset(column).checked()
    assert "\n" not in str(refused.value)


def test_before_its_begin_a_plan_is_where_it_begins():
    plan = np.zeros((4, 9))
    plan[:, V] = 0.5
    np.testing.assert_array_equal(stage_at(plan, 0.1, -0.3)[: V + 1], [0.0, 0.0, 0.0, 0.5])
