"""Controllers made of one function, for tests of what stands around a controller."""

from typing import ClassVar

import numpy as np

from drake_navbench.controller import ControllerParameters, Decision


class _Parameters(ControllerParameters):
    pass


class _Stub:
    """A controller made of one function."""

    Parameters = _Parameters
    nav2_plugin = None

    def __init__(self, step):
        self._step = step

    def initial_memory(self):
        return 0

    def step(self, observation, memory):
        return self._step(observation, memory)


class StubPreset:
    """Stands for a preset whose controller is a stub."""

    name = "stub"
    controller = "stub"
    is_running_stack = False
    parameters = _Parameters()
    file = None
    file_hashes: ClassVar = {}

    def __init__(self, step):
        self._step = step

    def controller_class(self, parameters, setup):
        return _Stub(self._step)

    def robot(self, robot):
        return robot


def straight_ahead(observation, memory):
    return Decision(np.array([0.5, 0.0]), memory + 1)
