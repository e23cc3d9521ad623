"""The summary at the top of a report: arrivals, touches, the best controllers, their weak points.

Every statement rests on a verdict (see `verdicts`) or on outcomes. A sentence that praises a
controller also names its weak points.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import pandas as pd

from drake_navbench.analysis.early_arrivals import early_arrivals
from drake_navbench.analysis.pairs import RELEVANT_RATIO
from drake_navbench.analysis.scenario_analysis import (
    ScenarioAnalysis,
)
from drake_navbench.analysis.statistics import CONFIDENCE
from drake_navbench.analysis.task_summary import (
    COMPUTE,
    QUANTITIES,
    SUPERLATIVES,
    best_ones,
    in_words,
    listed,
    metric_named,
    task_sentence,
    weak_points,
)
from drake_navbench.analysis.totals import ALL_DENSITIES, Total
from drake_navbench.analysis.verdicts import FirstPlace, MetricVerdict, verdict
from drake_navbench.analysis.weak_points import weak_point, worst_of

CHEAPEST = "cheapest to compute"
ALL_TRIALS = "all trials"
TOUCHES_ARE_FAULTS = "A controller may stop where the way is closed; it must never touch anything."


class TaskSummary(NamedTuple):
    """The sentences about one scenario."""

    scenario: str
    sentence: str


class ReportSummary(NamedTuple):
    """The paragraph on all scenarios together, and one line for each scenario."""

    sentences: list[str]
    tasks: list[TaskSummary]


def summary_of(
    scenarios: Sequence[ScenarioAnalysis],
    totals: Sequence[Total] = (),
    descriptions: Mapping[str, str] | None = None,
) -> ReportSummary:
    """Returns the summary of these scenarios, each of which has trials.

    totals: totals of suites with too many worlds to describe them one by one. descriptions: the
    presets' descriptions; the summary quotes those of controllers that touched something.
    """
    sentences = [_suite(suite, totals) for suite in dict.fromkeys(t.suite for t in totals)]
    if scenarios:
        compute = compute_verdict(scenarios)
        sentences += [
            _arrivals(scenarios),
            *_touches(scenarios, descriptions or {}),
            *_first_places(scenarios, compute),
            *_undecided(scenarios, compute),
            *early_arrivals(pd.concat([scenario.table for scenario in scenarios])),
        ]
    return ReportSummary(
        [sentence for sentence in sentences if sentence],
        [TaskSummary(scenario.scenario, task_sentence(scenario)) for scenario in scenarios],
    )


def compute_verdict(
    scenarios: Sequence[ScenarioAnalysis],
) -> tuple[MetricVerdict, pd.DataFrame] | None:
    """Returns the verdict on processor time over all scenarios, and each controller's mean, ms.

    Trials of equal scenario and seed make a pair. Returns None where there is nothing to compare.
    """
    trials = _compute_times(scenarios)
    entry = metric_named(COMPUTE)
    found = verdict(trials, ALL_TRIALS, entry)
    if found is None:
        return None
    return found, trials.groupby("controller")[[COMPUTE]].mean()


def _compute_times(scenarios: Sequence[ScenarioAnalysis]) -> pd.DataFrame:
    rows = pd.concat(
        [scenario.table[["scenario", "controller", "seed", COMPUTE]] for scenario in scenarios]
    )
    seeds = rows["scenario"].astype(str) + "/" + rows["seed"].astype(str)
    return rows.assign(seed=seeds, scenario=ALL_TRIALS)


def _suite(suite: str, totals: Sequence[Total]) -> str:
    """Returns a sentence on each controller's rates of arrivals and touches in a suite."""
    own = [t for t in totals if t.suite == suite and t.density == ALL_DENSITIES]
    own.sort(key=lambda total: -total.success.value)
    rates = []
    for total in own:
        low, high = (f"{100 * end:.0f}" for end in total.success.interval)
        rates.append(f"{total.controller} in {100 * total.success.value:.0f}% ({low} to {high}%)")
    worlds = max((total.worlds for total in own), default=0)
    text = f"How often the goal was reached in the {worlds} worlds of {suite}: {listed(rates)}."
    touched = [
        f"{total.controller} in {100 * total.collision.value:.0f}%"
        for total in own
        if total.collision.value > 0.0
    ]
    return f"{text} How often something was touched: {listed(touched)}." if touched else text


def _arrivals(scenarios: Sequence[ScenarioAnalysis]) -> str:
    """Returns a sentence on the controllers' arrivals in scenarios with a reachable goal."""
    possible = [scenario for scenario in scenarios if not scenario.is_impossible]
    if not possible:
        return "Every task here is impossible on purpose: nobody can arrive, and nobody is best."
    arrived: Counter[str] = Counter()
    driven: Counter[str] = Counter()
    for scenario in possible:
        for success in scenario.successes:
            arrived[success.controller] += success.succeeded
            driven[success.controller] += success.trials
    always = [name for name in driven if arrived[name] == driven[name]]
    ever = [name for name in driven if arrived[name]]
    others = [name for name in driven if name not in always]
    if not ever:
        return "No controller reached any goal, so none is best."
    missed = listed(
        _missed(name, driven[name] - arrived[name], driven[name]) for name in others or [""]
    )
    if len(driven) == 1:
        (name,) = driven
        return f"{name} reached the goal in {arrived[name]} of {driven[name]} trials."
    if len(ever) == 1:
        own = f"in {arrived[ever[0]]} of {driven[ever[0]]} trials"
        return (
            f"Only {ever[0]} arrived, {own}; {listed(n for n in driven if n != ever[0])} never "
            "reached a goal."
        )
    if not others:
        everybody = "Both" if len(driven) == 2 else f"All {len(driven)}"
        return f"{everybody} controllers reached every goal that can be reached."
    if not always:
        return f"No controller reached every goal: {missed}."
    alone = "Only " if len(always) == 1 else ""
    return f"{alone}{listed(always)} reached every goal that can be reached; {missed}."


def _missed(name: str, missed: int, driven: int) -> str:
    return f"{name} missed {'all' if missed == driven else missed} of {driven}"


def _touches(scenarios: Sequence[ScenarioAnalysis], descriptions: Mapping[str, str]) -> list[str]:
    """Returns a sentence on each controller that touched something: where, and its description."""
    places: dict[str, list[str]] = {}
    for scenario in scenarios:
        for success in scenario.successes:
            if success.touched:
                text = f"{scenario.scenario} ({success.touched} of {success.trials} trials)"
                places.setdefault(success.controller, []).append(text)
    if not places:
        return []
    told = [f"{name} touched something in {listed(where)}" for name, where in places.items()]
    sentences = [f"{'; '.join(told)}. {TOUCHES_ARE_FAULTS}"]
    sentences += [
        f"The preset {name}: {descriptions[name].rstrip('.')}."
        for name in places
        if descriptions.get(name)
    ]
    return sentences


def _first_places(
    scenarios: Sequence[ScenarioAnalysis], compute: tuple[MetricVerdict, pd.DataFrame] | None
) -> list[str]:
    """Returns a sentence on each controller that is best in a metric, and one on the certainty.

    A controller's sentence names the metrics, the scenarios and its weak points.
    """
    contested = [scenario for scenario in scenarios if scenario.anyone_arrived]
    firsts: dict[str, dict[str, list[str]]] = {}
    for scenario in contested:
        for metric, best in best_ones(scenario).items():
            firsts.setdefault(best, {}).setdefault(metric, []).append(scenario.scenario)
    cheapest = compute[0].best if compute else None
    # Who never arrives needs little time in vain.
    arrived = {s.controller for scenario in contested for s in scenario.successes if s.succeeded}
    if cheapest not in arrived:
        cheapest = None
    if cheapest:
        firsts.setdefault(cheapest, {})
    if not firsts:
        return []
    order = sorted(firsts, key=lambda name: -sum(map(len, firsts[name].values())))
    count = sum(len(where) for own in firsts.values() for where in own.values()) + bool(cheapest)
    return [
        *(
            f"{_honours(name, firsts[name], len(contested), is_cheapest=name == cheapest)}"
            f"{_weak_side(name, firsts[name], contested, compute)}."
            for name in order
        ),
        _how_sure(contested, count, is_timed=cheapest is not None),
    ]


def _honours(
    name: str, own: Mapping[str, Sequence[str]], task_count: int, *, is_cheapest: bool
) -> str:
    places: dict[tuple[str, ...], list[str]] = {}
    for metric, word in SUPERLATIVES.items():
        if metric in own:
            places.setdefault(tuple(own[metric]), []).append(word)
    words = [listed(some) + _where(where, task_count) for where, some in places.items()]
    if is_cheapest:
        words.append(f"{CHEAPEST} over {ALL_TRIALS}")
    return f"{name} is {listed(words)}"


def _where(scenarios: Sequence[str], task_count: int) -> str:
    if task_count == 1:
        return ""
    if len(scenarios) == task_count:
        return f" in all {task_count} tasks"
    return f" in {listed(scenarios)}"


def _weak_side(
    name: str,
    own: Mapping[str, Sequence[str]],
    contested: Sequence[ScenarioAnalysis],
    compute: tuple[MetricVerdict, pd.DataFrame] | None,
) -> str:
    """Returns the weak points of a controller over all scenarios in words."""
    found = [point for scenario in contested for point in weak_points(name, scenario)]
    told = worst_of(found, {place for where in own.values() for place in where})
    if not told and compute:
        verdict_of_all, means = compute
        point = weak_point(name, verdict_of_all, means, metric_named(COMPUTE), QUANTITIES[COMPUTE])
        told = [point] if point else []
    return in_words(told, tells_where=len(contested) > 1 or not found)


def _how_sure(scenarios: Sequence[ScenarioAnalysis], count: int, *, is_timed: bool) -> str:
    counts = sorted({s.trials for scenario in scenarios for s in scenario.successes})
    trials = f"{counts[0]}" if len(counts) == 1 else f"{counts[0]} to {counts[-1]}"
    once = [
        scenario.scenario
        for scenario in scenarios
        if all(success.is_one_trial for success in scenario.successes)
    ]
    if len(once) == len(scenarios) and not is_timed:
        return "Nothing in these trials is random, so these statements are sure, for these tasks."
    rests = "one trial" if trials == "1" else f"{trials} trials"
    these = f"Each of these {count} statements" if count > 1 else "This statement"
    text = (
        f"{these} rests on {rests} of each controller and task. With {CONFIDENCE:.0%} confidence "
        f"the controller beats each of the others by more than {RELEVANT_RATIO:.0%} there."
    )
    if count > 1:
        text += " One in twenty such statements may be wrong."
    return f"{text} Nothing is random in {listed(once)}." if once else text


def _undecided(
    scenarios: Sequence[ScenarioAnalysis], compute: tuple[MetricVerdict, pd.DataFrame] | None
) -> list[str]:
    open_questions = {
        found.metric: None
        for scenario in scenarios
        for found in scenario.verdicts
        if found.standing is FirstPlace.UNDECIDED
    }
    words = [word for metric, word in SUPERLATIVES.items() if metric in open_questions]
    is_compute_open = (
        compute is not None
        and compute[0].standing is FirstPlace.UNDECIDED
        and any(scenario.anyone_arrived for scenario in scenarios)
    )
    if all(success.trials == 1 for scenario in scenarios for success in scenario.successes):
        words += [CHEAPEST] * is_compute_open
        return [f"One trial of each cannot show who is {listed(words, 'or')}."] if words else []
    somewhere = "In some tasks more" if len(scenarios) > 1 else "More"
    told = [f"{somewhere} trials are needed to say who is {listed(words, 'or')}."] if words else []
    if is_compute_open:
        told.append(f"More trials are needed to say who is {CHEAPEST}.")
    return told
