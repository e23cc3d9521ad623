"""Tuning from a request to its files: search, fresh seeds, held-out scenarios, front, page."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import Any, NamedTuple

from drake_navbench.analysis.tuning_page import RESULT_NAME, write_tuning_page
from drake_navbench.campaign.rows_of_trials import planned_pairs
from drake_navbench.inputs.presets import Preset, load_preset
from drake_navbench.studies.tuning.chance import require_chance_in_held_out, with_chance
from drake_navbench.studies.tuning.front import judge_front
from drake_navbench.studies.tuning.guards import (
    WORLDS_IN_SEARCH,
    Guards,
    guard_specs,
    guards_for,
    told,
    touches_of,
)
from drake_navbench.studies.tuning.journal import JOURNAL, open_study
from drake_navbench.studies.tuning.nav2_space import FileSpace, current_values, file_space
from drake_navbench.studies.tuning.objectives import Objective, chosen_objectives
from drake_navbench.studies.tuning.request import (
    TuningRequest,
    names_of,
    require_scenarios_and_bounds,
)
from drake_navbench.studies.tuning.search_space import SearchSpace, search_space
from drake_navbench.studies.tuning.study import (
    Configuration,
    Ending,
    Sampling,
    Search,
    Trials,
    configurations_of,
    drive_baseline,
    front_of,
    importance_of,
)
from drake_navbench.studies.tuning.task import TuningTask, tuning_task
from drake_navbench.typed_files.output_file import write_text

MINUTE_S, HOUR_S = 60.0, 3600.0


def tune(request: TuningRequest, tell: Callable[[str], None]) -> None:
    """Searches, judges and writes files; tell: gets each line for the user.

    A study that exists in the folder is continued. Raises InputError.
    """
    objectives = chosen_objectives(request.objectives)
    require_scenarios_and_bounds(request)
    space = _space_of(request)
    baseline = space.baseline
    if baseline.stack is not None:
        request = replace(request, preset=baseline.name).with_tasks(baseline.stack)
    guards = guards_for(
        baseline, request.robot, seed=request.seed, first=0, worlds=WORLDS_IN_SEARCH
    )
    _tell_tasks_left_out(request, tell)
    request = with_chance(request, baseline, objectives, tell)
    trials = _planned_trials(request, baseline, guards)
    if request.held_out and not request.goals:
        require_chance_in_held_out(request, baseline, objectives)
    task = _task_of(request, baseline, space, guards)
    if (request.out / JOURNAL).exists():
        # A study of another task is refused before anything is driven for it.
        open_study(request.out, task, tell)
    _tell_guards(request, guards, tell)
    forecast = forecast_of(request, guards)
    tell(forecast.text)
    begun = time.monotonic()
    driven_baseline = drive_baseline(trials, objectives, jobs=request.jobs)
    baseline_s = time.monotonic() - begun
    _tell_touches_of_baseline(request.preset, driven_baseline, tell)
    study = open_study(request.out, task, tell)
    tell(forecast.time_text(baseline_s, len(configurations_of(study))))
    search = Search(
        study,
        space,
        trials,
        objectives,
        baseline=driven_baseline[: len(trials.pairs)],
        sampling=Sampling(request.sampler, request.seed),
        jobs=request.jobs,
        journal=request.out / JOURNAL,
    )
    search.run(request.configurations, lambda driven: tell(_line_of(driven, objectives)))
    if request.search_only:
        return
    driven = configurations_of(study)
    front = front_of(driven, request.most_front_points)
    importance = {entry.name: importance_of(study, index) for index, entry in enumerate(objectives)}
    result = _result(task, request, guards, driven, importance)
    if request.added_range_std_m:
        result["added_range_std_m"] = request.added_range_std_m
    if front:
        judge_front(request, space, objectives, front, result, tell)
    else:
        touched = sum(entry.ending == Ending.TOUCHED for entry in driven)
        tell(
            "no configuration came through the race without touching anything or failing more "
            f"often than the baseline; {touched} of {len(driven)} touched something"
        )
    write_text(request.out / RESULT_NAME, json.dumps(result, indent=1) + "\n")
    tell(f"Open {write_tuning_page(request.out)}")


def _space_of(request: TuningRequest) -> SearchSpace:
    if request.nav2 is None:
        return search_space(load_preset(request.preset), request.parameters)
    return file_space(request.nav2, request.plugin, request.robot, request.parameters)


def _planned_trials(request: TuningRequest, baseline: Preset, guards: Guards) -> Trials:
    closed, worlds = (
        guard_specs(scenarios, baseline, request.robot, request.seed)
        for scenarios in (guards.closed, guards.worlds)
    )
    pairs = planned_pairs(
        baseline, request.scenarios, request.robot, request.most_pairs, request.seed
    )
    return Trials(pairs, closed, worlds)


def _tell_tasks_left_out(request: TuningRequest, tell: Callable[[str], None]) -> None:
    if request.goals and len(request.scenarios) > request.most_pairs:
        tell(
            f"The search drives the first {request.most_pairs} of {len(request.scenarios)} tasks, "
            "as --pairs says; the front drives all of them"
        )


def _tell_guards(request: TuningRequest, guards: Guards, tell: Callable[[str], None]) -> None:
    for kind, why in guards.left_out.items():
        tell(f"No {kind} is driven as a further test for touches: {why}")
    if not guards.names:
        return
    parts = [scenario.name for scenario in guards.closed]
    if guards.worlds:
        parts.append(f"{len(guards.worlds)} random worlds if it comes through the race")
    tell(
        f"Each configuration drives {request.most_pairs} pairs at most, and for touches alone "
        f"{' and '.join(parts)}; one that touches anything is dropped."
    )


def _tell_touches_of_baseline(
    baseline: str, rows: Sequence[dict[str, Any]], tell: Callable[[str], None]
) -> None:
    touches = touches_of(rows)
    if touches:
        tell(
            f"{baseline} itself touches something in {told(touches)}: only configurations that "
            "mend this can come through"
        )


def _task_of(
    request: TuningRequest, baseline: Preset, space: SearchSpace, guards: Guards
) -> TuningTask:
    of_file: dict[str, Any] = {}
    if isinstance(space, FileSpace):
        # The whole text of the file counts: another file of the same name is another task.
        of_file = {"file": sha256(space.text.encode()).hexdigest(), **current_values(space)}
    if isinstance(request.goals, Path):
        # Tasks between other places have the same names.
        of_file["goals"] = sha256(request.goals.read_bytes()).hexdigest()
    if request.added_range_std_m:
        of_file["lidar.range_std_m"] = request.added_range_std_m
    return tuning_task(
        baseline,
        of_file,
        searched=[str(dimension) for dimension in space.dimensions],
        scenarios=names_of(request.scenarios),
        guards=guards.names,
        robot=request.robot,
        objectives=request.objectives,
        most_pairs=request.most_pairs,
        seed=request.seed,
    )


def _line_of(driven: Configuration, objectives: Sequence[Objective]) -> str:
    shown = ", ".join(
        f"{entry.name} {100.0 * mean:+.1f}%"
        for entry, mean in zip(objectives, driven.means, strict=True)
    )
    ends = {
        Ending.THROUGH: "through,",
        Ending.DROPPED: "dropped after",
        Ending.TOUCHED: f"touched in {told(driven.touches)}: dropped after",
    }
    return f"{driven.number:>4}: {ends[driven.ending]} {len(driven.differences)} pairs; {shown}"


def _result(
    task: TuningTask,
    request: TuningRequest,
    guards: Guards,
    driven: Sequence[Configuration],
    importance: dict[str, dict[str, float]],
) -> dict[str, Any]:
    return {
        "task": task.model_dump(mode="json"),
        "digest": task.digest,
        "command": request.command,
        "sampler": request.sampler,
        "held_out": list(names_of(request.held_out)),
        "left_out": guards.left_out,
        "configurations": [
            {
                "number": entry.number,
                "parameters": entry.parameters,
                "means": entry.means.tolist(),
                "pairs": len(entry.differences),
                "excess": entry.excess,
                "ending": entry.ending.value,
                "touches": entry.touches,
                "trials": entry.trials,
            }
            for entry in driven
        ],
        "importance": importance,
        "front": [],
        "touching": [],
        "winner": None,
    }


class Forecast(NamedTuple):
    """The largest number of trials that a search can drive.

    each: trials of the baseline and of each configuration. judgement: trials of the front and the
    baseline, on fresh seeds. A configuration that is dropped drives fewer.
    """

    configurations: int
    each: int
    judgement: int

    @property
    def trials(self) -> int:
        """The number of all trials, those of the baseline included."""
        return (self.configurations + 1) * self.each + self.judgement

    @property
    def text(self) -> str:
        """The number of trials in a sentence."""
        search = self.trials - self.judgement
        judged = f" and {self.judgement} to judge the front" if self.judgement else ""
        return (
            f"At most {self.trials} trials: {search} for the baseline and "
            f"{self.configurations} configurations{judged}. Ctrl-C stops; the same command goes on."
        )

    def time_text(self, baseline_s: float, known: int) -> str:
        """Returns a sentence with the remaining time, if every trial takes as long as these.

        A configuration that is dropped drives fewer trials; one that is slow or times out takes
        longer. baseline_s: duration of the baseline's trials, which load the kernels as well.
        known: configurations of the study that were driven before.
        """
        left = max(self.configurations - known, 0) * self.each + self.judgement
        return (
            f"The baseline's {self.each} trials took {baseline_s:.0f} s: if none is dropped, "
            f"{left} more like these take about {duration_text(left * baseline_s / self.each)}."
        )


def forecast_of(request: TuningRequest, guards: Guards) -> Forecast:
    """Returns the forecast of a search; request: with the tasks on its map drawn."""
    has_worlds = bool(guards.worlds)
    each = request.most_pairs + len(guards.closed) + WORLDS_IN_SEARCH * has_worlds
    if request.search_only:
        return Forecast(request.configurations, each, 0)
    columns = min(request.most_front_points, request.configurations) + 1
    seen, held_out = (
        len(scenarios) * request.trials_in(scenarios)
        for scenarios in (request.scenarios, request.held_out)
    )
    touches = request.fresh * (len(guards.closed) + has_worlds)
    return Forecast(request.configurations, each, columns * (seen + held_out + touches))


def duration_text(seconds: float) -> str:
    """Returns a time as minutes, from an hour and a half on as hours: '1 min', '2.5 h'."""
    if seconds < 1.5 * HOUR_S:
        return f"{max(math.ceil(seconds / MINUTE_S), 1)} min"
    return f"{seconds / HOUR_S:.1f} h"
