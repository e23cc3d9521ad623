"""Validates a Pareto front on fresh seeds, in held-out scenarios, and in the guards' scenarios."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from drake_navbench.analysis.numbers import counted
from drake_navbench.inputs.presets import Preset
from drake_navbench.logs.results import file_name
from drake_navbench.studies.tuning.guards import (
    WORLDS_IN_SEARCH,
    guards_for,
    rate_at_most,
    told,
    touches_of,
)
from drake_navbench.studies.tuning.judgement import Judged, driven_in, judge, suites_of, winner_of
from drake_navbench.studies.tuning.objectives import Objective
from drake_navbench.studies.tuning.request import HELD_OUT, TuningRequest, names_of
from drake_navbench.studies.tuning.search_space import SearchSpace
from drake_navbench.studies.tuning.study import Configuration

FRESH, FRONT = "fresh", "front"
CLOSED_WAY, RANDOM_WORLDS = "closed_way", "random_worlds"
# The seeds of trials on fresh seeds, in held-out scenarios, and for touches alone.
SEED_OF_FRESH, SEED_OF_HELD_OUT, SEED_OF_GUARDS = 1, 2, 3

Tell = Callable[[str], None]


def judge_front(
    request: TuningRequest,
    space: SearchSpace,
    objectives: Sequence[Objective],
    front: Sequence[Configuration],
    result: dict[str, Any],
    tell: Tell,
) -> None:
    """Drives the points of a front in further trials, and adds the judged points to the result.

    A point that touches anything in any of these trials is dropped from the front.
    """
    names = [f"{request.preset}_tuned_{index}" for index in range(1, len(front) + 1)]
    columns = [
        replace(
            space.candidate(entry.parameters),
            name=name,
            description=f"{request.preset}, tuned in {request.place}",
        )
        for name, entry in zip(names, front, strict=True)
    ]
    guarded = _guarded(request, [space.baseline, *columns], tell)
    judged = _judged(request, [space.baseline, *columns], objectives, tell)
    # Files of an earlier front are removed, since its points had the same names.
    for suffix in ("yaml", "patch"):
        for path in (request.out / FRONT).glob(f"*_tuned_*.{suffix}"):
            path.unlink()
    deciding = {entry.column: entry for entry in judged.get(HELD_OUT, judged[FRESH])}
    where = "in the held-out scenarios" if request.held_out else "on fresh seeds"
    for index, (entry, column) in enumerate(zip(front, columns, strict=True)):
        parts = {part: found[index] for part, found in judged.items()}
        point = _point(entry, column, parts, guarded[column.name])
        tell(_gap_line(point, objectives))
        if point["touches"]:
            result["touching"].append(point)
            tell(f"{column.name}: touches something in {told(point['touches'])}: not on the front")
        else:
            result["front"].append(point)
            tell(f"{column.name}: {_untouched(point)}")
            beats = "beats" if deciding[column.name].beats_baseline else "is not shown to beat"
            remarks = [
                f"{column.name} {beats} {request.preset} {where}",
                f"made by: {request.command}",
                f"study: {result['digest']}",
            ]
            if noise_m := request.added_range_std_m:
                remarks.append(f"driven with noise of {noise_m:g} m on a lidar that has none")
            stem = request.out / FRONT / file_name(column.name)
            space.write(column, entry.parameters, stem, remarks)
    kept = [deciding[point["name"]] for point in result["front"]]
    for own in kept:
        tell(own.text)
    best = winner_of(kept)
    result["winner"] = None if best is None else best.column
    if best is None:
        tell(f"none of the front is shown to beat {request.preset} {where}")
    else:
        tell(f"{best.column} beats {request.preset} {where}, and touches nothing")


def _guarded(
    request: TuningRequest, columns: Sequence[Preset], tell: Tell
) -> dict[str, dict[str, dict[str, Any]]]:
    """Returns the touches of each column in a closed way and random worlds, by column and part."""
    guards = guards_for(
        columns[0],
        request.robot,
        seed=request.seed,
        first=WORLDS_IN_SEARCH,
        worlds=request.fresh,
    )
    parts = {CLOSED_WAY: (guards.closed, request.fresh), RANDOM_WORLDS: (guards.worlds, 1)}
    found: dict[str, dict[str, dict[str, Any]]] = {column.name: {} for column in columns}
    for part, (scenarios, trials) in parts.items():
        if not scenarios:
            continue
        shown = scenarios[0].name if len(scenarios) == 1 else f"{len(scenarios)} random worlds"
        tell(f"Driving the front of {len(columns) - 1} in {shown}, for touches alone ...")
        table = driven_in(
            request.out / part,
            scenarios,
            columns,
            trials=trials,
            seed=request.seed + SEED_OF_GUARDS,
            robot=request.robot,
            jobs=request.jobs,
        ).to_dict("records")
        rows = {
            column.name: [row for row in table if row["controller"] == column.name]
            for column in columns
        }
        of_baseline = touches_of(rows[columns[0].name]).total()
        for name, own in rows.items():
            touches = touches_of(own)
            found[name][part] = {
                "touched": [touches.total(), of_baseline],
                "touches": dict(touches),
                "trials": len(own),
                "at_most": rate_at_most(len(own)),
            }
    return found


def _judged(
    request: TuningRequest,
    columns: Sequence[Preset],
    objectives: Sequence[Objective],
    tell: Tell,
) -> dict[str, list[Judged]]:
    """Returns the judgements of the columns after the baseline, by part."""
    parts = {FRESH: (request.scenarios, SEED_OF_FRESH)}
    if request.deciding_pairs > request.fresh:
        tell(
            f"--fresh {request.fresh} can decide nothing about "
            f"{counted(request.most_front_points, 'point')} and "
            f"{counted(len(request.objectives), 'objective')}; "
            f"{request.deciding_pairs} pairs are driven"
        )
    if request.held_out:
        parts[HELD_OUT] = (request.held_out, SEED_OF_HELD_OUT)
    judged = {}
    for part, (scenarios, further_seed) in parts.items():
        shown = ", ".join(names_of(scenarios)) if not request.goals else f"{part} tasks"
        tell(f"Driving the front of {len(columns) - 1} in {shown} ...")
        trials = driven_in(
            request.out / part,
            scenarios,
            columns,
            trials=request.trials_in(scenarios),
            seed=request.seed + further_seed,
            robot=request.robot,
            jobs=request.jobs,
        )
        names = [column.name for column in columns[1:]]
        judged[part] = judge(trials, columns[0].name, names, objectives, suites_of(scenarios))
    return judged


def _point(
    entry: Configuration,
    column: Preset,
    judged: dict[str, Judged],
    guarded: dict[str, dict[str, Any]],
) -> dict[str, Any]:
    touches: Counter[str] = Counter()
    for part in judged.values():
        touches += Counter(part.touches)
    for guard in guarded.values():
        touches += Counter(guard["touches"])
    return {
        "name": column.name,
        "number": entry.number,
        "parameters": entry.parameters,
        "tuning": entry.means.tolist(),
        "gap": (np.array(judged[FRESH].means) - entry.means).tolist(),
        "touches": dict(touches),
        **{part: found.as_data() for part, found in judged.items()},
        **guarded,
    }


def _gap_line(point: dict[str, Any], objectives: Sequence[Objective]) -> str:
    """Returns a line for a front point: the gain in the search, and that on fresh seeds."""
    parts = [
        f"{entry.name} {100.0 * promised:+.1f}% -> {100.0 * (promised + gap):+.1f}%"
        for entry, promised, gap in zip(objectives, point["tuning"], point["gap"], strict=True)
    ]
    return f"{point['name']}: optimism gap (search -> fresh seeds): {'; '.join(parts)}"


def _untouched(point: dict[str, Any]) -> str:
    """Returns the number of a point's trials without a touch, and the bound that follows."""
    trials = sum(
        point[part]["trials"]
        for part in (FRESH, HELD_OUT, CLOSED_WAY, RANDOM_WORLDS)
        if part in point
    )
    text = f"touches nothing in {trials} trials"
    if RANDOM_WORLDS in point:
        share = 100.0 * point[RANDOM_WORLDS]["at_most"]
        text += (
            f", {point[RANDOM_WORLDS]['trials']} random worlds among them (a touch in at "
            f"most {share:.1f}% of such worlds, with 95% confidence)"
        )
    return text
