"""The behaviour server runs one behaviour at a time and steps aside when there is none."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator

from drake_navbench.kernels.grid import Costmap
from drake_navbench.navigation.behavior import BehaviorServerParameters
from drake_navbench.navigation.task import BehaviorGoal, TaskState
from drake_navbench.trial.systems.behavior_server import BehaviorServer
from drake_navbench.trial.systems.ports import value_to_store

FOOTPRINT = np.array([[0.5, 0.2], [0.5, -0.2], [-0.5, -0.2], [-0.5, 0.2]])
BACK = {"target_x": 0.3, "speed": 0.15, "time_allowance": 10.0}


class Rig:
    """A server with a cycle every 0.1 s from t = 0 on; the controller commands 0.4 m/s."""

    def __init__(self):
        self.server = BehaviorServer(BehaviorServerParameters(), footprint=FOOTPRINT, offset_s=0.0)
        self.simulator = Simulator(self.server)
        self.context = self.simulator.get_mutable_context()
        free = Costmap(np.zeros((120, 120), dtype=np.uint8), -3.0, -3.0, 0.05)
        self.give(odometry_estimate=np.zeros(6), costmap=free, goal=None)
        self.give(controller_command=np.array([0.4, 0.0, 0.0]))

    def give(self, **inputs):
        for name, value in inputs.items():
            self.server.GetInputPort(name).FixValue(self.context, value_to_store(value))

    def run(self, duration_s):
        """Runs for a while; returns command and status."""
        self.simulator.AdvanceTo(self.context.get_time() + duration_s)
        return (
            self.server.GetOutputPort("command").Eval(self.context),
            self.server.GetOutputPort("status").Eval(self.context),
        )


def test_without_a_goal_the_controllers_command_passes():
    command, status = Rig().run(0.15)
    np.testing.assert_array_equal(command, [0.4, 0.0, 0.0])
    assert status.state is TaskState.IDLE


def test_a_behaviour_that_moves_the_robot_takes_the_command_and_gives_it_back():
    rig = Rig()
    rig.give(goal=BehaviorGoal(1, "backup", BACK))
    command, status = rig.run(0.15)
    np.testing.assert_array_equal(command, [-0.15, 0.0, 0.0])
    assert (status.state, status.task_id) == (TaskState.RUNNING, 1)
    rig.give(odometry_estimate=np.array([-0.3, 0.0, 0.0, 0.0, 0.0, 0.0]))
    command, status = rig.run(0.1)
    np.testing.assert_array_equal(command, [0.4, 0.0, 0.0])
    assert status.state is TaskState.SUCCEEDED


def test_a_wait_leaves_the_command_to_the_controller():
    rig = Rig()
    rig.give(goal=BehaviorGoal(1, "wait", {"time": 0.3}))
    command, status = rig.run(0.25)
    np.testing.assert_array_equal(command, [0.4, 0.0, 0.0])
    assert status.state is TaskState.RUNNING
    assert rig.run(0.1)[1].state is TaskState.SUCCEEDED


def test_without_a_costmap_it_does_not_move():
    rig = Rig()
    rig.give(goal=BehaviorGoal(1, "backup", BACK), costmap=None)
    command, status = rig.run(0.15)
    np.testing.assert_array_equal(command, [0.4, 0.0, 0.0])
    assert status.error_code == 714


def test_a_cancelled_behaviour_ends_with_the_next_cycle():
    rig = Rig()
    rig.give(goal=BehaviorGoal(1, "backup", BACK))
    rig.run(0.15)
    rig.give(goal=BehaviorGoal(1, "backup", BACK, cancel_requested=True))
    assert rig.run(0.1)[1].state is TaskState.CANCELED


@pytest.mark.parametrize("speed", [-0.1, 0.0])
def test_arguments_that_contradict_each_other_end_with_nav2s_code(speed):
    rig = Rig()
    rig.give(goal=BehaviorGoal(1, "drive_on_heading", {"target_x": 1.0, "speed": speed}))
    _, status = rig.run(0.15)
    assert status.error_code == 724
    assert "differ in sign" in status.reason


def test_a_new_goal_replaces_the_one_at_hand():
    rig = Rig()
    rig.give(goal=BehaviorGoal(1, "backup", BACK))
    rig.run(0.15)
    rig.give(goal=BehaviorGoal(2, "spin", {"target_yaw": 1.0}))
    command, status = rig.run(0.1)
    np.testing.assert_array_equal(command, [0.0, 1.0, 0.0])
    assert status.task_id == 2
