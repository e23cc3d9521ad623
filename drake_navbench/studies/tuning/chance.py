"""Chance in the trials of a search: without any, all trials of a task are one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from drake_navbench.campaign.rows_of_trials import measure, planned_pairs
from drake_navbench.errors import InputError
from drake_navbench.inputs.overrides import merged
from drake_navbench.inputs.presets import Preset
from drake_navbench.inputs.scenario import Scenario
from drake_navbench.studies.tuning.front import SEED_OF_HELD_OUT
from drake_navbench.studies.tuning.objectives import Objective, require_random
from drake_navbench.studies.tuning.request import TuningRequest

TRIALS_THAT_TELL_CHANCE = 2
# The noise of a lidar whose model has none: that of turtlebot4, turtlebot3 and jackal, m.
ADDED_RANGE_STD_M = 0.01


def require_chance_in_held_out(
    request: TuningRequest, baseline: Preset, objectives: Sequence[Objective]
) -> None:
    """Raises InputError before the search where nothing in a held-out scenario is random."""
    seed = request.seed + SEED_OF_HELD_OUT
    _require_chance(request, baseline, objectives, request.held_out, seed)


def with_chance(
    request: TuningRequest,
    baseline: Preset,
    objectives: Sequence[Objective],
    tell: Callable[[str], None],
) -> TuningRequest:
    """Returns a request for tasks on a map, with noise on the lidar where nothing is random.

    That is so where the lidar has none, the search drives a task more than once, and its first two
    trials are equal.
    """
    robot = baseline.stack
    is_repeated = request.most_pairs > len(request.scenarios)
    if not (request.goals and is_repeated) or robot is None or robot.lidar.range_std_m > 0.0:
        return request
    try:
        _require_chance(request, baseline, objectives, request.scenarios[:1], request.seed)
    except InputError:
        tell(
            f"The lidar of {request.robot} has no noise: tune drives with {ADDED_RANGE_STD_M:g} m "
            "(lidar.range_std_m, as turtlebot4 has), so that trials of other seeds differ."
        )
        return replace(
            request,
            scenarios=_with_noise(request.scenarios),
            held_out=_with_noise(request.held_out),
            added_range_std_m=ADDED_RANGE_STD_M,
        )
    return request


def _require_chance(
    request: TuningRequest,
    baseline: Preset,
    objectives: Sequence[Objective],
    scenarios: Sequence[str | Scenario],
    seed: int,
) -> None:
    count = TRIALS_THAT_TELL_CHANCE * len(scenarios)
    rows = measure(
        planned_pairs(baseline, scenarios, request.robot, count, seed), jobs=request.jobs
    )
    for scenario in dict.fromkeys(row["scenario"] for row in rows):
        own = [row for row in rows if row["scenario"] == scenario]
        require_random(scenario, own, objectives)


def _with_noise(tasks: Sequence[str | Scenario]) -> tuple[Scenario, ...]:
    noise = {"lidar": {"range_std_m": ADDED_RANGE_STD_M}}
    return tuple(
        task.model_copy(update={"robot_overrides": merged(task.robot_overrides, noise)})
        for task in tasks
        if isinstance(task, Scenario)
    )
