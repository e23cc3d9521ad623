"""Ranks in the living world.

`python studies/living_world_ranks.py DIR` writes docs/living_world_ranks.md from a results folder.

How the order of the controllers changes from the published five scenarios to those in which
something moves. The folder is that of a campaign through all of them:

    drake-navbench run $(python studies/living_world_ranks.py --scenarios) --out DIR
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd

from drake_navbench.analysis.pairs import values_by_seed
from drake_navbench.analysis.rank_changes import ranks_of
from drake_navbench.analysis.statistics import CONFIDENCE, Interval
from drake_navbench.analysis.verdicts import is_failed
from drake_navbench.inputs.scenario import PUBLISHED_SCENARIOS

RESAMPLES = 1000
MIN_SEEDS = 2
PAGE = Path(__file__).parents[1] / "docs" / "living_world_ranks.md"
LIVING_WORLD = (
    *("crossing", "oncoming", "overtaking"),
    *("corridor_passing", "doorway_people", "waiting_group", "ward_nurses"),
    *("ward_crowd", "crossing_streams", "recorded_crowd", "two_floors"),
)
HEADER = """\
# Ranks in a living world

Made by `python studies/living_world_ranks.py DIR` from a campaign of {seeds} trials each. A
controller's rank in a scenario is one more than the number of controllers that arrive there in more
trials, or in as many and are quicker. The mean is over the published five ({published}), and over
{living}.
The change is later minus former, with the 95% interval of a bootstrap over the seeds of each
scenario; bold where it leaves zero out.
In two of the published five nobody arrives, and all share rank 1 there, so
that mean ranks rise for everybody: what counts is by how much more for one than for another.

| controller | arrived | mean rank | arrived | mean rank | change | 95% interval |
|---|---:|---:|---:|---:|---:|---|"""


class MeanRankChange(NamedTuple):
    """A controller's rank in the mean over some scenarios and over others.

    arrived, trials: in both, first the ones. change: of the mean rank, 95% interval.
    """

    controller: str
    mean_ranks: tuple[float, float]
    arrived: tuple[int, int]
    trials: tuple[int, int]
    change: Interval

    @property
    def is_shown(self) -> bool:
        """Whether the trials show that the mean rank changes."""
        return self.change.excludes(0.0)


def mean_rank_changes(
    trials: pd.DataFrame, scenarios: Sequence[str], others: Sequence[str]
) -> list[MeanRankChange]:
    """Returns the change of each controller's mean rank from `scenarios` to `others`.

    trials: rows as in trials.parquet. Only controllers that drove in all these scenarios count.
    Each scenario has its own seeds, so the bootstrap draws seeds in each scenario separately. The
    result is empty if no controller counts, or if a scenario has no seed that all of them drove.
    """
    names = [*scenarios, *others]
    driven = trials[trials["scenario"].isin(names)]
    counts = driven.groupby("controller", sort=False)["scenario"].nunique()
    controllers = [str(name) for name, count in counts.items() if count == len(names)]
    if not controllers:
        return []
    generator = np.random.default_rng(0)
    driven = driven.assign(arrived=(~is_failed(driven)).astype(float))
    ranks, spread, arrivals, trial_counts = [], [], [], []
    for name in names:
        arrived = values_by_seed(driven, name, "arrived")[controllers].dropna()
        times = values_by_seed(driven, name, "time_to_goal_s").loc[arrived.index, controllers]
        count = len(arrived)
        if count == 0:
            return []
        everyone = np.arange(count)[None]
        drawn = np.broadcast_to(everyone, (RESAMPLES, count))
        if count >= MIN_SEEDS:
            drawn = generator.integers(count, size=(RESAMPLES, count))
        own = arrived.to_numpy(), times.to_numpy()
        ranks.append(_ranks_of_draws(*own, everyone)[0])
        spread.append(_ranks_of_draws(*own, drawn))
        arrivals.append(own[0].sum(axis=0))
        trial_counts.append(count)
    parts = (slice(len(scenarios)), slice(len(scenarios), None))
    means = [np.mean(ranks[part], axis=0) for part in parts]
    changes = np.mean(spread[parts[1]], axis=0) - np.mean(spread[parts[0]], axis=0)
    came = [np.sum(arrivals[part], axis=0) for part in parts]
    return [
        MeanRankChange(
            name,
            (float(means[0][i]), float(means[1][i])),
            (int(came[0][i]), int(came[1][i])),
            (sum(trial_counts[parts[0]]), sum(trial_counts[parts[1]])),
            _interval(changes[:, i]),
        )
        for i, name in enumerate(controllers)
    ]


def _ranks_of_draws(arrived: np.ndarray, times: np.ndarray, drawn: np.ndarray) -> np.ndarray:
    """Returns (draws, controllers) ranks; drawn: (draws, seeds) the indices of rows that count."""
    known = np.isfinite(times)[drawn]
    count, total = known.sum(axis=1), np.where(known, times[drawn], 0.0).sum(axis=1)
    mean = np.divide(total, count, out=np.full(total.shape, np.inf), where=count > 0)
    return ranks_of(arrived[drawn].mean(axis=1), mean)


def _interval(values: np.ndarray) -> Interval:
    """Returns the 95% interval of resampled values."""
    tail = 50.0 * (1.0 - CONFIDENCE)
    low, high = np.percentile(values, [tail, 100.0 - tail], method="nearest")
    return Interval(float(low), float(high))


def page(changes: list[MeanRankChange], seed_count: int) -> str:
    """Returns the page in Markdown, the best in the living world first."""
    names = (", ".join(scenarios) for scenarios in (PUBLISHED_SCENARIOS, LIVING_WORLD))
    lines = [
        HEADER.format(seeds=seed_count, **dict(zip(("published", "living"), names, strict=True)))
    ]
    for change in sorted(changes, key=lambda one: one.mean_ranks[1]):
        before, after = change.mean_ranks
        moved = f"{after - before:+.2f}"
        shown = f"**{moved}**" if change.is_shown else moved
        arrived = [f"{a}/{n}" for a, n in zip(change.arrived, change.trials, strict=True)]
        interval = f"{change.change.low:+.2f} to {change.change.high:+.2f}"
        lines.append(
            f"| {change.controller} | {arrived[0]} | {before:.2f} | {arrived[1]} | {after:.2f} | "
            f"{shown} | {interval} |"
        )
    return "\n".join(lines) + "\n"


def main() -> None:
    """Writes the page, or prints the scenarios."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, help="results of the campaign")
    parser.add_argument("--scenarios", action="store_true", help="print what to drive, and end")
    arguments = parser.parse_args()
    if arguments.scenarios:
        print(*PUBLISHED_SCENARIOS, *LIVING_WORLD)
        return
    if arguments.folder is None:
        parser.error("expected a results folder")
    trials = pd.read_parquet(arguments.folder / "trials.parquet")
    changes = mean_rank_changes(trials, PUBLISHED_SCENARIOS, LIVING_WORLD)
    if not changes:
        parser.error(f"{arguments.folder}: no controller drove in all of these scenarios")
    text = page(changes, changes[0].trials[0] // len(PUBLISHED_SCENARIOS))
    PAGE.write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
