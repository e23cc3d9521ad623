"""Why a trial's controller decided as it did at a time: the trial is driven again up to there.

Nothing of it is stored: a trial is a function of its inputs, so that the controller gets the same
observation and the same memory once more, and tells its reasons (`ExplainingController`).
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_navbench.controller import Controller
from drake_navbench.errors import InputError, NavbenchError, is_machine_fault, one_line
from drake_navbench.explanation import ControlCycle, ExplainingController, Explanation
from drake_navbench.logs.log import LIVE_CHANGES, UNREPEATABLE_COLUMNS, Outcome, TrialLog
from drake_navbench.processes.worker_process import Returned
from drake_navbench.processes.workers import Task, run_tasks, start_server
from drake_navbench.systems.compute_clock import ComputeClock
from drake_navbench.trial.column_controller import built_controller
from drake_navbench.trial.diagram import Looks
from drake_navbench.trial.recording_wiring import RECORDER_PERIOD_S
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.trial.task_cost import wall_clock_limit_s
from drake_navbench.trial.trial import compute_times, simulate_with

ROUNDING_S = 1e-9


class Why(NamedTuple):
    """The reasons of a decision, and whether it is the logged one.

    time_s: start of the control cycle. cycle: its number, counted from 1. explanation: of its
    command. sent: (3,) the command that the log has after it, v m/s, w rad/s, vy m/s. doubt: how
    the recomputed trial differs from the log, '' where both are equal to the last bit; with a doubt
    the explanation is not one of the logged decision. checked_rows: samples of the log that were
    compared.
    """

    time_s: float
    cycle: int
    explanation: Explanation
    sent: NDArray[np.float64]
    doubt: str
    checked_rows: int


class _Last:
    """Keeps the last control cycle that began by a time."""

    def __init__(self, time_s: float) -> None:
        self._time_s = time_s
        self.cycle: ControlCycle | None = None
        self.count = 0

    def hear(self, cycle: ControlCycle) -> None:
        if cycle.observation.time_s <= self._time_s + ROUNDING_S:
            self.cycle = cycle
            self.count += 1


def require_explainable(log: TrialLog, time_s: float) -> None:
    """Raises InputError where a log has no decision at a time that could be explained."""
    if log.is_recording:
        raise InputError("made of a recording: the controller of it is not known")
    if log.outcome is Outcome.ERROR:
        raise InputError(f"the trial ended in an error, {log.info['reason']}: none is explained")
    if log.info.get("running_stack") is not None:
        raise InputError("a running stack drove; it cannot be asked again")
    if log.info.get(LIVE_CHANGES):
        raise InputError("sliders of --live changed its parameters; it cannot be driven again")
    first_s, end_s = float(log.info["start_time_s"]), log.end_time_s
    if not (math.isfinite(time_s) and first_s <= time_s <= end_s):
        raise InputError(
            f"--at {time_s:g}: expected a time of the trial, {first_s:g} to {end_s:g} s"
        )


def why(spec: TrialSpec, log: TrialLog, time_s: float) -> Why:
    """Returns why the controller decided as it did in the last cycle by a time, s.

    spec: of the trial that the log is of. Raises InputError where the controller cannot tell, or
    there is no cycle by then. A controller that is not ours runs in a process of its own.
    """
    require_explainable(log, time_s)
    if ComputeClock(spec.scenario.conditions(spec.robot).timing, None).is_needed:
        spec = replace(spec, compute_times_ms=compute_times(log))
    if not spec.code_owner:
        return _why(spec, log, time_s)
    start_server([__name__])
    limit_s = wall_clock_limit_s(spec.scenario)
    task = Task(_why, (spec, log, time_s), time_limit_s=limit_s, owner=spec.code_owner)
    ((_, ending),) = run_tasks([task], jobs=1)
    if not isinstance(ending, Returned):
        raise InputError(f"{spec.preset.name}: {ending.sentence}")
    return ending.value


def _why(spec: TrialSpec, log: TrialLog, time_s: float) -> Why:
    spec = replace(spec, robot=spec.preset.robot(spec.robot), keeps_costmaps=False)
    name = spec.preset.name
    if not hasattr(spec.preset.controller_class, "explain"):
        raise InputError(f"{name}: its controller cannot tell why; it has no method `explain`")
    last = _Last(time_s)
    with built_controller(spec.preset, spec.robot) as controller:
        again = simulate_with(
            controller,
            spec,
            Looks(keeps_costmaps=False, hear=last.hear),
            until_s=time_s + 2.0 * RECORDER_PERIOD_S,
        )
    if last.cycle is None:
        raise InputError(f"--at {time_s:g}: there was no control cycle yet")
    with built_controller(spec.preset, spec.robot, wants_diagnostics=True) as controller:
        explanation = _explained(controller, last.cycle, name)
    checked, doubt = _doubt(again, log, time_s + RECORDER_PERIOD_S)
    if not doubt and not explanation.gives(last.cycle.command):
        doubt = "the explained command is not the one that the controller gave"
    return Why(
        last.cycle.observation.time_s,
        last.count,
        explanation,
        _sent(log, last.count),
        doubt,
        checked,
    )


def _explained(controller: Controller, cycle: ControlCycle, name: str) -> Explanation:
    """Returns a controller's own reasons; raises InputError where it breaks over them."""
    assert isinstance(controller, ExplainingController)
    try:
        found = controller.explain(cycle.observation, cycle.memory)
        if not isinstance(found, Explanation):
            raise TypeError(f"explain returned {type(found).__name__}, expected an Explanation")
    except NavbenchError:
        raise
    except Exception as error:
        if is_machine_fault(error):
            raise
        raise InputError(f"{name}: its method `explain` broke: {one_line(error)}") from error
    return found


def _doubt(again: TrialLog, log: TrialLog, until_s: float) -> tuple[int, str]:
    """Returns the number of compared samples, and the first difference, '' without one."""
    theirs = log.samples[log.samples["time_s"] <= until_s + ROUNDING_S]
    ours = again.samples[again.samples["time_s"].isin(theirs["time_s"])]
    count = len(theirs)
    if len(ours) != count:
        return count, f"the log has {count} samples up to then, the recomputed trial {len(ours)}"
    for name in theirs.columns:
        if name in UNREPEATABLE_COLUMNS:
            continue
        if name not in ours.columns:
            return count, f"the log has a column {name}, the recomputed trial has none"
        logged, recomputed = (entry[name].to_numpy() for entry in (theirs, ours))
        differs = ~((logged == recomputed) | (np.isnan(logged) & np.isnan(recomputed)))
        if differs.any():
            row = int(np.argmax(differs))
            return count, (
                f"{name} at {theirs['time_s'].iloc[row]:.2f} s: logged {logged[row]!r}, "
                f"recomputed {recomputed[row]!r}"
            )
    return count, ""


def _sent(log: TrialLog, cycle: int) -> NDArray[np.float64]:
    """Returns (3,) the command in the log's first sample that saw a cycle; not a number if none."""
    rows = log.samples[log.samples["cycle_count"] >= cycle]
    if rows.empty:
        return np.full(3, np.nan)
    row = rows.iloc[0]
    return np.array([row["command_v_mps"], row["command_w_radps"], row.get("command_vy_mps", 0.0)])
