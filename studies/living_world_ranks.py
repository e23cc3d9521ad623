"""Ranks in the living world.

`python studies/living_world_ranks.py DIR` writes docs/living_world_ranks.md from a results folder.

How the order of the controllers changes from the published scenarios whose way is open to those in
which something moves. The folder is that of a campaign through all of them:

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
from drake_navbench.analysis.verdicts import is_failed
from drake_navbench.inputs.scenario import PUBLISHED_SCENARIOS

PAGE = Path(__file__).parents[1] / "docs" / "living_world_ranks.md"
# Where the way is closed nobody arrives, and all would share the first place.
OPEN = tuple(name for name in PUBLISHED_SCENARIOS if not name.startswith("restricted"))
LIVING_WORLD = (
    *("crossing", "oncoming", "overtaking"),
    *("corridor_passing", "doorway_people", "waiting_group", "ward_nurses"),
    *("ward_crowd", "crossing_streams", "recorded_crowd", "two_floors"),
)
HEADER = """\
# Ranks in a living world

Made by `python studies/living_world_ranks.py DIR` from a campaign of {seeds} trials each. A
controller's rank in a scenario is one more than the number of controllers that arrive there in more
trials, or in as many and are quicker. The mean is over the published scenarios whose way is open
({open}), and over {living}.

**The table describes these trials and shows nothing about others.** With {seeds} trials in a
scenario chance alone moves ranks: {count} equally good controllers would have different mean ranks,
too.

| controller | still: arrived | mean rank | living: arrived | mean rank |
|---|---:|---:|---:|---:|"""


class MeanRanks(NamedTuple):
    """A controller's rank in the mean over some scenarios and over others.

    arrived, trials: in both, first the ones.
    """

    controller: str
    mean_ranks: tuple[float, float]
    arrived: tuple[int, int]
    trials: tuple[int, int]


def mean_ranks(
    trials: pd.DataFrame, scenarios: Sequence[str], others: Sequence[str]
) -> list[MeanRanks]:
    """Returns each controller's mean rank over `scenarios` and over `others`.

    trials: rows as in trials.parquet. Only controllers that drove in all these scenarios count. The
    result is empty if no controller counts, or if a scenario has no seed that all of them drove.
    """
    names = [*scenarios, *others]
    driven = trials[trials["scenario"].isin(names)]
    counts = driven.groupby("controller", sort=False)["scenario"].nunique()
    controllers = [str(name) for name, count in counts.items() if count == len(names)]
    driven = driven.assign(arrived=(~is_failed(driven)).astype(float))
    ranks, arrivals, trial_counts = [], [], []
    for name in names:
        arrived = values_by_seed(driven, name, "arrived").reindex(columns=controllers).dropna()
        times = values_by_seed(driven, name, "time_to_goal_s").loc[arrived.index, controllers]
        if arrived.empty:
            return []
        ranks.append(ranks_of(arrived.mean().to_numpy(), times.mean().to_numpy()))
        arrivals.append(arrived.sum().to_numpy())
        trial_counts.append(len(arrived))
    parts = (slice(len(scenarios)), slice(len(scenarios), None))
    means = [np.mean(ranks[part], axis=0) for part in parts]
    came = [np.sum(arrivals[part], axis=0) for part in parts]
    return [
        MeanRanks(
            name,
            (float(means[0][i]), float(means[1][i])),
            (int(came[0][i]), int(came[1][i])),
            (sum(trial_counts[parts[0]]), sum(trial_counts[parts[1]])),
        )
        for i, name in enumerate(controllers)
    ]


def page(found: Sequence[MeanRanks], seed_count: int) -> str:
    """Returns the page in Markdown, the best in the living world first."""
    places = {"open": ", ".join(OPEN), "living": ", ".join(LIVING_WORLD)}
    lines = [HEADER.format(seeds=seed_count, count=len(found), **places)]
    for one in sorted(found, key=lambda one: one.mean_ranks[1]):
        before, after = one.mean_ranks
        still, living = (f"{a}/{n}" for a, n in zip(one.arrived, one.trials, strict=True))
        lines.append(f"| {one.controller} | {still} | {before:.2f} | {living} | {after:.2f} |")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Writes the page, or prints the scenarios."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, help="results of the campaign")
    parser.add_argument("--scenarios", action="store_true", help="print what to drive, and end")
    arguments = parser.parse_args()
    if arguments.scenarios:
        print(*OPEN, *LIVING_WORLD)
        return
    if arguments.folder is None:
        parser.error("expected a results folder")
    trials = pd.read_parquet(arguments.folder / "trials.parquet")
    found = mean_ranks(trials, OPEN, LIVING_WORLD)
    if not found:
        parser.error(f"{arguments.folder}: no controller drove in all of these scenarios")
    text = page(found, found[0].trials[0] // len(OPEN))
    PAGE.write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
