"""A trial in which everything around the controller is a plugin of another package."""

from __future__ import annotations

from collections.abc import Iterator
from multiprocessing.forkserver import _forkserver
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from nav2_setups import read_nav2_files
from pydrake.systems.analysis import ApplySimulatorConfig, Simulator

from drake_navbench import run_trial
from drake_navbench.campaign.campaign import plan_campaign
from drake_navbench.errors import InputError
from drake_navbench.inputs.check import Status
from drake_navbench.inputs.presets import load_preset
from drake_navbench.inputs.robot import Robot, load_robot
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.outcome import Outcome
from drake_navbench.navigation.behavior_tree.board import Board
from drake_navbench.navigation.behavior_tree.description import (
    NAVIGATE_THROUGH_POSES,
    NAVIGATE_TO_POSE,
)
from drake_navbench.navigation.behavior_tree.navigators import navigator_tree
from drake_navbench.navigation.behavior_tree.snapshot import nodes_of
from drake_navbench.navigation.behaviors import make_behaviors
from drake_navbench.navigation.task import TaskState
from drake_navbench.trial.column_controller import make_controller
from drake_navbench.trial.diagram import build_trial_diagram
from drake_navbench.trial.simulation import INTEGRATION, trial_task
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.trial.trial import drive, simulate
from drake_navbench.typed_files.typed_yaml import validate

CODE = Path(__file__).parents[1] / "their_plugins.py"
ENTRY_POINTS = {
    "drake_navbench.planners": {"theirs::Detour": "theirs.theirs:Detour"},
    "drake_navbench.smoothers": {"thin": "theirs.theirs:Thin"},
    "drake_navbench.costmap_layers": {"theirs::Puddle": "theirs.theirs:Puddle"},
    "drake_navbench.goal_checkers": {"theirs::Within": "theirs.theirs:Within"},
    "drake_navbench.progress_checkers": {"theirs::Tired": "theirs.theirs:Tired"},
    "drake_navbench.behaviors": {"theirs::Shuffle": "theirs.theirs:Shuffle"},
    "drake_navbench.behavior_tree_nodes": {"theirs::Always": "theirs.theirs:Always"},
}
PUDDLE = (1.0, -0.6)
GOAL_X_M = 4.0
OVERRIDES: dict[str, Any] = {
    "navigation": {
        "planner": {"plugin": "theirs::Detour", "offset_m": 0.4},
        "goal_checker": {"plugin": "theirs::Within", "reach_m": 0.8},
        "progress_checker": {"plugin": "theirs::Tired", "from_s": 2.0, "until_s": 3.5},
        "local_costmap": {
            "plugins": ["obstacle_layer", "puddle", "inflation_layer"],
            "puddle": {"plugin": "theirs::Puddle", "centre": [*PUDDLE], "cost": 77},
        },
        "global_costmap": {
            "plugins": ["static_layer", "puddle", "inflation_layer"],
            "puddle": {"plugin": "theirs::Puddle", "centre": [*PUDDLE], "cost": 99},
        },
        "behavior_server": {"shuffle": {"plugin": "theirs/Shuffle", "distance_m": 0.2}},
        "behavior_tree": {
            "recovery_actions": ["sigh", "shuffle", "wait"],
            "sigh": {"plugin": "theirs::Always", "succeeds": False},
            "IsGoalNearby": {"plugin": "theirs::Always", "succeeds": False},
        },
    }
}
TASK = {
    "name": "theirs",
    "description": "nothing in the way",
    "goal": [GOAL_X_M, 0.0, 0.0],
    "navigation_mode": "navigate_to_pose",
    "timeout_s": 40.0,
    "plan": {"type": "planner", "smoother": {"plugin": "thin", "every": 3}},
    "robot_overrides": OVERRIDES,
}


@pytest.fixture
def installed(install_package, tmp_path, monkeypatch) -> Iterator[None]:
    install_package("theirs", CODE.read_text(), ENTRY_POINTS)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    # A server of the workers that runs already knows nothing of them, one that runs on too much.
    _forkserver._stop()
    yield
    _forkserver._stop()


def task(**changes) -> Scenario:
    return validate(Scenario, TASK | changes, "theirs.yaml")


def spec_of(scenario: Scenario) -> TrialSpec:
    return TrialSpec(scenario, scenario.load_robot("wheelchair"), load_preset("rpp"), seed=0)


class Watched(NamedTuple):
    """What was seen of a diagram: costs at the puddle every 0.5 s, and how the task ended."""

    local_costs: list[int]
    global_costs: list[int]
    state: TaskState


def watched(spec: TrialSpec) -> Watched:
    controller = make_controller(spec.preset, spec.robot)
    trial = build_trial_diagram(
        spec.robot, spec.scenario.true_world, controller, task=trial_task(spec)
    )
    context = trial.create_context(spec.scenario.start_pose(spec.seed), spec.seed)
    simulator = Simulator(trial.diagram, context)
    ApplySimulatorConfig(INTEGRATION, simulator)

    def value(system, port):
        return system.GetOutputPort(port).Eval(system.GetMyContextFromRoot(context))

    seen = Watched([], [], TaskState.RUNNING)
    while context.get_time() < spec.scenario.timeout_s and not seen.state.is_final:
        simulator.AdvanceTo(context.get_time() + 0.5)
        seen.local_costs.append(cost_at_puddle(value(trial.local_costmap, "costmap")))
        global_costmap = trial.diagram.GetSubsystemByName("global_costmap")
        seen.global_costs.append(cost_at_puddle(value(global_costmap, "costmap")))
        seen = seen._replace(state=value(trial.navigator, "task_status").state)
    return seen


def cost_at_puddle(costmap) -> int:
    column = int((PUDDLE[0] - costmap.origin_x) / costmap.resolution)
    row = int((PUDDLE[1] - costmap.origin_y) / costmap.resolution)
    rows, columns = costmap.costs.shape
    return int(costmap.costs[row, column]) if 0 <= row < rows and 0 <= column < columns else -1


def events_of(log: TrialLog, *nodes: str) -> list[tuple[str, str]]:
    return [
        (event["node"], event["status"])
        for _, event in log.events
        if event.get("node") in nodes and event["status"] != "idle"
    ]


def test_each_plugin_of_another_package_has_its_effect(installed):
    spec = spec_of(task())
    log, seen = simulate(spec), watched(spec)
    samples = log.samples
    # The planner: half a sine wave, 0.4 m to the left; the robot follows it.
    assert log.plans[0].poses[:, 1].max() == pytest.approx(0.4, abs=0.01)
    assert samples["y_m"].max() > 0.2
    # The smoother: every third pose of a path with one each 0.05 m along x.
    assert np.diff(log.plans[0].poses[:5, 0]) == pytest.approx(0.15, abs=0.01)
    # The layer: its cost, in both costmaps from its second cycle on.
    assert set(seen.local_costs) == {77}
    assert set(seen.global_costs) == {99}
    # The progress checker: the controller fails twice, and the recovery begins, while it is tired.
    recoveries = [time_s for time_s, event in log.events if event.get("node") == "RecoveryActions"]
    assert 2.0 <= recoveries[0] <= 3.5
    # The node that is a recovery fails, and the behaviour takes its turn: 0.2 m back at 0.1 m/s.
    assert events_of(log, "sigh", "shuffle") == [
        ("sigh", "failure"),
        ("shuffle", "running"),
        ("shuffle", "success"),
    ]
    back = samples[samples["command_v_mps"] < 0.0]
    assert back["command_v_mps"].min() == pytest.approx(-0.1)
    way_back_m = np.hypot(*(back[["x_m", "y_m"]].iloc[-1] - back[["x_m", "y_m"]].iloc[0]))
    assert way_back_m == pytest.approx(0.2, abs=0.03)
    # The node in the place of ours: no path is ever near its end, so each second brings a new one.
    assert ("IsGoalNearby", "failure") in events_of(log, "IsGoalNearby")
    assert len(log.plans) >= 5
    # The goal checker: the end is where it is near enough.
    last = samples.iloc[-1]
    assert np.hypot(last["x_m"] - GOAL_X_M, last["y_m"]) == pytest.approx(0.8, abs=0.03)
    assert log.outcome is Outcome.SUCCEEDED
    assert seen.state is TaskState.SUCCEEDED


@pytest.mark.usefixtures("real_workers")
def test_it_is_driven_in_a_worker_and_the_log_names_package_and_version(installed):
    log = run_trial(task(timeout_s=0.5), "rpp")
    assert log.outcome is Outcome.TIMED_OUT
    assert log.info["plugins"] == {
        "behavior theirs::Shuffle": "theirs 1.0",
        "behavior-tree node theirs::Always": "theirs 1.0",
        "costmap layer theirs::Puddle": "theirs 1.0",
        "goal checker theirs::Within": "theirs 1.0",
        "planner theirs::Detour": "theirs 1.0",
        "progress checker theirs::Tired": "theirs 1.0",
        "smoother thin": "theirs 1.0",
    }


def test_the_trials_of_a_scenario_with_plugins_have_workers_of_their_own(installed):
    ours = task(robot_overrides={}, plan={"type": "planner"}).model_copy(update={"name": "ours"})
    specs = plan_campaign([task(), ours], ["rpp", "dwb"], trials=1).specs
    assert [spec.code_owner for spec in specs] == ["rpp in theirs", "dwb in theirs", "", ""]
    assert not specs[-1].foreign_code


def test_settings_with_plugins_survive_being_written_and_read(installed):
    robot = task().load_robot("wheelchair")
    again = Robot.model_validate_json(robot.model_dump_json())
    assert again.navigation == robot.navigation
    assert again.navigation.local_costmap.plugin_blocks["puddle"].cost == 77
    assert Scenario.model_validate_json(task().model_dump_json()).plan == task().plan


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"planner": {"plugin": "theirs::Detour", "offset": 1.0}},
            "navigation.planner.offset: planner theirs::Detour has no such parameter; did you mean "
            "'offset_m'?, got 1.0",
        ),
        (
            {"planner": {"plugin": "theirs::Detour", "spacing_m": 0.0}},
            "navigation.planner.spacing_m: input should be greater than 0, got 0.0",
        ),
        (
            {"planner": {"plugin": "theirs::Detuor"}},
            "unknown plugin 'theirs::Detuor'; did you mean 'theirs::Detour'?",
        ),
        (
            {"local_costmap": {"puddle": {"plugin": "theirs::Puddle"}}},
            "navigation.local_costmap.puddle.centre: missing, but required",
        ),
        (
            {"local_costmap": {"puddel": {"plugin": "theirs::Puddel"}}},
            "navigation.local_costmap.puddel.plugin: costmap layer 'theirs::Puddel' is not "
            "registered; did you mean 'theirs::Puddle'?",
        ),
        (
            {"local_costmap": {"plugins": ["puddle", "pudle"]}},
            "navigation.local_costmap: plugins: got 'puddle', expected a layer of ours or the "
            "name of a block with `plugin`",
        ),
        (
            {"local_costmap": {"inflation_layr": {"inflation_radius": 1.0}}},
            "navigation.local_costmap.inflation_layr: unknown field; did you mean "
            "'inflation_layer'?",
        ),
        (
            {"behavior_tree": {"recovery_actions": ["shufle"]}},
            "navigation: behavior_tree.recovery_actions: unknown behaviour 'shufle'",
        ),
        (
            {
                "behavior_tree": {"shuffle": {"plugin": "theirs::Always"}},
                "behavior_server": {"shuffle": {"plugin": "theirs::Shuffle"}},
            },
            "navigation: behavior_tree.shuffle: found a behaviour of this name",
        ),
    ],
)
def test_what_is_wrong_in_a_plugin_s_block_is_one_line(installed, changes, message):
    with pytest.raises(InputError) as raised:
        task(robot_overrides={"navigation": changes}).load_robot("wheelchair")
    (line,) = str(raised.value).splitlines()
    assert line.startswith("scenario theirs: robot_overrides: ")
    assert message in line


def test_a_node_without_a_place_in_the_tree_is_refused(installed):
    nodes = {"IsGoalNearbye": {"plugin": "theirs::Always"}}
    with pytest.raises(InputError, match=r"tree.IsGoalNearbye: nothing runs it.*'IsGoalNearby'"):
        run_trial(task(robot_overrides={"navigation": {"behavior_tree": nodes}}), "rpp")


@pytest.mark.parametrize("leaf", ["ComputePathToPose", "RemovePassedGoals"])
def test_a_node_needs_a_place_in_the_tree_of_one_navigator_only(installed, leaf):
    board = Board(*[None] * 4)
    settings = task(
        robot_overrides={"navigation": {"behavior_tree": {leaf: {"plugin": "theirs::Always"}}}}
    ).load_robot("wheelchair")
    places = {
        mode: [
            node.name
            for node in nodes_of(navigator_tree(board, settings.navigation.behavior_tree, mode))
            if type(node).__name__ == "Always"
        ]
        for mode in (NAVIGATE_TO_POSE, NAVIGATE_THROUGH_POSES)
    }
    only = NAVIGATE_TO_POSE if leaf == "ComputePathToPose" else NAVIGATE_THROUGH_POSES
    assert places == {mode: [leaf] if mode == only else [] for mode in places}


@pytest.mark.parametrize(
    ("name", "line"),
    [
        ("Detour", "planner 'theirs::Detour'"),
        ("Thin", "smoother 'thin'"),
        ("Puddle", "costmap layer 'theirs::Puddle'"),
        ("Within", "goal checker 'theirs::Within'"),
        ("Tired", "progress checker 'theirs::Tired'"),
        ("Shuffle", "behavior 'theirs::Shuffle'"),
        ("Always", "behavior-tree node 'theirs::Always'"),
    ],
)
def test_a_plugin_that_cannot_be_made_is_named_before_anything_is_driven(
    name, line, install_package
):
    breaking = f"\n\ndef broken(self, *arguments):\n    1 / 0\n\n\n{name}.__init__ = broken\n"
    install_package("theirs", CODE.read_text() + breaking, ENTRY_POINTS)
    with pytest.raises(InputError) as raised:
        plan_campaign([task()], ["rpp"], trials=1)
    reason = "cannot be made: ZeroDivisionError: division by zero"
    assert str(raised.value) == f"{line} of package 'theirs': {reason}"


@pytest.mark.parametrize(
    ("name", "method", "reason"),
    [
        ("Detour", "plan", "planner theirs::Detour: got <class 'NoneType'>, expected an array"),
        ("Thin", "smooth", "smoother thin: got <class 'NoneType'>, expected an array (N, 3)"),
        ("Puddle", "observe", "costmap layer puddle: got None, expected an Observed"),
        ("Puddle", "write", "costmap layer puddle: got None, expected costs uint8"),
    ],
)
def test_a_plugin_that_returns_nonsense_ends_its_own_trial(name, method, reason, install_package):
    nonsense = f"\n\n{name}.{method} = lambda self, *arguments: None\n"
    install_package("theirs", CODE.read_text() + nonsense, ENTRY_POINTS)
    log = drive(spec_of(task(timeout_s=0.5)))
    assert log.outcome is Outcome.ERROR
    assert reason in log.info["reason"]


NAV2_FILE = """
controller_server:
  ros__parameters:
    goal_checker_plugins: [near]
    near: {plugin: "theirs::Within", reach_m: 0.7}
    controller_plugins: [FollowPath]
    FollowPath: {plugin: "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController"}
planner_server:
  ros__parameters:
    planner_plugins: [GridBased]
    GridBased: {plugin: "theirs/Detour", offset_m: 0.3}
behavior_server:
  ros__parameters:
    behavior_plugins: [spin, shuffle]
    spin: {plugin: "theirs::Shuffle", distance_m: 0.1}
    shuffle: {plugin: "theirs::Shuffle"}
local_costmap:
  local_costmap:
    ros__parameters:
      rolling_window: true
      plugins: [obstacle_layer, inflation_layer]
      obstacle_layer: {plugin: "theirs::Puddle", centre: [1.0, 0.5], cost: 9}
      inflation_layer: {plugin: "nav2_costmap_2d::InflationLayer"}
"""


def test_a_nav2_file_names_plugins_where_nav2_does(installed, tmp_path):
    path = tmp_path / "nav2.yaml"
    path.write_text(NAV2_FILE)
    setup = read_nav2_files([path], load_robot("wheelchair"), "wheelchair")
    navigation = setup.robot.navigation
    assert navigation.planner.offset_m == 0.3
    assert navigation.goal_checker.reach_m == 0.7
    assert navigation.local_costmap.plugins == ["obstacle_layer_plugin", "inflation_layer"]
    assert navigation.local_costmap.plugin_blocks["obstacle_layer_plugin"].centre == (1.0, 0.5)
    behaviors = make_behaviors(navigation.behavior_server)
    assert {type(behaviors[name]).__name__ for name in ("spin", "shuffle")} == {"Shuffle"}
    assert navigation.behavior_tree.recovery_actions == ("clear", "spin")
    rows = {row.parameter: row for row in setup.check.rows if row.node == "behavior_server"}
    assert "recovery_actions" in rows["shuffle.plugin"].remark
    assert rows["spin.distance_m"].status is Status.USED
    assert not setup.check.stand_ins
