"""How ranks change in a living world: `python docs/rank_table.py` writes docs/ranks.md.

Drives the default controllers through the published scenarios and through those in which things
move, people walk, maps change or wheels are wheels, and ranks them in each of these worlds as the
leaderboard does. It takes about ten minutes on two cores.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import NamedTuple

from drake_navbench import run_benchmark
from drake_navbench.analysis.leaderboard.ranking import RUN_SEED, Ranking, Standing, rank
from drake_navbench.inputs.scenario import PUBLISHED_SCENARIOS

PAGE = Path(__file__).with_name("ranks.md")
TRIALS = 4


class Surroundings(NamedTuple):
    """A set of scenarios that have one thing in common, and the robot that drives them."""

    name: str
    scenarios: tuple[str, ...]
    robot: str = "wheelchair"


PUBLISHED = Surroundings("published five", tuple(PUBLISHED_SCENARIOS))
OTHERS = (
    Surroundings("moving things", ("crossing", "oncoming", "overtaking")),
    Surroundings(
        "people",
        (
            *("corridor_passing", "doorway_people", "waiting_group", "ward_nurses"),
            *("crossing_streams", "recorded_crowd"),
        ),
    ),
    Surroundings("two floors and a lift", ("two_floors",)),
    Surroundings("published five on casters", PUBLISHED.scenarios, "wheelchair_casters"),
)
INTRODUCTION = """\
# Ranks in a living world

Made by `python docs/rank_table.py`: {trials} trials of each scenario and controller, the same seeds
for all. A controller's rank is one more than the number of those that are shown to be better: in
arrivals, or, where these are not shown to differ, in the time to the goal where both arrive; equals
share a rank (as in [a leaderboard](campaigns.md#a-leaderboard)). In brackets the ranks that the
trials leave possible. Arrivals are out of all trials; in two of the published five nobody is meant
to arrive.
"""


def ranking_in(surroundings: Surroundings) -> Ranking:
    """Drives all controllers in these surroundings and ranks them."""
    results = run_benchmark(surroundings.scenarios, trials=TRIALS, robot=surroundings.robot)
    return rank(results.trials.assign(**{RUN_SEED: 0}))


def place(standing: Standing) -> str:
    """Returns a cell of the table: rank, what it may be, arrivals."""
    low, high = (int(end) for end in standing.interval)
    possible = "" if low == high else f" ({low} to {high})"
    return f"{standing.rank}{possible}, {standing.arrived}/{standing.trials}"


def page(rankings: dict[str, Ranking]) -> str:
    """Returns the page: a table, and whose rank moves out of what the published five leave open."""
    standings = {name: {s.controller: s for s in r.standings} for name, r in rankings.items()}
    lines = [
        INTRODUCTION.format(trials=TRIALS),
        f"| controller | {' | '.join(standings)} |",
        f"|{'---|' * (len(standings) + 1)}",
    ]
    for controller in standings[PUBLISHED.name]:
        cells = [place(found[controller]) for found in standings.values()]
        lines.append(f"| `{controller}` | {' | '.join(cells)} |")
    lines += ["", *changes(standings)]
    return "\n".join(lines) + "\n"


def changes(standings: dict[str, dict[str, Standing]]) -> list[str]:
    """Returns a line for each of the other worlds: whose possible ranks lie apart from before."""
    clean = standings[PUBLISHED.name]
    lines = []
    for name, found in standings.items():
        if name == PUBLISHED.name:
            continue
        moves = [
            f"`{controller}` {'falls' if now.interval.low > before.interval.high else 'rises'}"
            for controller, now in found.items()
            for before in [clean[controller]]
            if now.interval.low > before.interval.high or now.interval.high < before.interval.low
        ]
        lines.append(f"- **{name}**: {', '.join(moves) or 'no change of a rank is shown'}.")
    return lines


def main() -> None:
    """Writes the page."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    rankings = {world.name: ranking_in(world) for world in (PUBLISHED, *OTHERS)}
    PAGE.write_text(page(rankings), encoding="utf-8")


if __name__ == "__main__":
    main()
