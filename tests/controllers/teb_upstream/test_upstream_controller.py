"""The original TEB's cycle: plan, obstacles, feasibility, saturation, recovery, parameters."""

import math
from dataclasses import replace

import numpy as np
import pytest
from controller_scenes import make_setup, observe
from pydantic import ValidationError
from scenes import WHEELCHAIR, straight_plan

from drake_navbench.controller import (
    NoiseKey,
    NoValidControl,
    Observation,
    SpeedLimit,
    memory_of_next_task,
)
from drake_navbench.controllers.teb_upstream import UpstreamTimedElasticBand
from drake_navbench.controllers.teb_upstream.controller import (
    robot_model,
    saturated,
    steering_angle,
)
from drake_navbench.controllers.teb_upstream.local_plan import (
    cut_local_plan,
    lethal_points,
    plan_window,
    pruned_begin,
)
from drake_navbench.controllers.teb_upstream.parameters import TebUpstreamParameters
from drake_navbench.controllers.teb_upstream.planner import limited
from drake_navbench.controllers.teb_upstream.recovery import is_oscillating
from drake_navbench.kernels.grid import LETHAL, Costmap

SIZE = 120


def costmap(*cells) -> Costmap:
    costs = np.zeros((SIZE, SIZE), dtype=np.uint8)
    for row, column in cells:
        costs[row, column] = LETHAL
    return Costmap(costs, -3.0, -3.0, 0.05)


def observation(*cells, **values) -> Observation:
    plan = values.pop("plan", straight_plan(4.0))
    known = {"time_s": 1.0, "costmap": costmap(*cells), "noise_key": NoiseKey(1, 4, 2)}
    return observe(plan, **known | values)


def controller(**parameters) -> UpstreamTimedElasticBand:
    defaults = {"max_vel_x": 0.5, "max_global_plan_lookahead_dist": 2.0}
    return UpstreamTimedElasticBand(TebUpstreamParameters(**defaults | parameters), make_setup())


def test_it_sets_off_and_is_soon_at_full_speed():
    driven = controller()
    memory = driven.initial_memory()
    speeds, x = [], 0.0
    for cycle in range(6):
        twist = np.array([speeds[-1] if speeds else 0.0, 0.0])
        seen = observation(time_s=0.05 * cycle, twist=twist, pose=np.array([x, 0.0, 0.0]))
        decision = driven.step(seen, memory)
        memory = decision.memory
        speeds.append(decision.command[0])
        x += 0.05 * decision.command[0]
    # 0.5 m/s^2 would allow 0.15 m/s after six cycles: penalties clip, they do not forbid.
    assert speeds[-1] > 0.4
    assert max(speeds) <= 0.5


def test_a_wall_across_the_way_is_no_way():
    wall = [(row, 80) for row in range(SIZE)]
    driven = controller()
    # The front is 0.85 m ahead of the axle, the wall 1 m.
    seen = observation(*wall, pose=np.array([0.1, 0.0, 0.0]))
    with pytest.raises(NoValidControl, match="no band is free of collision") as caught:
        driven.step(seen, driven.initial_memory())
    assert caught.value.memory.planner.trajectories == ()
    np.testing.assert_array_equal(caught.value.memory.last_command, [0.0, 0.0])


def test_the_plan_is_cut_at_the_nearest_pose_and_after_the_lookahead():
    parameters = TebUpstreamParameters(
        max_global_plan_lookahead_dist=1.0, global_plan_viapoint_sep=0.4
    )
    plan = cut_local_plan(observation(pose=np.array([0.52, 0.1, 0.3])), parameters)
    np.testing.assert_allclose(plan.poses[0], [0.52, 0.1, 0.3])
    # The piece that leads to the first pose counts as well; the pose that breaks the limit is in.
    assert plan.poses[-1, 0] == pytest.approx(1.5)
    np.testing.assert_allclose(plan.via_points[:, 0], [0.9, 1.3])


def test_the_piece_that_leads_to_the_first_pose_counts_though_the_path_handler_has_dropped_it():
    plan = straight_plan(4.0)
    seen = observation(pose=np.array([0.52, 0.1, 0.3]), plan=plan[10:], global_plan=plan)
    local = cut_local_plan(seen, TebUpstreamParameters(max_global_plan_lookahead_dist=1.02))
    # From 0.45 m on, in steps of 0.05 m; without that piece it would be 1.55 m.
    assert local.poses[-1, 0] == pytest.approx(1.5)


def test_what_lies_farther_behind_than_the_prune_distance_stays_dropped_until_the_next_plan():
    plan = straight_plan(4.0)
    # In steps of 0.05 m, 0.6 m is the first pose within 1 m of 1.57 m.
    assert pruned_begin(plan, 0, np.array([1.57, 0.0, 0.0]), 1.0) == 12
    assert pruned_begin(plan, 12, np.array([0.1, 0.0, 0.0]), 1.0) == 12
    assert pruned_begin(plan, 12, np.array([0.1, 5.0, 0.0]), 1.0) == 12
    driven = controller()
    seen = observation(global_plan=plan, pose=np.array([1.57, 0.0, 0.0]))
    memory = driven.step(seen, driven.initial_memory()).memory
    assert memory.plan_begin == 12
    back = replace(seen, pose=np.zeros(3))
    assert driven.step(back, memory).memory.plan_begin == 12
    assert driven.step(replace(back, plan_id=2), memory).memory.plan_begin == 0


def test_once_near_the_plan_an_earlier_place_wins_over_a_nearer_later_one():
    there_and_back = np.concatenate([np.arange(0.0, 2.0, 0.1), np.arange(2.0, 0.0, -0.1)])
    plan = np.zeros((len(there_and_back), 3))
    plan[:, 0] = there_and_back
    plan[len(plan) // 2 :, 1] = 0.2
    first, _ = plan_window(plan, np.array([0.5, 0.15, 0.0]), 2.55, 1.0)
    assert plan[first, 0] == pytest.approx(0.5)
    assert plan[first, 1] == 0.0


def test_cells_far_behind_and_in_the_last_row_are_no_obstacles():
    # Row and column 60 begin at 0 m.
    seen = costmap((60, 100), (60, 40), (60, 20), (SIZE - 1, 100), (100, SIZE - 1))
    points = lethal_points(seen.grid, np.zeros(3), 1.5)
    np.testing.assert_allclose(points, [[-0.975, 0.025], [2.025, 0.025]])


def test_each_component_is_cut_on_its_own():
    # The original does not declare use_proportional_saturation, so that a file cannot set it.
    each = TebUpstreamParameters(use_proportional_saturation=True)
    assert saturated(0.8, 0.6, each) == pytest.approx((0.4, 0.3))
    assert saturated(0.8, 0.15, each) == pytest.approx((0.4, 0.15))
    assert saturated(-0.5, -0.6, each) == pytest.approx((-0.2, -0.3))


def test_a_speed_limit_scales_all_speeds():
    half = limited(TebUpstreamParameters(), SpeedLimit(50.0, is_percentage=True))
    assert (half.max_vel_x, half.max_vel_x_backwards, half.max_vel_theta) == (0.2, 0.1, 0.15)


def test_a_car_turns_no_sharper_than_it_can():
    assert steering_angle(0.4, 0.2, 1.0, 0.5) == pytest.approx(math.atan(0.5))
    assert steering_angle(-0.1, 1.0, 1.0, 0.5) == pytest.approx(math.atan(-2.0))
    assert steering_angle(0.0, 1.0, 1.0, 0.5) == 0.0
    car = controller(
        min_turning_radius=1.0, cmd_angle_instead_rotvel=True, wheelbase=0.8, max_vel_theta=3.0
    )
    beside = np.array([0.0, 1.0, 0.9])
    speed, rate = car.step(observation(pose=beside), car.initial_memory()).command
    assert rate != 0.0
    assert abs(speed / rate) >= 0.95 - 1e-9


def test_turning_to_and_fro_on_the_spot_is_an_oscillation():
    parameters = TebUpstreamParameters()
    shuffle = np.column_stack([np.zeros(10), np.tile([0.5, -0.5], 5)])
    assert is_oscillating(shuffle, parameters, 20)
    assert not is_oscillating(shuffle[:8], parameters, 20)
    assert not is_oscillating(shuffle + np.array([0.2, 0.0]), parameters, 20)
    assert not is_oscillating(np.abs(shuffle), parameters, 20)


def test_a_preferred_side_reaches_the_bands_that_exist():
    driven = controller(oscillation_filter_duration=0.5)
    memory = driven.step(observation(), driven.initial_memory()).memory
    shuffle = np.column_stack([np.zeros(10), np.tile([0.5, -0.5], 5)])
    seen = replace(observation(), twist=np.array([0.0, 0.2]), time_s=12.0)
    after = driven.step(seen, memory._replace(history=shuffle, last_command=np.zeros(2))).memory
    assert after.preferred_turn == 1.0
    assert after.planner.trajectories[0].preferred_turn == 1.0


def test_a_car_s_steering_angle_is_searched_for_oscillations():
    car = controller(min_turning_radius=1.0, cmd_angle_instead_rotvel=True, wheelbase=0.8)
    beside = np.array([0.0, 1.0, 0.9])
    decision = car.step(observation(pose=beside), car.initial_memory())
    (speed, rate), (_, angle) = decision.command, decision.memory.last_command
    assert angle == pytest.approx(math.atan(0.8 * rate / speed))
    assert angle != pytest.approx(rate)


def test_shares_of_a_limited_speed_are_searched_for_oscillations():
    driven = controller(max_vel_x=0.5)
    memory = driven.initial_memory()._replace(last_command=np.array([0.25, 0.0]))
    slowed = observation(speed_limit=SpeedLimit(50.0, is_percentage=True))
    assert driven.step(slowed, memory).memory.history[-1, 0] == 1.0


def test_the_next_task_goes_on_from_the_band_along_its_own_plan():
    driven = controller(global_plan_prune_distance=0.5)
    seen = observation(pose=np.array([0.9, 0.0, 0.0]))
    memory = driven.step(seen, driven.initial_memory()).memory
    assert memory.plan_begin > 0
    bent = straight_plan(4.0) + np.array([0.0, 0.1, 0.0])
    start = observation(plan=bent)
    another_plan = driven.step(replace(start, plan_id=2), memory)
    next_task = driven.step(start, memory_of_next_task(driven, memory))
    assert next_task.memory.plan_begin == 0
    np.testing.assert_array_equal(next_task.command, another_plan.command)
    fresh = driven.step(start, driven.initial_memory())
    assert not np.array_equal(next_task.command, fresh.command)


def test_no_side_is_preferred_within_ten_seconds_of_the_start():
    driven = controller(oscillation_filter_duration=0.5)
    shuffle = np.column_stack([np.zeros(10), np.tile([0.5, -0.5], 5)])
    memory = driven.initial_memory()._replace(history=shuffle)
    seen = observation(twist=np.array([0.0, 0.2]))
    assert driven.step(replace(seen, time_s=9.9), memory).memory.preferred_turn == 0.0
    assert driven.step(replace(seen, time_s=10.1), memory).memory.preferred_turn == 1.0


@pytest.mark.parametrize(("with_classes", "kept"), [(False, 1.0), (True, 0.0)])
def test_a_single_band_keeps_the_preferred_side_after_a_failure(with_classes, kept):
    driven = controller(enable_homotopy_class_planning=with_classes)
    memory = driven.step(observation(time_s=12.0), driven.initial_memory()).memory
    memory = memory._replace(preferred_turn=1.0, oscillated_s=12.0)
    wall = [(row, 80) for row in range(SIZE)]
    with pytest.raises(NoValidControl) as caught:
        driven.step(observation(*wall, pose=np.array([0.1, 0.0, 0.0]), time_s=12.1), memory)
    after = driven.step(observation(time_s=12.2), caught.value.memory).memory
    assert after.planner.trajectories[0].preferred_turn == kept


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"dt_ref": 0.1}, "dt_hysteresis: got 0.1, expected less than dt_ref 0.1"),
        ({"min_samples": 2}, "min_samples: got 2, expected at least 3"),
        ({"footprint_model": {"type": "line"}}, "line_start and line_end: got none"),
        (
            {"footprint_model": {"type": "polygon", "vertices": "[[0, 0], [1, 0]]"}},
            "got 2, expected",
        ),
        ({"cmd_angle_instead_rotvel": True}, "min_turning_radius: got 0.0, expected more"),
        (
            {"obstacle_proximity_lower_bound": 0.7},
            "obstacle_proximity_lower_bound: got 0.7, expected less than",
        ),
        (
            {name: 0.0 for name in TebUpstreamParameters.model_fields if name.startswith("weight_")}
            | {"weight_adapt_factor": 2.0},
            "all weights are 0",
        ),
    ],
)
def test_contradictory_values_are_refused(values, said):
    with pytest.raises(ValidationError, match=said):
        TebUpstreamParameters(**values)


def test_defaults_are_those_of_the_original():
    parameters = TebUpstreamParameters()
    assert (parameters.max_vel_x, parameters.acc_lim_x, parameters.penalty_epsilon) == (
        0.4,
        0.5,
        0.05,
    )
    assert (parameters.selection_obst_cost_scale, parameters.footprint_model.type) == (
        100.0,
        "point",
    )
    # The original declares roadmap_graph_samples alone, so that a file's other name is not read.
    assert TebUpstreamParameters(roadmap_graph_no_samples=9).roadmap_graph_samples == 15


@pytest.mark.parametrize(("given", "meant"), [(1.0, True), (0.0, False), (1, True), (False, False)])
def test_teb_autosize_is_a_number_in_files_of_the_original(given, meant):
    assert TebUpstreamParameters(teb_autosize=given).teb_autosize is meant


def test_used_and_unused_names_are_disjoint():
    assert not TebUpstreamParameters.WITHOUT_EFFECT & set(TebUpstreamParameters.model_fields)


def test_the_corners_of_a_polygon_are_read_in_single_precision():
    # As Nav2's parser reads them: 0.86 is not among its numbers.
    corners = [[0.86, 0.31], [0.86, -0.31], [-0.26, -0.31], [-0.26, 0.31]]
    given = TebUpstreamParameters(footprint_model={"type": "polygon", "vertices": corners})
    own = TebUpstreamParameters(footprint_model={"type": "from_footprint"})
    rounded = robot_model(given, make_setup()).shapes[:, :2]
    np.testing.assert_array_equal(rounded, np.array(corners, dtype=np.float32))
    assert (rounded != corners).all()
    np.testing.assert_array_equal(robot_model(own, make_setup()).shapes[:, :2], WHEELCHAIR)
