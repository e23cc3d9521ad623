"""MPPI of the releases up to Kilted, with the arithmetic beside the numbers."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from mppi_scenes import BRINGUP, batch_of, costmap, observe, packed, round_robot, scene_of
from scenes import straight_plan

from drake_navbench.controller import ControllerError, InvalidPath, NoValidControl, SpeedLimit
from drake_navbench.controllers.mppi import ModelPredictivePathIntegral, MppiParameters
from drake_navbench.controllers.mppi.controller import straight_goal
from drake_navbench.controllers.mppi.critics.base import CriticContext
from drake_navbench.controllers.mppi.critics.batch import Scene
from drake_navbench.controllers.mppi.critics.registry import load_critics
from drake_navbench.controllers.mppi.memory import PlanState
from drake_navbench.controllers.mppi.motion_models import (
    VX,
    WZ,
    MotionModel,
    constrain_axis_freely,
    limit_curvature,
    limit_signed_curvature,
)
from drake_navbench.controllers.mppi.own_plan import OwnPlan, first_cusp_end
from drake_navbench.controllers.mppi.releases import Furthest
from drake_navbench.controllers.mppi.sequence_rules import SequenceRules, limits_of, smooth_in_place

OLDER = ("humble", "iron", "jazzy", "kilted")
F32 = np.float32


def critic_of(release, name, *, setup=None, steps=2, model=MotionModel.DIFF_DRIVE, **fields):
    """Returns a critic of a release, with `fields` in its block."""
    parameters = MppiParameters(
        nav2_release=release, critics=[name], time_steps=steps, **{name: fields}
    ).as_read()
    setup = setup or round_robot(inflation_cost_scaling_factor=3.0)
    limits = limits_of(parameters)
    context = CriticContext(setup, model, limits, 0.2, 0.05, steps, nav2_release=release)
    return load_critics(((name, parameters.critic(name)) for name in parameters.critics), context)[
        0
    ]


def see(plan):
    """Returns what a robot at the origin sees of a plan."""
    plan = np.array(plan, dtype=float)
    return replace(observe(), plan=plan, global_plan=plan, goal=plan[-1])


def cost_of(critic, batch):
    """Returns the cost of the one sample."""
    costs, _ = critic.score(batch)
    return float(costs[0])


def scene_to(goal, plan, **fields):
    """Returns a scene from which it is straight to a goal."""
    return replace(scene_of(plan), straight_goal=np.array(goal, dtype=float), **fields)


def test_goal_critics_ask_how_far_it_is_straight_to_the_goal():
    # A way of 2 m that ends beside the robot is near only if it is measured straight.
    out = np.array(straight_plan(1.0), float)
    back = out[::-1] + np.array([0.0, 0.1, 0.0])
    way = np.concatenate([out, back])
    near = batch_of(scene_to((0.0, 0.1, 0.0), way), x=[0.0, 0.3])
    along = batch_of(scene_of(way), x=[0.0, 0.3])
    assert cost_of(critic_of("jazzy", "GoalCritic"), near) > 0.0
    assert cost_of(critic_of("lyrical", "GoalCritic"), along) == 0.0
    # Distances of the columns to (0, 0.1): 0.1 and sqrt(0.09 + 0.01); the mean times 5.
    expected = 5.0 * (0.1 + math.sqrt(0.1)) / 2.0
    assert cost_of(critic_of("jazzy", "GoalCritic"), near) == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize(
    ("release", "fields", "goal"),
    [
        ("humble", {}, (1.4, 0.0, 0.0)),
        ("iron", {}, (1.4, 0.0, 0.0)),
        ("jazzy", {}, (9.0, 1.0, 0.0)),
        ("kilted", {}, (9.0, 1.0, 2.0)),
        ("kilted", {"enforce_path_inversion": True}, (1.4, 0.0, 0.0)),
    ],
)
def test_which_goal_that_is(release, fields, goal):
    parameters = MppiParameters(nav2_release=release, **fields)
    observation = replace(see(straight_plan(1.4)), goal=np.array([9.0, 1.0, 2.0]))
    assert straight_goal(parameters, observation, observation.plan) == pytest.approx(goal)


def test_how_the_furthest_point_is_looked_for():
    # Out along x = 0 .. 0.5 and back at y = 0.02; the first sample ends nearest to 5, the second
    # to 3, or, of those from 5 on, to 7 on the way back.
    out = [[0.1 * k, 0.0, 0.0] for k in range(6)]
    back = [[0.4 - 0.1 * k, 0.02, math.pi] for k in range(5)]
    scene = scene_of(out + back)
    poses = np.zeros((2, 2, 3))
    poses[0, 1, :2], poses[1, 1, :2] = (0.5, 0.0), (0.3, 0.0)
    found = {
        furthest: packed(replace(scene, furthest=furthest), poses, np.zeros_like(poses)).furthest
        for furthest in Furthest
    }
    assert found == {Furthest.BY_LENGTH: 5, Furthest.ONWARD: 7, Furthest.ALL: 5}


@pytest.mark.parametrize("release", OLDER)
def test_the_constraint_critic_limits_the_norm(release):
    # sqrt(0.5^2 + 0.5^2) = 0.707107: 0.8 m/s are 0.092893 too many, for one step of 0.05 s.
    critic = critic_of(release, "ConstraintCritic")
    batch = batch_of(scene_of(straight_plan(1.0)), x=[0.0, 0.1], vx=[0.7, 0.8])
    assert cost_of(critic, batch) == pytest.approx(4.0 * 0.05 * 0.092893, rel=1e-4)


@pytest.mark.parametrize("release", [*OLDER, "lyrical"])
def test_up_to_jazzy_a_car_that_stands_still_breaks_no_turning_radius(release):
    # 4.0 1/m * 0.05 s * (0.2 m, the least radius, - 0.05 m, driven at 0.1 m/s and 2 rad/s).
    critic = critic_of(release, "ConstraintCritic", model=MotionModel.ACKERMANN)
    columns = {"x": [0.0, 0.0, 0.1], "vx": [0.0, 0.1, 0.1], "wz": [0.0, 0.0, 2.0]}
    batch = batch_of(scene_of(straight_plan(1.0)), **columns)
    # In Kilted 0 / 0 is the cost.
    standing = {"kilted": math.nan, "lyrical": 4.0 * 0.05 * 0.2}.get(release, 0.0)
    wanted = 4.0 * 0.05 * 0.15 + standing
    assert cost_of(critic, batch) == pytest.approx(wanted, rel=1e-5, nan_ok=True)


def test_a_standing_car_of_kilted_is_sent_all_it_can():
    # No control is a number, and the upper limits stand for them: 0.5 m/s, and 0.5 / 0.5 rad/s,
    # less in the first columns by the filter: the original of 1.4.2 commanded 0.43073595 m/s.
    controller = controller_of(
        "kilted", motion_model="Ackermann", AckermannConstraints={"min_turning_r": 0.5}
    )
    command = controller.step(see(straight_plan(1.4)), controller.initial_memory()).command
    assert command[0] == pytest.approx(0.43073595, rel=1e-6)
    assert command[1] == pytest.approx(command[0] / 0.5, rel=1e-6)


def test_a_base_that_moves_sideways_is_limited_by_its_speed():
    critic = critic_of("jazzy", "ConstraintCritic", model=MotionModel.OMNI)
    # A speed of 1 m/s, 0.292893 too many.
    batch = batch_of(scene_of(straight_plan(1.0)), x=[0.0, 0.1], vx=[0.0, 0.6], vy=[0.0, 0.8])
    assert cost_of(critic, batch) == pytest.approx(4.0 * 0.05 * 0.292893, rel=1e-4)


def obstacle_batch():
    """Two columns, the first on a cell of 252."""
    costs = np.zeros((60, 60), np.uint8)
    costs[30, 30] = 252
    scene = replace(scene_of(straight_plan(1.45), costs=costs), straight_goal=np.array([9.0, 0, 0]))
    return batch_of(scene, x=[0.02, 1.0], y=0.02)


@pytest.mark.parametrize(
    ("release", "radius", "factor"), [("humble", 0.55, 10.0), ("iron", 0.7, 3)]
)
def test_up_to_iron_repulsion_is_what_lies_beyond_the_margin(release, radius, factor):
    # A cell of 100: d = ln(253 / 100) / factor; beyond the margin of 0.1 m only for the factor 3.
    costs = np.zeros((60, 60), np.uint8)
    costs[30, 30] = 100
    scene = replace(scene_of(straight_plan(1.45), costs=costs), straight_goal=np.array([9.0, 0, 0]))
    distance = math.log(253 / 100) / factor
    expected = 20 * (0.1 - distance) if distance < 0.1 else 1.5 * (radius - distance) / 2.0
    critic = critic_of(release, "ObstaclesCritic")
    assert cost_of(critic, batch_of(scene, x=[0.02, 1.0], y=0.02)) == pytest.approx(
        expected, rel=1e-4
    )


def test_since_jazzy_the_least_repulsion_counts_as_none():
    # d = ln(253 / 252) / 3 = 0.00132: within the margin, 20 * 0.09868, and nothing else.
    cost = cost_of(critic_of("jazzy", "ObstaclesCritic"), obstacle_batch())
    assert cost == pytest.approx(20 * 0.09868, rel=1e-4)
    # The same in Iron: within the margin there is no repulsion.
    assert cost_of(critic_of("iron", "ObstaclesCritic"), obstacle_batch()) == pytest.approx(cost)


def test_a_collision_costs_less_up_to_iron():
    costs = np.full((60, 60), 254, np.uint8)
    scene = replace(scene_of(straight_plan(1.45), costs=costs), straight_goal=np.array([9.0, 0, 0]))
    batch = batch_of(scene, x=[0.0, 0.1])
    assert cost_of(critic_of("iron", "ObstaclesCritic"), batch) == pytest.approx(20e4)
    assert cost_of(critic_of("jazzy", "ObstaclesCritic"), batch) == pytest.approx(20e5)
    own = critic_of("iron", "ObstaclesCritic", collision_cost=5.0)
    assert cost_of(own, batch) == pytest.approx(100.0)


@pytest.mark.parametrize(
    ("release", "columns"), [("iron", 3), ("jazzy", 1), ("kilted", 2), ("lyrical", 2)]
)
def test_which_columns_the_cost_critic_looks_at(release, columns):
    # Three columns on 100: all, or every second one, of which Jazzy leaves out the last.
    costs = np.full((60, 60), 100, np.uint8)
    scene = replace(scene_of(straight_plan(1.45), costs=costs), straight_goal=np.array([9.0, 0, 0]))
    if release == "lyrical":
        scene = replace(scene, straight_goal=None)
    critic = critic_of(release, "CostCritic", steps=3)
    assert critic.last_column == {"iron": 2, "jazzy": 0}.get(release, 2)
    # The mean is the same, whatever their number.
    assert cost_of(critic, batch_of(scene, x=[0.0, 0.1, 0.2])) == pytest.approx(381.0 / 254.0)
    assert critic.weight == pytest.approx(3.81 / 254.0 / columns)


def test_up_to_iron_the_angle_is_the_mean_of_all_columns():
    # To a point 1 m to the left: the headings 0 and pi / 2 are pi / 2 and 0 off; mean pi / 4.
    scene = replace(
        scene_of([[0.0, 0.0, 0.0], [0.0, 1.0, 0.0]]), straight_goal=np.array([9.0, 0, 0])
    )
    batch = batch_of(scene, x=[0.0, 0.0], yaw=[0.0, math.pi / 2], furthest=1)
    iron = critic_of("iron", "PathAngleCritic", offset_from_furthest=0)
    assert cost_of(iron, batch) == pytest.approx(2.0 * math.pi / 4, rel=1e-5)
    jazzy = critic_of("jazzy", "PathAngleCritic", offset_from_furthest=0)
    assert cost_of(jazzy, batch) == pytest.approx(0.0, abs=1e-5)


def test_humbles_preference_is_a_mode():
    def mode(release, **fields):
        return critic_of(release, "PathAngleCritic", **fields).mode

    assert [mode("humble"), mode("humble", forward_preference=False)] == [0, 1]
    # Each release reads its own parameter only.
    assert mode("humble", mode=2) == 0
    assert mode("iron", mode=2, forward_preference=False) == 2


def test_up_to_iron_a_sample_aligns_with_the_first_point_that_is_as_far():
    # Points each 0.1 m; columns at 0, 0.12, 0.16, 0.37 and 0.6 m, 0.05 m beside them.
    # 0.12: the first as far is 2, but 1 is nearer. 0.16: from 1 on it is 2. 0.37: 4. 0.6: beyond
    # the last of five: the next one, 5. Distances 0.05385, 0.06403, 0.05831, 0.11180: mean 0.0720.
    plan = [[0.1 * k, 0.0, 0.0] for k in range(7)]
    scene = replace(scene_of(plan), straight_goal=np.array([9.0, 0, 0]))
    fields = {"trajectory_point_step": 1, "offset_from_furthest": 1}
    batch = batch_of(scene, x=[0.0, 0.12, 0.16, 0.37, 0.6], y=0.05, furthest=5)
    iron = critic_of("iron", "PathAlignCritic", steps=5, **fields)
    mean = (math.hypot(0.02, 0.05) + math.hypot(0.04, 0.05) + math.hypot(0.03, 0.05)) / 4
    mean += math.hypot(0.1, 0.05) / 4
    assert cost_of(iron, batch) == pytest.approx(10.0 * mean, rel=1e-4)
    # Where the next one is the path's last, it does not count.
    beyond = batch_of(scene, x=[0.0, 0.12, 0.16, 0.37, 0.9], y=0.05, furthest=6)
    mean = (math.hypot(0.02, 0.05) + math.hypot(0.04, 0.05) + math.hypot(0.03, 0.05)) / 3
    assert cost_of(iron, beyond) == pytest.approx(10.0 * mean, rel=1e-4)
    # A sample that stands still has its own point found first, and goes back to the plan's begin.
    still = batch_of(scene, x=[0.3, 0.3, 0.3], furthest=5)
    critic = critic_of("iron", "PathAlignCritic", steps=3, **fields)
    assert cost_of(critic, still) == pytest.approx(10.0 * 0.3, rel=1e-4)


LEGACY = {"trajectory_point_step": 2, "offset_from_furthest": 1}


def legacy_scene(**fields):
    """Returns a scene with seven path points each 0.1 m, far from the goal."""
    plan = [[0.1 * k, 0.0, 0.2 * k] for k in range(7)]
    return replace(scene_of(plan, **fields), straight_goal=np.array([9.0, 0, 0]))


def test_the_legacy_critic_takes_the_closest_point_whatever_the_way_there():
    # Columns 2 and 4 count: (0.12, 0.05) is 0.02, 0.05 from point 1; (0.6, 0.05) is nearest to the
    # last but two, point 4 at 0.4 m. Two of them, as 5 // 2, divide the sum.
    critic = critic_of("humble", "PathAlignLegacyCritic", steps=5, **LEGACY)
    batch = batch_of(legacy_scene(), x=[0.0, 9.0, 0.12, 9.0, 0.6], y=0.05, furthest=5)
    mean = (math.hypot(0.02, 0.05) + math.hypot(0.2, 0.05)) / 2.0
    assert cost_of(critic, batch) == pytest.approx(10.0 * mean, rel=1e-4)
    # With headings (0.12, 0.05) at 0.4 rad is nearest to point 2: 0.08, 0.05 and 0 rad; the end to
    # point 3: 0.3, 0.05 and -0.2 rad, which is 0.3640, before point 4 with 0.4 rad, 0.4500.
    turned = critic_of(
        "humble", "PathAlignLegacyCritic", steps=5, **LEGACY, use_path_orientations=True
    )
    batch = batch_of(legacy_scene(), x=[0.0, 9.0, 0.12, 9.0, 0.6], y=0.05, yaw=0.4, furthest=5)
    mean = (math.hypot(0.08, 0.05) + math.hypot(0.3, 0.05, 0.2)) / 2.0
    assert cost_of(turned, batch) == pytest.approx(10.0 * mean, rel=1e-4)


def test_columns_nearest_to_the_first_point_or_an_occupied_one_do_not_count():
    critic = critic_of("iron", "PathAlignLegacyCritic", steps=5, **LEGACY)
    still = batch_of(legacy_scene(), x=[0.0, 0.0, 0.04, 0.0, 0.02], y=0.05, furthest=5)
    assert cost_of(critic, still) == 0.0
    costs = np.zeros((60, 60), np.uint8)
    costs[:, 32] = 254  # x in [0.10, 0.15): point 1 alone
    scene = legacy_scene(costs=costs)
    batch = batch_of(scene, x=[0.0, 9.0, 0.12, 9.0, 0.3], y=0.05, furthest=5)
    assert cost_of(critic, batch) == pytest.approx(10.0 * 0.05 / 2.0, rel=1e-4)


def test_the_legacy_critic_is_off_before_it_has_a_bearing():
    critic = critic_of(
        "humble", "PathAlignLegacyCritic", steps=3, **{**LEGACY, "offset_from_furthest": 4}
    )
    x = {"x": [0.0, 0.2, 0.3], "y": 0.1}
    assert cost_of(critic, batch_of(legacy_scene(), **x, furthest=3)) == 0.0
    assert cost_of(critic, batch_of(legacy_scene(), **x, furthest=4)) > 0.0


def test_how_a_sequence_obeys_the_limits():
    # Speeds to 0.5; from the first column on steps of at most 0.15 up and 0.3 down.
    controls = np.array([0.9, 0.1, 0.4, -0.2], F32)
    constrain_axis_freely(controls, F32(-0.35), F32(0.5), F32(0.15), F32(-0.3))
    assert controls == pytest.approx([0.5, 0.2, 0.35, 0.05])
    # Standing is like driving backwards: 0.3 up, 0.15 down.
    controls = np.array([0.0, 0.4, 0.0], F32)
    constrain_axis_freely(controls, F32(-0.35), F32(0.5), F32(0.15), F32(-0.3))
    assert controls == pytest.approx([0.0, 0.3, 0.0])


def test_iron_turns_a_car_the_other_way_while_it_drives_backwards():
    tight = np.array([[-0.2, 0.2, 0.0], [0.0] * 3, [1.0, 1.0, 0.0]], F32)
    iron, humble = tight.copy(), tight.copy()
    limit_signed_curvature(iron, F32(0.4))
    limit_curvature(humble, F32(0.4))
    assert iron[2] == pytest.approx([-0.5, 0.5, 0.0])
    assert humble[2] == pytest.approx([0.5, 0.5, 0.0])


@pytest.mark.parametrize("release", OLDER)
def test_samples_start_from_the_measured_velocity(release):
    parameters = MppiParameters(nav2_release=release, open_loop=True).as_read()
    rules = SequenceRules(parameters, MotionModel.DIFF_DRIVE, 0.05)
    start = rules.initial_speed(np.array([0.3, 0.0, 0.1]), np.array([0.5, 0.0, 0.2]))
    # Only Jazzy can start from the last command.
    assert start[VX] == (0.5 if release == "jazzy" else 0.3)
    rise, _ = rules.rates(0.05)
    assert (rise[WZ] == np.inf) == (release in ("humble", "iron"))


def test_the_filter_reads_what_it_has_written():
    controls = np.ones((3, 30), F32)
    smoothed = smooth_in_place(controls, np.zeros((3, 4), F32))
    # Of the history of zeros: (59 + 54 + 39 + 14 - 21) / 231 = 145 / 231, then with that one
    # (54 * 145 / 231 + 145) / 231.
    assert smoothed[0, 0] == pytest.approx(145 / 231)
    assert smoothed[0, 1] == pytest.approx((54 * 145 / 231 + 145) / 231)
    # The fifth from the end is left as it is.
    controls[:, 25] = 7.0
    assert smooth_in_place(controls, np.zeros((3, 4), F32))[0, 25] == 7.0
    assert smooth_in_place(controls[:, :20], np.zeros((3, 4), F32))[0, 0] == 1.0


def cut(release, plan, pose=(0.0, 0.0, 0.0), state=None, plan_id=1, **fields):
    """Returns the local plan's first and last x, and the state after it."""
    own = OwnPlan(MppiParameters(nav2_release=release, **fields))
    plan = np.array(plan, dtype=float)
    observation = replace(
        see(plan), pose=np.array(pose), global_plan=plan, plan_id=plan_id, costmap=costmap()
    )
    poses, state = own.cut(observation, state or PlanState())
    return poses[0, 0], poses[-1, 0], state


def test_the_plan_is_one_and_a_half_metres_long_and_ends_with_the_map():
    plan = [[0.25 * k - 1.0, 0.0, 0.0] for k in range(20)]
    assert cut("jazzy", plan, (-0.75, 0.0, 0.0))[:2] == (-0.75, 0.75)
    assert cut("jazzy", plan, (-0.75, 0.0, 0.0), prune_distance=0.5)[:2] == (-0.75, -0.25)
    # The map ends at 1.5 m.
    assert cut("jazzy", plan)[:2] == (0.0, 1.25)
    # The closest pose may be the last one.
    assert cut("jazzy", plan[:5])[:2] == (0.0, 0.0)


def test_where_nothing_of_the_plan_is_on_the_map_its_passed_part_is_dropped_all_the_same():
    plan = np.array([[4.0, 0.0, 0.0], [3.0, 0.0, 0.0], [3.0, 1.0, 0.0]])
    own = OwnPlan(MppiParameters(nav2_release="jazzy"))
    poses, state = own.cut(replace(see(plan), costmap=costmap()), PlanState())
    assert (len(poses), state.begin) == (0, 1)
    for release in OLDER:
        driver = controller_of(release)
        with pytest.raises(ControllerError, match="0 poses") as failure:
            driver.step(replace(see(plan), costmap=costmap()), driver.initial_memory())
        assert failure.value.memory.plan.begin == 1
        # Humble has no such exception.
        assert isinstance(failure.value, InvalidPath) == (release != "humble")


def test_of_equally_close_poses_humble_takes_the_first():
    plan = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]
    pose = (0.5, 0.0, 0.0)
    assert [cut(release, plan, pose)[0] for release in ("humble", "iron")] == [0.0, 1.0]


def test_a_cusp_is_followed_to_its_end_first():
    there = [[0.25 * k, 0.0, 0.0] for k in range(4)]
    plan = [*there, *[[x, 0.0, 0.0] for x in (0.5, 0.25, 0.0, -0.25)]]
    assert first_cusp_end(np.array(plan), 0) == 4
    assert first_cusp_end(np.array(plan), 4) == 8
    fields = {"enforce_path_inversion": True}
    first, last, state = cut("kilted", plan, **fields)
    assert (first, last, state.end) == (0.0, 0.75, 4)
    # Arrived, within 0.2 m and 0.4 rad, it goes on with the next cycle.
    first, last, state = cut("kilted", plan, (0.7, 0.0, 0.0), state, **fields)
    assert (last, state.begin, state.end) == (0.75, 4, 8)
    assert cut("kilted", plan, (0.7, 0.0, 0.0), state, **fields)[1] == -0.25
    # A new plan begins anew.
    assert cut("kilted", plan, (0.7, 0.0, 0.0), state, plan_id=2, **fields)[2].plan_id == 2


def controller_of(release, **fields):
    values = {**BRINGUP, "batch_size": 400, "nav2_release": release, **fields}
    return ModelPredictivePathIntegral(MppiParameters(**values), round_robot())


@pytest.mark.parametrize("release", OLDER)
def test_it_drives_along_the_plan(release):
    controller = controller_of(release)
    observation = see(straight_plan(1.4))
    memory = controller.initial_memory()
    for _ in range(20):
        decision = controller.step(observation, memory)
        memory = decision.memory
    assert decision.command[0] > 0.1
    assert abs(decision.command[1]) < 0.5
    assert memory.plan.plan_id == observation.plan_id


@pytest.mark.parametrize("release", OLDER)
def test_only_humble_ends_the_task_at_once_where_all_samples_collide(release):
    costs = np.full((60, 60), 254, np.uint8)
    observation = replace(see(straight_plan(1.4)), costmap=costmap(costs))
    controller = controller_of(release)
    with pytest.raises(ControllerError, match="every sample collides") as raised:
        controller.step(observation, controller.initial_memory())
    assert isinstance(raised.value, NoValidControl) == (release != "humble")


def test_what_a_release_does_not_read_changes_nothing():
    values = {"model_delay_vx": 0.2, "ax_max": 0.1, "TrajectoryValidator": {"plugin": "x"}}
    unread = ["model_delay_vx", "ax_max", "TrajectoryValidator", "TrajectoryValidator.plugin"]
    assert MppiParameters.keys_not_read({"nav2_release": "humble", **values}) == unread
    assert MppiParameters.keys_not_read({"nav2_release": "lyrical", **values}) == []
    read = MppiParameters(nav2_release="humble", model_delay_vx=0.2, ax_max=0.1).as_read()
    assert (read.model_delay_vx, read.ax_max) == (0.0, 3.0)
    scene = Scene.from_plan(straight_plan(1.0), pose=(0.0, 0.0, 0.0), costmap=costmap())
    assert scene.way_left == scene.path_length


def in_a_wall(**values):
    """Returns an observation in which every sample collides."""
    costs = np.full((60, 60), 254, np.uint8)
    return replace(see(straight_plan(1.4)), costmap=costmap(costs), **values)


@pytest.mark.parametrize("release", [*OLDER, "lyrical"])
def test_up_to_iron_and_in_kilted_a_failure_lifts_the_speed_limit_until_another_is_told(release):
    controller = controller_of(release)
    # 1% of 0.5 m/s.
    limited = {"speed_limit": SpeedLimit(1.0, is_percentage=True)}
    with pytest.raises(ControllerError) as raised:
        controller.step(in_a_wall(**limited), controller.initial_memory())
    memory = raised.value.memory
    free = replace(see(straight_plan(1.4)), **limited)
    command, after = controller.step(free, memory)[:2]
    is_lifted = release in {"humble", "iron", "kilted"}
    assert (command[0] > 0.00501) == is_lifted
    assert after.limit_is_lifted == is_lifted
    other = replace(free, speed_limit=SpeedLimit(30.0, is_percentage=True))
    assert not controller.step(other, after).memory.limit_is_lifted


def test_between_two_tasks_iron_lifts_the_speed_limit_and_humble_keeps_all():
    observation = replace(see(straight_plan(1.4)), speed_limit=SpeedLimit(0.2), time_s=3.0)
    for release in (*OLDER, "lyrical"):
        controller = controller_of(release)
        memory = controller.step(observation, controller.initial_memory()).memory
        after = controller.next_memory(memory)
        assert after.limit_is_lifted == (release == "iron")
        assert after.limit == SpeedLimit(0.2)
        assert (after.sampler is memory.sampler) == (release == "humble")


def test_humble_resets_the_optimizer_after_a_pause_longer_than_reset_period():
    controller = controller_of("humble", reset_period=0.5)
    observation = replace(see(straight_plan(1.4)), speed_limit=SpeedLimit(0.2), time_s=3.0)
    memory = controller.step(observation, controller.initial_memory()).memory
    for pause_s, resets in ((0.5, 0), (0.6, 1)):
        later = replace(observation, time_s=3.0 + pause_s)
        after = controller.step(later, controller.next_memory(memory)).memory
        assert after.sampler.reset_count == resets
        assert after.limit_is_lifted == bool(resets)
        assert after.driven_at_s == 3.0 + pause_s


def test_humble_resets_the_optimizer_in_every_cycle_where_reset_period_is_negative():
    controller = controller_of("humble", reset_period=-1.0)
    observation = replace(see(straight_plan(1.4)), time_s=3.0)
    memory = controller.step(observation, controller.initial_memory()).memory
    for cycle in (1, 2):
        memory = controller.step(replace(observation, time_s=3.0 + 0.1 * cycle), memory).memory
        assert memory.sampler.reset_count == cycle
