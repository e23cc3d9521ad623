"""The next comparison of harmony.

`python studies/harmony_comparison.py FOLDER` drives and judges it.

What is driven and how it is judged was written down before, in docs/harmony_comparison.md. Writes
worlds into FOLDER/worlds and a line for each trial into FOLDER/trials.csv, and prints the tables in
Markdown. It goes on where the file ends, family by family; in a family unit by unit, each by every
column, so that whatever is there is paired. A column whose code has changed must be deleted from
the file. --columns, --families, --first and --units drive a part, so that the rivals or units that
nobody has seen can go first. With --judge FILE it drives nothing.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import harmony_judgement as judgement
import pandas as pd
from harmony_families import FAMILIES, write_world
from question_trials import require_no_errors

from drake_navbench.campaign.campaign import plan_campaign
from drake_navbench.campaign.rows_of_trials import drive_each
from drake_navbench.campaign.trial_tasks import table_row
from drake_navbench.trial.spec import TrialSpec

OF_ROBOT = "ax_max=2.5:ax_min=-2.5:az_max=3.0"
# Each checks the outline, and has the wheelchair's accelerations where it has any.
RIVALS = {
    "rpp": "rpp",
    "dwb": "dwb:acc_lim_theta=3.0:decel_lim_theta=-3.0",
    "teb": "teb:acc_lim_x=2.5:acc_lim_theta=3.0",
    "mppi": f"mppi:{OF_ROBOT}",
    "mppi_nav2": f"mppi_nav2:{OF_ROBOT}",
    "mppi_bringup": f"mppi_bringup:CostCritic.consider_footprint=true:{OF_ROBOT}",
}
COLUMNS = {judgement.OURS: judgement.OURS, **RIVALS}
NAMED = (
    *("empty", "static_obstacles", "one_obstacle", "doorway", "everyday", "box_on_path", "pocket"),
    *judgement.CLOSED,
)
# The order in which families are driven; see the page.
ORDER = (
    *("box_on_path", "restricted_large_noisy", "clutter", "doorway", "pocket", "u_trap"),
    *("restricted_small_noisy", "restricted_large", "restricted_small", "one_obstacle"),
    *("everyday", "static_obstacles", "empty", "s_curve"),
)
# The seed and worlds that count. Nothing was tuned on these, and nobody had looked at them; worlds
# below 9000 and seeds from 1000 on are for trying things out.
SEED, TRIALS = 400, 30
FIRST_WORLDS = {"s_curve": 9500, "u_trap": 9600, "clutter": 9700}
KEPT = [
    *("identity", "family", "scenario", "seed", "controller", "outcome", "simulated_time_s"),
    *(measure.column for measure in judgement.MEASURES.values()),
]


def trials_of(
    folder: Path,
    columns: list[str],
    *,
    units: range,
    seed: int,
    first_worlds: dict[str, int],
) -> list[tuple[str, TrialSpec]]:
    """Returns the family and the trial, for each of the columns: family by family, then by unit.

    units: from 0 on.
    """
    named = plan_campaign(NAMED, columns, trials=units.stop, seed=seed, keeps_costmaps=False)
    found = [(spec.trial, spec.scenario.name, spec) for spec in named.specs if spec.trial in units]
    for family in FAMILIES:
        for place in units:
            path = write_world(folder, family, first_worlds[family] + place)
            world = plan_campaign([str(path)], columns, trials=1, seed=seed, keeps_costmaps=False)
            found.extend((place, family, spec) for spec in world.specs)
    found.sort(key=lambda member: (ORDER.index(member[1]), member[0]))
    return [(family, spec) for _, family, spec in found]


def drive_missing(path: Path, asked: list[tuple[str, TrialSpec]], jobs: int) -> pd.DataFrame:
    """Drives what a file of rows does not hold yet, and returns the asked ones.

    A line is written as soon as it is known.
    """
    driven = set(pd.read_csv(path)["identity"]) if path.exists() else set()
    families = {spec.identity: family for family, spec in asked}
    names = {spec: name for name, spec in COLUMNS.items()}

    def write(spec: TrialSpec, row: dict[str, Any]) -> None:
        row = row | {
            "identity": spec.identity,
            "family": families[spec.identity],
            "controller": names.get(row["controller"], row["controller"]),
        }
        line = pd.DataFrame([row]).reindex(columns=KEPT)
        line.to_csv(path, mode="a", header=not path.exists(), index=False)

    missing = [spec for _, spec in asked if spec.identity not in driven]
    drive_each(missing, table_row, jobs=jobs, on_row=write)
    rows = pd.read_csv(path)
    return rows[rows["identity"].isin(list(families))]


def whole_units(rows: pd.DataFrame) -> pd.DataFrame:
    """Returns the rows of the units that every column of their family has driven."""
    driven_by = rows.groupby(["family", "scenario", "seed"])["controller"].transform("nunique")
    return rows[driven_by == rows.groupby("family")["controller"].transform("nunique")]


def tell(rows: pd.DataFrame, ours: str = judgement.OURS) -> None:
    """Prints the page's tables: losses, families, what is pooled, and touches."""
    rows = rows[rows["controller"].isin([ours, *RIVALS])]
    rows = whole_units(rows.replace({"controller": {ours: judgement.OURS}}))
    rivals = [name for name in RIVALS if name in set(rows["controller"])]
    lost = judgement.losses(judgement.verdicts(rows, rivals))
    touched = judgement.touches(rows)
    parts = (lost, judgement.page_table(rows, rivals), judgement.pooled(rows, rivals), touched)
    for part in parts:
        print(judgement.markdown(part), "\n")


def main() -> None:
    """Drives and judges the comparison, or judges rows."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, nargs="?")
    parser.add_argument("--judge", type=Path, metavar="FILE", help="rows; drives nothing")
    parser.add_argument("--ours", default=judgement.OURS, help="the column of FILE that is judged")
    parser.add_argument("--try-out", action="store_true", help="two rounds that do not count")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--columns", nargs="+", choices=COLUMNS, default=list(COLUMNS))
    parser.add_argument("--families", nargs="+", choices=ORDER, default=list(ORDER))
    parser.add_argument("--first", type=int, default=1, help="the first unit of a family")
    parser.add_argument("--units", type=int, default=TRIALS, help="the last unit of a family")
    arguments = parser.parse_args()
    if not 1 <= arguments.first <= arguments.units:
        parser.error(f"--first: got {arguments.first}, expected 1 to {arguments.units} (--units)")
    if (arguments.folder is None) == (arguments.judge is None):
        parser.error("expected FOLDER or --judge FILE, and not both")
    if arguments.judge is not None and not arguments.judge.is_file():
        parser.error(f"--judge {arguments.judge}: no such file")
    if arguments.judge is not None:
        rows = pd.read_csv(arguments.judge)
        require_no_errors(rows, arguments.judge)
        if arguments.ours not in set(rows["controller"]):
            parser.error(f"--ours: got {arguments.ours!r}, expected a column of {arguments.judge}")
        tell(rows, arguments.ours)
        return
    (arguments.folder / "worlds").mkdir(parents=True, exist_ok=True)
    units = range(arguments.first - 1, arguments.units)
    settings = {"units": units, "seed": SEED, "first_worlds": FIRST_WORLDS}
    if arguments.try_out:
        settings = {"units": range(2), "seed": 1000, "first_worlds": dict.fromkeys(FAMILIES, 8000)}
    columns = [COLUMNS[name] for name in arguments.columns]
    asked = trials_of(arguments.folder / "worlds", columns, **settings)
    asked = [(family, spec) for family, spec in asked if family in arguments.families]
    path = arguments.folder / "trials.csv"
    rows = drive_missing(path, asked, arguments.jobs)
    require_no_errors(rows, path)
    if judgement.OURS in arguments.columns and len(arguments.columns) > 1:
        tell(rows)


if __name__ == "__main__":
    main()
