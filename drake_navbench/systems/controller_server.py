"""Hosts one controller plugin: rate, goal and progress checks, patience, error codes."""

from __future__ import annotations

import math
import time
import traceback
from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import BasicVector, Context, InputPort, LeafSystem, State

from drake_navbench.controller import (
    Controller,
    ControllerError,
    Decision,
    GracefulController,
    NoValidControl,
    Observation,
    SpeedLimit,
)
from drake_navbench.kernels.grid import Costmap
from drake_navbench.kernels.read_only import read_only
from drake_navbench.navigation.goal_checkers import GoalChecker
from drake_navbench.navigation.path_handler import PathHandler
from drake_navbench.navigation.progress_checkers import SimpleProgressChecker
from drake_navbench.navigation.task import ClearRequest, GlobalPlan, TaskState, TaskStatus
from drake_navbench.noise import NoiseKey, NoiseStream
from drake_navbench.robot import ControllerServerSettings

PATIENCE_EXCEEDED = 104
FAILED_TO_MAKE_PROGRESS = 105
CONTROLLER_TIMED_OUT = 107
PATIENT_FOR_EVER = -1.0
NANOSECOND_DIGITS = 9
STANDSTILL = read_only(np.zeros(2))


class ServerState(NamedTuple):
    """Everything of the server that evolves.

    command: (2,) last command published, v m/s, w rad/s. cycle_count: cycles computed so far.
    compute_time_ms: wall-clock time of the last call of the controller.
    diagnostics: what the controller left in that cycle.
    waiting_since_s: when the wait for a current costmap began, None where there is none.
    """

    status: TaskStatus = TaskStatus()
    plan_id: int = 0
    path: Any = None
    goal_check: Any = None
    progress_check: Any = None
    memory: Any = None
    last_valid_time_s: float = 0.0
    command: NDArray[np.float64] = STANDSTILL
    cycle_count: int = 0
    compute_time_ms: float = 0.0
    diagnostics: Mapping[str, Any] = MappingProxyType({})
    waiting_since_s: float | None = None

    def __deepcopy__(self, memo: dict) -> Self:
        """Returns itself: a state never changes, so Drake's copies cost nothing."""
        return self


class ControllerServer(LeafSystem):
    """Nav2's controller server around one controller, as one unrestricted update a control period.

    Inputs `estimate` [x m, y m, yaw rad, v m/s, w rad/s], `costmap` (Costmap or None), `plan`
    (GlobalPlan or None), `speed_limit` (SpeedLimit or None; not connected: no limit) and
    `clear_request` (ClearRequest or None; not connected: none). Outputs `command` [v m/s, w rad/s],
    `server_state` (ServerState) and `status` (TaskStatus). Abstract parameter `seed_parameter`
    holds the trial's seed.

    Order of a cycle as in nav2_controller's computeControl: cancel, new path, wait for a current
    costmap, cut of the path, goal test, progress test, command. A costmap is not current from the
    request to clear it until its next update. The first cycle runs at `offset_s`.
    """

    def __init__(
        self,
        controller: Controller,
        settings: ControllerServerSettings,
        *,
        path_handler: PathHandler,
        goal_checker: GoalChecker,
        progress_checker: SimpleProgressChecker,
        offset_s: float,
    ) -> None:
        super().__init__()
        self._controller = controller
        self._settings = settings
        self._path_handler = path_handler
        self._goal_checker = goal_checker
        self._progress_checker = progress_checker
        self._period_s = 1.0 / settings.controller_frequency
        self._offset_s = offset_s
        self.seed_parameter = self.DeclareAbstractParameter(AbstractValue.Make(0))
        self._estimate_port = self.DeclareVectorInputPort("estimate", 5)
        self._costmap_port = self.DeclareAbstractInputPort("costmap", AbstractValue.Make(object()))
        self._plan_port = self.DeclareAbstractInputPort("plan", AbstractValue.Make(object()))
        self._speed_limit_port = self.DeclareAbstractInputPort(
            "speed_limit", AbstractValue.Make(object())
        )
        self._clear_port = self.DeclareAbstractInputPort(
            "clear_request", AbstractValue.Make(object())
        )
        self._state = self.DeclareAbstractState(AbstractValue.Make(ServerState()))
        tickets = {self.abstract_state_ticket(self._state)}
        self.DeclareVectorOutputPort(
            "command", 2, self._calc_command, prerequisites_of_calc=tickets
        )
        self.DeclareStateOutputPort("server_state", self._state)
        self.DeclareAbstractOutputPort(
            "status",
            lambda: AbstractValue.Make(object()),
            self._calc_status,
            prerequisites_of_calc=tickets,
        )
        self.DeclarePeriodicUnrestrictedUpdateEvent(self._period_s, offset_s, self._on_tick)

    def _calc_command(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector(context.get_abstract_state(self._state).get_value().command)

    def _calc_status(self, context: Context, output: AbstractValue) -> None:
        output.set_value(context.get_abstract_state(self._state).get_value().status)

    def _on_tick(self, context: Context, state: State) -> None:
        server = context.get_abstract_state(self._state).get_value()
        plan = self._plan_port.Eval(context)
        is_new_task = plan is not None and plan.task_id != server.status.task_id
        if plan is None or (server.status.state.is_final and not is_new_task):
            return
        now_s = context.get_time()
        if plan.plan_id != server.plan_id or is_new_task:
            server = self._take_plan(server, plan, now_s)
        new = self._cancelled(server) if plan.cancel_requested else None
        if new is None:
            new = self._cycle_on_current_costmap(context, server, plan)
        if new.status.state.is_final:
            new = new._replace(status=replace(new.status, time_s=now_s))
        state.get_mutable_abstract_state(self._state).set_value(new)

    def _cancelled(self, server: ServerState) -> ServerState | None:
        """Returns the end of a cancelled task, or None where the controller wants to slow down."""
        controller = self._controller
        if isinstance(controller, GracefulController) and not controller.is_at_rest(server.memory):
            return None
        return self._end(server, TaskState.CANCELED, 0, "canceled")

    def _cycle_on_current_costmap(
        self, context: Context, server: ServerState, plan: GlobalPlan
    ) -> ServerState:
        """Returns the state after a cycle, or after a period of waiting for the costmap."""
        now_s = context.get_time()
        costmap = self._costmap_port.Eval(context)
        request: ClearRequest | None = _value_or_none(self._clear_port, context)
        if costmap is None or (request is not None and costmap.stamp_s <= request.time_s):
            return self._wait_for_costmap(server, now_s)
        seed = context.get_abstract_parameter(self.seed_parameter).get_value()
        step = round((now_s - self._offset_s) / self._period_s)
        if server.waiting_since_s is not None:
            server = server._replace(waiting_since_s=None)
        return self._cycle(
            server,
            plan,
            costmap,
            estimate=self._estimate_port.Eval(context),
            now_s=now_s,
            speed_limit=_value_or_none(self._speed_limit_port, context),
            noise_key=NoiseKey(seed, NoiseStream.CONTROLLER, step),
        )

    def _wait_for_costmap(self, server: ServerState, now_s: float) -> ServerState:
        """Keeps the last command while the costmap is not current, up to a limit; 0: no limit."""
        since_s = now_s if server.waiting_since_s is None else server.waiting_since_s
        timeout_s = self._settings.costmap_update_timeout
        if timeout_s > 0.0 and round(now_s - since_s, NANOSECOND_DIGITS) > timeout_s:
            reason = f"no current costmap for {now_s - since_s:.2f} s"
            return self._end(server, TaskState.ABORTED, CONTROLLER_TIMED_OUT, reason)
        return server._replace(waiting_since_s=since_s)

    def _cycle(
        self,
        server: ServerState,
        plan: GlobalPlan,
        costmap: Costmap,
        *,
        estimate: NDArray[np.float64],
        now_s: float,
        speed_limit: SpeedLimit | None,
        noise_key: NoiseKey,
    ) -> ServerState:
        pose, twist = estimate[:3], self._without_creep(estimate[3:])
        try:
            local_plan, path = self._path_handler.cut(server.path, pose, costmap)
        except ControllerError as error:
            return self._end(server, TaskState.ABORTED, error.code, str(error))
        goal = plan.poses[-1]
        goal_result = self._goal_checker.check(
            server.goal_check, pose=pose, goal=goal, twist=twist, local_plan=local_plan
        )
        if goal_result.reached:
            return self._end(server, TaskState.SUCCEEDED, 0, "goal reached")
        progress = self._progress_checker.check(server.progress_check, pose=pose, time_s=now_s)
        if not progress.made_progress:
            return self._end(
                server, TaskState.ABORTED, FAILED_TO_MAKE_PROGRESS, "failed to make progress"
            )
        observation = Observation(
            time_s=now_s,
            pose=pose,
            twist=twist,
            plan=local_plan,
            plan_id=plan.plan_id,
            costmap=costmap,
            goal=goal,
            goal_xy_tolerance_m=self._goal_checker.xy_tolerance_m,
            goal_yaw_tolerance_rad=self._goal_checker.yaw_tolerance_rad,
            goal_xy_reached=goal_result.xy_reached,
            speed_limit=speed_limit,
            noise_key=noise_key,
            cancel_requested=plan.cancel_requested,
        )
        server = server._replace(
            path=path, goal_check=goal_result.state, progress_check=progress.state
        )
        return self._compute(server, observation)

    def _take_plan(self, server: ServerState, plan: GlobalPlan, now_s: float) -> ServerState:
        """Returns the state at the start of a task, or with a path that preempts the one before."""
        server = server._replace(
            plan_id=plan.plan_id,
            path=self._path_handler.set_plan(plan.poses),
            goal_check=self._goal_checker.initial_state(),
        )
        if plan.task_id == server.status.task_id:
            # Nav2 keeps the progress baseline over a preempting path.
            return server
        return server._replace(
            status=TaskStatus(TaskState.RUNNING, task_id=plan.task_id),
            progress_check=self._progress_checker.initial_state(),
            memory=self._controller.initial_memory(),
            last_valid_time_s=now_s,
            waiting_since_s=None,
        )

    def _without_creep(self, twist: NDArray[np.float64]) -> NDArray[np.float64]:
        settings = self._settings
        v, w = twist
        return np.array(
            [
                v if abs(v) > settings.min_x_velocity_threshold else 0.0,
                w if abs(w) > settings.min_theta_velocity_threshold else 0.0,
            ]
        )

    def _compute(self, server: ServerState, observation: Observation) -> ServerState:
        started = time.perf_counter()
        try:
            decision = self._controller.step(observation, server.memory)
            command = self._checked_command(decision)
        except NoValidControl as error:
            return self._wait(server, error, observation.time_s, started)
        except ControllerError as error:
            return self._end(server, TaskState.ABORTED, error.code, str(error), error.details)
        except Exception as error:
            # A plugin may break in any way; its own trial ends, never the campaign.
            ended = self._end(server, TaskState.ERROR, ControllerError.code, _one_line(error))
            status = replace(ended.status, traceback=traceback.format_exc())
            return ended._replace(status=status)
        return server._replace(
            memory=decision.memory,
            command=command,
            last_valid_time_s=observation.time_s,
            cycle_count=server.cycle_count + 1,
            compute_time_ms=1e3 * (time.perf_counter() - started),
            diagnostics=decision.diagnostics,
        )

    @staticmethod
    def _checked_command(decision: Decision) -> NDArray[np.float64]:
        command = np.array(decision.command, dtype=float)
        if command.shape != (2,) or not all(map(math.isfinite, command.tolist())):
            raise ValueError(
                f"the controller returned the command {decision.command!r}; "
                "expected two finite numbers, v m/s and w rad/s"
            )
        return command

    def _wait(
        self, server: ServerState, error: NoValidControl, now_s: float, started: float
    ) -> ServerState:
        """Stops for a cycle without control, or gives up where the patience has run out."""
        server = server._replace(
            memory=server.memory if error.memory is None else error.memory,
            cycle_count=server.cycle_count + 1,
            compute_time_ms=1e3 * (time.perf_counter() - started),
            diagnostics={"failure": str(error)},
        )
        tolerance_s = self._settings.failure_tolerance
        if tolerance_s == 0.0:
            return self._end(server, TaskState.ABORTED, error.code, str(error), error.details)
        # ROS keeps time in whole nanoseconds; without rounding 0.32 - 0.02 may exceed 0.3.
        waited_s = round(now_s - server.last_valid_time_s, NANOSECOND_DIGITS)
        if tolerance_s != PATIENT_FOR_EVER and waited_s > tolerance_s:
            reason = f"no valid control for {waited_s:.2f} s: {error}"
            return self._end(server, TaskState.ABORTED, PATIENCE_EXCEEDED, reason, error.details)
        return server._replace(command=STANDSTILL)

    @staticmethod
    def _end(
        server: ServerState,
        state: TaskState,
        code: int,
        reason: str,
        details: Mapping[str, Any] | None = None,
    ) -> ServerState:
        status = replace(
            server.status, state=state, error_code=code, reason=reason, details=dict(details or {})
        )
        return server._replace(status=status, command=STANDSTILL)


def _value_or_none(port: InputPort, context: Context) -> Any:
    """Returns what an abstract port carries, None where it is not connected."""
    return port.Eval(context) if port.HasValue(context) else None


def _one_line(error: Exception) -> str:
    text = str(error).strip().splitlines()
    return f"{type(error).__name__}: {text[0]}" if text else type(error).__name__
