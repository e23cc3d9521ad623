"""A controller drives the same whether its parameters come from a preset file or a Nav2 file."""

from pathlib import Path

import pytest
import yaml

from drake_navbench import run_trial
from drake_navbench.inputs.presets import load_preset
from drake_navbench.inputs.scenario import load_scenario
from drake_navbench.logs.outcome import Outcome
from drake_navbench.nav2.controllers import load_parameter_file

# The true motion, and what was commanded; compute times differ from run to run.
MOTION = ["time_s", "x_m", "y_m", "yaw_rad", "v_mps", "w_radps", "command_v_mps", "command_w_radps"]
# Around two bends; with the critics' parameters left out the robot does not get through.
SCENARIO, PRESET = "doorway", "dwb_bringup"
# Until it stands in the door, behind the first of them.
FIRST_BEND_S = 8.0
FIRST_BEND = load_scenario(SCENARIO).model_copy(update={"timeout_s": FIRST_BEND_S})


def dotted(parameters):
    result = {}
    for name, value in parameters.items():
        is_block = isinstance(value, dict)
        result |= {f"{name}.{key}": v for key, v in value.items()} if is_block else {name: value}
    return result


def mixed(parameters):
    """Returns every critic's scale dotted and the rest of it in a block."""
    scales = {n: v for n, v in dotted(parameters).items() if n.endswith(".scale")}
    rest = {
        name: {k: v for k, v in value.items() if k != "scale"} if isinstance(value, dict) else value
        for name, value in parameters.items()
    }
    return scales | rest


@pytest.fixture(scope="module")
def motion():
    log = run_trial(SCENARIO, PRESET)
    assert log.outcome is Outcome.SUCCEEDED
    return log.samples[MOTION]


@pytest.mark.parametrize("form", [dotted, mixed])
def test_dwb_drives_around_bends_alike_from_a_preset_and_from_a_nav2_file(form, motion, tmp_path):
    block = {"plugin": "dwb_core::DWBLocalPlanner"} | form(dict(load_preset(PRESET).values))
    server = {"controller_plugins": ["FollowPath"], "FollowPath": block}
    path = Path(tmp_path / "nav2_params.yaml")
    path.write_text(yaml.safe_dump({"controller_server": {"ros__parameters": server}}))
    (preset,) = load_parameter_file(path)
    driven = run_trial(FIRST_BEND, preset).samples[MOTION]
    assert driven["time_s"].iloc[-1] == FIRST_BEND_S
    assert driven.to_numpy().tobytes() == motion.iloc[: len(driven)].to_numpy().tobytes()
