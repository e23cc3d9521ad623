"""Brings the robot to its goals as Nav2 does: replanning and recoveries by a behaviour tree."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from py_trees.common import Status
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, LeafSystem, State

from drake_navbench.kernels.immutable import Immutable
from drake_navbench.kernels.read_only import read_only
from drake_navbench.logs.plans import Plan
from drake_navbench.navigation.behavior_tree.board import GOALS, Blackboard, Board, TickInputs
from drake_navbench.navigation.behavior_tree.description import (
    NAVIGATE_THROUGH_POSES,
    NAVIGATE_TO_POSE,
)
from drake_navbench.navigation.behavior_tree.navigators import navigator_tree
from drake_navbench.navigation.behavior_tree.settings import BehaviorTreeSettings
from drake_navbench.navigation.behavior_tree.snapshot import (
    Snapshot,
    nodes_of,
    restore,
    take_snapshot,
)
from drake_navbench.navigation.behavior_tree.tree_node import TreeNode
from drake_navbench.navigation.mission import MissionFollower
from drake_navbench.navigation.poses_follower import PosesFollower, PosesProgress
from drake_navbench.navigation.task import GlobalPlan, TaskState, TaskStatus
from drake_navbench.navigation.waypoint_follower import Progress, WaypointFollower
from drake_navbench.trial.systems.lifetime import weakly_bound
from drake_navbench.trial.systems.ports import (
    STATE_SIZE,
    declare_object_input,
    declare_state_part_output,
    read_object,
)

# The error code of a tree that fails while none of its actions has reported one.
UNKNOWN = 9000
# The time for which events are kept: longer than any recorder's period, so that none misses one, s.
EVENT_MEMORY_S = 0.2

STATUS_NAMES = {
    Status.INVALID: "idle",
    Status.RUNNING: "running",
    Status.SUCCESS: "success",
    Status.FAILURE: "failure",
}

Events = tuple[tuple[float, dict[str, Any]], ...]


@dataclass(frozen=True, eq=False)
class NavigatorState(Immutable):
    """The state of the navigator.

    tree: memory of the nodes. values: the blackboard. progress: progress over the waypoints.
    events: (time_s, mapping) of the last ticks that had any: changes of status, and new plans.
    plans: all plans given to the controller server so far.
    """

    tree: Snapshot
    values: Blackboard
    progress: Progress
    events: Events = ()
    plans: tuple[Plan, ...] = ()


class TreeNavigator(LeafSystem):
    """Nav2's bt_navigator with its default trees, and its waypoint follower.

    A PosesFollower makes it drive through all poses by one action, NavigateThroughPoses; any other
    follower to one goal after another.

    Inputs `estimate` [x m, y m, yaw rad, ...], in the map frame, `global_costmap` (Costmap),
    `server_state` (ServerState) and `behavior_status` (TaskStatus). Outputs `plan` (GlobalPlan or
    None), `behavior_goal` (BehaviorGoal or None), `clear_local` and `clear_global` (ClearRequest or
    None), `task_status` (TaskStatus of the whole task) and `navigator_state` (NavigatorState); for
    a mission over several floors also `floor_switch` (FloorSwitch or None), the last one, whose
    time may be yet to come.

    The tree is ticked when the trial starts, and then once a period from `offset_s` on. The first
    tick sees the true pose: the localization draws its first noise after it.

    Nav2 ticks the tree every 10 ms. One tick a control period, 10 ms after the controller's cycle,
    gives the servers the same inputs: the end of a task is noticed as soon as by Nav2's next tick,
    and a request between two ticks would take effect only with a server's next cycle. In the
    scenario dead_end every task begins and ends at the same time as with ticks of 10 ms, except
    where a decision depends on rounding, and a trial takes two thirds of the computing time.

    The py_trees tree held here is only a machine: a tick first sets it to the Context's snapshot.
    """

    def __init__(
        self,
        settings: BehaviorTreeSettings,
        follower: WaypointFollower,
        board: Board,
        *,
        period_s: float,
        offset_s: float,
    ) -> None:
        super().__init__()
        self._follower = follower
        goes_through = isinstance(follower, PosesFollower)
        navigator = NAVIGATE_THROUGH_POSES if goes_through else NAVIGATE_TO_POSE
        self._tree = _Machine(navigator_tree(board, settings, navigator), board)
        start = NavigatorState(
            tree=take_snapshot(self._tree.nodes),
            values=self._through_all() if goes_through else self._with_goal(Blackboard(), 0),
            progress=follower.first_progress(),
        )
        self._estimate_port = self.DeclareVectorInputPort("estimate", STATE_SIZE)
        self._costmap_port = declare_object_input(self, "global_costmap")
        self._server_port = declare_object_input(self, "server_state")
        self._behavior_port = declare_object_input(self, "behavior_status")
        self._state = self.DeclareAbstractState(AbstractValue.Make(start))
        parts = {
            "plan": lambda state: state.values.follow_path,
            "behavior_goal": lambda state: state.values.behavior,
            "clear_local": lambda state: state.values.clear_local,
            "clear_global": lambda state: state.values.clear_global,
            "task_status": lambda state: state.progress.status,
        }
        for name, select in parts.items():
            declare_state_part_output(self, name, self._state, select)
        if isinstance(follower, MissionFollower):
            declare_state_part_output(
                self, "floor_switch", self._state, lambda state: state.progress.switch
            )
        self.DeclareStateOutputPort("navigator_state", self._state)
        self.DeclareInitializationUnrestrictedUpdateEvent(weakly_bound(self._on_tick))
        self.DeclarePeriodicUnrestrictedUpdateEvent(period_s, offset_s, weakly_bound(self._on_tick))

    def _on_tick(self, context: Context, state: State) -> None:
        before: NavigatorState = context.get_abstract_state(self._state).get_value()
        if before.progress.status.state.is_final:
            return
        now_s = context.get_time()
        if before.progress.pause_end_s is not None:
            after = self._pause(before, now_s)
        else:
            x, y, yaw, forward, _, left = self._estimate_port.Eval(context)
            inputs = TickInputs(
                now_s=now_s,
                pose=np.array([x, y, yaw]),
                global_costmap=read_object(self._costmap_port, context),
                controller_status=self._server_port.Eval(context).status,
                behavior_status=read_object(self._behavior_port, context),
                twist=(forward, left),
            )
            after = self._navigate(before, inputs)
        state.get_mutable_abstract_state(self._state).set_value(after)

    def _with_goal(self, values: Blackboard, index: int) -> Blackboard:
        """Returns the blackboard at the start of the way to a waypoint."""
        return replace(
            values,
            goal_id=values.goal_id + 1,
            goal=np.array(self._follower.waypoints[index]),
            paths={},
            results={},
            recovery_count=0,
        )

    def _through_all(self) -> Blackboard:
        """Returns the blackboard at the start of the way through all poses."""
        progress = self._follower.first_progress()
        assert isinstance(progress, PosesProgress)
        goals = read_only(np.array(self._follower.waypoints))
        return Blackboard(goal_id=1, lists={GOALS: goals}, task_poses=progress.task_poses)

    def _pause(self, state: NavigatorState, now_s: float) -> NavigatorState:
        progress = self._follower.end_pause(state.progress, now_s)
        if progress is state.progress:
            return state
        return self._advanced(state, progress)

    def _advanced(self, state: NavigatorState, progress: Progress) -> NavigatorState:
        """Returns the state with new progress, and with a new goal where an action begins."""
        values = state.values
        if isinstance(progress, PosesProgress):
            return replace(state, progress=progress)
        if progress.index != state.progress.index:
            values = self._with_goal(values, progress.index)
        return replace(state, progress=progress, values=values)

    def _navigate(self, state: NavigatorState, inputs: TickInputs) -> NavigatorState:
        now_s = inputs.now_s
        if inputs.controller_status.state is TaskState.ERROR:
            return self._end_leg(state, inputs.controller_status, now_s)
        tree, values, events, result = self._tree.tick(state.tree, state.values, inputs)
        if events:
            recent = (event for event in state.events if now_s - event[0] < EVENT_MEMORY_S)
            events = (*recent, *events)
        new = replace(
            state,
            tree=tree,
            values=values,
            events=events or state.events,
            plans=_with_new_plan(state, values.follow_path, now_s),
        )
        if values.task_poses is not state.values.task_poses:
            new = replace(new, progress=self._noted(new, now_s))
        if result is Status.SUCCESS:
            return self._end_leg(new, TaskStatus(TaskState.SUCCEEDED, reason="goal reached"), now_s)
        if result is Status.FAILURE:
            return self._end_leg(new, _failure(values), now_s)
        return new

    def _noted(self, state: NavigatorState, now_s: float) -> PosesProgress:
        """Returns the progress after a tick in which the tree left poses behind or out."""
        assert isinstance(self._follower, PosesFollower)
        assert isinstance(state.progress, PosesProgress)
        values = state.values
        return self._follower.note_poses(
            state.progress, values.task_poses, now_s, values.recovery_count
        )

    def _end_leg(self, state: NavigatorState, status: TaskStatus, now_s: float) -> NavigatorState:
        progress = self._follower.end_leg(
            state.progress, status, now_s, state.values.recovery_count
        )
        return self._advanced(state, progress)


class _Machine:
    """The py_trees tree with its board; its own memory between ticks has no effect."""

    def __init__(self, root: TreeNode, board: Board) -> None:
        self._board = board
        self._root = root
        self.nodes = nodes_of(self._root)
        self._changes: list[dict[str, Any]] = []
        # The snapshot that the nodes are in, which need not be set again; None during a tick.
        self._standing: Snapshot | None = None
        for node in self.nodes:
            node.on_change = self._note_change

    def _note_change(self, name: str, status: Status) -> None:
        self._changes.append({"node": name, "status": STATUS_NAMES[status]})

    def tick(
        self, tree: Snapshot, values: Blackboard, inputs: TickInputs
    ) -> tuple[Snapshot, Blackboard, Events, Status]:
        """Ticks the tree once from a snapshot; a tree that ends is made idle."""
        board = self._board
        if tree is not self._standing:
            restore(self.nodes, tree)
        self._standing = None
        self._changes.clear()
        board.values, board.inputs = values, inputs
        self._root.tick_once()
        result = self._root.status
        if result is not Status.RUNNING:
            self._halt_all()
        changes = list(self._changes)
        if board.values.plan_count != values.plan_count and board.values.path is not None:
            changes.append({"plan_id": board.values.plan_count, "poses": len(board.values.path)})
        events = tuple((inputs.now_s, change) for change in changes)
        self._standing = take_snapshot(self.nodes)
        return self._standing, board.values, events, result

    def _halt_all(self) -> None:
        """Makes every node idle, and clears memories that outlive a success, as Nav2 does."""
        self._root.stop(Status.INVALID)
        for node in self.nodes:
            node.halt()


def _with_new_plan(
    state: NavigatorState, given: GlobalPlan | None, now_s: float
) -> tuple[Plan, ...]:
    """Returns the plans so far, and the controller server's newest one if it is new."""
    before = state.values.follow_path
    if given is None or (before is not None and given.plan_id == before.plan_id):
        return state.plans
    # All plans of NavigateThroughPoses belong to the one action, and lead to all poses that are
    # left.
    leg = 0 if isinstance(state.progress, PosesProgress) else state.progress.index
    return (*state.plans, Plan(now_s, given.poses, leg))


def _failure(values: Blackboard) -> TaskStatus:
    """Returns the failure with the least code on the blackboard, as Nav2 reports it."""
    failures = [status for status in values.results.values() if status.error_code != 0]
    if not failures:
        return TaskStatus(TaskState.ABORTED, UNKNOWN, "the behaviour tree failed")
    return min(failures, key=lambda status: status.error_code)
