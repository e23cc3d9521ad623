"""Requests a plan and reports the status of the whole task."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import Context, LeafSystem, State

from drake_navbench.kernels.immutable import Immutable
from drake_navbench.navigation.planner import PlanningError
from drake_navbench.navigation.task import GlobalPlan, TaskState, TaskStatus
from drake_navbench.trial.systems.lifetime import weakly_bound
from drake_navbench.trial.systems.ports import (
    STATE_SIZE,
    declare_object_input,
    declare_object_output,
    declare_state_part_output,
)


@dataclass(frozen=True)
class _NavigatorState(Immutable):
    plan: GlobalPlan | None = None
    planning_failure: TaskStatus | None = None


class Navigator(LeafSystem):
    """Nav2's FollowPath use: plan once at the start, follow it, end when the controller ends.

    Inputs `estimate` [x m, y m, yaw rad, ...], in the map frame, and `server_state` (ServerState).
    Outputs `plan` (GlobalPlan, or None before there is one) and `task_status` (TaskStatus of the
    whole task). The planner is a function from a start pose (3,) to plan poses
    (N, 3) that raises PlanningError. The plan starts from the true pose: the localization draws its
    first noise after the planning.
    """

    def __init__(self, make_plan: Callable[[NDArray[np.float64]], NDArray[np.float64]]) -> None:
        super().__init__()
        self._make_plan = make_plan
        self._estimate_port = self.DeclareVectorInputPort("estimate", STATE_SIZE)
        self._server_port = declare_object_input(self, "server_state")
        self._state = self.DeclareAbstractState(AbstractValue.Make(_NavigatorState()))
        declare_state_part_output(self, "plan", self._state, lambda state: state.plan)
        declare_object_output(
            self,
            "task_status",
            self._calc_task_status,
            {
                self.abstract_state_ticket(self._state),
                self.input_port_ticket(self._server_port.get_index()),
            },
        )
        self.DeclareInitializationUnrestrictedUpdateEvent(weakly_bound(self._on_start))

    def _on_start(self, context: Context, state: State) -> None:
        start = self._estimate_port.Eval(context)[:3]
        try:
            poses = np.ascontiguousarray(self._make_plan(start))
        except PlanningError as error:
            failure = TaskStatus(TaskState.ABORTED, error.code, str(error))
            new_state = _NavigatorState(planning_failure=failure)
        else:
            poses.flags.writeable = False
            new_state = _NavigatorState(plan=GlobalPlan(plan_id=1, poses=poses))
        state.get_mutable_abstract_state(self._state).set_value(new_state)

    def _calc_task_status(self, context: Context) -> TaskStatus:
        failure = context.get_abstract_state(self._state).get_value().planning_failure
        return failure or self._server_port.Eval(context).status
