"""The controller server as the navigator sees it: tasks, preemption, cancelling, waiting."""

import re

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from scenes import straight_plan

from drake_navbench.controller import Decision, NoValidControl, SpeedLimit
from drake_navbench.inputs.navigation_settings import ControllerServerSettings
from drake_navbench.kernels.grid import Costmap
from drake_navbench.navigation.goal_checkers import SimpleGoalChecker, SimpleGoalCheckerParameters
from drake_navbench.navigation.path_handler import PathHandler, PathHandlerParameters
from drake_navbench.navigation.progress_checkers import (
    SimpleProgressChecker,
    SimpleProgressCheckerParameters,
)
from drake_navbench.navigation.task import ClearRequest, GlobalPlan, TaskState
from drake_navbench.trial.systems.controller_server import ControllerServer
from drake_navbench.trial.systems.ports import value_to_store

PERIOD_S = 0.05


class Counter:
    """A controller that counts its steps in its memory and keeps what it observed."""

    def __init__(self):
        self.seen = []

    def initial_memory(self):
        return 0

    def step(self, observation, memory):
        self.seen.append(observation)
        return Decision(np.array([0.1 * (memory + 1), 0.0]), memory + 1)


class Gentle(Counter):
    """One that wants three steps before it is cancelled."""

    def is_at_rest(self, memory):
        return memory >= 3


class Cutter(Counter):
    """One that cuts the plan itself."""

    cuts_plan = True


def plan(task_id=1, plan_id=1, length_m=2.95, **more) -> GlobalPlan:
    return GlobalPlan(plan_id, straight_plan(length_m), task_id=task_id, **more)


def costmap(stamp_s=0.0) -> Costmap:
    return Costmap(np.zeros((120, 120), dtype=np.uint8), -3.0, -3.0, 0.05, stamp_s=stamp_s)


class Rig:
    """A server with a cycle every 0.05 s from t = 0 on, whose inputs a test sets."""

    def __init__(self, controller, **settings):
        self.server = ControllerServer(
            controller,
            ControllerServerSettings(**settings),
            path_handler=PathHandler(PathHandlerParameters()),
            goal_checker=SimpleGoalChecker(SimpleGoalCheckerParameters()),
            progress_checker=SimpleProgressChecker(SimpleProgressCheckerParameters()),
            offset_s=0.0,
        )
        self.simulator = Simulator(self.server)
        self.context = self.simulator.get_mutable_context()
        self.cycle_count = 0
        self.give(odometry_estimate=np.zeros(6), costmap=costmap(), plan=None)

    def give(self, **inputs):
        for name, value in inputs.items():
            port = self.server.GetInputPort(name)
            port.FixValue(self.context, value_to_store(value))

    def run(self, cycles):
        """Runs some cycles and returns the state after them."""
        self.cycle_count += cycles
        # Shortly before the cycle after the last one.
        self.simulator.AdvanceTo(PERIOD_S * (self.cycle_count - 0.5))
        return self.state

    @property
    def state(self):
        return self.server.GetOutputPort("server_state").Eval(self.context)


def test_without_a_plan_it_does_nothing():
    controller = Counter()
    assert Rig(controller).run(4).status.state is TaskState.IDLE
    assert controller.seen == []


def test_a_preempting_plan_keeps_the_memory_and_a_new_task_starts_afresh():
    rig = Rig(Counter())
    rig.give(plan=plan())
    assert rig.run(2).memory == 2
    rig.give(plan=plan(plan_id=2))
    state = rig.run(2)
    assert (state.memory, state.plan_id) == (4, 2)
    rig.give(plan=plan(plan_id=2, task_id=2))
    state = rig.run(1)
    assert (state.memory, state.status.task_id) == (1, 2)


def test_a_task_that_has_ended_waits_for_the_next_one():
    rig = Rig(Counter())
    rig.give(plan=plan(length_m=0.05))
    state = rig.run(3)
    assert state.status.state is TaskState.SUCCEEDED
    assert state.memory == 0
    rig.give(plan=plan(task_id=2))
    assert rig.run(1).status.state is TaskState.RUNNING


def test_cancelling_stops_at_once():
    rig = Rig(Counter())
    rig.give(plan=plan())
    rig.run(2)
    rig.give(plan=plan(cancel_requested=True))
    state = rig.run(1)
    assert state.status.state is TaskState.CANCELED
    np.testing.assert_array_equal(state.command, [0.0, 0.0, 0.0])


def test_a_controller_that_slows_down_is_cancelled_when_it_is_at_rest():
    controller = Gentle()
    rig = Rig(controller)
    rig.give(plan=plan())
    rig.run(1)
    rig.give(plan=plan(cancel_requested=True))
    assert rig.run(2).status.state is TaskState.RUNNING
    assert controller.seen[-1].cancel_requested
    assert rig.run(1).status.state is TaskState.CANCELED
    assert len(controller.seen) == 3


def test_after_a_request_to_clear_it_waits_for_the_next_costmap_and_keeps_the_command():
    controller = Counter()
    rig = Rig(controller)
    rig.give(plan=plan(), clear_request=None)
    rig.run(2)
    rig.give(clear_request=ClearRequest(time_s=0.06))
    state = rig.run(3)
    assert len(controller.seen) == 2
    np.testing.assert_allclose(state.command, [0.2, 0.0, 0.0])
    rig.give(costmap=costmap(stamp_s=0.2))
    assert rig.run(1).memory == 3


@pytest.mark.parametrize(("release", "code"), [("lyrical", 107), ("iron", 107)])
def test_it_gives_up_on_a_costmap_that_never_becomes_current(release, code):
    rig = Rig(Counter(), costmap_update_timeout=0.3, nav2_release=release)
    rig.give(plan=plan(), clear_request=ClearRequest(time_s=0.0))
    # The first cycle waits for 0 s, the seventh for 0.30 s, the eighth for more.
    assert rig.run(7).status.state is TaskState.RUNNING
    assert rig.run(1).status.error_code == code


@pytest.mark.parametrize(
    ("release", "cycles", "code"),
    [("iron", 0, 0), ("jazzy", 0, 107), ("kilted", 0, 107), ("lyrical", 8, 0)],
)
def test_a_timeout_of_zero_means_what_it_does_in_its_release(release, cycles, code):
    # Iron waits for ever, Jazzy and Kilted not at all, Lyrical drives with the old costmap.
    controller = Counter()
    rig = Rig(controller, costmap_update_timeout=0.0, nav2_release=release)
    rig.give(plan=plan(), clear_request=ClearRequest(time_s=0.0))
    assert rig.run(8).status.error_code == code
    assert len(controller.seen) == cycles


@pytest.mark.parametrize(
    ("release", "cycles"),
    [("humble", 1), ("iron", 1), ("jazzy", 0), ("kilted", 1), ("lyrical", 0)],
)
def test_a_cycle_at_the_goal_makes_a_command_first_where_the_release_does(release, cycles):
    controller = Counter()
    rig = Rig(controller, nav2_release=release)
    rig.give(plan=plan(), odometry_estimate=np.array([*plan().poses[-1], 0.0, 0.0, 0.0]))
    state = rig.run(1)
    assert state.status.state is TaskState.SUCCEEDED
    assert (len(controller.seen), state.cycle_count) == (cycles, cycles)
    np.testing.assert_array_equal(state.command, np.zeros(3))


def test_the_controller_is_told_the_speed_limit():
    controller = Counter()
    rig = Rig(controller)
    rig.give(plan=plan())
    rig.run(1)
    rig.give(speed_limit=SpeedLimit(50.0, is_percentage=True))
    rig.run(1)
    assert controller.seen[0].speed_limit is None
    assert controller.seen[1].speed_limit == SpeedLimit(50.0, is_percentage=True)


class Broken(Counter):
    """One whose first call of a method raises."""

    def __init__(self, method):
        super().__init__()
        setattr(self, method, self._break)

    def is_at_rest(self, memory):
        return True

    def _break(self, *arguments):
        raise ZeroDivisionError("one over nothing\nand more")


@pytest.mark.parametrize("method", ["initial_memory", "step", "is_at_rest"])
def test_a_plugin_that_breaks_ends_its_task_with_the_traceback(method):
    rig = Rig(Broken(method))
    rig.give(plan=plan(cancel_requested=method == "is_at_rest"))
    status = rig.run(2).status
    assert status.state is TaskState.ERROR
    assert status.reason == "ZeroDivisionError: one over nothing"
    assert "_break" in status.traceback
    assert (status.task_id, status.time_s) == (1, 0.0)


class Talkative(Counter):
    """One that leaves what it is given as diagnostics."""

    def __init__(self, diagnostics):
        super().__init__()
        self._diagnostics = diagnostics

    def step(self, observation, memory):
        return Decision(np.zeros(2), memory, self._diagnostics)


LOGGABLE = {
    "nothing": {},
    "plain": {"count": 3, "cost": 0.5, "why": "slow", "is_near": True, "none": None},
    "numpy": {"count": np.int64(3), "cost": np.float32(0.5), "path": np.zeros((4, 3))},
    "nested": {"costs": {"goal": [1.0, np.float64(2.0)]}},
}
UNLOGGABLE = {
    "a set": ({"seen": {1, 2}}, "got set"),
    "an array of objects": ({"seen": np.array([{}, None])}, "seen: .* got an array of object"),
    "keys that are no text": ({1: 0.5}, "text as keys, got 1"),
    "no mapping": (["seen"], "a mapping, got list"),
}


@pytest.mark.parametrize("case", LOGGABLE)
def test_diagnostics_are_kept_as_the_controller_left_them(case):
    rig = Rig(Talkative(LOGGABLE[case]))
    rig.give(plan=plan())
    state = rig.run(1)
    assert state.status.state is TaskState.RUNNING
    assert state.diagnostics is LOGGABLE[case]


def test_the_default_diagnostics_are_empty_and_cannot_be_changed():
    diagnostics = Decision(np.zeros(2)).diagnostics
    assert diagnostics == {}
    with pytest.raises(TypeError):
        diagnostics["seen"] = 1


@pytest.mark.parametrize("case", UNLOGGABLE)
def test_diagnostics_that_no_log_can_hold_end_the_task(case):
    diagnostics, reason = UNLOGGABLE[case]
    rig = Rig(Talkative(diagnostics))
    rig.give(plan=plan())
    status = rig.run(1).status
    assert status.state is TaskState.ERROR
    assert re.search(reason, status.reason)


def test_details_of_a_failure_that_no_log_can_hold_end_the_task():
    class Failing(Counter):
        def step(self, observation, memory):
            raise NoValidControl("no way", details={("a", 1): 3})

    rig = Rig(Failing())
    rig.give(plan=plan())
    assert rig.run(1).status.state is TaskState.ERROR


def far_costmap() -> Costmap:
    """Returns a costmap on which no pose of the plan lies."""
    return Costmap(np.zeros((120, 120), dtype=np.uint8), 20.0, 20.0, 0.05)


def test_where_nothing_is_left_of_the_plan_the_task_ends():
    rig = Rig(Counter())
    rig.give(plan=plan(), costmap=far_costmap())
    status = rig.run(1).status
    assert (status.state, status.error_code) == (TaskState.ABORTED, 103)


def test_a_controller_that_cuts_the_plan_itself_decides_that():
    controller = Cutter()
    rig = Rig(controller)
    rig.give(plan=plan(), costmap=far_costmap())
    assert rig.run(2).status.state is TaskState.RUNNING
    (first, *_) = controller.seen
    assert first.plan is first.global_plan


def test_a_controller_that_takes_over_keeps_the_memory_and_drives_in_this_context_alone():
    first, second = Counter(), Counter()
    rig = Rig(first)
    rig.give(plan=plan())
    untouched = rig.context.Clone()
    rig.server.listen(None, lambda time_s: second if time_s > 1.5 * PERIOD_S else None)
    state = rig.run(4)
    # The cycles at 0.00 and 0.05 s are the first one's, those at 0.10 and 0.15 s the second one's.
    assert (len(first.seen), len(second.seen), state.memory) == (2, 2, 4)
    rig.server.listen(None, None)
    Simulator(rig.server, untouched).AdvanceTo(1.5 * PERIOD_S)
    assert (len(first.seen), len(second.seen)) == (4, 2)
