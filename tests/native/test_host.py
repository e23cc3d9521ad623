"""The host: how a plugin is called, and what its faults cost."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from controller_scenes import observe, setup_of
from scenes import SHORT_DRIVE

from drake_navbench import run_trial
from drake_navbench.controller import ControllerError, InvalidPath, NoValidControl, SpeedLimit
from drake_navbench.controllers.external import ExternalController
from drake_navbench.controllers.external.client_process import ExternalControllerFailed
from drake_navbench.errors import InputError, InputWarning
from drake_navbench.inputs.presets import load_preset
from drake_navbench.inputs.robot import load_robot
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.kernels.grid import Costmap
from drake_navbench.logs.log_columns import UNREPEATABLE_COLUMNS
from drake_navbench.logs.outcome import Outcome
from drake_navbench.trial.column_controller import check_controller

SETUP = setup_of(np.array([[0.3, 0.2], [0.3, -0.2], [-0.3, -0.2], [-0.3, 0.2]]))
PLAN = np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [1.0, 0.0, 0.1]])
SCENARIO = Scenario(**SHORT_DRIVE)
FREE = Costmap(np.zeros((60, 60), np.uint8), -1.5, -1.5, 0.05)
OBSERVATION = observe(PLAN, time_s=0.25, twist=(0.1, 0.0), costmap=FREE, global_plan=PLAN)


@pytest.fixture
def begin(tiny):
    """A function that starts a host with parameters of the tiny controller."""
    started = []

    def start(deadline_s: float = 5.0, **values) -> ExternalController:
        client = {"plugin": "tiny::Controller", "parameters": values}
        parameters = ExternalController.Parameters(
            command=[str(tiny.host)], client=client, deadline_s=deadline_s
        )
        started.append(ExternalController(parameters, SETUP))
        return started[-1]

    yield start
    for controller in started:
        controller.close()


def _step(controller, observation=OBSERVATION):
    return controller.step(observation, controller.initial_memory())


def test_a_plugin_is_given_plan_pose_and_transforms(begin):
    # The plan ends at (1, 0), so from (0, -1) and turned by 0.2 rad it is 45 degrees less 0.2 rad.
    decision = _step(begin(), replace(OBSERVATION, pose=np.array([0.0, -1.0, 0.2])))
    assert decision.command == pytest.approx([0.3, math.pi / 4 - 0.2], abs=1e-15)


@pytest.mark.parametrize("yaw", [0.0, 1e-9, 0.3, -2.0, 3.1, math.pi])
def test_a_heading_arrives_as_it_was(begin, yaw):
    observation = replace(OBSERVATION, pose=np.array([0.0, 0.0, yaw]))
    assert _step(begin(deed="tells yaw"), observation).command[0] == pytest.approx(yaw, abs=1e-15)


def test_a_plugin_reads_the_costmap(begin):
    costs = np.zeros((60, 60), np.uint8)
    # The cell of x in [0.5, 0.55), y in [-1, -0.95).
    costs[10, 40] = 254
    there = replace(OBSERVATION, costmap=Costmap(costs, -1.5, -1.5, 0.05))
    controller = begin()
    on_it = replace(there, pose=np.array([0.52, -0.98, 0.0]))
    beside = replace(there, pose=np.array([0.52, -0.93, 0.0]))
    assert _step(controller, on_it).command[0] == 0.0
    assert _step(controller, beside).command[0] == 0.3


def test_time_is_that_of_the_trial(begin):
    assert _step(begin(deed="tells time")).command[0] == 0.25


def test_a_whole_number_serves_where_a_plugin_wants_a_real_one(begin):
    assert _step(begin(speed=1)).command[0] == 1.0


def test_a_speed_limit_is_told_when_it_changes_and_when_it_ends(begin):
    controller = begin()
    half = replace(OBSERVATION, speed_limit=SpeedLimit(50.0, is_percentage=True))
    slow = replace(OBSERVATION, speed_limit=SpeedLimit(0.1))
    speeds = [_step(controller, seen).command[0] for seen in (half, slow, OBSERVATION)]
    assert speeds == [0.15, 0.1, 0.3]


def test_each_task_but_the_first_begins_with_a_reset(begin):
    controller = begin(deed="tells resets")
    assert [_step(controller).command[0] for _ in range(3)] == [0.0, 1.0, 2.0]


def test_one_that_slows_down_by_itself_is_waited_for(begin):
    controller = begin(slows_down=True, speed=0.15)
    memory = controller.initial_memory()
    assert not controller.is_at_rest(memory)
    cancelled = replace(OBSERVATION, cancel_requested=True)
    first = controller.step(cancelled, memory)
    second = controller.step(cancelled, first.memory)
    assert [controller.is_at_rest(d.memory) for d in (first, second)] == [False, True]


def test_one_that_does_not_is_cancelled_at_once(begin):
    controller = begin()
    assert controller.is_at_rest(controller.initial_memory())


@pytest.mark.parametrize(
    ("deed", "kind", "words"),
    [
        ("finds no control", NoValidControl, "tiny: sees no way"),
        ("finds no path", InvalidPath, "tiny: sees no plan"),
        ("throws", ControllerError, "tiny: lost its mind"),
    ],
)
def test_what_a_plugin_throws_is_the_failure_that_nav2s_server_would_answer(
    begin, deed, kind, words
):
    with pytest.raises(ControllerError, match=words) as failure:
        _step(begin(deed=deed))
    assert type(failure.value) is kind


def test_a_plugin_that_crashes_ends_its_process_with_its_last_words(begin):
    with pytest.raises(ExternalControllerFailed, match="signal 6") as failure:
        _step(begin(deed="crashes"))
    assert "tiny: about to crash" in str(failure.value)


def test_a_plugin_that_throws_what_nobody_catches_ends_its_process(begin):
    with pytest.raises(ExternalControllerFailed, match="signal 6"):
        _step(begin(deed="throws nothing known"))


def test_a_plugin_that_hangs_is_killed(begin):
    with pytest.raises(ExternalControllerFailed, match=r"no answer to compute within 0\.2 s"):
        _step(begin(deadline_s=0.2, deed="hangs"))


def test_a_plugin_that_refuses_its_parameters_is_wrong_input(begin):
    with pytest.raises(InputError, match="tiny: does not like its parameters"):
        begin(deed="refuses")


def test_a_parameter_of_another_type_is_wrong_input(begin):
    with pytest.raises(InputError, match=r"'FollowPath\.speed' has invalid type"):
        begin(speed="fast")


def test_a_plugin_that_is_not_linked_is_wrong_input(tiny):
    parameters = ExternalController.Parameters(
        command=[str(tiny.host)], client={"plugin": "no::Such", "parameters": {}}
    )
    with pytest.raises(InputError, match=r"no::Such.*Declared types are .*tiny::Controller"):
        ExternalController(parameters, SETUP)


def test_a_column_names_a_plugin_of_a_build(tiny):
    preset = load_preset("tiny::Controller@tiny:speed=0.25")
    assert preset.name == "tiny::Controller@tiny:speed=0.25"
    assert preset.description == "the original of tiny::Controller, Nav2 jazzy 1.3.99"
    assert preset.parameters.client["parameters"] == {"speed": 0.25}
    assert set(preset.file_hashes) == {"nav2_host"}


def test_a_column_of_a_port_has_its_parameters(tiny, monkeypatch):
    plugin = load_preset("rpp").controller_class.nav2_plugin
    both = {"controllers": (*tiny.controllers, plugin)}
    monkeypatch.setattr(
        "drake_navbench.inputs.originals.find_build", lambda name: tiny.model_copy(update=both)
    )
    original = load_preset("rpp@tiny:lookahead_dist=0.7").parameters.client
    assert original["plugin"] == plugin
    port = load_preset("rpp:lookahead_dist=0.7").values
    assert original["parameters"] == port


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("rpp@nowhere", "build 'nowhere' is not known"),
        ("rpp@", "name of a build: got ''"),
        ("rpp@tiny", "is not in the build: it has tiny::Controller"),
        ("vector_pursuit_of_nobody@tiny", "is not known"),
        ("learned@tiny", "it is not a port of a Nav2 controller"),
        ("tiny::Controller@tiny:speed", "expected param=value"),
    ],
)
def test_a_column_that_cannot_be_had_is_one_line(tiny, text, words):
    with pytest.raises(InputError, match=words) as error:
        load_preset(text)
    assert "\n" not in str(error.value)


def test_parameters_that_a_plugin_does_not_know_are_told(tiny):
    preset = load_preset("tiny::Controller@tiny:spede=0.25")
    with pytest.warns(InputWarning, match="does not read spede"):
        check_controller(preset, load_robot("wheelchair"))


def test_a_trial_is_driven_and_repeated_to_the_last_bit(tiny):
    logs = [run_trial(SCENARIO, "tiny::Controller@tiny", seed=1) for _ in range(2)]
    first, second = (log.samples.drop(columns=list(UNREPEATABLE_COLUMNS)) for log in logs)
    pd.testing.assert_frame_equal(first, second, check_exact=True)
    assert logs[0].outcome is not Outcome.ERROR


def test_a_crash_ends_its_own_trial_and_is_told_in_its_log(tiny):
    log = run_trial(SCENARIO, "tiny::Controller@tiny:deed=crashes", seed=1)
    assert log.outcome is Outcome.ERROR
    assert "tiny: about to crash" in log.info["reason"]
