"""The log of a trial: its recording, its specification and its outcome."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from pydrake.systems.framework import Context

from drake_navbench.errors import as_line
from drake_navbench.inputs.presets import Preset
from drake_navbench.inputs.recorded_people import RecordedPeople
from drake_navbench.inputs.robot import Robot
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.kernels.moving_bodies import FAR_AWAY_M
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.log_columns import (
    COLUMNS,
    LATERAL_COLUMNS,
    MISSION_COLUMNS,
    ODOMETRY_COLUMNS,
)
from drake_navbench.logs.outcome import Outcome
from drake_navbench.logs.people import DECIMALS, LoggedPeople
from drake_navbench.logs.plans import Plan, as_logged
from drake_navbench.navigation.mission import FloorLeg, MissionProgress
from drake_navbench.navigation.task import TaskState, TaskStatus
from drake_navbench.trial.contact_watch import ContactWatch
from drake_navbench.trial.diagram import TrialDiagram
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.trial.systems.ports import read_object
from drake_navbench.trial.systems.recorder import Recording
from drake_navbench.trial.systems.running_stack import RunningStackSystem
from drake_navbench.trial.systems.tree_navigator import TreeNavigator
from drake_navbench.trial.timing import CONTROLLER_OFFSET_S

OUTCOME_OF_TASK = {
    TaskState.SUCCEEDED: Outcome.SUCCEEDED,
    TaskState.ABORTED: Outcome.ABORTED,
    TaskState.ERROR: Outcome.ERROR,
}
MAX_TRACEBACK_LENGTH = 20_000
Event = tuple[float, Any]


def make_log(
    spec: TrialSpec, trial: TrialDiagram, context: Context, contact_watch: ContactWatch
) -> TrialLog:
    """Returns the log of a trial whose simulation has ended."""
    contact = _contact_account(contact_watch)
    outcome, status = _outcome(trial, context, touched=contact["name"] if contact else "")
    recorder_context = trial.recorder.GetMyContextFromRoot(context)
    recording = trial.recorder.find_recording(recorder_context)
    # The last cycle, or the navigator's last tick, may be later than the recorder's last sample.
    trial.recorder.record(recorder_context)
    info = _info(spec, outcome, status) | _filter_changes(trial, context)
    people = spec.scenario.true_world.people
    if isinstance(people, RecordedPeople):
        info["people"] = {"names": people.names, "groups": people.groups}
    if contact and contact_watch.moving is not None:
        info["contact"] = contact
    navigator_context, mission = trial.navigator.GetMyContextFromRoot(context), None
    if isinstance(trial.navigator, RunningStackSystem):
        answer = trial.navigator.GetOutputPort("answer").Eval(navigator_context)
        info["legs"] = [leg.as_plain() for leg in answer.legs]
        info["running_stack"] = trial.navigator.facts()
        plans = answer.plans
    elif isinstance(trial.navigator, TreeNavigator):
        navigator = trial.navigator.GetOutputPort("navigator_state").Eval(navigator_context)
        info["legs"] = [leg.as_plain() for leg in navigator.progress.legs]
        plans = navigator.plans
        if isinstance(navigator.progress, MissionProgress):
            mission = navigator.progress
    else:
        given = read_object(trial.navigator.GetOutputPort("plan"), navigator_context)
        plans = (Plan(0.0, given.poses),) if given is not None else ()
    return TrialLog(
        samples=_samples(recording, spec.robot, mission),
        plans=as_logged(plans),
        info=info,
        scans=tuple(recording.scans),
        diagnostics=tuple(recording.diagnostics),
        events=(
            tuple(recording.events)
            if mission is None
            else mission_events(mission, recording.events, status.time_s)
        ),
        costmaps=tuple(recording.costmaps),
        people=_people(recording),
    )


def failed_log(spec: TrialSpec, reason: str, details: str = "") -> TrialLog:
    """Returns the log of a trial that never came to an end of its own; details: a traceback."""
    status = TaskStatus(TaskState.ERROR, reason=as_line(reason), traceback=details)
    return TrialLog(
        samples=_samples(Recording(), spec.robot),
        plans=(),
        info=_info(spec, Outcome.ERROR, status),
    )


def _outcome(trial: TrialDiagram, context: Context, *, touched: str) -> tuple[Outcome, TaskStatus]:
    """Returns the outcome of the trial, with the reason and the time.

    touched: the name of the obstacle that the robot touched, '' for none.
    """
    now_s = context.get_time()
    if touched:
        reason = f"the footprint touched {touched}"
        return Outcome.COLLIDED, TaskStatus(reason=reason, time_s=now_s)
    status = trial.navigator.GetOutputPort("task_status").Eval(
        trial.navigator.GetMyContextFromRoot(context)
    )
    if status.state in OUTCOME_OF_TASK:
        return OUTCOME_OF_TASK[status.state], status
    return Outcome.TIMED_OUT, TaskStatus(reason=f"not finished after {now_s:g} s", time_s=now_s)


def _contact_account(contact_watch: ContactWatch) -> dict[str, Any]:
    """Returns the name and kind of the touched obstacle as plain data; {} without a touch."""
    contact, moving = contact_watch.contact, contact_watch.moving
    if contact is None:
        return {}
    if contact.body is None or moving is None:
        return {"name": "an obstacle", "kind": "obstacle"}
    return moving.facts(contact.body, contact.time_s, contact.state)


def _people(recording: Recording) -> LoggedPeople | None:
    """Returns the people's poses over time, None where there were no people."""
    if not recording.people:
        return None
    times, rows = zip(*recording.people, strict=True)
    poses = np.round(np.array(rows), DECIMALS)
    poses[poses[..., 0] >= FAR_AWAY_M] = np.nan
    return LoggedPeople(np.array(times), poses)


def _filter_changes(trial: TrialDiagram, context: Context) -> dict[str, Any]:
    """Returns the changes that the scenario's filters made, and their times, by filter name."""
    return {
        system.get_name(): system.GetOutputPort("filter_state")
        .Eval(system.GetMyContextFromRoot(context))
        .as_plain()
        for system in trial.filters
    }


def _info(spec: TrialSpec, outcome: Outcome, status: TaskStatus) -> dict[str, Any]:
    plugins = {"plugins": spec.foreign_code} if spec.foreign_code else {}
    return plugins | {
        "scenario": spec.scenario.model_dump(mode="json"),
        **(mission_account(spec.scenario) if spec.scenario.floors else {}),
        "obstacles": [
            obstacle.model_dump(mode="json") for obstacle in spec.scenario.true_world.shapes
        ],
        "robot": spec.robot.model_dump(mode="json"),
        "controller": spec.preset.name,
        "controller_plugin": spec.preset.controller,
        "parameters": spec.preset.parameters.as_read().model_dump(mode="json"),
        **_controller_files(spec.preset),
        "identity": spec.identity,
        "seed": spec.seed,
        "trial": spec.trial,
        "outcome": str(outcome),
        "reason": status.reason,
        "error_code": status.error_code,
        "details": json.loads(json.dumps(status.details or {}, default=str)),
        # The end of a traceback tells most; the traceback of an endless recursion would fill the
        # log.
        "traceback": status.traceback[-MAX_TRACEBACK_LENGTH:],
        # A trial may end before its first control cycle.
        "start_time_s": min(CONTROLLER_OFFSET_S, status.time_s),
        "end_time_s": status.time_s,
    }


def _controller_files(preset: Preset) -> dict[str, Any]:
    """Returns the digests of the files that a controller consists of or reads, where it has any."""
    hashes = preset.file_hashes
    return {"controller_files": hashes} if hashes else {}


def _samples(
    recording: Recording, robot: Robot, mission: MissionProgress | None = None
) -> pd.DataFrame:
    """Returns the samples with the columns that a log of the robot has."""
    recorded: dict[str, Any] = recording.columns()
    lateral = LATERAL_COLUMNS if robot.drive.lateral_speed_mps > 0.0 else ()
    own = [name for name in ODOMETRY_COLUMNS if name in recorded]
    columns = {name: recorded[name] for name in (*COLUMNS, *lateral, *own)}
    columns["cycle_count"] = columns["cycle_count"].astype(np.int64)
    if mission is not None:
        columns |= mission_columns(mission, columns["time_s"])
    return pd.DataFrame(columns)


def mission_account(scenario: Scenario) -> dict[str, Any]:
    """Returns the header's `floors` and `mission`, and its `scenario` with goals in the world.

    A point (x, y) on a floor's map is (x, y) + `offset_m` in the world, the frame of all poses of a
    log.
    """
    *waypoints, goal = (list(pose) for pose in scenario.goals)
    described = scenario.model_dump(mode="json") | {"waypoints": waypoints, "goal": goal}
    floors = [
        {"name": floor.name, "offset_m": list(floor.offset), "bounds_m": list(floor.bounds)}
        for floor in scenario.placed_floors
    ]
    legs = [
        {"floor": leg.floor.name, "goal": list(leg.goal)}
        | (
            {}
            if leg.lift is None or leg.to is None or leg.arrival is None
            else {"lift": leg.lift.name, "to": leg.to.name, "arrival": list(leg.arrival)}
        )
        for leg in scenario.legs
    ]
    return {"scenario": described, "floors": floors, "mission": legs}


def mission_columns(
    mission: MissionProgress, time_s: NDArray[np.float64]
) -> dict[str, NDArray[np.int64]]:
    """Returns the columns of `MISSION_COLUMNS` for samples (N,) taken at these times."""
    floors = np.array([0, *(switch.floor for switch in mission.switches)])
    changes = [switch.time_s for switch in mission.switches]
    starts = [*(leg.start_time_s for leg in mission.legs), mission.leg_start_s]
    last_begun = max(len(mission.legs), mission.index + 1)
    # A sample at the instant of a change was taken before it.
    values = (
        floors[np.searchsorted(changes, time_s, side="left")],
        np.searchsorted(starts[1:last_begun], time_s, side="left"),
    )
    return {
        name: value.astype(np.int64) for name, value in zip(MISSION_COLUMNS, values, strict=True)
    }


def mission_events(
    mission: MissionProgress, events: Sequence[Event], end_s: float
) -> tuple[Event, ...]:
    """Returns the navigator's events with those of the lifts, in order, up to the trial's end."""
    of_lifts = [
        (time_s, {"lift": leg.lift, "event": name})
        for leg in mission.legs
        if isinstance(leg, FloorLeg)
        for time_s, name in leg.lift_events
        if time_s <= end_s
    ]
    return tuple(sorted([*events, *of_lifts], key=lambda event: event[0]))
