"""The Graceful Controller of the releases up to Kilted, with the arithmetic beside the numbers.

Defaults: Humble aims 0.6 m ahead, Jazzy and Kilted up to 1 m along the plan; 0.5 m/s, slower within
1.5 m of the target.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from controller_scenes import command_of, make_costmap, make_setup, observe, turned_plan

from drake_navbench.controller import ControllerError, InvalidPath, NoValidControl
from drake_navbench.controllers.graceful import Graceful, GracefulParameters
from drake_navbench.kernels.grid import LETHAL

AHEAD = turned_plan(0.0)
WALL = [(1.5, -1.0 + 0.05 * i, LETHAL) for i in range(40)]
LATER = ("jazzy", "kilted")
OLDER = ("humble", *LATER)


def make_graceful(release, **parameters):
    model = GracefulParameters.model_validate({"nav2_release": release, **parameters})
    return Graceful(model, make_setup())


def error_of(controller, observation):
    with pytest.raises(ControllerError) as caught:
        controller.step(observation, controller.initial_memory())
    return caught.value


@pytest.mark.parametrize(("release", "v"), [("humble", 0.2), ("jazzy", 1.0 / 3.0)])
def test_the_target_is_a_pose_of_the_plan(release, v):
    # 0.5 * 0.6 / 1.5 and 0.5 * 1 / 1.5; poses are 0.05 m apart.
    assert command_of(make_graceful(release), observe(AHEAD)) == (pytest.approx(v), 0.0)


def test_humble_aims_at_a_straight_distance_the_others_along_the_plan():
    # There and back again: 0.4 m away, 0.8 m along the plan from its start.
    hook = np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.0], [0.6, 0.0, 0.0], [0.4, 0.0, 0.0]])
    straight = {"initial_rotation": False, "prefer_final_rotation": False}
    assert command_of(make_graceful("humble", initial_rotation=False), observe(hook))[
        0
    ] == pytest.approx(0.2)
    v = command_of(make_graceful("jazzy", **straight), observe(hook))[0]
    assert v == pytest.approx(0.5 * 0.4 / 1.5)


@pytest.mark.parametrize("release", LATER)
def test_what_is_nearer_than_the_least_lookahead_is_no_target(release):
    near = make_costmap(cells=[(x - 0.45, y, cost) for x, y, cost in WALL])
    seen = observe(AHEAD, costmap=near)
    # Free are the first 0.2 m; a target 0.3 m ahead is driven to for 18 steps.
    assert command_of(make_graceful(release, min_lookahead=0.1), seen)[0] > 0.0
    assert isinstance(error_of(make_graceful(release, min_lookahead=0.5), seen), NoValidControl)


def test_humble_has_no_other_target_where_the_way_is_blocked():
    near = make_costmap(cells=[(x - 0.4, y, cost) for x, y, cost in WALL])
    seen = observe(AHEAD, costmap=near)
    assert isinstance(error_of(make_graceful("humble"), seen), NoValidControl)
    assert command_of(make_graceful("jazzy"), seen)[0] > 0.0


def test_humble_looks_at_the_drive_also_where_it_turns_in_place():
    side = turned_plan(1.2)
    assert command_of(make_graceful("humble"), observe(side)) == (0.0, pytest.approx(0.6))
    ahead = [(0.7, -0.2 + 0.05 * i, LETHAL) for i in range(10)]
    seen = observe(side, costmap=make_costmap(cells=ahead))
    assert command_of(make_graceful("humble"), seen) == "NoValidControl"


@pytest.mark.parametrize(("release", "w"), [("humble", 0.05), ("jazzy", 0.25)])
def test_near_the_end_once_it_turns_until_the_next_plan(release, w):
    graceful = make_graceful(release)
    plan = turned_plan(0.0, 0.2)
    plan[-1, 2] = 0.1
    arrived = graceful.step(observe(plan), graceful.initial_memory())
    assert arrived.command.tolist() == [0.0, pytest.approx(w)]
    # Pushed back by half a metre it goes on turning; another plan it drives along.
    away = {"pose": (-0.5, 0.0, 0.0)}
    still = graceful.step(observe(plan, **away), arrived.memory)
    assert still.command.tolist() == [0.0, pytest.approx(w)]
    other = observe(turned_plan(0.0) + np.array([-0.5, 0.0, 0.0]), plan_id=2, **away)
    assert graceful.step(other, still.memory).command[0] > 0.0


def test_only_lyrical_brakes_within_a_limit_and_widens_the_outline():
    # sqrt(2 * 1 m * 0.02 m/s^2) = 0.2 m/s.
    assert command_of(make_graceful("lyrical", deceleration_max=0.02), observe(AHEAD))[
        0
    ] == pytest.approx(0.2)
    limited = make_graceful("kilted", deceleration_max=0.02, footprint_scaling_linear_vel=0.0)
    assert command_of(limited, observe(AHEAD))[0] == pytest.approx(1.0 / 3.0)


@pytest.mark.parametrize(("release", "is_blind"), [("jazzy", False), ("kilted", True)])
def test_collisions_are_looked_for_whatever_jazzy_is_told(release, is_blind):
    near = [(x - 0.65, y, cost) for x, y, cost in WALL]
    graceful = make_graceful(release, use_collision_detection=False)
    command = command_of(graceful, observe(AHEAD, costmap=make_costmap(cells=near)))
    assert (command != "NoValidControl") is is_blind


@pytest.mark.parametrize("release", OLDER)
def test_of_the_whole_plan_what_was_passed_is_not_looked_at_again(release):
    loop = np.concatenate(
        [turned_plan(0.0, 1.0), turned_plan(0.0, 1.0)[::-1] + np.array([0.0, 0.5, 0.0])]
    )
    graceful = make_graceful(release, max_robot_pose_search_dist=0.6)
    first = graceful.step(observe(loop, pose=(0.5, 0.0, 0.0)), graceful.initial_memory())
    assert first.memory.plan_begin == 10
    # Nearer to the way back, which lies farther along the plan than is searched.
    again = observe(loop, pose=(0.5, 0.3, 0.0))
    assert graceful.step(again, first.memory).memory.plan_begin == 10


def test_what_humble_throws_the_server_is_patient_with():
    empty = observe(np.empty((0, 3)))
    assert isinstance(error_of(make_graceful("humble"), empty), NoValidControl)
    assert isinstance(error_of(make_graceful("jazzy"), empty), InvalidPath)
    beyond = observe(AHEAD + np.array([5.0, 0.0, 0.0]))
    assert isinstance(error_of(make_graceful("jazzy"), beyond), InvalidPath)


def test_defaults_and_names_are_those_of_the_release():
    humble = GracefulParameters.model_validate({"nav2_release": "humble", "beta": 0.7})
    assert (humble.k_phi, humble.k_delta, humble.beta) == (3.0, 2.0, 0.7)
    assert GracefulParameters().k_phi == 2.0
    given = {"max_lookahead": 1.0, "motion_target_dist": 0.6, "min_lookahead": 0.2}
    assert GracefulParameters.keys_not_read({**given, "nav2_release": "humble"}) == [
        "max_lookahead",
        "min_lookahead",
    ]
    assert GracefulParameters.keys_not_read(given) == ["motion_target_dist"]
    assert GracefulParameters.is_without_effect("min_lookahead")
    assert not GracefulParameters.is_without_effect("min_lookahead", {"nav2_release": "jazzy"})


def test_backwards_the_headings_are_turned_round():
    behind = turned_plan(math.pi)
    for release, v in (("humble", -0.2), ("kilted", -1.0 / 3.0)):
        backing = make_graceful(release, allow_backward=True, initial_rotation=False)
        command = command_of(backing, observe(behind))
        assert command[0] == pytest.approx(v)
        assert math.isclose(command[1], 0.0, abs_tol=1e-6)
