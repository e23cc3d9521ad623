"""The verdict first: who is to be taken for which task, how sure that is, at what price, in words.

Every word rests on a verdict (see `verdicts`), on who reached the goal, or on two means side by
side; nothing is said that these do not say.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import pandas as pd

from drake_navbench.analysis.metrics.definition import Better, Metric
from drake_navbench.analysis.metrics.registry import all_metrics
from drake_navbench.analysis.numbers import number, typeset
from drake_navbench.analysis.scenario_analysis import (
    HEADLINE_METRICS,
    ScenarioAnalysis,
    Success,
)
from drake_navbench.analysis.statistics import CONFIDENCE
from drake_navbench.analysis.totals import ALL_DENSITIES, Total
from drake_navbench.analysis.verdicts import RELEVANT_RATIO, Standing, comparable_trials
from drake_navbench.log import Outcome

# What the best one in a metric is; the other headline metrics say much the same as one of these.
SUPERLATIVES = {
    "time_to_goal_s": "quickest",
    "min_clearance_m": "farthest from obstacles",
    "cross_track_error_mean_m": "nearest to the plan",
    "jerk_rms_mps3": "smoothest",
    "compute_time_p95_ms": "cheapest to compute",
}
# As the price of a controller: what it has more of, or less of, than the best.
PRICES = {
    "time_to_goal_s": "time",
    "min_clearance_m": "clearance",
    "cross_track_error_mean_m": "distance from the plan",
    "jerk_rms_mps3": "jerk",
    "compute_time_p95_ms": "compute time",
}
DIGITS = 3
# Less than this much more is no price worth a word.
PRICE_RATIO = 1.1


class TaskLead(NamedTuple):
    """What is to be said of one scenario."""

    scenario: str
    sentence: str


class Lead(NamedTuple):
    """The paragraph for all scenarios together, and a line for each."""

    sentences: list[str]
    tasks: list[TaskLead]


def lead_of(scenarios: Sequence[ScenarioAnalysis], totals: Sequence[Total] = ()) -> Lead:
    """Returns the verdict on these scenarios, each of which has trials.

    totals: of suites with so many worlds that they are not looked at one by one.
    """
    sentences = [_suite(suite, totals) for suite in dict.fromkeys(t.suite for t in totals)]
    if scenarios:
        sentences += [_arrivals(scenarios), *_first_places(scenarios), *_undecided(scenarios)]
    return Lead(
        [sentence for sentence in sentences if sentence],
        [TaskLead(scenario.scenario, _task(scenario)) for scenario in scenarios],
    )


def listed(names: Iterable[str], last: str = "and") -> str:
    """Returns names as a sentence lists them: 'a, b and c'."""
    *most, end = names
    return f"{', '.join(most)} {last} {end}" if most else end


def _suite(suite: str, totals: Sequence[Total]) -> str:
    """Returns how often each controller arrived in the worlds of a suite."""
    own = [t for t in totals if t.suite == suite and t.density == ALL_DENSITIES]
    own.sort(key=lambda total: -total.success.value)
    rates = []
    for total in own:
        low, high = (f"{100 * end:.0f}" for end in total.success.interval)
        rates.append(f"{total.controller} {100 * total.success.value:.0f}% ({low} to {high}%)")
    worlds = max((total.worlds for total in own), default=0)
    return f"In the {worlds} worlds of {suite} the goal was reached by {listed(rates)}."


def _arrivals(scenarios: Sequence[ScenarioAnalysis]) -> str:
    """Returns who reached the goals that can be reached."""
    possible = [scenario for scenario in scenarios if not scenario.is_impossible]
    if not possible:
        return "Every task here is impossible on purpose: nobody can arrive, and nobody is best."
    arrived: Counter[str] = Counter()
    asked: Counter[str] = Counter()
    for scenario in possible:
        for success in scenario.successes:
            arrived[success.controller] += success.succeeded
            asked[success.controller] += success.trials
    always = [name for name in asked if arrived[name] == asked[name]]
    ever = [name for name in asked if arrived[name]]
    others = [name for name in asked if name not in always]
    if not ever:
        return "No controller reached any goal, so that none is best."
    missed = listed(
        _missed(name, asked[name] - arrived[name], asked[name]) for name in others or [""]
    )
    if len(asked) == 1:
        (name,) = asked
        return f"{name} reached the goal in {arrived[name]} of {asked[name]} trials."
    if len(ever) == 1:
        own = f"in {arrived[ever[0]]} of {asked[ever[0]]} trials"
        return (
            f"Only {ever[0]} arrives, {own}; {listed(n for n in asked if n != ever[0])} never "
            "reached a goal. For these tasks it is the one to take."
        )
    if not others:
        return f"All {len(asked)} controllers reached every goal that can be reached."
    if not always:
        return f"No controller reached every goal: {missed}."
    alone = "Only " if len(always) == 1 else ""
    return f"{alone}{listed(always)} reached every goal that can be reached; {missed}."


def _missed(name: str, missed: int, asked: int) -> str:
    return f"{name} missed {'all' if missed == asked else missed} of {asked}"


def _first_places(scenarios: Sequence[ScenarioAnalysis]) -> list[str]:
    """Returns who is best at what and where, how sure that is, and the price of the foremost."""
    contested = [scenario for scenario in scenarios if scenario.anyone_arrived]
    firsts: dict[str, dict[str, list[str]]] = {}
    for scenario in contested:
        for verdict in scenario.verdicts:
            if verdict.best and verdict.metric in SUPERLATIVES:
                own = firsts.setdefault(verdict.best, {})
                own.setdefault(verdict.metric, []).append(scenario.scenario)
    if not firsts:
        return []
    order = sorted(firsts, key=lambda name: -sum(map(len, firsts[name].values())))
    told = [_honours(name, firsts[name], len(contested)) for name in order]
    return [
        f"{'; '.join(told)}.",
        _how_sure(contested),
        _price(order[0], contested),
    ]


def _honours(name: str, own: Mapping[str, Sequence[str]], task_count: int) -> str:
    places: dict[tuple[str, ...], list[str]] = {}
    for metric, word in SUPERLATIVES.items():
        if metric in own:
            places.setdefault(tuple(own[metric]), []).append(word)
    words = [listed(some) + _where(where, task_count) for where, some in places.items()]
    return f"{name} is {listed(words)}"


def _where(scenarios: Sequence[str], task_count: int) -> str:
    if task_count == 1:
        return ""
    if len(scenarios) == task_count:
        return f" in all {task_count} tasks"
    return f" in {listed(scenarios)}"


def _how_sure(scenarios: Sequence[ScenarioAnalysis]) -> str:
    counts = sorted({s.trials for scenario in scenarios for s in scenario.successes})
    trials = f"{counts[0]}" if len(counts) == 1 else f"{counts[0]} to {counts[-1]}"
    once = [
        scenario.scenario
        for scenario in scenarios
        if all(success.is_one_trial for success in scenario.successes)
    ]
    if len(once) == len(scenarios):
        return "Nothing in these trials is random: each word holds for this one task, surely."
    rests = "one trial" if trials == "1" else f"{trials} trials"
    text = (
        f"Each of these words holds with {CONFIDENCE:.0%} confidence against all others together "
        f"and by more than {RELEVANT_RATIO:.0%}; it rests on {rests} of each controller and task"
    )
    return f"{text}; in {listed(once)} nothing is random." if once else f"{text}."


def _price(name: str, scenarios: Sequence[ScenarioAnalysis]) -> str:
    """Returns in what a controller is farthest behind the best one, where that is worth a word."""
    worst: tuple[float, str] = (PRICE_RATIO, "")
    for scenario in scenarios:
        means = means_of(scenario)
        for entry in _shown_metrics():
            ratio, best = _ratio_to_best(means, entry, name)
            if ratio > worst[0]:
                amount = (
                    f"{number(ratio, 2)} times the {PRICES[entry.name]}"
                    if entry.better is Better.LOWER
                    else f"{number(1.0 / ratio, 2)} of the {PRICES[entry.name]}"
                )
                worst = (ratio, f"{amount} of {best} in {scenario.scenario}")
    if not worst[1]:
        return f"{name} has no price: nowhere is it 10% behind the best."
    return f"The price of {name} is highest where it has {worst[1]}."


def means_of(scenario: ScenarioAnalysis) -> pd.DataFrame:
    """Returns means over the trials that are compared: a row a controller, a column a metric."""
    comparable = comparable_trials(scenario.table, HEADLINE_METRICS)
    order = list(dict.fromkeys(comparable["controller"]))
    return comparable.groupby("controller")[list(HEADLINE_METRICS)].mean().reindex(order)


def _ratio_to_best(means: pd.DataFrame, entry: Metric, name: str) -> tuple[float, str]:
    """Returns how many times worse than the best a controller is, and who is the best."""
    values = means[entry.name].dropna()
    if name not in values or len(values) < 2:
        return 1.0, ""
    best = values.idxmin() if entry.better is Better.LOWER else values.idxmax()
    own, first = float(values[name]), float(values[best])
    if abs(own - first) <= entry.relevant or min(own, first) <= 0.0:
        return 1.0, ""
    return (own / first if entry.better is Better.LOWER else first / own), str(best)


def _undecided(scenarios: Sequence[ScenarioAnalysis]) -> list[str]:
    open_questions = {
        verdict.metric: None
        for scenario in scenarios
        for verdict in scenario.verdicts
        if verdict.standing is Standing.UNDECIDED and verdict.metric in SUPERLATIVES
    }
    if not open_questions:
        return []
    words = listed(
        (word for metric, word in SUPERLATIVES.items() if metric in open_questions), "or"
    )
    if all(success.trials == 1 for scenario in scenarios for success in scenario.successes):
        return [f"One trial of each cannot show who is {words}."]
    return [f"More trials would be needed to say who is {words} in every task."]


def _task(scenario: ScenarioAnalysis) -> str:
    """Returns a scenario's line: who arrives, who is best at what."""
    if scenario.is_impossible:
        return _impossible(scenario)
    successes = scenario.successes
    if not scenario.anyone_arrived:
        return "nobody reaches the goal."
    arriving = [success for success in successes if success.succeeded]
    if len(successes) == 1:
        return f"{_rate(successes[0])}."
    if len(arriving) == 1:
        return f"only {arriving[0].controller} arrives ({_rate(arriving[0])})."
    always = [s.controller for s in successes if s.succeeded == s.trials]
    partly = [
        f"{s.controller} {s.succeeded} of {s.trials}" for s in successes if s.succeeded < s.trials
    ]
    text = "all arrive" if not partly else ""
    if partly:
        text = f"{listed(always)} always arrive{'s' * (len(always) == 1)}, " if always else ""
        text += listed(partly)
    return f"{text}; {_best_ones(scenario)}."


def _rate(success: Success) -> str:
    text = f"{success.succeeded} of {success.trials} trials reach the goal"
    if success.is_one_trial:
        return f"{text}, all of them the same one"
    low, high = (f"{100 * end:.0f}" for end in success.interval)
    return f"{text}: {low} to {high}% with 95% confidence"


def _best_ones(scenario: ScenarioAnalysis) -> str:
    means = means_of(scenario)
    units = {entry.name: typeset(entry.unit) for entry in all_metrics()}
    best = {v.metric: v.best for v in scenario.verdicts if v.best and v.metric in SUPERLATIVES}
    if not best:
        return "nobody is shown to be best at anything"
    told: dict[str, list[str]] = {}
    for metric, word in SUPERLATIVES.items():
        if metric in best:
            value = number(float(means.loc[best[metric], metric]), DIGITS)
            told.setdefault(str(best[metric]), []).append(f"{word} ({value} {units[metric]})")
    return "; ".join(f"{name} is {listed(words)}" for name, words in told.items())


def _impossible(scenario: ScenarioAnalysis) -> str:
    outcomes = scenario.table["outcome"]
    aborted = int((outcomes == Outcome.ABORTED).sum())
    if aborted == len(outcomes):
        return f"impossible on purpose; all {aborted} trials were given up, as they should be."
    others = Counter(outcomes[outcomes != Outcome.ABORTED])
    rest = listed(f"{count} {str(name).replace('_', ' ')}" for name, count in others.items())
    return (
        f"impossible on purpose; {aborted} of {len(outcomes)} trials were given up, as they "
        f"should be, but {rest}."
    )


def _shown_metrics() -> list[Metric]:
    return [entry for entry in all_metrics() if entry.name in PRICES]
