"""harmony among people: the eleven living scenarios, beside four rivals.

`python studies/harmony_living.py FILE --rounds N` drives them and prints tables; with --judge it
drives nothing. A round is one trial of every scenario by each of the columns, from campaign seed
500 on; columns are compared with those that have the same kind of map, or with the first --columns
of them. With --scenarios a round has these scenarios alone. FILE gets a line a trial, and the drive
goes on where FILE ends. What the rows decide is in docs/harmony.md.

The stop for moving things was made anew in November 2026. Rounds 32 to 35, which nobody had driven,
tell what it costs: all six columns on cleared maps. Its default stays off unless it loses no
arrival, no more units touch than without it, and it takes at most 7% longer.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from harmony_comparison import COLUMNS
from harmony_judgement import OURS, markdown, share_bound
from question_trials import require_no_errors
from scipy import stats

from drake_navbench.analysis.statistics import CONFIDENCE
from drake_navbench.campaign.campaign import plan_campaign
from drake_navbench.campaign.rows_of_trials import drive_each
from drake_navbench.campaign.trial_tasks import table_row
from drake_navbench.inputs.scenario import Scenario, load_scenario
from drake_navbench.logs.outcome import Outcome
from drake_navbench.trial.spec import TrialSpec

FIRST_SEED = 500
LIVING_WORLD = (
    *("crossing", "oncoming", "overtaking"),
    *("corridor_passing", "doorway_people", "waiting_group", "ward_nurses"),
    *("ward_crowd", "crossing_streams", "recorded_crowd", "two_floors"),
)
# Beams without a hit clear the cells along them, in both costmaps. The local one's other fields are
# the robot's; the global one's are Nav2's defaults, which a source that is named must give.
SCAN = {"inf_is_valid": True, "clearing": True, "max_obstacle_height": 2.0}
CLEARING = {"obstacle_layer": {"observation_sources": {"scan": SCAN}}}
CLEARED = {"navigation": {"local_costmap": CLEARING, "global_costmap": CLEARING}}
OPTION = "stop_for_moving"
RIVALS_OF_LIVING = ("dwb", "teb", "mppi_nav2", "rpp")
# The columns that are compared with each other, all with the same map: of the controller, and
# whether beams without a hit clear cells.
SAME_MAP = {
    "Nav2's map": {name: (COLUMNS[name], False) for name in (OURS, *RIVALS_OF_LIVING)},
    "clearing": {f"{name}, clearing": (COLUMNS[name], True) for name in (OURS, *RIVALS_OF_LIVING)},
}
STOPS = {f"{OURS}, clearing, {OPTION}": (f"{OURS}:{OPTION}=true", True)}
SAME_MAP[OPTION] = STOPS | SAME_MAP["clearing"]
SAME_MAP[f"{OPTION}, Nav2's map"] = {
    f"{OURS}, {OPTION}": (f"{OURS}:{OPTION}=true", False),
    **SAME_MAP["Nav2's map"],
}
KEPT = ["identity", "scenario", "seed", "column", "outcome", "time_to_goal_s", "min_clearance_m"]


def clearing(scenario: Scenario) -> Scenario:
    """Returns a scenario in which beams without a hit clear cells."""
    if scenario.robot_overrides.keys() & CLEARED.keys():
        raise ValueError(f"{scenario.name}: replaces fields of navigation already")
    return scenario.model_copy(update={"robot_overrides": scenario.robot_overrides | CLEARED})


def specs_of(
    round_number: int, column: str, clears: bool, names: Sequence[str] = LIVING_WORLD
) -> list[TrialSpec]:
    """Returns the trials of a round, one a scenario, by a column of the controller."""
    scenarios = [load_scenario(name) for name in names]
    if clears:
        scenarios = [clearing(scenario) for scenario in scenarios]
    seed = FIRST_SEED + round_number
    return list(plan_campaign(scenarios, [column], trials=1, seed=seed, keeps_costmaps=False).specs)


def drive_round(
    path: Path,
    round_number: int,
    columns: dict[str, tuple[str, bool]],
    scenarios: Sequence[str] = LIVING_WORLD,
) -> None:
    """Drives what FILE does not hold yet of a round; a line is written as soon as it is known."""
    driven = set(pd.read_csv(path)["identity"]) if path.exists() else set()
    names: dict[str, str] = {}
    missing = []
    for name, (column, clears) in columns.items():
        for spec in specs_of(round_number, column, clears, scenarios):
            if spec.identity not in driven:
                names[spec.identity] = name
                missing.append(spec)

    def write(spec: TrialSpec, row: dict[str, Any]) -> None:
        own = {"identity": spec.identity, "column": names[spec.identity]}
        line = pd.DataFrame([row | own | {"seed": FIRST_SEED + round_number}])
        line = line.reindex(columns=KEPT)
        line.to_csv(path, mode="a", header=not path.exists(), index=False)

    drive_each(missing, table_row, jobs=1, on_row=write)


def whole_rounds(
    rows: pd.DataFrame, columns: list[str], scenarios: Sequence[str] = LIVING_WORLD
) -> pd.DataFrame:
    """Returns the rows of the rounds that each of these columns has driven wholly."""
    own = rows[rows["column"].isin(columns) & rows["scenario"].isin(scenarios)]
    counts = own.groupby("seed")["column"].count()
    return own[own["seed"].isin(counts.index[counts == len(columns) * len(scenarios)])]


def table(rows: pd.DataFrame) -> pd.DataFrame:
    """Returns a line a column: arrivals, touches, and the mean over scenarios of the mean time."""
    found = []
    for name, own in rows.groupby("column", sort=False):
        arrived = own[own["outcome"] == Outcome.SUCCEEDED.value]
        touches = int((own["outcome"] == Outcome.COLLIDED.value).sum())
        found.append(
            {
                "column": name,
                "trials": len(own),
                "arrive": len(arrived),
                "touch": touches,
                "of all, at most": share_bound(touches, len(own)),
                "time [s], mean over scenarios": arrived.groupby("scenario")["time_to_goal_s"]
                .mean()
                .mean(),
            }
        )
    return pd.DataFrame(found)


def compared(rows: pd.DataFrame, ours: str, other: str) -> str:
    """Returns a sentence on two columns: touches, arrivals, and time; limits are one-sided, at 95%.

    The sign test counts a scenario once, whichever number of its trials differ: trials of one
    scenario share its difficulty.
    """
    wide = rows.pivot(index=["scenario", "seed"], columns="column")
    outcome, words = wide["outcome"], []
    for what in (Outcome.COLLIDED.value, Outcome.SUCCEEDED.value):
        is_so = (outcome == what).groupby("scenario").sum()
        ahead = is_so[ours] - is_so[other]
        more, fewer = int((ahead > 0).sum()), int((ahead < 0).sum())
        p = stats.binomtest(more, more + fewer).pvalue if more + fewer else 1.0
        words.append(f"{what}: more often in {more} scenarios, less in {fewer} (p {p:.3f})")
    arrives = outcome[[ours, other]] == Outcome.SUCCEEDED.value
    lost = int((~arrives[ours] & arrives[other]).sum())
    bound = 100.0 * share_bound(lost, len(arrives))
    words.append(f"only the other one arrives in {lost} of {len(arrives)} (at most {bound:.1f}%)")
    time_s = wide["time_to_goal_s"][arrives.all(axis=1)]
    # Of a single scenario the seeds are the units.
    unit = "scenario" if time_s.index.unique("scenario").size > 1 else "seed"
    behind = (time_s[ours] / time_s[other]).groupby(unit).mean() - 1.0
    words.append(
        f"time {100.0 * behind.mean():+.1f}% (at most {100.0 * mean_bound(behind):+.1f}%) "
        f"in {len(behind)} {unit}s"
    )
    return f"{ours} against {other}: " + "; ".join(words)


def mean_bound(values: pd.Series) -> float:
    """Returns the one-sided upper limit of the mean (Student's t); inf of fewer than two."""
    if len(values) < 2:
        return np.inf
    quantile = float(stats.t.ppf(CONFIDENCE, len(values) - 1))
    return float(values.mean() + quantile * stats.sem(values))


def main() -> None:
    """Drives rounds and prints the tables, or prints those of a file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file", type=Path)
    parser.add_argument("--rounds", type=int, default=4)
    parser.add_argument("--first-round", type=int, default=0)
    parser.add_argument("--maps", nargs="+", choices=list(SAME_MAP), default=list(SAME_MAP))
    parser.add_argument("--columns", type=int, help="how many of each map's columns")
    parser.add_argument("--scenarios", nargs="+", choices=LIVING_WORLD, default=LIVING_WORLD)
    parser.add_argument("--judge", action="store_true", help="drives nothing")
    parser.add_argument("--among", nargs="+", help="columns of FILE; the first against the others")
    arguments = parser.parse_args()
    if arguments.among and not arguments.judge:
        parser.error("--among: expected --judge beside it, as it drives nothing")
    columns = {
        name: dict(list(SAME_MAP[name].items())[: arguments.columns]) for name in arguments.maps
    }
    if not arguments.judge:
        for number in range(arguments.first_round, arguments.first_round + arguments.rounds):
            for name in columns:
                drive_round(arguments.file, number, columns[name], arguments.scenarios)
    if not arguments.file.is_file():
        parser.error(f"{arguments.file}: no such file")
    rows = pd.read_csv(arguments.file)
    unknown = sorted({*(arguments.among or ())} - {*rows["column"]})
    if unknown:
        parser.error(f"--among: got {unknown[0]!r}, expected columns of {arguments.file}")
    require_no_errors(rows, arguments.file)
    judged = {name: list(columns[name]) for name in columns}
    if arguments.among:
        judged = {"among": arguments.among}
    for name, (ours, *others) in judged.items():
        whole = whole_rounds(rows, [ours, *others], arguments.scenarios)
        if whole.empty:
            print(f"{name}: no whole round is driven\n")
            continue
        print(f"{name}\n\n{markdown(table(whole))}\n")
        for other in others:
            print(compared(whole, ours, other), "\n")


if __name__ == "__main__":
    main()
