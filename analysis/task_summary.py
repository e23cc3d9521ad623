"""The summary of one scenario: arrivals, touches, the best controllers and their weak points."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence

import pandas as pd

from drake_navbench.analysis.metrics.definition import Metric
from drake_navbench.analysis.metrics.registry import all_metrics
from drake_navbench.analysis.numbers import number, typeset
from drake_navbench.analysis.scenario_analysis import (
    HEADLINE_METRICS,
    ScenarioAnalysis,
    Success,
)
from drake_navbench.analysis.verdicts import comparable_trials
from drake_navbench.analysis.weak_points import DIGITS, WeakPoint, weak_point, worst_of
from drake_navbench.logs.outcome import Outcome

# Metric -> the word for its best controller. The other headline metrics say much the same as one of
# these.
SUPERLATIVES = {
    "time_to_goal_s": "quickest",
    "min_clearance_m": "farthest from obstacles",
    "cross_track_error_mean_m": "nearest to the plan",
    "jerk_rms_mps3": "smoothest",
}
# Compared over the trials of all scenarios: a cycle's cost does not depend on the task.
COMPUTE = "compute_cpu_time_p95_ms"
# Metric -> the quantity of which a controller with a weak point has more, or less, than the best.
QUANTITIES = {
    "time_to_goal_s": "time",
    "min_clearance_m": "smallest clearance",
    "cross_track_error_mean_m": "distance from the plan",
    "jerk_rms_mps3": "jerk",
    COMPUTE: "processor time a cycle",
}


def task_sentence(scenario: ScenarioAnalysis) -> str:
    """Returns a scenario's line: arrivals, touches, and the best controllers by metric."""
    if scenario.is_impossible:
        return _impossible(scenario)
    successes = scenario.successes
    touched = _touched_there(scenario)
    if not scenario.anyone_arrived:
        return f"nobody reaches the goal{touched}."
    arriving = [success for success in successes if success.succeeded]
    if len(successes) == 1:
        return f"{_rate(successes[0])}{touched}."
    if len(arriving) == 1:
        return f"only {arriving[0].controller} arrives: {_rate(arriving[0])}{touched}."
    always = [s.controller for s in successes if s.succeeded == s.trials]
    partly = [
        f"{s.controller} {s.succeeded} of {s.trials}" for s in successes if s.succeeded < s.trials
    ]
    text = "all arrive" if not partly else ""
    if partly:
        text = f"{listed(always)} always arrive{'s' * (len(always) == 1)}, " if always else ""
        text += listed(partly)
    return f"{text}{touched}. {_best_ones(scenario)}."


def _touched_there(scenario: ScenarioAnalysis) -> str:
    told = [
        f"{success.controller} touched something in {success.touched} of {success.trials} trials"
        for success in scenario.successes
        if success.touched
    ]
    return f". {listed(told)}" if told else ""


def _rate(success: Success) -> str:
    text = f"{success.succeeded} of {success.trials} trials reach the goal"
    if success.is_one_trial:
        return f"{text}; nothing is random, so they are all the same trial"
    low, high = (f"{100 * end:.0f}" for end in success.interval)
    return f"{text}; with 95% confidence {low} to {high}% of all such trials do"


def _best_ones(scenario: ScenarioAnalysis) -> str:
    means = means_of(scenario)
    best = best_ones(scenario)
    if not best:
        return "In how they drive nobody is shown to be best"
    told: dict[str, list[str]] = {}
    for metric, name in best.items():
        value = number(float(means.loc[name, metric]), DIGITS)
        unit = typeset(metric_named(metric).unit)
        told.setdefault(name, []).append(f"{SUPERLATIVES[metric]} ({value} {unit})")
    return ". ".join(
        f"{name} is {listed(words)}"
        + in_words(worst_of(weak_points(name, scenario), ()), tells_where=False)
        for name, words in told.items()
    )


def _impossible(scenario: ScenarioAnalysis) -> str:
    outcomes = scenario.table["outcome"]
    aborted = int((outcomes == Outcome.ABORTED).sum())
    if aborted == len(outcomes):
        return f"impossible on purpose. All {aborted} trials ended with giving up, as they should."
    text = f"impossible on purpose. {aborted} of {len(outcomes)} trials ended with giving up, as "
    text += f"they should{_touched_there(scenario)}"
    others = Counter(outcomes[~outcomes.isin([Outcome.ABORTED, Outcome.COLLIDED])])
    if not others:
        return f"{text}."
    rest = listed(f"{count} {str(name).replace('_', ' ')}" for name, count in others.items())
    return f"{text}. The others: {rest}."


def best_ones(scenario: ScenarioAnalysis) -> dict[str, str]:
    """Returns for each metric of SUPERLATIVES the controller that is shown to be best in it."""
    found = {v.metric: v.best for v in scenario.verdicts if v.best}
    return {metric: str(found[metric]) for metric in SUPERLATIVES if metric in found}


def weak_points(name: str, scenario: ScenarioAnalysis) -> list[WeakPoint]:
    means = means_of(scenario)
    points = (
        weak_point(name, found, means, metric_named(found.metric), QUANTITIES[found.metric])
        for found in scenario.verdicts
        if found.metric in SUPERLATIVES
    )
    return [point for point in points if point is not None]


def in_words(points: Sequence[WeakPoint], *, tells_where: bool) -> str:
    """Returns the clause that ends a sentence of praise with the controller's weak points."""
    if not points:
        return ", and is nowhere shown to be 10% behind another controller"
    return f", but has {listed(point.in_words(tells_where=tells_where) for point in points)}"


def means_of(scenario: ScenarioAnalysis) -> pd.DataFrame:
    """Returns means over the comparable trials: one row a controller, one column a metric."""
    comparable = comparable_trials(scenario.table, HEADLINE_METRICS)
    order = list(dict.fromkeys(comparable["controller"]))
    return comparable.groupby("controller")[list(HEADLINE_METRICS)].mean().reindex(order)


def listed(names: Iterable[str], last: str = "and") -> str:
    """Returns names as a sentence lists them: 'a, b and c'."""
    *most, end = names
    return f"{', '.join(most)} {last} {end}" if most else end


def metric_named(name: str) -> Metric:
    return next(entry for entry in all_metrics() if entry.name == name)
