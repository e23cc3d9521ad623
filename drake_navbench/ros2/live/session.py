"""One trial of a running stack: from the search for it to the end of its last goal."""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import ExitStack
from typing import Any

import numpy as np

from drake_navbench.navigation.task import GlobalPlan, Leg, TaskState, TaskStatus
from drake_navbench.ros2.live.clock_file import ClockFile
from drake_navbench.ros2.live.domain import LiveDomain
from drake_navbench.ros2.live.endpoints import Endpoint, listeners_of
from drake_navbench.ros2.live.goal_watch import GoalState
from drake_navbench.ros2.live.lookout import Lookout, StackMissing
from drake_navbench.ros2.live.pace import Pace, percentiles_ms
from drake_navbench.ros2.live.parameters import LiveParameters
from drake_navbench.ros2.live.robot_topics import RobotTopics, nanoseconds
from drake_navbench.ros2.live.stack_topics import StackTopics
from drake_navbench.trial.systems.running_stack import (
    STANDSTILL,
    RobotReadings,
    StackAnswer,
    StackTask,
)

# The time between two tries of a goal that no stack takes, s.
RESEND_S = 2.0
# The time for a stack to end the goal of the last trial, s.
END_PATIENCE_S = 10.0
OUTCOME_OF_GOAL = {
    GoalState.SUCCEEDED: (TaskState.SUCCEEDED, "the stack reports the goal as reached"),
    GoalState.ABORTED: (TaskState.ABORTED, "the stack aborted the goal"),
    GoalState.CANCELED: (TaskState.ABORTED, "the stack cancelled the goal"),
}


class LiveSession:
    """The conversation with a running stack in one trial.

    ended: set to True from outside; the next step then ends the trial.
    """

    def __init__(self, parameters: LiveParameters, task: StackTask) -> None:
        self._parameters = parameters
        self._task = task
        self.ended = False
        self._clock_file = ClockFile(parameters.domain)
        self._stamp_ns = self._clock_file.first_stamp_ns
        self._offset_ns = self._stamp_ns
        with ExitStack() as undo:
            undo.callback(self._clock_file.close, self._stamp_ns)
            self._domain = LiveDomain(parameters.domain, parameters.peers)
            undo.callback(self._domain.close)
            self._robot = RobotTopics(self._domain, parameters, task.robot)
            self._stack = StackTopics(self._domain, parameters)
            undo.pop_all()
        self._lookout = Lookout(
            self._domain,
            parameters,
            self._stack,
            own=self._robot.own,
            signs=self._robot.signs_of_a_robot,
        )
        rate = None if parameters.rate == "max" else float(parameters.rate)
        self._pace = Pace(
            rate,
            command_period_s=parameters.command_period_s,
            patience_s=parameters.patience_s,
        )
        self._stack_localizes = parameters.localization == "stack"
        self._answer = StackAnswer(status=TaskStatus(TaskState.RUNNING))
        self._moves_sideways = task.robot.drive.lateral_speed_mps > 0.0
        self._leg, self._leg_start_s = 0, 0.0
        self._command_s = -np.inf
        self._scan_sent_at: float | None = None
        self._scan_to_command_s: list[float] = []
        self._goal_sent_at = self._pose_told_at = -np.inf
        self._began_at = time.monotonic()

    def begin(self, sensed: RobotReadings) -> StackAnswer:
        """Opens the topics; shows the stack a standing robot until it takes the first goal."""
        parameters = self._parameters
        self._robot.open(self._task.known_map, self._lookout.listen(), self._stamp_ns)
        deadline = time.monotonic() + parameters.start_timeout_s
        ready_since: float | None = None
        was_sent = False
        while parameters.sends_goal and not (was_sent and self._stack.goals.is_taken):
            endpoints = self._stand_still(sensed)
            now = time.monotonic()
            if endpoints is not None:
                self._tell_pose(endpoints, sensed)
                if self._stack.missing(endpoints):
                    ready_since = None
                elif ready_since is None:
                    ready_since = now
            if now >= deadline:
                raise StackMissing(self._lookout.why_no_stack())
            if ready_since is None or now - ready_since < parameters.settle_s:
                continue
            if not was_sent and self._stack.goals.any_active:
                self._end_old_goal(sensed)
            if not (was_sent and self._stack.goals.is_taken):
                self._send_goal()
                was_sent = True
        self._lookout.settle()
        self._offset_ns = self._stamp_ns - nanoseconds(sensed.time_s)
        self._pace.begin(sensed.time_s)
        self._began_at = time.monotonic()
        self._leg_start_s = sensed.time_s
        self._command_s = sensed.time_s
        return self._answer

    def advance(self, sensed: RobotReadings) -> StackAnswer:
        """Advances by one step of the clock."""
        self._pace.hold(sensed.time_s)
        self._stamp_ns = self._offset_ns + nanoseconds(sensed.time_s)
        self._tell(sensed)
        self._clock_file.keep(self._stamp_ns)
        self._look_around(sensed)
        patience_s = 0.0
        if not self._lookout.is_stack_gone:
            patience_s = self._pace.patience_for_command_s(sensed.time_s)
        command = self._stack.newest_command(patience_s)
        if command is not None or not self._stack.goals.has_ended:
            self._pace.note_command(sensed.time_s, has_come=command is not None)
        self._stack.read(sensed.time_s, self._leg)
        self._obey(command, sensed.time_s)
        if self.ended:
            status = TaskStatus(TaskState.CANCELED, reason="ended by the user")
            self._answer = self._answer._replace(status=status)
        elif self._parameters.sends_goal:
            self._follow_goal(sensed.time_s)
        return self._answer

    def facts(self) -> dict[str, Any]:
        """Returns the facts of the conversation, for the log."""
        rate = self._parameters.rate
        answered = percentiles_ms(self._scan_to_command_s)
        return {
            "domain": self._parameters.domain,
            "rate": rate,
            "command_type": self._stack.command_type,
            "command_count": self._stack.command_count,
            "localization": "stack" if self._stack_localizes else "benchmark",
            "restart_count": self._lookout.restart_count,
            "lost_message_count": self._robot.lost_count,
            "wall_s": round(time.monotonic() - self._began_at, 3),
            "faults": list(self._lookout.faults),
            **self._pace.facts(),
            **{f"scan_to_command_p{share}_ms": value for share, value in answered.items()},
        }

    def close(self) -> None:
        """Leaves the domain."""
        self._domain.close()
        self._clock_file.close(self._stamp_ns)

    def _stand_still(self, sensed: RobotReadings) -> list[Endpoint] | None:
        """Advances by one period of the clock in which the world stands still.

        Returns the endpoints of others, where it was time to look.
        """
        period_s = self._parameters.clock_period_s
        time.sleep(period_s)
        self._stamp_ns += nanoseconds(period_s)
        readings_ns = nanoseconds(self._task.robot.lidar.period_s)
        if self._stamp_ns // readings_ns != (self._stamp_ns - nanoseconds(period_s)) // readings_ns:
            self._robot.send_readings_again(self._stamp_ns, sensed)
        at_rest = sensed._replace(odometry=np.append(sensed.odometry[:3], np.zeros(3)))
        with_map = not self._stack_localizes
        self._robot.send_motion(self._stamp_ns, at_rest, with_map=with_map)
        self._robot.send_clock(self._stamp_ns)
        self._stack.newest_command(0.0)
        self._stack.read(sensed.time_s, self._leg)
        return self._lookout.look()

    def _tell_pose(self, endpoints: Sequence[Endpoint], sensed: RobotReadings) -> None:
        """Tells a stack that localizes the robot its pose, until the stack has localized it.

        AMCL forgets a pose that comes before it is active, so once may not be enough.
        """
        listeners = listeners_of(endpoints, self._parameters.topic("initialpose"))
        if self._parameters.localization == "auto":
            self._stack_localizes = bool(listeners)
        now = time.monotonic()
        if not (self._stack_localizes and listeners) or now - self._pose_told_at < RESEND_S:
            return
        if not self._stack.has_localized():
            self._robot.send_pose("initialpose", self._stamp_ns, sensed.state[:3])
            self._pose_told_at = now

    def _end_old_goal(self, sensed: RobotReadings) -> None:
        """Makes the stack end the goal of the last trial, by a goal at the robot's place."""
        self._stack.goals.expect()
        self._robot.send_pose("goal_pose", self._stamp_ns, self._task.start_pose)
        deadline = time.monotonic() + END_PATIENCE_S
        while self._stack.goals.any_active and time.monotonic() < deadline:
            self._stand_still(sensed)

    def _send_goal(self) -> None:
        """Sends the goal of the present leg, unless that was done just now."""
        now = time.monotonic()
        if now - self._goal_sent_at >= RESEND_S:
            self._goal_sent_at = now
            self._stack.goals.expect()
            self._robot.send_pose("goal_pose", self._stamp_ns, self._task.goals[self._leg])

    def _tell(self, sensed: RobotReadings) -> None:
        """Sends the readings, then the clock: a node that waits for the clock has the readings."""
        scan_before = self._robot.sent_scan
        self._robot.send_new_readings(self._offset_ns, sensed)
        if self._robot.sent_scan is not scan_before:
            self._scan_sent_at = time.perf_counter()
        parameters = self._parameters
        every = max(1, round(parameters.odom_period_s / parameters.clock_period_s))
        if round(sensed.time_s / parameters.clock_period_s) % every == 0:
            with_map = not self._stack_localizes
            self._robot.send_motion(self._stamp_ns, sensed, with_map=with_map)
        self._robot.send_clock(self._stamp_ns)

    def _obey(self, command: Any, time_s: float) -> None:
        """Takes the newest command; a command that is too old counts as standstill."""
        if command is not None:
            self._command_s = time_s
            if self._scan_sent_at is not None:
                self._scan_to_command_s.append(time.perf_counter() - self._scan_sent_at)
                self._scan_sent_at = None
            if not self._moves_sideways:
                command = np.array([command[0], command[1], 0.0])
            self._answer = self._answer._replace(command=command)
        limit_s = self._parameters.command_timeout_s
        if limit_s > 0.0 and time_s - self._command_s > limit_s:
            self._answer = self._answer._replace(command=STANDSTILL)
        plans = self._stack.plans
        if len(plans) != len(self._answer.plans):
            plan = GlobalPlan(plan_id=len(plans), poses=plans[-1].poses)
            self._answer = self._answer._replace(plan=plan, plans=tuple(plans))

    def _look_around(self, sensed: RobotReadings) -> None:
        """Notices whether the stack is gone or was started anew."""
        endpoints = self._lookout.look()
        if endpoints is None:
            return
        if not self._parameters.sends_goal:
            self._tell_pose(endpoints, sensed)
            return
        is_new = self._lookout.is_new_stack(endpoints)
        if self._lookout.is_stack_gone:
            self._pace.rest(sensed.time_s)
        if is_new:
            self._stack.goals.forget()
            self._stack.forget_localization()
            self._goal_sent_at = self._pose_told_at = -np.inf
        self._tell_pose(endpoints, sensed)

    def _follow_goal(self, time_s: float) -> None:
        """Ends the leg or the task where the stack's goal has ended."""
        goals = self._stack.goals
        if not goals.is_taken:
            if not self._lookout.is_stack_gone:
                self._send_goal()
            return
        if goals.state not in OUTCOME_OF_GOAL:
            return
        state, reason = OUTCOME_OF_GOAL[goals.state]
        status = TaskStatus(state, reason=reason, time_s=time_s)
        goal = self._task.goals[self._leg]
        leg = Leg(goal, status, self._leg_start_s, time_s)
        self._answer = self._answer._replace(legs=(*self._answer.legs, leg))
        if state is TaskState.SUCCEEDED and self._leg + 1 < len(self._task.goals):
            self._leg, self._leg_start_s = self._leg + 1, time_s
            self._goal_sent_at = -np.inf
            self._send_goal()
            return
        self._answer = self._answer._replace(status=status)
