"""Each control node against Nav2's rule, as tables of what its children return tick by tick.

S, F, R stand for success, failure, running.
"""

import pytest
from py_trees.common import Status

from drake_navbench.navigation.behavior_tree.board import Board
from drake_navbench.navigation.behavior_tree.builder import build_tree
from drake_navbench.navigation.behavior_tree.control_nodes import (
    FallbackNode,
    InverterNode,
    NonblockingSequence,
    PipelineSequence,
    ReactiveFallbackNode,
    ReactiveSequenceNode,
    RecoveryNode,
    RoundRobinNode,
    SequenceNode,
)
from drake_navbench.navigation.behavior_tree.description import NodeDescription
from drake_navbench.navigation.behavior_tree.pacing import RateController
from drake_navbench.navigation.behavior_tree.snapshot import nodes_of, restore, take_snapshot
from drake_navbench.navigation.behavior_tree.tree_node import TreeNode
from drake_navbench.plugins.releases import Release

STATUS = {"S": Status.SUCCESS, "F": Status.FAILURE, "R": Status.RUNNING}
LETTER = {status: letter for letter, status in STATUS.items()}


class Script(TreeNode):
    """A leaf that returns the letters of a script, one a tick; it counts ticks and halts."""

    MEMORY = ("tick_count",)

    def __init__(self, script: str) -> None:
        super().__init__(script)
        self._script = script
        self.tick_count = 0
        self.halt_count = 0

    def update(self) -> Status:
        self.tick_count += 1
        return STATUS[self._script[self.tick_count - 1]]

    def terminate(self, new_status: Status) -> None:
        if new_status == Status.INVALID and self.status == Status.RUNNING:
            self.halt_count += 1


def ticked(node: TreeNode, count: int) -> str:
    """Returns the letters of `count` ticks of a node."""
    letters = ""
    for _ in range(count):
        node.tick_once()
        letters += LETTER[node.status]
    return letters


@pytest.mark.parametrize(
    ("scripts", "result"),
    [
        (["S", "S"], "S"),
        (["S", "F"], "F"),
        (["F", ""], "F"),
        # The first child is not ticked again while the second runs.
        (["S", "RRS"], "RRS"),
        # It begins anew after its end.
        (["SS", "FS"], "FS"),
    ],
)
def test_sequence(scripts, result):
    assert ticked(SequenceNode("n", [Script(s) for s in scripts]), len(result)) == result


@pytest.mark.parametrize(
    ("scripts", "result"),
    [(["S", ""], "S"), (["F", "S"], "S"), (["F", "F"], "F"), (["F", "RRF"], "RRF")],
)
def test_fallback(scripts, result):
    assert ticked(FallbackNode("n", [Script(s) for s in scripts]), len(result)) == result


@pytest.mark.parametrize(
    ("scripts", "result", "halts"),
    [
        # Every tick begins with the first child; its failure halts the one that runs.
        (["SSS", "RRS"], "RRS", [0, 0]),
        (["SSF", "RR"], "RRF", [0, 1]),
    ],
)
def test_reactive_sequence(scripts, result, halts):
    children = [Script(s) for s in scripts]
    assert ticked(ReactiveSequenceNode("n", children), len(result)) == result
    assert [child.halt_count for child in children] == halts


@pytest.mark.parametrize(
    ("scripts", "result", "halts"),
    [(["FFF", "RRF"], "RRF", [0, 0]), (["FFS", "RR"], "RRS", [0, 1])],
)
def test_reactive_fallback(scripts, result, halts):
    children = [Script(s) for s in scripts]
    assert ticked(ReactiveFallbackNode("n", children), len(result)) == result
    assert [child.halt_count for child in children] == halts


@pytest.mark.parametrize("reactive", [ReactiveSequenceNode, ReactiveFallbackNode])
def test_what_ended_beside_a_running_child_begins_anew_and_is_told_once(reactive):
    """Once a second, a rate controller ticks its child; here it does at every tick."""
    end = "S" if reactive is ReactiveSequenceNode else "F"
    once = RateController("rate", Script(3 * end), hz=1.0, now_s=lambda: 0.0)
    changes: list[str] = []
    once.on_change = lambda name, status: changes.append(LETTER[status])
    assert ticked(reactive("n", [once, Script("RRR")]), 3) == "RRR"
    assert once.children[0].tick_count == 3
    assert changes == [end]


@pytest.mark.parametrize(("release", "result"), [(Release.KILTED, "S"), (Release.LYRICAL, "F")])
def test_before_lyrical_a_round_robin_wraps_around(release, result):
    def nobody(*_):
        raise AssertionError("no leaf asks anybody")

    board = Board(nobody, nobody, nobody, nobody, release=release)
    leaf = NodeDescription(node="AlwaysSuccess")
    node = build_tree(NodeDescription(node="RoundRobin", children=(leaf,)), board)
    assert ticked(node, 1) == result


@pytest.mark.parametrize(("script", "result"), [("S", "F"), ("F", "S"), ("R", "R")])
def test_inverter(script, result):
    assert ticked(InverterNode("n", [Script(script)]), 1) == result


@pytest.mark.parametrize(
    ("main", "recovery", "retries", "result"),
    [
        ("S", "", 1, "S"),
        # A failure, a recovery and the next try happen in one tick.
        ("FS", "S", 1, "S"),
        ("FF", "S", 1, "F"),
        ("FFF", "SS", 2, "F"),
        # A recovery that fails ends the node at once, whatever retries are left.
        ("F", "F", 6, "F"),
        ("FR", "RRS", 1, "RRR"),
        # Running in between does not bring the retries back.
        ("FRF", "S", 1, "RF"),
        # A success does.
        ("FSFS", "SS", 1, "SS"),
        ("F", "", 0, "F"),
    ],
)
def test_recovery(main, recovery, retries, result):
    children = [Script(main), Script(recovery)]
    node = RecoveryNode("n", children, number_of_retries=retries)
    assert ticked(node, len(result)) == result
    assert [child.tick_count for child in children] == [len(main), len(recovery)]


def test_recovery_forgets_its_retries_when_it_is_halted():
    node = RecoveryNode("n", [Script("FRFR"), Script("SS")], number_of_retries=1)
    assert ticked(node, 1) == "R"
    node.stop(Status.INVALID)
    assert ticked(node, 1) == "R"


@pytest.mark.parametrize(
    ("scripts", "result", "ticks"),
    [
        (["S", "S"], "S", [1, 1]),
        # Earlier children are ticked at every tick.
        (["SSS", "RRS"], "RRS", [3, 3]),
        # One that runs does not hold up the later one that was reached before ...
        (["SRS", "RRS"], "RRS", [3, 3]),
        # ... but one that was not.
        (["RRS", "S"], "RRS", [3, 1]),
        (["SF", "R"], "RF", [2, 1]),
    ],
)
def test_pipeline(scripts, result, ticks):
    children = [Script(s) for s in scripts]
    assert ticked(PipelineSequence("n", children), len(result)) == result
    assert [child.tick_count for child in children] == ticks


def test_pipeline_halts_what_runs_when_an_earlier_child_fails():
    children = [Script("SF"), Script("R")]
    assert ticked(PipelineSequence("n", children), 2) == "RF"
    assert children[1].halt_count == 1


@pytest.mark.parametrize(
    ("scripts", "wrap_around", "result", "ticks"),
    [
        # Each tick goes on behind the last success.
        (["S", "S", "S"], True, "SSS", [1, 1, 1]),
        (["SS", "S", "S"], True, "SSSS", [2, 1, 1]),
        # Without wrap_around the end of the last child is a failure, even its success.
        (["S", "S", "S"], False, "SSF", [1, 1, 1]),
        (["S", "S", "RS"], False, "SSRF", [1, 1, 2]),
        # ... after which it begins with the first.
        (["SS", "S", "F"], False, "SSFS", [2, 1, 1]),
        # A failure is followed by the next child in the same tick.
        (["F", "F", "S"], True, "S", [1, 1, 1]),
        (["F", "F", "F"], True, "F", [1, 1, 1]),
        (["S", "F", "R"], True, "SR", [1, 1, 1]),
    ],
)
def test_round_robin(scripts, wrap_around, result, ticks):
    children = [Script(s) for s in scripts]
    node = RoundRobinNode("n", children, wrap_around=wrap_around)
    assert ticked(node, len(result)) == result
    assert [child.tick_count for child in children] == ticks


def test_round_robin_keeps_its_place_over_a_success_but_not_over_a_halt():
    children = [Script("SS"), Script("R"), Script("")]
    node = RoundRobinNode("n", children, wrap_around=True)
    assert ticked(node, 1) == "S"
    node.stop(Status.INVALID)  # idle after its success, as its parent leaves it
    assert ticked(node, 1) == "R"
    node.stop(Status.INVALID)  # halted while it runs
    assert ticked(node, 1) == "S"
    assert [child.tick_count for child in children] == [2, 1, 0]


def test_rate_ticks_its_child_at_first_and_a_period_after_each_success():
    clock = [0.0]
    child = Script("SSS")
    node = RateController("n", child, hz=1.0, now_s=lambda: clock[0])
    letters = ""
    for time_s in (0.03, 0.5, 1.02, 1.03, 1.9, 2.03):
        clock[0] = time_s
        letters += ticked(node, 1)
    # 1.03 - 0.03 is a second, although not in floating point.
    assert letters == "SRRSRS"
    assert child.tick_count == 3


def test_rate_ticks_a_running_child_at_every_tick_and_counts_from_its_success():
    clock = [0.0]
    child = Script("RRSS")
    node = RateController("n", child, hz=1.0, now_s=lambda: clock[0])
    letters = ""
    for time_s in (0.0, 0.4, 0.8, 1.2, 1.8):
        clock[0] = time_s
        letters += ticked(node, 1)
    assert letters == "RRSRS"


def test_rate_ticks_its_child_at_once_after_a_halt():
    node = RateController("n", Script("SS"), hz=1.0, now_s=lambda: 0.5)
    assert ticked(node, 2) == "SR"
    node.stop(Status.INVALID)
    assert ticked(node, 1) == "S"


def test_every_change_of_a_status_is_reported_once():
    changes = []
    node = SequenceNode("outer", [Script("RS")])
    for inner in nodes_of(node):
        inner.on_change = lambda name, status: changes.append((name, status))
    ticked(node, 2)
    assert changes == [
        ("RS", Status.RUNNING),
        ("outer", Status.RUNNING),
        ("RS", Status.SUCCESS),
        ("RS", Status.INVALID),
        ("outer", Status.SUCCESS),
    ]


def recovery_tree() -> TreeNode:
    """Returns a tree with something to remember in every kind of node."""
    steps = SequenceNode("steps", [Script("SSS"), Script("RFRFR"), Script("")])
    actions = RoundRobinNode("actions", [Script("S"), Script("RS")], wrap_around=True)
    return RecoveryNode("root", [steps, actions], number_of_retries=3)


@pytest.mark.parametrize("count", range(4))
def test_a_tree_set_to_a_snapshot_goes_on_as_the_one_it_was_taken_from(count):
    first, second = recovery_tree(), recovery_tree()
    ticked(first, count)
    restore(nodes_of(second), take_snapshot(nodes_of(first)))
    assert take_snapshot(nodes_of(second)) == take_snapshot(nodes_of(first))
    assert ticked(second, 1) == ticked(first, 1)
    assert take_snapshot(nodes_of(second)) == take_snapshot(nodes_of(first))


@pytest.mark.parametrize(
    ("scripts", "result"),
    [
        (["S", "S"], "S"),
        # All are ticked again until all succeed in one tick.
        (["RSS", "SRS"], "RRS"),
        (["RR", "RF"], "RF"),
        (["F", ""], "F"),
    ],
)
def test_nonblocking_sequence(scripts, result):
    children = [Script(script) for script in scripts]
    assert ticked(NonblockingSequence("n", children), len(result)) == result
    assert all(child.status == Status.INVALID for child in children)
