"""The environment of Gymnasium: the trial's robot and world, stepped from outside."""

from __future__ import annotations

import gc
import math
import resource
import warnings
import weakref

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from hypothesis import given, settings
from hypothesis import strategies as st
from stub_controller import StubPreset

import drake_navbench.studies.gymnasium  # noqa: F401
from drake_navbench.controller import Decision
from drake_navbench.errors import InputError
from drake_navbench.inputs.robot import load_robot, overridden
from drake_navbench.inputs.scenario import Scenario, load_scenario
from drake_navbench.kernels.swept_contact import clearance_at, covers
from drake_navbench.studies.gymnasium.environment import NavigationEnvironment
from drake_navbench.studies.gymnasium.tasks import RandomTasks, random_task
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.trial.timing import CONTROLLER_OFFSET_S
from drake_navbench.trial.trial import simulate

ID = "drake_navbench/Navigation-v0"
AHEAD = np.array([0.5, 0.0], dtype=np.float32)
# Physical units are what a controller commands; RescaleAction makes them from -1 to 1.
KNOWN_REMARK = "we recommend using a symmetric and normalized space"


@pytest.fixture(scope="module")
def environment():
    """The scenario `one_obstacle`, whose start varies and whose localization is noisy."""
    return NavigationEnvironment("one_obstacle")


def wall_ahead(distance_m: float) -> Scenario:
    wall = {"type": "box", "min": [distance_m, -1.0], "max": [distance_m + 0.2, 1.0]}
    return Scenario(
        name="wall",
        description="a wall",
        world={"obstacles": [wall]},
        goal=(distance_m + 2.0, 0.0, 0.0),
        timeout_s=30.0,
    )


def way(metres: float) -> Scenario:
    return Scenario(name="way", description="ahead", goal=(metres, 0.0, 0.0), timeout_s=8.0)


def driven(environment: NavigationEnvironment, seed: int | None, steps: int = 15) -> list[bytes]:
    """The bytes of everything that an episode shows, under commands that are always the same."""
    seen, _ = environment.reset(seed=seed)
    shown = [b"".join(seen[key].tobytes() for key in sorted(seen))]
    for step in range(steps):
        action = np.array([0.4, math.sin(0.3 * step)], dtype=np.float32)
        seen, reward, terminated, truncated, _ = environment.step(action)
        shown.append(b"".join(seen[key].tobytes() for key in sorted(seen)))
        shown.append(np.array([reward, terminated, truncated]).tobytes())
    return shown


def test_it_passes_the_checker_of_gymnasium():
    with warnings.catch_warnings(record=True) as remarks:
        warnings.simplefilter("always")
        made = gymnasium.make(ID, scenario="one_obstacle")
        check_env(made.unwrapped)
    told = [str(remark.message) for remark in remarks if issubclass(remark.category, UserWarning)]
    assert all(KNOWN_REMARK in remark for remark in told), told


def test_it_shows_the_scan_the_goal_and_the_speed_in_the_robots_frame():
    scenario = wall_ahead(2.0).model_copy(update={"start": (0.0, 0.0, 0.5 * math.pi)})
    robot = overridden(load_robot("wheelchair"), {"localization": {"xy_std_m": 0.0}}, "test")
    robot = overridden(robot, {"localization": {"yaw_std_rad": 0.0}}, "test")
    environment = NavigationEnvironment(scenario, robot)
    seen, info = environment.reset(seed=1)
    assert info == {"seed": 1}
    # The wall, 2 m to the east, lies to the right of a robot that looks north.
    beam = round(seen["lidar"].size / 4)
    assert seen["lidar"][beam] == pytest.approx(2.0, abs=1e-3)
    assert seen["lidar"][3 * beam] == robot.lidar.range_max_m
    np.testing.assert_allclose(seen["goal"], [0.0, -4.0, -0.5 * math.pi], atol=1e-6)
    assert seen["twist"].tolist() == [0.0, 0.0]


def test_an_episode_is_a_function_of_its_seed_whatever_came_before(environment):
    first = driven(environment, seed=4)
    driven(environment, seed=5, steps=40)
    assert driven(environment, seed=4) == first
    assert driven(environment, seed=5) != first


def test_episodes_without_a_seed_follow_from_the_last_one_that_had_it(environment):
    environment.reset(seed=9)
    shown = [driven(environment, seed=None) for _ in range(2)]
    environment.reset(seed=9)
    assert [driven(environment, seed=None) for _ in range(2)] == shown
    assert shown[0] != shown[1]


def test_side_by_side_they_are_what_each_is_alone():
    both = gymnasium.make_vec(ID, num_envs=2, scenario="one_obstacle")
    alone = [NavigationEnvironment("one_obstacle") for _ in range(2)]
    seen, _ = both.reset(seed=7)
    shown = [one.reset(seed=7 + index)[0] for index, one in enumerate(alone)]
    actions = np.array([[0.5, 0.4], [0.3, -0.6]], dtype=np.float32)
    for _ in range(5):
        for index in range(2):
            for key, value in shown[index].items():
                np.testing.assert_array_equal(seen[key][index], value)
        seen, rewards, *_ = both.step(actions)
        stepped = [one.step(action) for one, action in zip(alone, actions, strict=True)]
        shown = [step[0] for step in stepped]
        np.testing.assert_array_equal(rewards, [step[1] for step in stepped])
    both.close()


def test_the_robot_moves_as_in_a_trial_with_the_same_commands():
    commands = [np.array([0.5, 0.8 * math.sin(k)]) for k in range(12)]
    scenario = load_scenario("one_obstacle").model_copy(update={"timeout_s": 1.4})
    rate = {"navigation": {"controller_server": {"controller_frequency": 10.0}}}
    robot = overridden(scenario.load_robot("wheelchair"), rate, "test")

    def played(observation, memory):
        return Decision(commands[min(memory, len(commands) - 1)], memory + 1)

    log = simulate(TrialSpec(scenario, robot, StubPreset(played), seed=3))
    environment = NavigationEnvironment(scenario, robot)
    environment.reset(seed=3)
    for k, command in enumerate(commands, start=1):
        environment.step(command)
        row = log.samples.set_index("time_s").iloc[
            np.abs(log.samples["time_s"] - (CONTROLLER_OFFSET_S + 0.1 * k)).argmin()
        ]
        state = environment._simulation.state
        # The steps of the integrator end at other times.
        np.testing.assert_allclose(
            row[["x_m", "y_m", "yaw_rad", "v_mps", "w_radps"]], state[:5], atol=1e-3
        )


def test_contact_ends_an_episode_at_the_instant_of_it():
    environment = NavigationEnvironment(wall_ahead(1.5))
    environment.reset(seed=0)
    steps, terminated = 0, False
    while not terminated:
        _, reward, terminated, truncated, info = environment.step(AHEAD)
        steps += 1
    assert (terminated, truncated) == (True, False)
    assert info["outcome"] == "collided"
    assert not info["is_success"]
    assert info["min_clearance_m"] == 0.0
    assert math.isnan(info["time_to_goal_s"])
    # The front reaches 0.85 m ahead of the base: 0.65 m at 0.5 m/s, and the time to get there.
    assert info["driven_length_m"] == pytest.approx(0.65, abs=1e-3)
    assert 1.3 <= 0.1 * steps <= 1.7
    assert reward < -4.0


def test_the_goal_checker_of_the_robot_ends_an_episode_with_its_metrics():
    environment = NavigationEnvironment(way(2.0))
    environment.reset(seed=0)
    total, steps, terminated = 0.0, 0, False
    while not terminated:
        _, reward, terminated, _, info = environment.step(AHEAD)
        total, steps = total + reward, steps + 1
    assert info["outcome"] == "succeeded"
    assert info["is_success"]
    assert info["time_to_goal_s"] == pytest.approx(0.1 * steps)
    # Within 0.25 m, looked at every 0.05 m, by an estimate that is a little off.
    assert info["driven_length_m"] == pytest.approx(1.775, abs=0.05)
    # What was driven, what it is worth to arrive, less 0.05 a second.
    assert total == pytest.approx(info["driven_length_m"] + 5.0 - 0.005 * steps, abs=0.01)


def test_an_episode_is_cut_off_after_its_time():
    environment = NavigationEnvironment(way(2.0), timeout_s=0.3)
    environment.reset(seed=0)
    ends = [environment.step(np.zeros(2))[2:] for _ in range(3)]
    assert [truncated for _, truncated, _ in ends] == [False, False, True]
    assert ends[-1][2]["outcome"] == "timed_out"


@settings(max_examples=25)
@given(seed=st.integers(0, 2**63 - 1))
def test_a_random_task_leaves_room_at_both_ends(seed):
    scenario, robot = load_scenario("static_obstacles"), load_robot("wheelchair")
    asked = RandomTasks(max_obstacles=8)
    task = random_task(scenario, robot, asked, seed)
    world, outline = task.world, np.ascontiguousarray(robot.outline)
    free_m = clearance_at(outline, *task.start, world.segments, world.circles, 1.0)
    assert free_m >= asked.start_clearance_m - 1e-6
    assert not covers(world.segments, world.circles, *task.start[:2])
    for yaw in np.linspace(0.0, 2.0 * math.pi, 8):
        turned_m = clearance_at(outline, *task.goal[:2], yaw, world.segments, world.circles, 1.0)
        assert turned_m > 0.0
    assert 2.0 <= math.dist(task.start[:2], task.goal[:2]) <= 6.0
    again = random_task(scenario, robot, asked, seed)
    assert again.start.tobytes() == task.start.tobytes()
    assert again.world.segments.tobytes() == world.segments.tobytes()


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"scenario": "emtpy"}, "scenario 'emtpy' is not known"),
        ({"scenario": "two_floors"}, "floors: expected a task on one map"),
        ({"tasks": "any"}, "tasks: got 'any', expected 'scenario' or 'random'"),
        ({"frequency": 0.0}, "frequency: got 0.0, expected"),
        ({"timeout_s": -1.0}, "timeout_s: got -1.0, expected"),
        ({"reward": {"progres": 1.0}}, "reward: progres: "),
        ({"random_tasks": {"area_m": -1.0}}, "random_tasks: area_m: "),
        ({"tasks": "random", "random_tasks": {"min_distance_m": 50.0}}, "no free goal found"),
    ],
)
def test_what_is_wrong_is_one_line(given, told):
    with pytest.raises(InputError) as refused:
        NavigationEnvironment(**{"scenario": "empty", **given}).reset(seed=0)
    assert told in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("action", [[math.nan, 0.0], [0.1], "ahead"])
def test_what_is_no_command_is_refused(environment, action):
    environment.reset(seed=0)
    with pytest.raises(ValueError, match=r"action|could not convert"):
        environment.step(action)


def test_a_closed_environment_is_freed_and_drives_no_more():
    environment = NavigationEnvironment("empty")
    environment.reset(seed=0)
    environment.step(AHEAD)
    lidar = weakref.ref(environment._simulation._lidar)
    environment.close()
    environment.close()
    with pytest.raises(RuntimeError, match="is closed"):
        environment.reset(seed=0)
    with pytest.raises(RuntimeError, match="expected reset"):
        environment.step(AHEAD)
    del environment
    gc.collect()
    assert lidar() is None


@pytest.mark.long
def test_ten_thousand_episodes_take_no_more_memory_than_one():
    environment = NavigationEnvironment("empty", tasks="random")
    for seed in range(500):
        environment.reset(seed=seed)
        environment.step(AHEAD)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for seed in range(10_000):
        environment.reset(seed=seed)
        environment.step(AHEAD)
    grown_kb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    assert grown_kb < 20_000
