"""Why a trial's controller decided as it did: the trial is driven again, up to a time or its end.

Nothing of it is stored: a trial is a function of its inputs, so that the controller gets the same
observation and the same memory once more, and tells its reasons (`ExplainingController`).
"""

from __future__ import annotations

import math
import multiprocessing
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from drake_navbench.controller import Controller
from drake_navbench.errors import InputError, NavbenchError, is_machine_fault, one_line
from drake_navbench.explanation import (
    ControlCycle,
    ExplainingController,
    Explanation,
    command_text,
)
from drake_navbench.logs.log import LIVE_CHANGES, TrialLog
from drake_navbench.logs.log_columns import UNREPEATABLE_COLUMNS
from drake_navbench.logs.outcome import Outcome
from drake_navbench.processes.tasks import Task
from drake_navbench.processes.worker_process import Returned
from drake_navbench.processes.workers import run_tasks, start_server
from drake_navbench.trial.column_controller import built_controller
from drake_navbench.trial.diagram import Observers
from drake_navbench.trial.recording_wiring import RECORDER_PERIOD_S
from drake_navbench.trial.simulation import simulate_with
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.trial.systems.compute_clock import ComputeClock
from drake_navbench.trial.task_cost import wall_clock_limit_s
from drake_navbench.trial.trial import compute_times

ROUNDING_S = 1e-9


class Why(NamedTuple):
    """The reasons of a decision, and whether it is the logged one.

    time_s: start of the control cycle. cycle: its number, counted from 1. explanation: the reasons
    of its command. sent: (3,) the command that the log has after the cycle, v m/s, w rad/s, vy m/s.
    doubt: how the recomputed trial differs from the log, '' where both are equal to the last bit;
    with a doubt the explanation is not that of the logged decision. checked_rows: samples of the
    log that were compared.
    """

    time_s: float
    cycle: int
    explanation: Explanation
    sent: NDArray[np.float64]
    doubt: str
    checked_rows: int

    @property
    def assurance(self) -> tuple[str, ...]:
        """Sentences that say how certain the reasons of the logged command are."""
        if self.doubt:
            return (
                f"Not certain: {self.doubt}. The trial that was driven again is another one from "
                "there on, and so may be its reasons.",
            )
        command = self.explanation.command
        changed = (
            (f"The robot got {command_text(self.sent)}: what follows the controller changed it.",)
            if command is not None and not self.explanation.gives(self.sent)
            else ()
        )
        return (
            *changed,
            f"Recomputed: command and all {self.checked_rows} samples up to then equal the log to "
            "the last bit.",
        )


class WholeWhy(NamedTuple):
    """The reasons of all decisions of a trial.

    decisions: in the order of their control cycles. diagnostics: time s and diagnostics of each
    cycle, arrays included, as in `TrialLog.diagnostics`.
    """

    decisions: tuple[Why, ...]
    diagnostics: tuple[tuple[float, Mapping[str, Any]], ...]


def require_explainable(log: TrialLog) -> None:
    """Raises InputError where the decisions in a log cannot be explained."""
    if log.is_recording:
        raise InputError("made of a recording, whose controller is not known")
    if log.outcome is Outcome.ERROR:
        raise InputError(
            f"the trial ended in an error, {log.info['reason']}; such trials are not explained"
        )
    if log.info.get("running_stack") is not None:
        raise InputError("a running ROS 2 stack drove it; it cannot be repeated")
    if log.info.get(LIVE_CHANGES):
        raise InputError(
            "sliders of --live changed its parameters; the trial cannot be driven again"
        )


def why(spec: TrialSpec, log: TrialLog, time_s: float) -> Why:
    """Returns why the controller decided as it did in its last cycle up to `time_s`, s.

    spec: specification of the trial that the log is of. Raises InputError where the controller
    cannot tell, or there is no cycle by then. A controller that is not ours runs in a process of
    its own.
    """
    require_explainable(log)
    first_s, end_s = float(log.info["start_time_s"]), log.end_time_s
    if not (math.isfinite(time_s) and first_s <= time_s <= end_s):
        raise InputError(
            f"--at {time_s:g}: expected a time of the trial, {first_s:g} to {end_s:g} s"
        )
    found = _asked_again(spec, log, time_s).decisions
    if not found:
        raise InputError(f"--at {time_s:g}: there was no control cycle yet")
    return found[-1]


def whole_why(spec: TrialSpec, log: TrialLog) -> WholeWhy:
    """Returns why the controller decided as it did in each cycle of a trial; as for `why`."""
    require_explainable(log)
    return _asked_again(spec, log, None)


def _asked_again(spec: TrialSpec, log: TrialLog, time_s: float | None) -> WholeWhy:
    """Returns the reasons of the last decision by a time, s; without one, of all."""
    if ComputeClock(spec.scenario.conditions(spec.robot).timing, None).is_needed:
        spec = replace(spec, compute_times_ms=compute_times(log))
    # A worker is a process of its own already, and may have no others.
    if not spec.code_owner or multiprocessing.current_process().daemon:
        return _driven_again(spec, log, time_s)
    start_server([__name__])
    limit_s = wall_clock_limit_s(spec.scenario)
    task = Task(_driven_again, (spec, log, time_s), time_limit_s=limit_s, owner=spec.code_owner)
    ((_, ending),) = run_tasks([task], jobs=1)
    if not isinstance(ending, Returned):
        raise InputError(f"{spec.preset.name}: {ending.sentence}")
    return ending.value


def _driven_again(spec: TrialSpec, log: TrialLog, time_s: float | None) -> WholeWhy:
    """Drives a trial and explains it afterwards, so that explaining cannot change the drive."""
    spec = replace(spec, robot=spec.preset.robot(spec.robot), wants_diagnostics=True)
    if not hasattr(spec.preset.controller_class, "explain"):
        raise InputError(
            f"{spec.preset.name}: its controller cannot tell why; it has no method `explain`"
        )
    asked_s = math.inf if time_s is None else time_s
    cycles: list[ControlCycle] = []

    def on_cycle(cycle: ControlCycle) -> None:
        if cycle.observation.time_s <= asked_s + ROUNDING_S:
            cycles.append(cycle)

    observers, until_s = Observers(on_cycle=on_cycle), asked_s + 2.0 * RECORDER_PERIOD_S
    with built_controller(spec.preset, spec.robot, wants_diagnostics=True) as controller:
        again = simulate_with(controller, spec, observers, until_s=until_s)
    difference = _first_difference(again, log, asked_s + RECORDER_PERIOD_S)
    numbers = range(len(cycles)) if time_s is None else range(len(cycles))[-1:]
    with built_controller(spec.preset, spec.robot, wants_diagnostics=True) as controller:
        decisions = tuple(
            _decision(controller, cycles[number], number + 1, log, difference, time_s)
            for number in numbers
        )
    return WholeWhy(decisions, again.diagnostics)


def _decision(
    controller: Controller,
    cycle: ControlCycle,
    count: int,
    log: TrialLog,
    difference: _Difference,
    asked_s: float | None,
) -> Why:
    """Returns the reasons of one cycle; asked_s: the time that was asked for, None for its own."""
    begun_s = cycle.observation.time_s
    until_s = (begun_s if asked_s is None else asked_s) + RECORDER_PERIOD_S + ROUNDING_S
    explanation = _explained(controller, cycle, log.info["controller"])
    doubt = difference.text if difference.time_s <= until_s else ""
    if not doubt and not explanation.gives(cycle.command):
        doubt = "the explained command is not the one that the controller gave"
    checked = int(np.searchsorted(log.samples["time_s"].to_numpy(), until_s, "right"))
    return Why(begun_s, count, explanation, _sent(log, count), doubt, checked)


def _explained(controller: Controller, cycle: ControlCycle, name: str) -> Explanation:
    """Returns a controller's own reasons; raises InputError where its `explain` breaks."""
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


class _Difference(NamedTuple):
    """The first value in which a trial that was driven again differs from its log, and when."""

    time_s: float
    text: str


def _first_difference(again: TrialLog, log: TrialLog, until_s: float) -> _Difference:
    """Returns the first difference up to a time; its time is infinite where there is none."""
    theirs = log.samples[log.samples["time_s"] <= until_s + ROUNDING_S]
    ours = again.samples[again.samples["time_s"].isin(theirs["time_s"])]
    count = len(theirs)
    if len(ours) != count:
        return _Difference(
            -math.inf, f"the log has {count} samples up to then, the recomputed trial {len(ours)}"
        )
    first = _Difference(math.inf, "")
    for name in theirs.columns:
        if name in UNREPEATABLE_COLUMNS:
            continue
        if name not in ours.columns:
            return _Difference(
                -math.inf, f"the log has a column {name}, the recomputed trial has none"
            )
        logged, recomputed = (entry[name].to_numpy() for entry in (theirs, ours))
        differs = ~((logged == recomputed) | (np.isnan(logged) & np.isnan(recomputed)))
        row = int(np.argmax(differs))
        time_s = float(theirs["time_s"].iloc[row]) if differs.any() else math.inf
        if time_s < first.time_s:
            first = _Difference(
                time_s,
                f"{name} at {time_s:.2f} s: logged {logged[row]!r}, recomputed {recomputed[row]!r}",
            )
    return first


def _sent(log: TrialLog, cycle: int) -> NDArray[np.float64]:
    """Returns (3,) the command in the log's first sample after a cycle; NaN without one."""
    rows = log.samples[log.samples["cycle_count"] >= cycle]
    if rows.empty:
        return np.full(3, np.nan)
    row = rows.iloc[0]
    return np.array([row["command_v_mps"], row["command_w_radps"], row.get("command_vy_mps", 0.0)])
