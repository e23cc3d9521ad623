"""Several poses passed by one action: Nav2's NavigateThroughPoses, as legs of a trial."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from drake_navbench.navigation.task import PoseState, TaskPose, TaskState, TaskStatus
from drake_navbench.navigation.waypoint_follower import (
    Pose,
    Progress,
    WaypointFollower,
    WaypointFollowerParameters,
)

REACHED = TaskStatus(TaskState.SUCCEEDED, reason="goal reached")
PASSED = TaskStatus(TaskState.SUCCEEDED, reason="passed")
SKIPPED = TaskStatus(TaskState.ABORTED, reason="skipped, as it is in collision")


@dataclass(frozen=True)
class PosesProgress(Progress):
    """The progress through the poses; task_poses: what became of each so far."""

    task_poses: tuple[TaskPose, ...] = ()


class PosesFollower(WaypointFollower):
    """Keeps the account of an action that leads through all poses; the behaviour tree drives.

    A leg ends when the tree counts its pose as passed or leaves it out, and never before the legs
    of the poses before. Where the tree succeeds, all poses that it still had count as passed, as in
    Nav2. Where it fails, its error is that of the task.
    """

    noun = "pose"

    def __init__(self, poses: tuple[Pose, ...]) -> None:
        # A pose that is left out ends no task, and nobody pauses at a pose.
        super().__init__(poses, WaypointFollowerParameters(stop_on_failure=False))

    def first_progress(self) -> PosesProgress:
        """Returns the progress at the start."""
        return PosesProgress(task_poses=tuple(TaskPose(pose) for pose in self.waypoints))

    def note_poses(
        self,
        progress: PosesProgress,
        task_poses: Sequence[TaskPose],
        time_s: float,
        recovery_count: int,
    ) -> PosesProgress:
        """Returns the progress after a tick that left the poses so.

        recovery_count: of the whole action so far.
        """
        progress = replace(progress, task_poses=tuple(task_poses))
        while progress.index + 1 < len(self.waypoints):
            state = task_poses[progress.index].state
            if state is PoseState.PENDING:
                break
            progress = self._end_pose(progress, state, time_s, recovery_count)
        return progress

    def end_leg(
        self, progress: Progress, status: TaskStatus, time_s: float, recovery_count: int
    ) -> Progress:
        """Returns the progress after the tree ended with `status`."""
        assert isinstance(progress, PosesProgress)
        if status.state is not TaskState.SUCCEEDED:
            where = f"{self.noun} {progress.index + 1} of {len(self.waypoints)}"
            told = replace(status, reason=f"{where}: {status.reason}", time_s=time_s)
            count = _recoveries_of_leg(progress, recovery_count)
            ended = super().end_leg(progress, status, time_s, count)
            return replace(ended, status=told)
        while progress.status.state is TaskState.RUNNING:
            state = progress.task_poses[progress.index].state
            progress = self._end_pose(progress, state, time_s, recovery_count)
        return progress

    def _end_pose(
        self, progress: PosesProgress, state: PoseState, time_s: float, recovery_count: int
    ) -> PosesProgress:
        count = _recoveries_of_leg(progress, recovery_count)
        is_last = progress.index + 1 == len(self.waypoints)
        status = SKIPPED if state is PoseState.SKIPPED else REACHED if is_last else PASSED
        ended = super().end_leg(progress, status, time_s, count)
        assert isinstance(ended, PosesProgress)
        return ended


def _recoveries_of_leg(progress: Progress, recovery_count: int) -> int:
    """Returns the recoveries since the last leg ended; recovery_count: of the whole action."""
    return recovery_count - sum(leg.recovery_count for leg in progress.legs)
