"""Every parameter of harmony, away from its default: what it changes."""

from __future__ import annotations

import numpy as np
import pytest
from harmony_scenes import DISCS, arc, problem, straight
from test_harmony_controller import decide, seen, setup_for
from test_harmony_detour import DEAD_END

from drake_navbench.controller import CollisionAhead
from drake_navbench.controllers.harmony import Harmony, HarmonyParameters
from drake_navbench.controllers.harmony.interior_point import SolverSettings, solve
from drake_navbench.controllers.harmony.memory import HarmonyMemory
from drake_navbench.controllers.harmony.motion import ALPHA, ANGULAR_JERK, JERK, A, V, W
from drake_navbench.controllers.harmony.scene import make_start
from drake_navbench.controllers.harmony.terms import plan_cost
from drake_navbench.kernels.distance_field import distance_field, path_clearance
from drake_navbench.kernels.path_geometry import path_from_polyline

BEHIND = np.array([[0.0, 0.0, 0.0], [-0.6, 0.0, 0.0]])
BACKWARDS = {
    "path": BEHIND,
    "goal": (-0.6, 0.0, 0.0),
    "speed": 0.0,
    "weights": {"forward_preference": 0.0, "path_orientation": 0.0, "maximum_velocity": 0.0},
}
TURNED = {"start": (0.0, 0.0, 0.9), "speed": 0.2, "weights": {"path_orientation": 20.0}}
CURVE = {"path": arc(0.6, 3.0), "speed": 0.2, "weights": {"path_alignment": 40.0}}


def wheel_speed(separation_m):
    return lambda plan: np.abs(plan[:, V]) + 0.5 * separation_m * np.abs(plan[:, W])


def size_of(column):
    return lambda plan: np.abs(plan[:, column])


# Of each limit: a lower value, what then stays below it, and where it does not by itself.
LIMITS = {
    "max_vel_x": (0.25, size_of(V), {"speed": 0.1}),
    "max_vel_x_backwards": (0.05, lambda plan: -plan[:, V], BACKWARDS),
    "max_vel_theta": (0.3, size_of(W), TURNED),
    "acc_lim_x": (0.2, size_of(A), {"speed": 0.0, "weights": {"linear_jerk": 0.05}}),
    "acc_lim_theta": (0.4, size_of(ALPHA), TURNED),
    "jerk_lim_x": (0.5, size_of(JERK), {"speed": 0.0, "weights": {"linear_jerk": 0.05}}),
    "jerk_lim_theta": (1.5, size_of(ANGULAR_JERK), TURNED),
    "max_wheel_speed": (0.3, wheel_speed(0.5), {"speed": 0.1}),
    "max_lateral_acceleration": (0.05, lambda plan: np.abs(plan[:, V] * plan[:, W]), CURVE),
}


@pytest.mark.parametrize("name", LIMITS)
def test_a_limit_holds_in_plans(name):
    value, measure, scene = LIMITS[name]
    settings = SolverSettings(60, 1e-2, 1e-5, 1e-2)
    free = solve(*problem(**scene), settings)
    # Where it drives slower, it also takes longer to come to rest than the plan is long otherwise.
    bound = solve(*problem(**scene, **{name: value}), settings)
    assert bound.solved
    assert measure(free.plan).max() > 1.1 * value
    assert measure(bound.plan).max() < 1.02 * value


def test_wheels_farther_apart_leave_less_speed_in_a_turn():
    settings = SolverSettings(60, 1e-2, 1e-5, 1e-2)
    near, far = (
        solve(
            *problem(
                **CURVE, wheel_separation=one, max_wheel_speed=0.4, max_lateral_acceleration=1.0
            ),
            settings,
        ).plan
        for one in (0.3, 1.5)
    )
    assert wheel_speed(1.5)(near).max() > 0.45
    assert wheel_speed(1.5)(far).max() < 0.41


def test_more_clearance_is_kept_where_it_is_asked_for():
    box, settings = (1.2, 0.36, 1.6, 0.6), SolverSettings(60, 1e-2, 1e-5, 1e-2)
    gaps = []
    for asked in (0.0, 0.08):
        scene, guess = problem(boxes=[box], min_obstacle_dist=asked, weights={"costmap_cost": 0.0})
        plan = solve(scene, guess, settings).plan
        gaps.append(path_clearance(scene.field, DISCS, plan[:, :3].copy()).min())
    assert gaps[0] < 0.08
    # The program may miss a row by a hundredth.
    assert gaps[1] > 0.03 + 0.02 + 0.08 - 0.02


def test_a_share_of_limits_changes_the_cost():
    costs = [
        plan_cost(*problem(weights={"constraints": 1.0}, **given))
        for given in ({}, {"limit_share": 0.3})
    ]
    assert abs(costs[1] - costs[0]) > 1e-3 * costs[0]


def planned(*boxes, **parameters):
    return decide(*boxes, twist=(0.45, 0.0), parameters=HarmonyParameters(**parameters))


def before_a_box(**parameters):
    return planned((1.5, -0.05, 1.6, 0.05), **parameters)


def test_a_horizon_and_a_step_are_those_of_plans():
    assert planned(horizon=2.0, time_step=0.05).diagnostics["predicted_trajectory"].shape == (41, 3)


def test_the_gatekeeper_lets_no_plan_into_the_bound():
    # 4 cm ahead, with a bound of 10 cm and of 1 cm: plans keep less clearance where it is missing.
    near = (0.9, -0.5, 1.0, 0.5)
    accepted = [
        decide(
            near,
            parameters=HarmonyParameters(localization_error=bound_m, give_up_distance=0.0),
            twist=(0.1, 0.0),
        ).diagnostics["accepted"]
        for bound_m in (0.1, 0.01)
    ]
    assert accepted == ["stop", "plan"]


def test_it_gives_up_as_far_off_as_asked():
    closed = (1.25, -3.0, 1.35, 3.0)
    with pytest.raises(CollisionAhead):
        decide(closed)
    assert decide(closed, parameters=HarmonyParameters(give_up_distance=0.1)).command[0] > 0.0


@pytest.mark.parametrize("speed", [0.2, 0.0])
def test_it_backs_out_of_where_it_cannot_turn_only_if_it_may_drive_backwards(speed):
    controller = Harmony(HarmonyParameters(max_vel_x_backwards=speed), setup_for())
    now = seen(*DEAD_END, pose=(0.5, 0.0, 0.0))
    out = path_from_polyline(
        np.array([[0.5, 0.0], [-1.2, 0.0], [-1.2, 1.2], [2.2, 1.2], [2.2, 0.0]]), 0.05
    )
    found = controller._way_finder.find(
        now,
        HarmonyMemory(detour=out, is_trapped=True),
        make_start(now.pose, 0.0, 0.0),
        distance_field(now.costmap),
        1.5,
    )
    assert found.detour is not None
    assert found.way.backs_up is (speed > 0.0)


@pytest.mark.parametrize("values", [{"max_vel_x": 0.15}, {"horizon": 1.2}])
def test_a_slow_robot_sees_the_way_past_a_box(values):
    # Behind it there is room from 2.5 m on, where 0.15 m/s get in 17 s.
    box = (1.4, -0.1, 1.5, 0.1)
    assert decide(box, parameters=HarmonyParameters(**values), plan=straight(2.5)).command[0] >= 0.0
