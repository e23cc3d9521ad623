"""A controller in another process: what it is told, what it may answer, what its faults cost."""

from __future__ import annotations

import math
import os
import shutil
import subprocess
import sys
import time
from dataclasses import fields, replace
from pathlib import Path

import msgpack
import numpy as np
import pandas as pd
import pytest
from controller_scenes import observe, setup_of
from scenes import SHORT_DRIVE

from drake_navbench import run_trial
from drake_navbench.commands.run import main
from drake_navbench.controller import (
    Controller,
    GracefulController,
    InvalidPath,
    NoValidControl,
    SpeedLimit,
)
from drake_navbench.controllers.external import ExternalController
from drake_navbench.controllers.external.client_process import ExternalControllerFailed
from drake_navbench.controllers.rotation_shim import RotationShim
from drake_navbench.errors import EndedFromOutside, InputError
from drake_navbench.inputs.presets import Preset
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.kernels.grid import Costmap
from drake_navbench.kernels.noise import NoiseKey
from drake_navbench.logs.log_columns import UNREPEATABLE_COLUMNS
from drake_navbench.logs.outcome import Outcome

HERE = Path(__file__).parent
EXAMPLES = Path(__file__).parents[3] / "examples" / "external_controllers"
HOSTILE = HERE / "hostile_client.py"
RECORDING = HERE / "recording_client.py"
COMPILER = shutil.which("c++")

SETUP = setup_of(
    np.array([[0.3, 0.2], [0.3, -0.2], [-0.3, -0.2], [-0.3, 0.2]]),
    wants_diagnostics=True,
    response_time_constant_s=0.25,
    max_linear_acceleration_mps2=math.inf,
)
COSTS = np.arange(60, dtype=np.uint8).reshape(6, 10)
PLAN = np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [1.0, 0.0, 0.1]])
OBSERVATION = observe(
    PLAN[:2],
    time_s=0.07,
    pose=(0.1, 0.2, 0.3),
    twist=(0.4, -0.5),
    plan_id=7,
    costmap=Costmap(COSTS, -1.0, -2.0, 0.05, tracks_unknown=True, stamp_s=0.06),
    goal=PLAN[-1],
    goal_xy_tolerance_m=0.25,
    goal_yaw_tolerance_rad=0.3,
    speed_limit=SpeedLimit(50.0, is_percentage=True),
    noise_key=NoiseKey(2**64 - 1, 4, 11),
    global_plan=PLAN,
    vy_mps=0.6,
)


@pytest.fixture
def start():
    """A function that starts a client of this folder; all are ended after the test."""
    started = []

    def begin(script: Path, argument: str, **values) -> ExternalController:
        command = (sys.executable, str(script), argument)
        parameters = ExternalController.Parameters(command=command, **values)
        started.append(ExternalController(parameters, SETUP))
        return started[-1]

    yield begin
    for controller in started:
        controller.close()


@pytest.fixture
def step(start):
    """A function that asks a hostile client for one decision."""

    def ask(deed: str, **values):
        controller = start(HOSTILE, deed, **values)
        return controller.step(OBSERVATION, controller.initial_memory())

    return ask


def test_a_client_is_told_everything_that_a_controller_sees(start, tmp_path):
    controller = start(RECORDING, str(tmp_path / "record"), client={"gain": 2.0})
    assert not controller.cuts_plan
    memory = controller.initial_memory()
    decision = controller.step(OBSERVATION, memory)
    controller.step(replace(OBSERVATION, time_s=0.12, speed_limit=None), decision.memory)
    controller.close()
    unpacker = msgpack.Unpacker((tmp_path / "record").open("rb"))
    configure, reset, plan, first, second, shutdown = unpacker
    assert configure["parameters"] == {"gain": 2.0}
    assert configure["footprint"] == SETUP.footprint.tolist()
    assert configure["control_period_s"] == 0.05
    assert configure["wants_diagnostics"] is True
    assert configure["response_time_constant_s"] == 0.25
    assert configure["max_linear_acceleration_mps2"] == math.inf
    assert (reset, shutdown) == ({"call": "reset"}, {"call": "shutdown"})
    assert plan["plan_id"] == first["plan_id"] == 7
    assert plan["plan"] == {"shape": [3, 3], "data": PLAN.tobytes()}
    assert first["local_plan"] == {"shape": [2, 3], "data": PLAN[:2].tobytes()}
    assert first["costmap"] == {
        "shape": [6, 10],
        "data": bytes(range(60)),
        "origin": [-1.0, -2.0],
        "resolution": 0.05,
        "stamp_s": 0.06,
        "tracks_unknown": True,
    }
    assert first["pose"] == [0.1, 0.2, 0.3]
    assert first["twist"] == [0.4, -0.5, 0.6]
    assert first["goal"] == [1.0, 0.0, 0.1]
    assert (first["goal_xy_tolerance_m"], first["goal_yaw_tolerance_rad"]) == (0.25, 0.3)
    assert first["speed_limit"] == {"value": 50.0, "is_percentage": True}
    assert first["noise"] == {"seed": 2**64 - 1, "stream": 4, "step": 11}
    assert first["cancel_requested"] is first["goal_xy_reached"] is False
    assert second["time_s"] == 0.12
    assert second["speed_limit"] is None
    # What it remembers comes back, so that it need not keep it.
    assert (first["memory"], second["memory"]) == (0, 1)
    fixed = {field.name for field in fields(SETUP)}
    assert set(configure) == fixed | {"call", "protocol", "parameters"}


def test_the_global_plan_is_told_again_only_when_it_changes_or_after_a_reset(start, tmp_path):
    controller = start(RECORDING, str(tmp_path / "record"))
    memory = controller.initial_memory()
    other = replace(OBSERVATION, plan_id=8)
    for observation in (OBSERVATION, OBSERVATION, other, other):
        memory = controller.step(observation, memory).memory
    controller.step(other, controller.initial_memory())
    controller.close()
    calls = [r["call"] for r in msgpack.Unpacker((tmp_path / "record").open("rb"))]
    told = "configure reset set_plan compute compute set_plan compute compute"
    assert calls == [*told.split(), "reset", "set_plan", "compute", "shutdown"]


def test_an_answer_carries_command_memory_and_what_is_drawn(start, tmp_path):
    controller = start(RECORDING, str(tmp_path / "record"))
    decision = controller.step(OBSERVATION, controller.initial_memory())
    assert isinstance(controller, Controller)
    assert decision.command.tolist() == [0.1, 0.0]
    assert decision.diagnostics["cycles"] == 1
    assert decision.diagnostics["predicted_trajectory"].tolist() == [[0.0, 0.0, 0.0]]


def test_a_graceful_client_is_asked_until_it_is_at_rest(start, tmp_path):
    controller = start(RECORDING, str(tmp_path / "record"))
    assert isinstance(controller, GracefulController)
    memory, cycles = controller.initial_memory(), 0
    while not controller.is_at_rest(memory):
        memory, cycles = controller.step(OBSERVATION, memory).memory, cycles + 1
    assert cycles == 3


def test_a_client_that_is_not_graceful_is_at_rest_at_once(start):
    controller = start(HOSTILE, "stands")
    assert controller.is_at_rest(controller.initial_memory())


@pytest.mark.parametrize(
    ("deed", "told"),
    [
        (
            "dies",
            "ended with exit code 3 before it answered compute; it printed last: the last straw",
        ),
        ("crashes", "was ended by signal 11 (Segmentation fault)"),
        ("hangs", "no answer to compute within 0.2 s"),
        ("closes", "closed its pipe"),
        (
            "raises",
            "ended with exit code 1 before it answered compute; "
            "it printed last: ZeroDivisionError: division by zero",
        ),
        ("sends too much", "announced an answer of 2147483648 bytes, expected at most 16777216"),
        ("sends garbage", "its answer is not MessagePack"),
        ("sends half", "no answer to compute within 0.2 s"),
        ("sends two", "bytes behind its answer"),
        ("sends a list", "its answer is list, expected a map"),
        ("sends nothing of use", "its answer to compute is wrong: command: got None, expected"),
        ("sends text", "command: got ['0.1', '0.0'], expected [v, w] or [v, w, vy]"),
        ("sends four", "command: got [0.1, 0.0, 0.0, 0.0], expected [v, w] or [v, w, vy]"),
        ("fails oddly", "failure: got 'bored', expected no_valid_control, invalid_path"),
        ("says it is broken", "answered compute with the error 'out of ideas'"),
        ("draws a wrong shape", "carrot: got the shape [3], expected [2]"),
    ],
)
def test_what_a_client_does_wrong_is_told_and_ends_it(deed, told, start):
    controller = start(HOSTILE, deed, deadline_s=0.2 if "0.2 s" in told else 5.0)
    memory = controller.initial_memory()
    with pytest.raises(ExternalControllerFailed) as failed:
        controller.step(OBSERVATION, memory)
    assert told in str(failed.value).splitlines()[0]
    with pytest.raises(ExternalControllerFailed, match="was already ended"):
        controller.step(OBSERVATION, memory)


# More than a pipe takes at once.
LARGE = Costmap(np.arange(400 * 500).reshape(400, 500).astype(np.uint8), 0.0, 0.0, 0.05)


def test_a_map_that_is_larger_than_a_pipe_arrives_whole(start, tmp_path):
    controller = start(RECORDING, str(tmp_path / "record"))
    controller.step(replace(OBSERVATION, costmap=LARGE), controller.initial_memory())
    *_, asked = msgpack.Unpacker((tmp_path / "record").open("rb"))
    assert asked["costmap"]["data"] == LARGE.costs.tobytes()


def test_a_client_that_does_not_read_ends_after_the_deadline(start):
    controller = start(HOSTILE, "reads no more", deadline_s=0.2)
    memory = controller.initial_memory()
    with pytest.raises(ExternalControllerFailed, match="within"):
        controller.step(replace(OBSERVATION, costmap=LARGE), memory)


def test_without_a_command_it_is_wrong_input_in_one_line(capsys):
    assert main(["empty", "--controllers", "external"]) == 2
    assert capsys.readouterr().err == "controller external: command: missing, but required\n"


def test_a_failure_that_a_controller_may_have_is_raised_as_such(step):
    with pytest.raises(NoValidControl, match=r"^no way$") as failed:
        step("finds no control")
    assert failed.value.details == {"tried": 3}
    with pytest.raises(InvalidPath, match=r"^no plan$"):
        step("finds no path")


def test_what_a_client_prints_breaks_nothing(step):
    assert step("chats").command.tolist() == [0.0, 0.0]


def test_one_that_the_system_kills_is_the_machines_fault(step):
    with pytest.raises(EndedFromOutside, match=r"was ended by signal 9 \(Killed\)"):
        step("is killed")


@pytest.mark.parametrize(
    ("command", "told"),
    [
        (("nowhere/to/be_found",), "'nowhere/to/be_found': no such program"),
        ((sys.executable, str(HOSTILE), "refuses"), "refused to be configured: speed: expected"),
        ((sys.executable, str(HOSTILE), "speaks another protocol"), "speaks protocol 7, expected"),
        (
            (sys.executable, str(HOSTILE), "dies at once"),
            "ended with exit code 3 before it answered configure; it printed last",
        ),
        ((sys.executable, "-c", "pass"), "ended with exit code 0"),
    ],
)
def test_one_that_cannot_begin_is_wrong_input(command, told):
    with pytest.raises(InputError) as refused:
        ExternalController(ExternalController.Parameters(command=command), SETUP)
    assert told in str(refused.value)


def test_a_client_is_gone_when_it_is_closed_or_forgotten(start, tmp_path):
    closed = start(HOSTILE, "stands")
    process = closed._client._process
    closed.close()
    assert process.returncode == 0
    parameters = ExternalController.Parameters(command=(sys.executable, str(HOSTILE), "stands"))
    process = ExternalController(parameters, SETUP)._client._process
    # Killed, unless the end of its pipe was faster.
    assert process.returncode in (-9, 0)


def test_under_the_rotation_shim_it_is_closed_with_it_and_its_files_are_known():
    command = [sys.executable, str(HOSTILE), "stands"]
    block = {"primary_controller": {"plugin": "external", "command": command}}
    parameters = RotationShim.Parameters.model_validate(block)
    assert "hostile_client.py" in parameters.files_read()
    shim = RotationShim(parameters, SETUP)
    process = shim._primary._client._process
    shim.close()
    assert process.returncode == 0


@pytest.mark.skipif(sys.platform != "linux", reason="the kernel ends it with its parent on Linux")
def test_a_client_ends_with_the_process_that_has_started_it():
    code = f"""
import os, signal, sys
from drake_navbench.controllers.external.client_process import ClientProcess
client = ClientProcess([sys.executable, {str(HOSTILE)!r}, "stands"])
print(client._process.pid, flush=True)
os.kill(os.getpid(), signal.SIGKILL)
"""
    parent = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    pid = int(parent.stdout)
    while Path(f"/proc/{pid}/stat").exists():
        # Nobody may be there to take its exit code.
        if Path(f"/proc/{pid}/stat").read_text().split()[2] == "Z":
            return
        time.sleep(0.01)
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


SCENARIO = Scenario(**SHORT_DRIVE)


def column(*command: str) -> Preset:
    return Preset("client", "external", "a client", {"command": list(command)}, "client")


def example(name: str, *arguments: str) -> Preset:
    return column(*arguments, str(EXAMPLES / name))


def motion(log) -> pd.DataFrame:
    return log.samples.drop(columns=list(UNREPEATABLE_COLUMNS))


@pytest.fixture(scope="module")
def driven_in_python():
    return run_trial(SCENARIO, example("carrot_client.py", sys.executable), seed=3)


def test_the_python_example_reaches_the_goal_with_its_digest_in_the_log(driven_in_python):
    assert driven_in_python.outcome is Outcome.SUCCEEDED
    assert "carrot_client.py" in driven_in_python.info["controller_files"]
    assert "bearing_rad" in driven_in_python.diagnostics[0][1]


def test_the_same_trial_has_the_same_bytes(driven_in_python, tmp_path):
    again = run_trial(SCENARIO, example("carrot_client.py", sys.executable), seed=3)
    pd.testing.assert_frame_equal(motion(again), motion(driven_in_python), check_exact=True)
    assert again.info == driven_in_python.info


@pytest.mark.skipif(COMPILER is None, reason="there is no C++ compiler")
def test_the_cpp_example_drives_as_the_python_one(driven_in_python, tmp_path):
    options = ["-std=c++17", "-O0", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror"]
    program = tmp_path / "carrot_client"
    subprocess.run([COMPILER, *options, "-o", program, EXAMPLES / "carrot_client.cpp"], check=True)
    log = run_trial(SCENARIO, column(str(program)), seed=3)
    pd.testing.assert_frame_equal(motion(log), motion(driven_in_python), rtol=0.0, atol=1e-9)


@pytest.mark.parametrize(
    ("deed", "outcome", "told"),
    [
        ("dies", Outcome.ERROR, "ExternalControllerFailed: python"),
        ("finds no control", Outcome.ABORTED, "no way"),
    ],
)
def test_a_fault_costs_the_trial_in_which_it_happens(deed, outcome, told):
    log = run_trial(SCENARIO, column(sys.executable, str(HOSTILE), deed))
    assert log.outcome is outcome
    assert told in log.info["reason"]


def test_a_client_that_is_killed_from_outside_leaves_its_trial_undriven():
    with pytest.raises(EndedFromOutside):
        run_trial(SCENARIO, column(sys.executable, str(HOSTILE), "is killed"))
