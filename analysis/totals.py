"""Totals over the many worlds of a suite: success, collisions and score, with intervals.

Each world counts once, however many trials it has: trials in one world are not independent, and
without randomness they are equal. The value of a suite is the mean over its worlds of each world's
own mean.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple

import pandas as pd

from drake_navbench.analysis.pairs import ComparedPair, compare_every_pair
from drake_navbench.analysis.statistics import (
    Interval,
    Summary,
    share_interval,
    summarize,
)
from drake_navbench.logs.outcome import Outcome
from drake_navbench.logs.text_tables import csv_text

# The most worlds of a suite that the report shows one by one; of larger suites it shows totals.
MAX_WORLDS_ONE_BY_ONE = 8
SCORE = "barn_score"
BEST_SCORE = 0.5
ALL_DENSITIES = ""
# The quantities in which two controllers are compared, by their names in the tables.
COMPARED = ("success", "collision", "score")


class Share(NamedTuple):
    """A share of worlds from 0 to 1, with Wilson's interval."""

    value: float
    interval: Interval


class Total(NamedTuple):
    """The totals of a controller over all worlds of a suite, or of one density of it.

    density: '' for all. success, collision: the shares of success and of touches. scored: the
    share of worlds with a score above 0, which is success as BARN defines it. score: the mean BARN
    score. time_s: time to the goal of the trials that arrive. has_densities: whether the suite's
    worlds tell their density, as BARN's do.
    """

    suite: str
    density: str
    controller: str
    worlds: int
    trials: int
    success: Share
    collision: Share
    scored: Share
    score: Summary
    time_s: Summary
    has_densities: bool


class Difference(NamedTuple):
    """Two controllers compared in one quantity over the worlds of a suite that both drove."""

    suite: str
    quantity: str
    compared: ComparedPair


def scenarios_in_totals(suites: Mapping[str, str]) -> frozenset[str]:
    """Returns the scenarios of suites that are too large for the report to show one by one.

    suites: the suite of each scenario, '' for none.
    """
    names = list(suites.values())
    return frozenset(
        scenario
        for scenario, suite in suites.items()
        if suite and names.count(suite) > MAX_WORLDS_ONE_BY_ONE
    )


def suites_of(trials: pd.DataFrame) -> dict[str, str]:
    """Returns the suite of each scenario; trials: rows as from `trial_row`."""
    if "suite" not in trials:
        return {}
    return dict(zip(trials["scenario"], trials["suite"].fillna(""), strict=True))


def totals(trials: pd.DataFrame) -> list[Total]:
    """Returns the totals of every suite of more than one world, all densities first."""
    found = []
    for suite, own in _suites(trials):
        densities = [density for density in sorted(own["density"].unique()) if density]
        for density in [ALL_DENSITIES, *(densities if len(densities) > 1 else ())]:
            part = own[own["density"] == density] if density else own
            for controller in dict.fromkeys(own["controller"]):
                rows = part[part["controller"] == controller]
                if len(rows):
                    total = _total(suite, density, controller, rows, bool(densities))
                    found.append(total)
    return found


def differences(trials: pd.DataFrame) -> list[Difference]:
    """Returns every pair of controllers of every suite of more than one world, compared."""
    found = []
    for suite, own in _suites(trials):
        by_world = {name: _by_world(rows) for name, rows in own.groupby("controller", sort=False)}
        for quantity in COMPARED:
            values = {str(name): rows[quantity] for name, rows in by_world.items()}
            found += [Difference(suite, quantity, p) for p in compare_every_pair(values)]
    return found


def totals_csv(found: Iterable[Total]) -> str:
    """Returns totals as CSV, one row each; an interval takes two columns."""
    rows = [
        {
            "suite": total.suite,
            "density": total.density or "all",
            "controller": total.controller,
            "worlds": total.worlds,
            "trials": total.trials,
            **_with_interval("success", total.success.value, total.success.interval),
            **_with_interval("collision", total.collision.value, total.collision.interval),
            **_with_interval("scored", total.scored.value, total.scored.interval),
            **_with_interval("score", total.score.mean, total.score.interval),
            **_with_interval("time_to_goal_s", total.time_s.mean, total.time_s.interval),
        }
        for total in found
    ]
    return csv_text(pd.DataFrame(rows))


def _with_interval(name: str, value: float, interval: Interval) -> dict[str, float]:
    return {name: value, f"{name}_low": interval.low, f"{name}_high": interval.high}


def _suites(trials: pd.DataFrame) -> Iterator[tuple[str, pd.DataFrame]]:
    for suite in dict.fromkeys(suites_of(trials).values()):
        own = trials[trials["suite"] == suite]
        if suite and own["scenario"].nunique() > 1:
            yield suite, own


def _by_world(trials: pd.DataFrame) -> pd.DataFrame:
    """Returns one row a world: mean success, collision, scored and score, and time of successes."""
    quantities = pd.DataFrame(
        {
            "scenario": trials["scenario"],
            "success": (trials["outcome"] == Outcome.SUCCEEDED).astype(float),
            "collision": (trials["outcome"] == Outcome.COLLIDED).astype(float),
            "scored": (trials[SCORE] > 0.0).astype(float),
            # A trial without a score, such as one that never moved, has a score of 0.
            "score": trials[SCORE].fillna(0.0),
            "time_s": trials["time_to_goal_s"],
        }
    )
    return quantities.groupby("scenario", sort=False).mean()


def _total(
    suite: str, density: str, controller: str, trials: pd.DataFrame, has_densities: bool
) -> Total:
    worlds = _by_world(trials)
    return Total(
        suite=suite,
        density=density,
        controller=controller,
        worlds=len(worlds),
        trials=len(trials),
        success=_share(worlds["success"]),
        collision=_share(worlds["collision"]),
        scored=_share(worlds["scored"]),
        score=_within(summarize(worlds["score"]), 0.0, BEST_SCORE),
        time_s=_within(summarize(worlds["time_s"]), 0.0, math.inf),
        has_densities=has_densities,
    )


def _within(found: Summary, low: float, high: float) -> Summary:
    """Returns the summary with its interval cut to the possible values, low to high."""
    # Comparisons with NaN are false: an undefined interval stays undefined.
    interval = Interval(
        low if found.interval.low < low else found.interval.low,
        high if found.interval.high > high else found.interval.high,
    )
    return found._replace(interval=interval)


def _share(values: Iterable[float]) -> Share:
    shares = list(values)
    mean = sum(shares) / len(shares)
    return Share(mean, share_interval(mean, len(shares)))
