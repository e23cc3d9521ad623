"""Whole trials of a behaviour tree around a controller: plans, recoveries, ends."""

import dataclasses

import numpy as np
import pandas as pd
import pytest
from navigation_scenes import box, scenario, simulate_stub, statuses
from pydrake.systems.analysis import ApplySimulatorConfig, InitializeParams, Simulator
from stub_controller import straight_ahead

from drake_navbench import run_trial
from drake_navbench.analysis.metrics import efficiency, tracking
from drake_navbench.analysis.metrics.registry import measure_all
from drake_navbench.controller import Decision, NoValidControl
from drake_navbench.inputs.presets import load_preset
from drake_navbench.inputs.robot import load_robot
from drake_navbench.inputs.scenario import Scenario, load_scenario
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.log_columns import UNREPEATABLE_COLUMNS
from drake_navbench.logs.outcome import Outcome
from drake_navbench.trial.column_controller import controller_setup
from drake_navbench.trial.diagram import build_trial_diagram
from drake_navbench.trial.simulation import INTEGRATION, trial_task
from drake_navbench.trial.spec import TrialSpec


@pytest.fixture(scope="module")
def past_pillars() -> TrialLog:
    """A drive between pillars that the planner's map does not show."""
    pillars = [
        {"type": "cylinder", "centre": centre, "radius_m": 0.3, "known_to_planner": False}
        for centre in ([3.0, 0.3], [5.5, -0.3])
    ]
    return run_trial(scenario(goal=[9.0, 0.0, 0.0], world={"obstacles": pillars}), "rpp", seed=1)


@pytest.fixture(scope="module")
def dead_end() -> TrialLog:
    return run_trial("dead_end", "rpp", seed=1)


def test_rpp_backs_out_of_a_dead_end_and_arrives(dead_end):
    assert dead_end.outcome is Outcome.SUCCEEDED
    assert ("BackUp", "success") in statuses(dead_end, "BackUp")
    assert dead_end.samples["clearance_m"].min() > 0.05


def test_the_dead_end_needs_its_recoveries():
    task = load_scenario("dead_end").model_copy(update={"navigation_mode": "follow_path"})
    assert run_trial(task, "rpp", seed=1).outcome is Outcome.ABORTED


def test_recoveries_come_in_nav2s_order_and_a_blocked_spin_gives_way_to_the_wait(dead_end):
    nodes = ["ClearingActions", "Spin", "Wait", "BackUp"]
    assert statuses(dead_end, *nodes) == [
        ("ClearingActions", "success"),
        ("Spin", "running"),
        ("Spin", "failure"),
        ("Wait", "running"),
        ("Wait", "success"),
        ("BackUp", "running"),
        ("BackUp", "success"),
    ]


def test_the_robot_stands_still_while_it_waits_and_drives_back_as_told(dead_end):
    times = {
        (event["node"], event["status"]): time_s
        for time_s, event in dead_end.events
        if event.get("node") in ("Wait", "BackUp")
    }
    samples = dead_end.samples.set_index("time_s")
    waiting = samples.loc[times["Wait", "running"] + 0.5 : times["Wait", "success"]]
    assert (waiting["command_v_mps"] == 0.0).all()
    assert times["Wait", "success"] - times["Wait", "running"] == pytest.approx(5.0, abs=0.15)
    backing = samples.loc[times["BackUp", "running"] + 0.2 : times["BackUp", "success"] - 0.3]
    np.testing.assert_allclose(backing["command_v_mps"], -0.15)
    driven = np.hypot(*(backing[["x_m", "y_m"]].iloc[-1] - backing[["x_m", "y_m"]].iloc[0]))
    assert driven == pytest.approx(0.3, abs=0.05)


def test_the_log_counts_recoveries_as_nav2s_feedback_does(dead_end):
    (leg,) = dead_end.info["legs"]
    assert leg["outcome"] == "succeeded"
    started = [
        status
        for status in statuses(
            dead_end,
            "Spin",
            "Wait",
            "BackUp",
            "ClearLocalCostmap-Context",
            "ClearLocalCostmap-Subtree",
            "ClearGlobalCostmap-Subtree",
        )
        if status[1] == "running" or status[0].startswith("Clear")
    ]
    assert leg["recovery_count"] == len(started)


def test_events_survive_the_log_file(dead_end, tmp_path):
    path = tmp_path / "trial.parquet"
    dead_end.write(path)
    assert TrialLog.read(path).events == dead_end.events


def test_a_tick_of_10_ms_as_in_nav2_changes_nothing_that_the_servers_see():
    def fails_for_a_while(observation, memory):
        if 1.0 < observation.time_s < 3.0:
            raise NoValidControl("not yet")
        return straight_ahead(observation, memory)

    begins_and_ends = []
    for duration_ms in (None, 10):
        settings = {"bt_loop_duration": duration_ms, "recovery_actions": ["clear", "wait"]}
        settings |= {"wait_duration": 0.5, "wrap_around": True, "number_of_retries": 20}
        task = scenario(robot_overrides={"navigation": {"behavior_tree": settings}})
        log = simulate_stub(fails_for_a_while, task)
        begins_and_ends.append(
            [
                (event["node"], event["status"], round(time_s, 6))
                for time_s, event in log.events
                if event.get("node") in ("FollowPath", "Wait")
            ]
        )
    assert len(begins_and_ends[0]) > 10
    assert begins_and_ends[0] == begins_and_ends[1]


def test_far_from_the_goal_it_plans_every_second_and_near_it_keeps_the_path():
    log = run_trial(scenario(goal=[7.0, 0.0, 0.0]), "rpp", seed=1)
    assert log.outcome is Outcome.SUCCEEDED
    plans = np.array([time_s for time_s, event in log.events if "plan_id" in event])
    # First at the start, and from the first regular tick after it once a second.
    np.testing.assert_allclose(np.diff(plans), 1.0, atol=0.051)
    assert [plan.time_s for plan in log.plans] == plans.tolist()
    x_m = np.interp(plans[-1], log.samples["time_s"], log.samples["x_m"])
    # A path of less than 4 m is kept.
    assert x_m == pytest.approx(7.0 - 4.0, abs=0.55)
    assert log.end_time_s > plans[-1] + 5.0


def test_every_plan_begins_at_the_robot_and_leads_to_the_goal(past_pillars):
    times = [plan.time_s for plan in past_pillars.plans]
    assert len(times) > 5
    for axis in ("x_m", "y_m"):
        driven = np.interp(times, past_pillars.samples["time_s"], past_pillars.samples[axis])
        column = ("x_m", "y_m").index(axis)
        # The pose that the planner is told has a noise of 5 mm.
        starts = [plan.poses[0, column] for plan in past_pillars.plans]
        np.testing.assert_allclose(starts, driven, atol=0.04)
    for plan in past_pillars.plans:
        np.testing.assert_allclose(plan.poses[-1, :2], [9.0, 0.0], atol=1e-6)


def test_a_straight_drive_of_known_length_and_speed_has_the_scores_worked_out_by_hand():
    log = simulate_stub(straight_ahead, scenario(goal=[10.0, 0.0, 0.0]))
    assert log.outcome is Outcome.SUCCEEDED
    assert len(log.plans) > 10
    assert efficiency.spl(log) == 1.0
    # OT = 10 m / (2 m/s) = 5 s. At 0.5 m/s the clock starts after 0.1 m and stops within a cycle of
    # 0.05 s of 0.25 m before the goal: AT = 9.65 m / (0.5 m/s) = 19.3 s.
    assert efficiency.barn_score(log) == pytest.approx(5.0 / 19.3, rel=0.005)
    assert tracking.cross_track_error_max_m(log) < 0.02
    assert tracking.plan_progress_ratio(log) == pytest.approx(9.75 / 10.0, abs=0.005)


def test_a_robot_that_replans_around_what_it_did_not_know_is_centimetres_off_its_plan(past_pillars):
    assert past_pillars.outcome is Outcome.SUCCEEDED
    # It had to leave the first plan, the straight line, by decimetres.
    assert past_pillars.samples["y_m"].abs().max() > 0.5
    assert tracking.cross_track_error_mean_m(past_pillars) < 0.05
    assert tracking.cross_track_error_max_m(past_pillars) < 0.25
    assert 0.9 < efficiency.spl(past_pillars) < 1.0


def test_a_log_with_all_plans_is_at_most_half_as_large_again_as_one_with_the_first(
    past_pillars, tmp_path
):
    sizes = []
    for name, plans in (("all", past_pillars.plans), ("first", past_pillars.plans[:1])):
        path = tmp_path / name
        dataclasses.replace(past_pillars, plans=plans).write(path)
        sizes.append(path.stat().st_size)
    assert sizes[0] < 1.5 * sizes[1]


def test_metrics_of_a_log_read_back_are_those_of_the_trial_to_the_last_bit(past_pillars, tmp_path):
    past_pillars.write(tmp_path / "trial.parquet")
    again = TrialLog.read(tmp_path / "trial.parquet")
    assert measure_all(again) == measure_all(past_pillars)


def test_plans_of_a_robot_that_stands_still_are_kept_once():
    exact = {"localization": {"xy_std_m": 0.0, "yaw_std_rad": 0.0}}
    task = scenario(goal=[9.0, 0.0, 0.0], robot_overrides=exact, timeout_s=5.0)
    log = simulate_stub(lambda o, m: Decision(np.zeros(2), m), task)
    assert sum("plan_id" in event for _, event in log.events) == 5
    assert [plan.time_s for plan in log.plans] == [0.0]


def test_without_wrap_around_the_task_aborts_right_after_the_last_recovery():
    def never(observation, memory):
        raise NoValidControl("no way")

    actions = {"recovery_actions": ["clear", "wait"], "wait_duration": 0.5}
    task = scenario(robot_overrides={"navigation": {"behavior_tree": actions}})
    log = simulate_stub(never, task)
    assert log.outcome is Outcome.ABORTED
    assert log.info["error_code"] == NoValidControl.code
    nodes = ["ClearingActions", "Wait", "NavigateRecovery"]
    assert statuses(log, *nodes)[-3:] == [
        ("Wait", "running"),
        ("Wait", "success"),
        ("NavigateRecovery", "failure"),
    ]


def test_with_wrap_around_seven_attempts_are_made():
    def never(observation, memory):
        raise NoValidControl("no way")

    actions = {"recovery_actions": ["clear", "wait"], "wait_duration": 0.5, "wrap_around": True}
    task = scenario(robot_overrides={"navigation": {"behavior_tree": actions}})
    log = simulate_stub(never, task)
    # Each attempt tries twice: once more after the local costmap was cleared.
    assert statuses(log, "FollowPath").count(("FollowPath", "failure")) == 2 * 7


def test_an_error_that_no_recovery_helps_against_aborts_at_once():
    ring = [
        box((2.0, -1.0), (4.0, -0.9)),
        box((2.0, 0.9), (4.0, 1.0)),
        box((2.0, -1.0), (2.1, 1.0)),
        box((3.9, -1.0), (4.0, 1.0)),
    ]
    task = scenario(world={"obstacles": ring}, start=[-1.0, 0.0, 0.0])
    log = simulate_stub(straight_ahead, task)
    assert log.outcome is Outcome.ABORTED
    assert log.info["error_code"] in (206, 208)
    assert statuses(log, "FollowPath") == []


def test_a_controller_that_breaks_ends_the_trial_as_an_error():
    def broken(observation, memory):
        raise ZeroDivisionError("one over nothing")

    log = simulate_stub(broken, scenario())
    assert log.outcome is Outcome.ERROR
    assert "broken" in log.info["traceback"]


def built(task: Scenario, preset: str = "rpp"):
    """Returns a diagram of a trial, and a simulator at its start."""
    robot = load_robot("wheelchair", task.robot_overrides)
    loaded = load_preset(preset)
    controller = loaded.controller_class(loaded.parameters, controller_setup(robot))
    spec = TrialSpec(task, robot, loaded, seed=1)
    trial = build_trial_diagram(robot, task.true_world, controller, task=trial_task(spec))
    return trial, simulator_of(trial, trial.create_context(task.start_pose(1), 1))


def simulator_of(trial, context) -> Simulator:
    time_s = context.get_time()
    simulator = Simulator(trial.diagram, context)
    # Applying a configuration sets the time to the configuration's start.
    ApplySimulatorConfig(INTEGRATION, simulator)
    simulator.get_mutable_context().SetTime(time_s)
    return simulator


def test_a_cloned_context_goes_on_exactly_as_the_one_it_was_cloned_from():
    trial, simulator = built(load_scenario("dead_end"))
    simulator.Initialize()
    # In the middle of the spin, with a running node in every layer of the tree.
    simulator.AdvanceTo(0.905)
    clone = simulator_of(trial, simulator.get_context().Clone())
    # It has begun already: the events of the start must not happen once more.
    clone.Initialize(InitializeParams(suppress_initialization_events=True))
    simulator.AdvanceTo(10.0)
    clone.AdvanceTo(10.0)
    first, second = simulator.get_context(), clone.get_context()
    np.testing.assert_array_equal(
        first.get_continuous_state_vector().CopyToVector(),
        second.get_continuous_state_vector().CopyToVector(),
    )
    port = trial.navigator.GetOutputPort("navigator_state")
    states = [port.Eval(trial.navigator.GetMyContextFromRoot(c)) for c in (first, second)]
    assert states[0].values.task_count == states[1].values.task_count
    assert states[0].events == states[1].events
    assert states[0].tree.statuses == states[1].tree.statuses


def samples_of(trial, contexts) -> list[dict[str, np.ndarray]]:
    """Returns each context's samples up to 1 s, driven in turns of a sixteenth of a second."""
    simulators = [simulator_of(trial, context) for context in contexts]
    for simulator in simulators:
        simulator.Initialize()
    for turn in range(1, 17):
        for simulator in simulators:
            simulator.AdvanceTo(turn / 16)
    recorder = trial.recorder
    recordings = [
        recorder.find_recording(recorder.GetMyContextFromRoot(simulator.get_context())).columns()
        for simulator in simulators
    ]
    return [
        {name: values for name, values in own.items() if name not in UNREPEATABLE_COLUMNS}
        for own in recordings
    ]


@pytest.mark.parametrize("preset", ["rpp", "teb"])
def test_two_contexts_of_one_diagram_drive_as_each_does_in_a_diagram_of_its_own(preset):
    """Nothing that evolves is kept in a system or a controller, as a solver's last result might."""
    task = load_scenario("restricted_small_noisy")

    def contexts(trial, seeds):
        return [trial.create_context(task.start_pose(seed), seed) for seed in seeds]

    alone = []
    for seed in (1, 2):
        trial, _ = built(task, preset)
        alone += samples_of(trial, contexts(trial, [seed]))
    trial, _ = built(task, preset)
    in_turns = samples_of(trial, contexts(trial, (1, 2)))
    again = samples_of(trial, contexts(trial, [1]))
    for expected, found in zip([*alone, alone[0]], in_turns + again, strict=True):
        for name, values in expected.items():
            np.testing.assert_array_equal(values, found[name])
    assert not np.array_equal(alone[0]["yaw_rad"], alone[1]["yaw_rad"])


def test_equal_seeds_give_equal_logs_with_a_behaviour_tree_too(dead_end):
    again = run_trial("dead_end", "rpp", seed=1)
    varying = list(UNREPEATABLE_COLUMNS)
    pd.testing.assert_frame_equal(
        again.samples.drop(columns=varying),
        dead_end.samples.drop(columns=varying),
        check_exact=True,
    )
    assert again.events == dead_end.events
