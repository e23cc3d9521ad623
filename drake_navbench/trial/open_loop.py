"""Drives a robot's base by commands that were given before: no sensors, no controller."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pydrake.geometry import SceneGraph
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator

from drake_navbench.inputs.robot import Drive
from drake_navbench.systems.wheelchair import Wheelchair
from drake_navbench.trial.trial import INTEGRATION

Array = NDArray[np.float64]

# Only to be carried along: nothing is near.
FOOTPRINT = np.array([[0.1, 0.1], [-0.1, 0.1], [-0.1, -0.1], [0.1, -0.1]])


def drive_open_loop(
    drive: Drive, start: Array, time_s: Array, command_time_s: Array, commands: Array
) -> Array:
    """Returns (N, 5) the states of a trial's base at rising times (N,), the first of them at start.

    start: (5,) x m, y m, yaw rad, v m/s, w rad/s. command_time_s: (M,) rising; commands: (M, 2)
    v m/s, w rad/s, each held until the next, 0 before the first.
    """
    wheelchair = Wheelchair(drive, SceneGraph(), footprint=FOOTPRINT)
    simulator = Simulator(wheelchair)
    ApplySimulatorConfig(INTEGRATION, simulator)
    context = simulator.get_mutable_context()
    context.SetTime(time_s[0])
    context.SetContinuousState(start)
    port = wheelchair.get_command_input_port()
    given = int(np.searchsorted(command_time_s, time_s[0], side="right"))
    port.FixValue(context, commands[given - 1] if given else np.zeros(2))
    states = np.empty((len(time_s), 5))
    simulator.Initialize()
    for row, until_s in enumerate(time_s.tolist()):
        while given < len(command_time_s) and command_time_s[given] <= until_s:
            simulator.AdvanceTo(max(float(command_time_s[given]), context.get_time()))
            port.FixValue(context, commands[given])
            given += 1
        simulator.AdvanceTo(until_s)
        states[row] = context.get_continuous_state_vector().CopyToVector()
    return states
