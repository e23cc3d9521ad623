"""Drives a robot's base by given commands: no sensors, no controller."""

from __future__ import annotations

import numpy as np
from pydrake.geometry import SceneGraph
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator

from drake_navbench.inputs.robot import Robot
from drake_navbench.kernels.arrays import Array
from drake_navbench.trial.base_wiring import make_base
from drake_navbench.trial.simulation import INTEGRATION
from drake_navbench.trial.systems.ports import COMMAND_SIZE, STATE_SIZE


def drive_open_loop(
    robot: Robot, start: Array, time_s: Array, command_time_s: Array, commands: Array
) -> Array:
    """Returns (N, 6) the states of a trial's base at rising times (N,); the first one is `start`.

    start: (6,) x m, y m, yaw rad, v m/s, w rad/s, vy m/s. command_time_s: (M,) rising; commands:
    (M, 3) v m/s, w rad/s, vy m/s, each held until the next, 0 before the first.
    """
    # The base registers its outline in a SceneGraph, which nothing reads.
    scene_graph: SceneGraph = SceneGraph()
    base = make_base(robot, scene_graph)
    simulator = Simulator(base)
    ApplySimulatorConfig(INTEGRATION, simulator)
    context = simulator.get_mutable_context()
    context.SetTime(time_s[0])
    base.set_state(context, start)
    port, state_port = base.get_command_input_port(), base.get_state_output_port()
    given = int(np.searchsorted(command_time_s, time_s[0], side="right"))
    port.FixValue(context, commands[given - 1] if given else np.zeros(COMMAND_SIZE))
    states = np.empty((len(time_s), STATE_SIZE))
    simulator.Initialize()
    for row, until_s in enumerate(time_s.tolist()):
        while given < len(command_time_s) and command_time_s[given] <= until_s:
            simulator.AdvanceTo(max(float(command_time_s[given]), context.get_time()))
            port.FixValue(context, commands[given])
            given += 1
        simulator.AdvanceTo(until_s)
        states[row] = state_port.Eval(context)
    return states
