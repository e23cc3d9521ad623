"""The DWB controller as a whole: one cycle, several cycles, symmetries, failures."""

import math
from dataclasses import replace

import dwb_reference
import numpy as np
import pytest
from dwb_cases import RECTANGLE, SETUP, free_map, observe, parameters, situate
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import straight_plan

from drake_navbench.controller import NoValidControl, SpeedLimit
from drake_navbench.controllers.dwb import DynamicWindowApproach
from drake_navbench.controllers.dwb.local_planner import LocalPlanner
from drake_navbench.kernels.grid import Costmap

GRID_CRITICS = ["BaseObstacle", "GoalAlign", "PathAlign", "PathDist", "GoalDist"]
ALL_SPACE_CRITICS = [*GRID_CRITICS, "ObstacleFootprint"]


def controller_of(*, wants_diagnostics=False, **changes):
    setup = replace(SETUP, wants_diagnostics=wants_diagnostics)
    return DynamicWindowApproach(parameters(**changes), setup)


def step(controller, **changes):
    return controller.step(observe(**changes), controller.initial_memory())


def random_world(seed, *, resolution=0.0625, size=47, obstacles=6):
    """Returns (costmap, pose, twist, plan, goal) in no particular order or symmetry.

    The resolution is a power of two, so that moving by whole cells is exact.
    """
    random = np.random.default_rng(seed)
    half = 0.5 * size * resolution
    costs = random.integers(0, 200, (size, size)).astype(np.uint8)
    for row, column in random.integers(0, size, (obstacles, 2)):
        costs[row, column] = random.choice([253, 254, 255])
    pose = random.uniform([-0.2, -0.2, -math.pi], [0.2, 0.2, math.pi])
    headings = random.uniform(-math.pi, math.pi) + np.cumsum(random.normal(0.0, 0.1, 20))
    steps = random.uniform(0.03, 0.3) * np.column_stack([np.cos(headings), np.sin(headings)])
    plan = np.column_stack([pose[:2] + np.cumsum(steps, axis=0), headings])
    return {
        "costmap": Costmap(costs, -half, -half, resolution),
        "pose": pose,
        "twist": np.array([random.uniform(0.0, 0.26), random.uniform(-1.0, 1.0)]),
        "plan": plan,
        "goal": plan[-1] + [random.uniform(0.0, 2.0), 0.0, 0.0],
    }


def situation_of(world):
    v, w = world["twist"]
    return situate(
        pose=tuple(world["pose"]),
        twist=(v, 0.0, w),
        plan=world["plan"],
        goal=tuple(world["goal"]),
        costmap=world["costmap"],
    )


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), short_circuit=st.booleans())
def test_whole_window_agrees_with_one_trajectory_at_a_time(seed, short_circuit):
    p = parameters(
        critics=ALL_SPACE_CRITICS,
        vx_samples=5,
        vtheta_samples=6,
        short_circuit_trajectory_evaluation=short_circuit,
    )
    planner = LocalPlanner(p, SETUP)
    situation = situation_of(random_world(seed))
    evaluation = planner.evaluate(situation, planner.initial_memory())
    best, totals, reasons = dwb_reference.evaluate(
        situation, evaluation.trajectories.twists, p, [tuple(c) for c in RECTANGLE.tolist()]
    )
    assert evaluation.best == best
    np.testing.assert_array_equal(evaluation.totals, totals)
    np.testing.assert_array_equal(evaluation.is_legal, [reason is None for reason in reasons])
    counts = {reason: reasons.count(reason) for reason in set(reasons) - {None}}
    assert planner.rejections(evaluation) == counts


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_early_stop_does_not_change_the_command(seed):
    world = random_world(seed, obstacles=0)
    with_stop, without = (
        step(controller_of(short_circuit_trajectory_evaluation=stop), **world)
        for stop in (True, False)
    )
    np.testing.assert_array_equal(with_stop.command, without.command)
    assert with_stop.diagnostics["best_total"] == without.diagnostics["best_total"]


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), columns=st.integers(-400, 400), rows=st.integers(-400, 400))
def test_world_moved_by_whole_cells_gives_the_same_command(seed, columns, rows):
    world = random_world(seed, obstacles=0)
    # Coordinates in multiples of 2^-20 m, so that moving them is exact too.
    world["pose"][:2] = np.round(world["pose"][:2] * 2**20) / 2**20
    world["plan"][:, :2] = np.round(world["plan"][:, :2] * 2**20) / 2**20
    world["goal"][:2] = np.round(world["goal"][:2] * 2**20) / 2**20
    costmap = world["costmap"]
    shift = np.array([columns, rows]) * costmap.resolution
    moved = world | {
        "pose": world["pose"] + [*shift, 0.0],
        "plan": world["plan"] + [*shift, 0.0],
        "goal": world["goal"] + [*shift, 0.0],
        "costmap": Costmap(
            costmap.costs,
            costmap.origin_x + shift[0],
            costmap.origin_y + shift[1],
            costmap.resolution,
        ),
    }
    here, there = (step(controller_of(critics=ALL_SPACE_CRITICS), **w) for w in (world, moved))
    np.testing.assert_array_equal(here.command, there.command)
    assert here.diagnostics == there.diagnostics


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_mirrored_world_gives_the_mirrored_command_unless_there_is_a_tie(seed):
    world = random_world(seed, obstacles=0)
    flip = np.array([1.0, -1.0, -1.0])
    costmap = world["costmap"]
    mirrored = world | {
        "pose": world["pose"] * flip,
        "twist": world["twist"] * [1.0, -1.0],
        "plan": world["plan"] * flip,
        "goal": world["goal"] * flip,
        "costmap": Costmap(
            np.ascontiguousarray(costmap.costs[::-1]),
            costmap.origin_x,
            costmap.origin_y,
            costmap.resolution,
        ),
    }
    # Without early stops all totals are final, so that ties can be seen.
    controller = controller_of(
        critics=GRID_CRITICS, short_circuit_trajectory_evaluation=False, wants_diagnostics=True
    )
    left, right = step(controller, **world), step(controller, **mirrored)
    assert left.diagnostics["best_total"] == right.diagnostics["best_total"]
    costs = left.diagnostics["sampled_costs"]
    if np.count_nonzero(costs == np.nanmin(costs)) == 1:
        np.testing.assert_allclose(left.command, right.command * [1.0, -1.0], rtol=0, atol=1e-12)


def test_ties_go_to_the_slowest_and_then_the_most_negative_yaw_rate():
    # One cell of 9 m: every trajectory ends in it with the same score.
    world = {"costmap": free_map(1, 1, resolution=9.0), "plan": np.zeros((1, 3))}
    decision = step(controller_of(critics=["PathDist"]), **world)
    np.testing.assert_allclose(decision.command, [0.0, -1.0], rtol=0, atol=1e-12)


def test_straight_path_of_7_25_m_takes_the_original_15_05_s():
    # Bringup critics at 0.5 m/s, 20 Hz, perfect velocity tracking, tolerance 0.25 m, pruned at 2 m.
    controller = controller_of(max_vel_x=0.5, max_speed_xy=0.5)
    plan = straight_plan(7.25)
    memory, x, v, cycles = controller.initial_memory(), 0.0, 0.0, 0
    while 7.25 - x > 0.25:
        nearest = int(np.argmin(np.abs(plan[:, 0] - x)))
        origin_x = math.floor((x - 3.0) / 0.05) * 0.05
        decision = controller.step(
            observe(
                time_s=cycles * 0.05,
                pose=np.array([x, 0.0, 0.0]),
                twist=np.array([v, 0.0]),
                plan=plan[nearest : nearest + 41],
                goal=plan[-1],
                costmap=free_map(120, 120, origin=(origin_x, -3.0)),
            ),
            memory,
        )
        memory, (v, w) = decision.memory, decision.command
        assert w == 0.0
        x += v * 0.05
        cycles += 1
    assert cycles * 0.05 == pytest.approx(15.05)


def test_new_plan_makes_the_critics_forget():
    controller = controller_of()
    at_goal = {"goal": np.array([0.1, 0.0, 1.0]), "plan": straight_plan(0.1)}
    memory = controller.step(observe(**at_goal), controller.initial_memory()).memory
    assert memory.critics[0].rotating
    far = {"goal": np.array([5.0, 0.0, 0.0])}
    assert controller.step(observe(**far), memory).memory.critics[0].rotating
    assert not controller.step(observe(**far, plan_id=2), memory).memory.critics[0].rotating


def test_speed_limit_holds_until_it_is_lifted():
    controller = controller_of()
    limited = controller.step(
        observe(speed_limit=SpeedLimit(50.0, is_percentage=True)), controller.initial_memory()
    )
    assert limited.command[0] <= 0.13
    # At or above the nominal planar speed the message changes nothing.
    kept = controller.step(observe(speed_limit=SpeedLimit(0.3)), limited.memory)
    np.testing.assert_array_equal(kept.command, limited.command)
    assert controller.step(observe(), kept.memory).command[0] > 0.2


def test_start_in_an_obstacle_rejects_every_trajectory_and_says_why():
    costs = np.zeros((60, 60), dtype=np.uint8)
    costs[30, 30] = 253
    with pytest.raises(NoValidControl) as caught:
        step(controller_of(), costmap=Costmap(costs, -1.5, -1.5, 0.05))
    assert str(caught.value).endswith("No valid trajectories out of 419!")
    assert caught.value.details == {"BaseObstacle/Trajectory Hits Obstacle.": 419}


def test_total_below_zero_counts_as_none_and_the_error_says_so():
    # The last sample, at 1 rad/s, scores -1 * 1: less than any before it.
    block = {"penalty": 0.0, "theta_scale": -1.0}
    controller = controller_of(critics=["PreferForward"], PreferForward=block)
    with pytest.raises(
        NoValidControl, match=r"419 valid .*\(100% of 419\), .* below zero"
    ) as caught:
        step(controller)
    assert caught.value.details == {}


def test_failed_cycle_hands_on_the_memory_after_a_zero_command():
    controller = controller_of(critics=["Oscillation", "BaseObstacle"])
    memory = controller.initial_memory()
    banned = memory.critics[0].trends[0]._replace(sign=-1, negative_only=True)
    critics = (
        memory.critics[0]._replace(trends=(banned, *memory.critics[0].trends[1:])),
        None,
    )
    memory = memory._replace(plan_id=1, critics=critics)
    costmap = Costmap(np.full((60, 60), 254, dtype=np.uint8), -1.5, -1.5, 0.05)
    with pytest.raises(NoValidControl) as caught:
        controller.step(observe(costmap=costmap), memory)
    assert caught.value.memory.critics[0].trends[0] == banned
    # At x > 0 every sample moves forward or turns in place; the ban rejects the moving ones first.
    assert set(caught.value.details) == {
        "Oscillation/Trajectory is oscillating.",
        "BaseObstacle/Trajectory Hits Obstacle.",
    }
    with pytest.raises(NoValidControl) as caught:
        controller.step(observe(costmap=costmap, pose=np.array([0.1, 0.0, 0.0])), memory)
    assert not caught.value.memory.critics[0].trends[0].is_restricted


def test_no_admissible_sample_is_a_failure_too():
    with pytest.raises(NoValidControl, match=r"out of 0!$") as caught:
        step(controller_of(max_vel_x=0.0, max_vel_theta=0.0))
    assert caught.value.details == {}


def test_diagnostics_hold_the_whole_window_where_wanted():
    cheap = step(controller_of()).diagnostics
    assert set(cheap) == {"sample_count", "illegal_count", "best_total"}
    costs = np.zeros((60, 60), dtype=np.uint8)
    costs[:, 36] = 254
    world = {"costmap": Costmap(costs, -1.5, -1.5, 0.05), "pose": np.array([0.0, 0.0, 0.1])}
    decision = step(controller_of(wants_diagnostics=True), **world)
    full = decision.diagnostics
    count = full["sample_count"]
    assert 0 < full["illegal_count"] < count
    assert full["sampled_trajectories"].shape[0] == full["sampled_costs"].shape[0] == count
    assert full["critic_scores"].shape == (count, 7)
    best = int(np.nanargmin(full["sampled_costs"]))
    assert full["sampled_costs"][best] == np.float32(full["best_total"])
    np.testing.assert_array_equal(full["sampled_twists"][best], decision.command)
    weighted = full["critic_scores"][best] @ full["critic_scales"].astype(float)
    assert weighted == pytest.approx(full["best_total"], rel=1e-6)
    np.testing.assert_array_equal(full["sampled_is_legal"], np.isfinite(full["sampled_costs"]))
    np.testing.assert_array_equal(full["sampled_is_legal"], full["sampled_rejected_by"] == -1)
    np.testing.assert_array_equal(
        full["sampled_trajectories"][best, : len(full["predicted_trajectory"])],
        full["predicted_trajectory"],
    )
