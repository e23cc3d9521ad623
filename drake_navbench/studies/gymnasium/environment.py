"""`drake_navbench/Navigation-v0`: drive a robot to a goal by its lidar."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal, cast

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from drake_navbench.errors import InputError
from drake_navbench.inputs.robot import Robot
from drake_navbench.inputs.scenario import Scenario, load_scenario
from drake_navbench.inputs.task_check import check_task
from drake_navbench.kernels.poses import to_robot_frame
from drake_navbench.navigation.checker_settings import make_goal_checker
from drake_navbench.studies.gymnasium.reward import (
    Moment,
    RewardWeights,
    moment,
    step_reward,
)
from drake_navbench.studies.gymnasium.robot_simulation import RobotSimulation
from drake_navbench.studies.gymnasium.tasks import (
    EpisodeTask,
    RandomTasks,
    random_task,
    scenario_task,
)
from drake_navbench.trial.trial import DEFAULT_ROBOT
from drake_navbench.typed_files.quantities import MAX_LENGTH_M
from drake_navbench.typed_files.typed_yaml import validate

Seen = dict[str, NDArray[np.float32]]

VELOCITIES = ("v", "w", "vy")
# The largest speeds in an observation, as multiples of the limits, as the estimate is noisy.
TWIST_MARGIN = 10.0
MAX_SEED = 2**63


class NavigationEnvironment(gymnasium.Env[Seen, NDArray[np.float32]]):
    """One robot that is to reach a goal without touching anything.

    Observation, in the base frame: `lidar` (beams,) ranges m, 0 for nearer than the least range,
    the longest range for no hit; `goal` (3,) x m, y m, yaw rad by the estimated pose; `twist` (2,)
    estimated v m/s, w rad/s. Action: the command (2,) v m/s, w rad/s, held for a period. A base
    that moves sideways has vy m/s, to the left, as a third number of both.

    An episode terminates when the robot's goal checker says so, or at a touch; it is truncated
    after `timeout_s`. `info` of its last step has the outcome and metrics of a trial:
    `time_to_goal_s`, `driven_length_m`, `min_clearance_m` (sampled once a step).

    scenario, robot: names, paths of files, or loaded ones. tasks: 'scenario' takes start and noise
    of the trial with the seed of the episode; 'random' draws start, goal and obstacles, by the
    fields of `random_tasks`. frequency: commands per second. reward: fields of `RewardWeights`.
    timeout_s: the episode's; None: the scenario's. Raises InputError where an argument is wrong.
    """

    def __init__(
        self,
        scenario: str | Scenario = "one_obstacle",
        robot: str | Robot = DEFAULT_ROBOT,
        *,
        tasks: Literal["scenario", "random"] = "scenario",
        random_tasks: Mapping[str, Any] | None = None,
        frequency: float = 10.0,
        reward: Mapping[str, Any] | None = None,
        timeout_s: float | None = None,
    ) -> None:
        if tasks not in ("scenario", "random"):
            raise InputError(f"tasks: got {tasks!r}, expected 'scenario' or 'random'")
        if not 0.0 < frequency <= 1000.0:
            raise InputError(f"frequency: got {frequency!r}, expected up to 1000 Hz, above 0")
        if timeout_s is not None and not 0.0 < timeout_s <= 1e5:
            raise InputError(f"timeout_s: got {timeout_s!r}, expected up to 1e5 s, above 0")
        self.metadata = {"render_modes": []}
        self._scenario = scenario if isinstance(scenario, Scenario) else load_scenario(scenario)
        self._robot = self._scenario.load_robot(robot)
        check_task(self._scenario, self._robot)
        if self._scenario.floors:
            raise InputError(
                f"scenario {self._scenario.name}: floors: expected a task on one map; the "
                "environment has no lifts"
            )
        if self._scenario.true_world.moving_count:
            raise InputError(
                f"scenario {self._scenario.name}: world: expected a world that "
                "stands still; the environment moves nothing but the robot"
            )
        self._draws = tasks == "random"
        self._random_tasks = validate(RandomTasks, dict(random_tasks or {}), "random_tasks")
        self._weights = validate(RewardWeights, dict(reward or {}), "reward")
        self._period_s = 1.0 / frequency
        self._max_steps = round((timeout_s or self._scenario.timeout_s) * frequency)
        self._goal_checker = make_goal_checker(self._robot.navigation.goal_checker)
        self._simulation = RobotSimulation(
            self._robot, self._scenario.true_world, period_s=self._period_s
        )
        self._task: EpisodeTask | None = None
        self._is_open = True
        self._set_spaces()

    @property
    def robot(self) -> Robot:
        """The robot that is driven."""
        return self._robot

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Seen, dict[str, Any]]:
        """Begins an episode, which is a function of its seed alone.

        Without a seed, the next one is drawn from the seed of the last reset that had one.
        """
        if not self._is_open:
            raise RuntimeError("reset: the environment is closed")
        super().reset(seed=seed)
        drawn = int(self.np_random.integers(MAX_SEED)) if seed is None else seed
        task = self._make_task(drawn)
        self._task = task
        self._simulation.reset(task.start, seed=drawn, world=task.world)
        self._steps, self._driven_m, self._last_turn_radps = 0, 0.0, 0.0
        self._goal_check = self._goal_checker.initial_state()
        self._at = self._moment()
        self._position = self._simulation.state[:2]
        self._min_clearance_m = self._at.clearance_m
        return self._observation(), {"seed": drawn}

    def step(self, action: NDArray[np.float32]) -> tuple[Seen, float, bool, bool, dict[str, Any]]:
        """Drives one period; raises ValueError where the action is not a valid command."""
        command = np.asarray(action, dtype=np.float64)
        if command.shape != self._command_shape or not np.isfinite(command).all():
            expected = " and ".join(VELOCITIES[: self._command_shape[0]])
            raise ValueError(f"action: got {action!r}, expected finite numbers, {expected}")
        if self._task is None:
            raise RuntimeError("step: expected reset to be called before")
        simulation = self._simulation
        began_s, before = simulation.driven_s, self._at
        simulation.step(command)
        self._steps += 1
        self._at = self._moment()
        has_collided = simulation.has_collided
        has_reached = not has_collided and self._has_reached()
        reward = step_reward(
            self._weights,
            before,
            self._at,
            duration_s=simulation.driven_s - began_s,
            turn_change_radps=command[1] - self._last_turn_radps,
            has_reached=has_reached,
            has_collided=has_collided,
            time_left_s=(self._max_steps - self._steps) * self._period_s,
        )
        self._last_turn_radps = float(command[1])
        self._measure()
        terminated = has_reached or has_collided
        truncated = not terminated and self._steps >= self._max_steps
        info: dict[str, Any] = {}
        if terminated or truncated:
            info = self._summary(has_reached=has_reached, has_collided=has_collided)
        return self._observation(), reward, terminated, truncated, info

    def close(self) -> None:
        """Frees the simulation."""
        if self._is_open:
            self._is_open, self._task = False, None
            self._simulation.close()

    def _make_task(self, seed: int) -> EpisodeTask:
        if self._draws:
            return random_task(self._scenario, self._robot, self._random_tasks, seed)
        return scenario_task(self._scenario, seed)

    def _moment(self) -> Moment:
        assert self._task is not None
        simulation = self._simulation
        clearance_m = simulation.clearance_m(self._weights.near_m)
        return moment(simulation.state[:3], self._task.goal, clearance_m)

    def _has_reached(self) -> bool:
        """Tells whether the robot's goal checker takes the estimated pose for the goal."""
        assert self._task is not None
        estimate = self._simulation.estimate
        # There is no plan; the remaining path is a straight line.
        way = np.array([estimate[:3], self._task.goal])
        result = self._goal_checker.check(
            self._goal_check,
            pose=estimate[:3],
            goal=self._task.goal,
            twist=estimate[3:],
            local_plan=way,
        )
        self._goal_check = result.state
        return result.reached

    def _measure(self) -> None:
        position = self._simulation.state[:2]
        self._driven_m += float(np.hypot(*(position - self._position)))
        self._position = position
        self._min_clearance_m = min(self._min_clearance_m, self._at.clearance_m)

    def _summary(self, *, has_reached: bool, has_collided: bool) -> dict[str, Any]:
        outcome = "succeeded" if has_reached else "collided" if has_collided else "timed_out"
        return {
            "outcome": outcome,
            "is_success": has_reached,
            "time_to_goal_s": self._simulation.driven_s if has_reached else float("nan"),
            "driven_length_m": self._driven_m,
            "min_clearance_m": self._min_clearance_m,
        }

    def _observation(self) -> Seen:
        assert self._task is not None
        estimate = self._simulation.estimate
        goal = to_robot_frame(self._task.goal[np.newaxis], *estimate[:3])[0]
        range_max_m = self._robot.lidar.range_max_m
        # Beams without a hit, or with an unknown range, have no range.
        ranges = np.nan_to_num(
            self._simulation.scan.ranges_m, nan=range_max_m, posinf=range_max_m, neginf=0.0
        )
        return {
            "lidar": ranges,
            "goal": goal.astype(np.float32),
            "twist": estimate[3 : 3 + self._command_shape[0]].astype(np.float32),
        }

    def _set_spaces(self) -> None:
        drive, lidar = self._robot.drive, self._robot.lidar
        turn, sideways = drive.max_angular_velocity_radps, drive.lateral_speed_mps
        count = 3 if sideways > 0.0 else 2
        low, high = np.array(
            [
                [drive.min_linear_velocity_mps, -turn, -sideways],
                [drive.max_linear_velocity_mps, turn, sideways],
            ],
            dtype=np.float32,
        )[:, :count]
        self._command_shape = (count,)
        fastest = TWIST_MARGIN * np.maximum(np.abs(low), high)
        reach = np.array([MAX_LENGTH_M, MAX_LENGTH_M, 4.0], dtype=np.float32)
        self.action_space = spaces.Box(low, high, dtype=np.float32)
        shown: dict[str, spaces.Space[Any]] = {
            "lidar": spaces.Box(0.0, lidar.range_max_m, (lidar.beam_count,), dtype=np.float32),
            "goal": spaces.Box(-reach, reach, dtype=np.float32),
            "twist": spaces.Box(-fastest, fastest, dtype=np.float32),
        }
        # The type of a space of maps does not say of which spaces.
        self.observation_space = cast(spaces.Space[Seen], spaces.Dict(shown))
