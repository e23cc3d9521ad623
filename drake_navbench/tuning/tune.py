"""Tuning from a request to its files: search, fresh seeds, held-out scenarios, front, page."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from drake_navbench.analysis.tuning_page import RESULT_NAME, write_tuning_page
from drake_navbench.errors import InputError
from drake_navbench.inputs.presets import Preset, load_preset
from drake_navbench.results import file_name, write_text
from drake_navbench.tuning.judgement import Judged, driven_in, judge, winner_of
from drake_navbench.tuning.objectives import Objective, chosen_objectives, require_random
from drake_navbench.tuning.outputs import write_nav2_file, write_preset_file
from drake_navbench.tuning.pairs import measure, planned_pairs
from drake_navbench.tuning.search_space import SearchSpace, search_space
from drake_navbench.tuning.study import (
    JOURNAL,
    Configuration,
    Sampler,
    Search,
    configurations_of,
    drive_baseline,
    front_of,
    importance_of,
    open_study,
)
from drake_navbench.tuning.task import TuningTask, tuning_task

FRESH, HELD_OUT, FRONT = "fresh", "held_out", "front"
# Trials of these seeds are those of the search, of fresh seeds and of held-out scenarios.
SEED_OF_FRESH, SEED_OF_HELD_OUT = 1, 2
TRIALS_THAT_TELL_CHANCE = 2


@dataclass(frozen=True)
class TuningRequest:
    """What is asked for; `command` is what the files say they were made by.

    fresh: trials a scenario of the front on fresh seeds, and in each held-out scenario.
    """

    preset: str
    scenarios: tuple[str, ...]
    objectives: tuple[str, ...]
    held_out: tuple[str, ...]
    parameters: tuple[str, ...]
    configurations: int
    most_pairs: int
    most_front_points: int
    fresh: int
    seed: int
    robot: str
    sampler: Sampler
    jobs: int
    out: Path
    command: str
    search_only: bool = False


def tune(request: TuningRequest, tell: Callable[[str], None]) -> None:
    """Searches, judges and writes; tell: is given each line for the user.

    A study that is in the folder already is gone on with. Raises InputError.
    """
    objectives = chosen_objectives(request.objectives)
    baseline = load_preset(request.preset)
    space = search_space(baseline, request.parameters)
    doubled = sorted(set(request.scenarios) & set(request.held_out))
    if doubled:
        raise InputError(f"--held-out {doubled[0]}: is searched in; expected another scenario")
    pairs = planned_pairs(
        baseline, request.scenarios, request.robot, request.most_pairs, request.seed
    )
    if request.held_out:
        _require_chance_in(request, baseline, objectives)
    task = _task_of(request, baseline, space)
    if (request.out / JOURNAL).exists():
        # A study of something else is refused before anything is driven for it.
        open_study(request.out, task)
    driven_baseline = drive_baseline(pairs, objectives, jobs=request.jobs)
    study = open_study(request.out, task)
    search = Search(
        study,
        space,
        pairs,
        objectives,
        baseline=driven_baseline,
        sampler=request.sampler,
        seed=request.seed,
        jobs=request.jobs,
    )
    search.run(request.configurations, lambda driven: tell(_line_of(driven, objectives)))
    if request.search_only:
        return
    driven = configurations_of(study)
    front = front_of(driven, request.most_front_points)
    importance = {entry.name: importance_of(study, index) for index, entry in enumerate(objectives)}
    result = _result(task, request, space, driven, importance)
    if front:
        _judge_front(request, space, objectives, front, result, tell)
    else:
        tell("no configuration came through the race without failing more often than the baseline")
    write_text(request.out / RESULT_NAME, json.dumps(result, indent=1) + "\n")
    tell(f"Open {write_tuning_page(request.out)}")


def _require_chance_in(
    request: TuningRequest, baseline: Preset, objectives: Sequence[Objective]
) -> None:
    """Raises InputError before the search where nothing in a held-out scenario is random."""
    count = TRIALS_THAT_TELL_CHANCE * len(request.held_out)
    specs = planned_pairs(
        baseline, request.held_out, request.robot, count, request.seed + SEED_OF_HELD_OUT
    )
    rows = measure(specs, jobs=request.jobs)
    for scenario in dict.fromkeys(row["scenario"] for row in rows):
        own = [row for row in rows if row["scenario"] == scenario]
        require_random(scenario, own, objectives)


def _task_of(request: TuningRequest, baseline: Preset, space: SearchSpace) -> TuningTask:
    return tuning_task(
        baseline,
        searched=[str(dimension) for dimension in space.dimensions],
        scenarios=request.scenarios,
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
    end = "dropped after" if driven.is_dropped else "through,"
    return f"{driven.number:>4}: {end} {len(driven.differences)} pairs; {shown}"


def _result(
    task: TuningTask,
    request: TuningRequest,
    space: SearchSpace,
    driven: Sequence[Configuration],
    importance: dict[str, dict[str, float]],
) -> dict[str, Any]:
    return {
        "task": task.model_dump(mode="json"),
        "digest": task.digest,
        "command": request.command,
        "sampler": request.sampler,
        "held_out": list(request.held_out),
        "configurations": [
            {
                "number": entry.number,
                "parameters": entry.parameters,
                "means": entry.means.tolist(),
                "pairs": len(entry.differences),
                "excess": entry.excess,
                "is_dropped": entry.is_dropped,
            }
            for entry in driven
        ],
        "importance": importance,
        "front": [],
        "winner": None,
    }


def _judge_front(
    request: TuningRequest,
    space: SearchSpace,
    objectives: Sequence[Objective],
    front: Sequence[Configuration],
    result: dict[str, Any],
    tell: Callable[[str], None],
) -> None:
    names = [f"{request.preset}_tuned_{index}" for index in range(1, len(front) + 1)]
    columns = [
        replace(
            space.candidate(entry.parameters),
            name=name,
            description=f"{request.preset}, tuned in {', '.join(request.scenarios)}",
        )
        for name, entry in zip(names, front, strict=True)
    ]
    parts = {FRESH: (request.scenarios, SEED_OF_FRESH)}
    if request.held_out:
        parts[HELD_OUT] = (request.held_out, SEED_OF_HELD_OUT)
    judged: dict[str, list[Judged]] = {}
    for part, (scenarios, further_seed) in parts.items():
        tell(f"Driving the front of {len(front)} in {', '.join(scenarios)} ...")
        trials = driven_in(
            request.out / part,
            scenarios,
            [space.baseline, *columns],
            trials=request.fresh,
            seed=request.seed + further_seed,
            robot=request.robot,
            jobs=request.jobs,
        )
        judged[part] = judge(trials, request.preset, names, objectives)
    # What is there is of an earlier front, whose points had these names, too.
    for path in (request.out / FRONT).glob("*_tuned_*.yaml"):
        path.unlink()
    for index, (entry, column) in enumerate(zip(front, columns, strict=True)):
        fresh = judged[FRESH][index]
        point = {
            "name": column.name,
            "number": entry.number,
            "parameters": entry.parameters,
            "tuning": entry.means.tolist(),
            "gap": (np.array(fresh.means) - entry.means).tolist(),
            **{part: found[index].as_data() for part, found in judged.items()},
        }
        result["front"].append(point)
        tell(_gap_line(point, objectives))
        remarks = [f"made by: {request.command}", f"study: {result['digest']}"]
        folder, stem = request.out / FRONT, file_name(column.name)
        write_preset_file(column, folder / f"{stem}.preset.yaml", remarks)
        if column.controller_class.nav2_plugin is not None:
            write_nav2_file(column, folder / f"{stem}.nav2.yaml", remarks)
    decisive = judged.get(HELD_OUT, judged[FRESH])
    best = winner_of(decisive)
    where = "in the held-out scenarios" if request.held_out else "on fresh seeds"
    result["winner"] = None if best is None else best.column
    if best is None:
        tell(f"none of the front is shown to beat {request.preset} {where}")
    else:
        tell(f"{best.column} beats {request.preset} {where}")


def _gap_line(point: dict[str, Any], objectives: Sequence[Objective]) -> str:
    """Returns what is left of a front point: what the search promised, what fresh seeds gave."""
    parts = [
        f"{entry.name} {100.0 * promised:+.1f}% -> {100.0 * (promised + gap):+.1f}%"
        for entry, promised, gap in zip(objectives, point["tuning"], point["gap"], strict=True)
    ]
    return f"{point['name']}: optimism gap (search -> fresh seeds): {'; '.join(parts)}"
