"""The contract of every controller, and the behaviour of this one."""

from __future__ import annotations

import numpy as np
import pytest
from my_controller.controller import MyController

from drake_navbench import run_trial
from drake_navbench.controller import ControllerSetup, NoValidControl, Observation
from drake_navbench.errors import InputError
from drake_navbench.inputs.presets import load_preset
from drake_navbench.kernels.grid import LETHAL, Costmap

CELLS = 60
RESOLUTION_M = 0.1
SETUP = ControllerSetup(
    control_period_s=0.1,
    footprint=np.array([[0.3, 0.2], [0.3, -0.2], [-0.3, -0.2], [-0.3, 0.2]]),
    inscribed_radius_m=0.2,
    circumscribed_radius_m=0.36,
)


def observation(*, pose=(0.0, 0.0, 0.0), obstacle=None, **values) -> Observation:
    """A straight plan along x on a costmap of 6 m, with one lethal cell where asked for."""
    x = np.arange(0.0, 2.0, 0.05)
    plan = np.column_stack([x, np.zeros_like(x), np.zeros_like(x)])
    costs = np.zeros((CELLS, CELLS), dtype=np.uint8)
    half_m = 0.5 * CELLS * RESOLUTION_M
    if obstacle is not None:
        column, row = ((np.array(obstacle) + half_m) / RESOLUTION_M).astype(int)
        costs[row, column] = LETHAL
    plan.flags.writeable = False
    return Observation(
        time_s=0.0,
        pose=np.array(pose),
        twist=np.zeros(2),
        plan=plan,
        plan_id=1,
        costmap=Costmap(costs, -half_m, -half_m, RESOLUTION_M),
        goal=plan[-1],
        **values,
    )


@pytest.fixture
def controller():
    return MyController(MyController.Parameters(), SETUP)


def test_it_starts_gently_and_then_cruises(controller):
    memory, speeds = controller.initial_memory(), []
    for _ in range(12):
        command, memory, _ = controller.step(observation(), memory)
        speeds.append(command[0])
    # 0.5 m/s^2 in cycles of 0.1 s, up to 0.4 m/s.
    np.testing.assert_allclose(speeds[:3], [0.05, 0.1, 0.15])
    assert speeds[-1] == pytest.approx(0.4)


def test_it_turns_back_to_the_plan(controller):
    left_of_it = observation(pose=(0.0, 0.3, 0.0))
    assert controller.step(left_of_it, 0.0).command[1] < 0.0


def test_commands_stay_within_the_limits_of_the_base(controller):
    for yaw in np.linspace(-3.0, 3.0, 7):
        v, w = controller.step(observation(pose=(0.0, 0.0, yaw)), 0.4).command
        assert 0.0 <= v <= SETUP.max_linear_velocity_mps
        assert abs(w) <= SETUP.max_angular_velocity_radps


def test_at_the_goal_it_only_turns(controller):
    there = observation(pose=(1.95, 0.0, 0.5), goal_xy_reached=True)
    assert controller.step(there, 0.4).command.tolist() == [0.0, -1.0]


def test_where_the_way_is_blocked_there_is_no_command(controller):
    with pytest.raises(NoValidControl, match="an obstacle stands between"):
        controller.step(observation(obstacle=(0.4, 0.0)), 0.0)


def test_the_same_question_has_the_same_answer_whatever_came_between(controller):
    first = controller.step(observation(), 0.1)
    controller.step(observation(pose=(0.5, 0.1, 1.0)), 0.4)
    again = controller.step(observation(), 0.1)
    assert again.command.tobytes() == first.command.tobytes()


def test_a_parameter_beyond_its_bounds_is_refused():
    with pytest.raises(InputError, match="speed"):
        load_preset("my_controller:speed=-1")


def test_it_drives_to_the_goal():
    log = run_trial("empty", "my_controller", seed=1)
    assert log.outcome == "succeeded", log.info["reason"]
