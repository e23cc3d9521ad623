"""Hosts one controller plugin: rate, goal and progress checks, patience, error codes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydrake.common.value import AbstractValue
from pydrake.systems.framework import BasicVector, Context, LeafSystem, State

from drake_navbench.controller import (
    Controller,
    ControllerError,
    GracefulController,
    NoValidControl,
    Observation,
    PlanCuttingController,
    SpeedLimit,
    memory_of_next_task,
)
from drake_navbench.errors import as_line
from drake_navbench.explanation import ControlCycle
from drake_navbench.inputs.navigation_settings import ControllerServerSettings
from drake_navbench.inputs.timeline import SLACK_S, Timeline
from drake_navbench.inputs.timing import TimingSettings
from drake_navbench.kernels.grid import Costmap
from drake_navbench.kernels.noise import NoiseKey, NoiseStream
from drake_navbench.kernels.poses import to_robot_frame
from drake_navbench.kernels.read_only import read_only
from drake_navbench.navigation.goal_check import GoalChecker
from drake_navbench.navigation.path_handler import PathHandler
from drake_navbench.navigation.progress_checkers import ProgressChecker
from drake_navbench.navigation.task import ClearRequest, GlobalPlan, TaskState, TaskStatus
from drake_navbench.trial.systems.compute_clock import ComputeClock
from drake_navbench.trial.systems.controller_call import (
    PluginBroke,
    PluginCode,
    Stopwatch,
    checked_command,
    require_loggable,
)
from drake_navbench.trial.systems.controller_server_state import ServerState
from drake_navbench.trial.systems.lifetime import weakly_bound
from drake_navbench.trial.systems.ports import (
    COMMAND_SIZE,
    POSE_SIZE,
    STATE_SIZE,
    declare_object_input,
    read_object,
    value_or_none,
)

FAILED_TO_MAKE_PROGRESS = 105


class ControllerServer(LeafSystem):
    """Nav2's controller server around one controller, as one unrestricted update a control period.

    Inputs in the odometry frame: `odometry_estimate` [x m, y m, yaw rad, v m/s, w rad/s, vy m/s]
    and `costmap` (Costmap or None). Input in the map frame: `plan` (GlobalPlan or None). Other
    inputs: `map_from_odometry` (3,), the pose of the odometry frame in the map frame (not
    connected: the two are one), `speed_limit` (SpeedLimit or None; not connected: no limit) and
    `clear_request` (ClearRequest or None; not connected: none). As in Nav2, a controller sees
    everything in the odometry frame; the server transforms the plan in every cycle. Outputs
    `command` [v m/s, w rad/s, vy m/s] and `server_state` (ServerState, with the task's status).
    Abstract parameter `seed_parameter` holds the trial's seed.

    Order of a cycle as in nav2_controller's computeControl: cancel, new path, wait for a current
    costmap, cut of the path, goal test, progress test, command; in Humble, Iron and Kilted the goal
    is tested last. From a request to clear the costmap until its next update, the costmap is not
    current. The first cycle runs at `offset_s`.

    A controller ends its task in the state ERROR if its `step` raises anything but a
    ControllerError, or returns an invalid command or diagnostics that no log can hold.

    Where cycles take time, a command is published when its cycle is over, and a cycle that misses
    its period puts the next one off.

    clock: tells how long a cycle takes; without it, cycles take no time. moves_sideways: whether
    the base follows vy; otherwise a command must not have any.
    """

    def __init__(
        self,
        controller: Controller,
        settings: ControllerServerSettings,
        *,
        path_handler: PathHandler,
        goal_checker: GoalChecker,
        progress_checker: ProgressChecker,
        offset_s: float,
        moves_sideways: bool = False,
        clock: ComputeClock | None = None,
    ) -> None:
        super().__init__()
        self._on_cycle: Callable[[ControlCycle], None] | None = None
        self._takes_over: Callable[[float], Controller | None] | None = None
        self._clock = clock or ComputeClock(Timeline.constant(TimingSettings()), None)
        self._takes_time = self._clock.is_needed
        self._controller = controller
        self._settings = settings
        self._cuts_plan = isinstance(controller, PlanCuttingController) and controller.cuts_plan
        self._path_handler = path_handler
        self._goal_checker = goal_checker
        self._progress_checker = progress_checker
        self._period_s = 1.0 / settings.controller_frequency
        self._offset_s = offset_s
        self._moves_sideways = moves_sideways
        self.seed_parameter = self.DeclareAbstractParameter(AbstractValue.Make(0))
        self._estimate_port = self.DeclareVectorInputPort("odometry_estimate", STATE_SIZE)
        self._costmap_port = declare_object_input(self, "costmap")
        self._plan_port = declare_object_input(self, "plan")
        self._speed_limit_port = declare_object_input(self, "speed_limit")
        self._clear_port = declare_object_input(self, "clear_request")
        self._map_port = self.DeclareVectorInputPort("map_from_odometry", POSE_SIZE)
        self._state = self.DeclareAbstractState(AbstractValue.Make(ServerState()))
        tickets = {self.abstract_state_ticket(self._state)}
        if self._takes_time:
            tickets.add(self.time_ticket())
        self.DeclareVectorOutputPort(
            "command", COMMAND_SIZE, weakly_bound(self._calc_command), prerequisites_of_calc=tickets
        )
        self.DeclareStateOutputPort("server_state", self._state)
        self.DeclarePeriodicUnrestrictedUpdateEvent(
            self._period_s / self._clock.ticks_a_period(self._period_s),
            offset_s,
            weakly_bound(self._on_tick),
        )

    def listen(
        self,
        on_cycle: Callable[[ControlCycle], None] | None,
        takes_over: Callable[[float], Controller | None] | None,
    ) -> None:
        """Sets the listeners of control cycles.

        on_cycle: is called with every cycle; it changes nothing. takes_over: is called before every
        cycle with its time, s. It returns a controller of the same kind with other parameters,
        which drives from then on with the memory of the last one, or None.
        """
        self._on_cycle, self._takes_over = on_cycle, takes_over

    def _calc_command(self, context: Context, output: BasicVector) -> None:
        server: ServerState = context.get_abstract_state(self._state).get_value()
        output.SetFromVector(server.command_at(context.get_time()))

    def _on_tick(self, context: Context, state: State) -> None:
        server: ServerState = context.get_abstract_state(self._state).get_value()
        now_s = context.get_time()
        if self._takes_time and now_s < server.next_cycle_s - SLACK_S:
            return
        plan = read_object(self._plan_port, context)
        is_new_task = plan is not None and plan.task_id != server.status.task_id
        if plan is None or (server.status.state.is_final and not is_new_task):
            return
        if self._takes_over is not None and (other := self._takes_over(now_s)) is not None:
            server = server._replace(controller=other)
        try:
            new = self._advanced(context, server, plan, is_new_task=is_new_task)
        except PluginBroke as broken:
            new = server.broken(plan.task_id, broken.error)
        new = self._with_compute_time(server, new, now_s)
        if new.status.state.is_final:
            new = new._replace(status=replace(new.status, time_s=now_s))
        state.get_mutable_abstract_state(self._state).set_value(new)

    def _with_compute_time(
        self, before: ServerState, after: ServerState, now_s: float
    ) -> ServerState:
        """Returns the state after a cycle that took the time that its controller needed."""
        late_s = 0.0
        if after.cycle_count > before.cycle_count:
            measured = after.compute_time_ms, after.compute_cpu_time_ms
            known = self._clock.known(before.cycle_count, measured)
            if known is not measured:
                after = after._replace(compute_time_ms=known[0], compute_cpu_time_ms=known[1])
            if self._takes_time:
                late_s = self._clock.late_s(now_s, known[0])
        if not self._takes_time:
            return after
        if after.status.state.is_final:
            late_s = 0.0
        return after._replace(
            next_cycle_s=now_s + max(self._period_s, late_s),
            command_due_s=now_s + late_s,
            earlier_command=before.command_at(now_s),
        )

    def _advanced(
        self, context: Context, server: ServerState, plan: GlobalPlan, *, is_new_task: bool
    ) -> ServerState:
        """Returns the state after a cycle; raises PluginBroke."""
        if plan.plan_id != server.plan_id or is_new_task:
            server = self._take_plan(server, plan, context.get_time())
        if plan.cancel_requested and self._may_end(server):
            return server.ended(TaskState.CANCELED, 0, "canceled")
        return self._cycle_on_current_costmap(context, server, plan)

    def _driving(self, server: ServerState) -> Controller:
        """Returns the controller that drives."""
        return self._controller if server.controller is None else server.controller

    def _may_end(self, server: ServerState) -> bool:
        """Returns whether a cancelled task ends now: not while the controller slows down."""
        controller = self._driving(server)
        with PluginCode():
            return not isinstance(controller, GracefulController) or controller.is_at_rest(
                server.memory
            )

    def _cycle_on_current_costmap(
        self, context: Context, server: ServerState, plan: GlobalPlan
    ) -> ServerState:
        """Returns the state after a cycle, or after a period of waiting for the costmap."""
        now_s = context.get_time()
        costmap = read_object(self._costmap_port, context)
        request: ClearRequest | None = value_or_none(self._clear_port, context)
        if costmap is None:
            return server.waiting_for_costmap(now_s, self._settings.longest_wait_s)
        is_old = request is not None and costmap.stamp_s <= request.time_s
        if (is_old or not costmap.is_current) and not self._settings.takes_old_costmaps:
            return server.waiting_for_costmap(now_s, self._settings.longest_wait_s)
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
            speed_limit=value_or_none(self._speed_limit_port, context),
            noise_key=NoiseKey(seed, NoiseStream.CONTROLLER, step),
            map_from_odometry=value_or_none(self._map_port, context),
        )

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
        map_from_odometry: NDArray[np.float64] | None = None,
    ) -> ServerState:
        pose, velocity = estimate[:3], self._without_creep(estimate[3:])
        global_plan, path = plan.poses, server.path
        if map_from_odometry is not None:
            global_plan = read_only(to_robot_frame(global_plan, *map_from_odometry))
            path = path._replace(plan=global_plan)
        try:
            local_plan, path = self._cut(path, global_plan, pose, costmap)
        except ControllerError as error:
            return server.ended(TaskState.ABORTED, error.code, str(error))
        goal = global_plan[-1]
        goal_result = self._goal_checker.check(
            server.goal_check, pose=pose, goal=goal, twist=velocity, local_plan=local_plan
        )
        if goal_result.reached and self._settings.tests_goal_first:
            return server.ended(TaskState.SUCCEEDED, 0, "goal reached")
        progress = self._progress_checker.check(server.progress_check, pose=pose, time_s=now_s)
        if not progress.made_progress:
            return server.ended(
                TaskState.ABORTED, FAILED_TO_MAKE_PROGRESS, "failed to make progress"
            )
        observation = Observation(
            time_s=now_s,
            pose=pose,
            twist=velocity[:2],
            vy_mps=float(velocity[2]),
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
            global_plan=global_plan,
        )
        server = server._replace(
            path=path, goal_check=goal_result.state, progress_check=progress.state
        )
        server = self._compute(server, observation)
        if goal_result.reached and not server.status.state.is_final:
            return server.ended(TaskState.SUCCEEDED, 0, "goal reached")
        return server

    def _cut(
        self, path: Any, global_plan: NDArray[np.float64], pose: Any, costmap: Costmap
    ) -> tuple[NDArray[np.float64], Any]:
        """Returns the local plan and the path that is left; raises ControllerError."""
        try:
            return self._path_handler.cut(path, pose, costmap)
        except ControllerError:
            if not self._cuts_plan or len(global_plan) == 0:
                raise
            # This controller's release has no path handler: the controller has its own rules.
            return global_plan, path

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
        with PluginCode():
            memory = memory_of_next_task(self._driving(server), server.memory)
        return server._replace(
            status=TaskStatus(TaskState.RUNNING, task_id=plan.task_id),
            progress_check=self._progress_checker.initial_state(),
            memory=memory,
            last_valid_time_s=now_s,
            waiting_since_s=None,
        )

    def _without_creep(self, velocity: NDArray[np.float64]) -> NDArray[np.float64]:
        settings = self._settings
        v, w, vy = velocity.tolist()
        return np.array(
            [
                v if abs(v) > settings.min_x_velocity_threshold else 0.0,
                w if abs(w) > settings.min_theta_velocity_threshold else 0.0,
                vy if abs(vy) > settings.min_y_velocity_threshold else 0.0,
            ]
        )

    def _compute(self, server: ServerState, observation: Observation) -> ServerState:
        watch = Stopwatch.started()
        with PluginCode():
            try:
                decision = self._driving(server).step(observation, server.memory)
            except ControllerError as error:
                self._report_cycle(observation, server.memory, None, as_line(str(error)))
                require_loggable("details", error.details)
                if error.memory is not None:
                    server = server._replace(memory=error.memory)
                if isinstance(error, NoValidControl):
                    wall_ms, cpu_ms = watch.elapsed_ms()
                    server = server._replace(
                        cycle_count=server.cycle_count + 1,
                        compute_time_ms=wall_ms,
                        compute_cpu_time_ms=cpu_ms,
                        diagnostics={"failure": as_line(str(error))},
                    )
                    patience_s = self._settings.failure_tolerance
                    return server.without_control(error, observation.time_s, patience_s)
                return server.ended(TaskState.ABORTED, error.code, str(error), error.details)
            wall_ms, cpu_ms = watch.elapsed_ms()
            command = checked_command(decision, moves_sideways=self._moves_sideways)
            require_loggable("diagnostics", decision.diagnostics)
        self._report_cycle(observation, server.memory, command)
        return server._replace(
            memory=decision.memory,
            command=command,
            last_valid_time_s=observation.time_s,
            cycle_count=server.cycle_count + 1,
            compute_time_ms=wall_ms,
            compute_cpu_time_ms=cpu_ms,
            diagnostics=decision.diagnostics,
        )

    def _report_cycle(
        self,
        observation: Observation,
        memory: Any,
        command: NDArray[np.float64] | None,
        failure: str = "",
    ) -> None:
        if self._on_cycle is not None:
            self._on_cycle(ControlCycle(observation, memory, command, failure))
