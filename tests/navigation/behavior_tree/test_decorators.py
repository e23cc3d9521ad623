"""Nodes around a child, and conditions, against Nav2's rules, tick by tick.

S, F, R stand for success, failure, running.
"""

from dataclasses import replace

import numpy as np
import pytest
from py_trees.common import Status
from scenes import straight_plan
from test_control_nodes import Script, ticked

from drake_navbench.navigation.behavior_tree.board import GOAL, Board, TickInputs
from drake_navbench.navigation.behavior_tree.builder import build_tree
from drake_navbench.navigation.behavior_tree.conditions import (
    AlwaysEnds,
    DistanceTraveled,
    GoalReached,
    PathExpiringTimer,
    TimeExpired,
)
from drake_navbench.navigation.behavior_tree.decorators import (
    ForceFailure,
    ForceSuccess,
    KeepRunningUntilFailure,
    Repeat,
    RetryUntilSuccessful,
    SequenceStar,
    SequenceWithMemory,
)
from drake_navbench.navigation.behavior_tree.description import NodeDescription
from drake_navbench.navigation.behavior_tree.leaves import CancelControl
from drake_navbench.navigation.behavior_tree.node_attributes import NotOurs
from drake_navbench.navigation.behavior_tree.pacing import (
    DistanceController,
    PathLongerOnApproach,
    SingleTrigger,
    SpeedController,
)
from drake_navbench.navigation.behavior_tree.snapshot import nodes_of, restore, take_snapshot
from drake_navbench.navigation.task import GlobalPlan
from drake_navbench.plugins.releases import Release


def board() -> Board:
    made = Board(lambda *_: None, lambda *_: True, lambda path, _: path, lambda *_: 0)
    made.inputs = TickInputs(now_s=0.0, pose=np.zeros(3), global_costmap=None)
    made.write(goal_id=1, goal=np.array([6.0, 0.0, 0.0]))
    return made


def at(shared: Board, node, **inputs) -> str:
    """Ticks a node with other inputs; x stands for the pose."""
    if "x" in inputs:
        inputs["pose"] = np.array([inputs.pop("x"), 0.0, 0.0])
    shared.inputs = replace(shared.inputs, **inputs)
    return ticked(node, 1)


def test_a_distance_controller_ticks_once_a_distance():
    shared, child = board(), Script("SSSS")
    node = DistanceController("n", child, shared, distance_m=1.0)
    assert [at(shared, node, x=x) for x in (0.0, 0.9, 1.0, 1.9, 2.0)] == list("SRSRS")
    assert child.tick_count == 3


def test_a_distance_controller_measures_from_where_it_was_idle():
    shared, child = board(), Script("SSSS")
    node = DistanceController("n", child, shared, distance_m=1.0)
    at(shared, node, x=0.0)
    node.stop(Status.INVALID)
    # At once, and then a metre from here.
    assert [at(shared, node, x=x) for x in (0.5, 1.4, 1.5)] == list("SRS")


def test_a_distance_controller_stays_with_a_child_that_runs():
    shared, child = board(), Script("RRS")
    node = DistanceController("n", child, shared, distance_m=1.0)
    assert [at(shared, node, x=x) for x in (0.0, 0.1, 0.2, 0.3)] == list("RRSR")


def speed_controller(shared, child):
    return SpeedController("n", child, shared, rates_hz=(0.5, 2.0), speeds_mps=(0.0, 1.0))


def due_times(speed, until_s=6.0):
    """Returns when a child is ticked at a steady speed, looked at each 0.125 s."""
    shared, child = board(), Script("S" * 99)
    node, times = speed_controller(shared, child), []
    for step in range(int(until_s * 8)):
        count = child.tick_count
        at(shared, node, now_s=step / 8, twist=(0.6 * speed, 0.8 * speed))
        if child.tick_count > count:
            times.append(step / 8)
    return times


def test_a_speed_controller_ticks_faster_the_faster_the_robot():
    # It begins at its largest rate.
    assert due_times(1.0, 2.0) == [0.0, 0.5, 1.0, 1.5]
    assert due_times(9.0, 2.0) == [0.0, 0.5, 1.0, 1.5]
    assert due_times(0.0) == [0.0, 0.5, 2.5, 4.5]
    # 0.5 + 1/3 * 1.5 = 1 Hz.
    assert due_times(1.0 / 3.0, 4.0) == [0.0, 0.5, 1.5, 2.5, 3.5]


def test_a_new_goal_begins_a_speed_controllers_time_anew():
    shared, child = board(), Script("SSSS")
    node = speed_controller(shared, child)
    assert at(shared, node, now_s=0.0) == "S"
    assert at(shared, node, now_s=0.1) == "R"
    shared.write(goal_id=2)
    assert at(shared, node, now_s=0.2) == "S"


def test_a_path_that_gets_much_longer_near_the_goal_ticks_the_child():
    shared = board()
    node = PathLongerOnApproach("n", Script("RF"), shared, near_m=3.0, factor=2.0)

    def with_path(length_m, spacing_m=0.1):
        path = straight_plan(length_m, spacing_m)
        path[:, 0] -= path[-1, 0]
        shared.write_path("path", path)
        return ticked(node, 1)

    assert with_path(2.0) == "S"
    assert with_path(3.9) == "S"
    # The one before was 3.9 m long: not near.
    assert with_path(8.0) == "S"
    assert with_path(2.0) == "S"
    assert with_path(4.2) == "R"
    assert with_path(4.2) == "F"
    # The same path is no new one.
    assert with_path(4.2) == "S"


def test_a_path_to_another_goal_is_not_compared():
    shared, child = board(), Script("")
    node = PathLongerOnApproach("n", child, shared, near_m=3.0, factor=2.0)
    for length_m in (1.0, 2.9):
        shared.write_path("path", straight_plan(length_m, 0.1))
        assert ticked(node, 1) == "S"


def test_in_iron_a_path_is_compared_only_while_the_node_is_not_idle():
    shared = replace(board(), release=Release.IRON)
    shared.inputs = TickInputs(now_s=0.0, pose=np.zeros(3), global_costmap=None)
    node = PathLongerOnApproach("n", Script("F"), shared, near_m=3.0, factor=2.0)
    results = ""
    for length_m, is_idle in ((1.0, False), (2.5, True), (6.0, False)):
        path = straight_plan(length_m, 0.1)
        path[:, 0] -= path[-1, 0]
        shared.write_path("path", path)
        if is_idle:
            node.stop(Status.INVALID)
        results += ticked(node, 1)
    assert results == "SSF"


def test_a_child_that_runs_when_the_path_is_short_again_goes_on_later():
    shared, child = board(), Script("RRS")
    node = PathLongerOnApproach("n", child, shared, near_m=3.0, factor=2.0)
    results = ""
    for length_m in (1.0, 2.5, 1.0, 2.5):
        path = straight_plan(length_m, 0.1)
        path[:, 0] -= path[-1, 0]
        shared.write_path("path", path)
        results += ticked(node, 1)
        if results == "SRS":
            node.stop(Status.INVALID)
    assert (results, child.halt_count) == ("SRSR", 0)
    node.stop(Status.INVALID)
    assert child.halt_count == 1


@pytest.mark.parametrize(("star", "result"), [(SequenceStar, "FFF"), (SequenceWithMemory, "FFS")])
def test_only_up_to_iron_a_sequence_with_memory_forgets_at_the_end_of_the_tree(star, result):
    node = star("n", [Script("SF"), Script("FFS")])
    results = ticked(node, 2)
    node.halt()
    assert results + ticked(node, 1) == result


@pytest.mark.parametrize(
    ("node", "result"),
    [
        (SingleTrigger("n", Script("RS")), "RSFF"),
        (KeepRunningUntilFailure("n", [Script("SRSF")]), "RRRF"),
        (ForceSuccess("n", [Script("RFS")]), "RSS"),
        (ForceFailure("n", [Script("RFS")]), "RFF"),
        (Repeat("n", Script("SRSSF"), limit=3), "RSF"),
        (Repeat("n", Script("SSF"), limit=-1), "RRF"),
        (RetryUntilSuccessful("n", Script("FRFFS"), limit=3), "RFS"),
        (RetryUntilSuccessful("n", Script("FFS"), limit=-1), "RRS"),
        # It goes on with the second child, and begins anew after a success.
        (SequenceWithMemory("n", [Script("SS"), Script("FSF")]), "FSF"),
        (AlwaysEnds("n", Status.FAILURE), "FF"),
    ],
    ids=lambda value: type(value).__name__ if not isinstance(value, str) else value,
)
def test_how_a_node_ends(node, result):
    assert ticked(node, len(result)) == result


def test_a_single_trigger_begins_anew_after_being_idle():
    child = Script("SS")
    node = SingleTrigger("n", child)
    assert ticked(node, 2) == "SF"
    node.stop(Status.INVALID)
    assert ticked(node, 1) == "S"


def test_time_expires_once_a_period():
    shared = board()
    node = TimeExpired("n", shared, period_s=1.0)
    times = (5.0, 5.9, 6.0, 6.1, 7.0)
    assert [at(shared, node, now_s=t) for t in times] == list("FFSFS")


def test_a_path_expires_unless_there_is_another_one():
    shared = board()
    node = PathExpiringTimer("n", shared, period_s=1.0)
    shared.write_path("path", straight_plan(1.0, 0.1))
    assert [at(shared, node, now_s=t) for t in (0.0, 0.9)] == list("FF")
    # An equal path is none, but as a new plan, whose stamp is another one.
    shared.write_path("path", straight_plan(1.0, 0.1))
    assert at(shared, node, now_s=1.0) == "S"
    shared.write_path("path", straight_plan(1.0, 0.1), plan_count=1)
    assert [at(shared, node, now_s=t) for t in (1.5, 2.4, 2.5)] == list("FFS")
    shared.write_path("path", straight_plan(2.0, 0.1))
    assert [at(shared, node, now_s=t) for t in (2.9, 3.8, 3.9)] == list("FFS")
    # Being idle does not begin the time anew.
    node.stop(Status.INVALID)
    assert at(shared, node, now_s=4.9) == "S"


def test_a_distance_is_travelled_as_the_crow_flies():
    shared = board()
    node = DistanceTraveled("n", shared, distance_m=1.0)
    assert [at(shared, node, x=x) for x in (5.0, 5.9, 6.0, 5.1, 5.0)] == list("FFSFS")


def test_the_goal_is_reached_within_the_tolerance():
    shared = board()
    node = GoalReached("n", shared, goal=GOAL, tolerance_m=0.25)
    assert [at(shared, node, x=x) for x in (5.7, 5.75)] == list("FS")


def test_control_is_cancelled_where_there_is_any():
    shared = board()
    assert ticked(CancelControl("n", shared), 1) == "S"
    shared.write(follow_path=GlobalPlan(1, straight_plan(1.0, 0.1), task_id=1))
    assert ticked(CancelControl("n", shared), 1) == "S"
    assert shared.values.follow_path.cancel_requested


def test_a_snapshot_holds_all_that_they_remember():
    shared = board()
    shared.write_path("path", straight_plan(1.0, 0.1))

    def tree():
        leaf = NodeDescription(node="PathExpiringTimer", attributes={"seconds": "0.3"})
        inner = NodeDescription(node="RetryUntilSuccessful", children=(leaf,))
        inner = inner.model_copy(update={"attributes": {"num_attempts": "2"}})
        faster = NodeDescription(node="SpeedController", children=(inner,))
        return build_tree(
            NodeDescription(
                node="DistanceController", attributes={"distance": "0.2"}, children=(faster,)
            ),
            shared,
        )

    whole, first, second = tree(), tree(), tree()
    places = [(0.1 * step, {"x": 0.13 * step, "now_s": 0.1 * step}) for step in range(12)]
    wanted = [at(shared, whole, **inputs) for _, inputs in places]
    found = [at(shared, first, **inputs) for _, inputs in places[:5]]
    restore(nodes_of(second), take_snapshot(nodes_of(first)))
    found += [at(shared, second, **inputs) for _, inputs in places[5:]]
    assert found == wanted
    assert len(set(wanted)) > 1


def test_the_frames_of_a_node_have_no_effect():
    frames = {"global_frame": "map", "robot_base_frame": "base_link"}
    leaf = NodeDescription(node="GoalReached", attributes={"goal": "{goal}"} | frames)
    assert ticked(build_tree(leaf, board()), 1) == "F"


@pytest.mark.parametrize(
    ("node", "attributes", "message"),
    [
        ("SpeedController", {"min_rate": "0"}, "expected rates above 0"),
        ("SpeedController", {"min_speed": "0.5"}, "expected two speeds"),
        ("Repeat", {}, "num_cycles: expected -1 or at least 1, got 0"),
        ("RetryUntilSuccessful", {"num_attempts": "x"}, "num_attempts: expected a number"),
        ("DistanceController", {"far": "1"}, "far: has no effect here"),
    ],
)
def test_an_attribute_that_makes_no_sense_is_named(node, attributes, message):
    child = NodeDescription(node="AlwaysSuccess")
    description = NodeDescription(node=node, attributes=attributes, children=(child,))
    with pytest.raises(NotOurs, match=message):
        build_tree(description, board())
