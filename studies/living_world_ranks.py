"""Ranks in the living world.

`python studies/living_world_ranks.py DIR` writes docs/living_world_ranks.md from a results folder.

How the order of the controllers changes from the published five scenarios to those in which
something moves. The folder is that of a campaign through all of them:

    drake-navbench run $(python studies/living_world_ranks.py --scenarios) --out DIR
"""

from __future__ import annotations

import argparse
from pathlib import Path

import pandas as pd

from drake_navbench.analysis.rank_changes import MeanRankChange, mean_rank_changes
from drake_navbench.inputs.scenario import PUBLISHED_SCENARIOS

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
