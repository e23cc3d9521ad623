"""Speed of one DWB cycle through `step`. Target: 0.6 ms median with the default critics."""

import numpy as np
import pytest
from controller_scenes import observe, setup_of
from scenes import WHEELCHAIR, straight_plan

from drake_navbench.inputs.presets import load_preset
from drake_navbench.kernels.footprint import pad_footprint
from drake_navbench.kernels.grid import Costmap

RESOLUTION_M = 0.05


def controller_of(preset_name):
    """Returns a preset's controller for the wheelchair."""
    preset = load_preset(preset_name)
    setup = setup_of(pad_footprint(WHEELCHAIR, 0.01))
    return preset.controller_class(preset.parameters, setup)


def observation_of(costs):
    """Returns a robot driving at 0.3 m/s in the middle of a map, its plan straight ahead."""
    half_m = 0.5 * costs.shape[0] * RESOLUTION_M
    return observe(
        straight_plan(half_m - 0.05),
        pose=(0.01, 0.02, 0.1),
        twist=(0.3, 0.0),
        costmap=Costmap(costs, -half_m, -half_m, RESOLUTION_M),
        goal=np.array([5.0, 0.0, 0.0]),
    )


def boxed_in(costs):
    """Returns the map with walls 1.6 m ahead and 1.25 m to either side."""
    costs = costs.copy()
    middle = costs.shape[0] // 2
    costs[:, middle + 32 :] = 254
    costs[middle + 25 :, :] = 254
    costs[: middle - 25, :] = 254
    return costs


FREE_60, FREE_120 = np.zeros((60, 60), np.uint8), np.zeros((120, 120), np.uint8)


@pytest.mark.parametrize(
    ("preset_name", "costs"),
    [
        pytest.param("dwb_bringup", FREE_60, id="bringup-free-60x60"),
        pytest.param("dwb", FREE_120, id="footprint-free-120x120"),
        pytest.param("dwb", boxed_in(FREE_120), id="footprint-boxed-in-120x120"),
    ],
)
def test_cycle(benchmark, preset_name, costs):
    controller = controller_of(preset_name)
    observation = observation_of(costs)
    memory = controller.initial_memory()
    controller.step(observation, memory)
    decision = benchmark(controller.step, observation, memory)
    assert decision.diagnostics["sample_count"] > 400
