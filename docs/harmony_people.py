"""The figures with people in harmony.md: `python docs/harmony_people.py FOLDER`.

Reads the logs of a campaign and prints what contacts there were, column by column, in Markdown:

    python -m drake_navbench.run $(python docs/harmony_people.py --scenarios) \\
        --controllers harmony,dwb,rpp,teb,mppi --trials 8 --seed 100 --out FOLDER

Passive safety asks that the robot be at rest when it meets somebody who walked into it.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from drake_navbench.analysis.tables import trial_identity
from drake_navbench.log import Outcome, TrialLog

SCENARIOS = ("corridor_passing", "doorway_people", "ward_nurses", "crossing_streams")
# Slower than this the robot is at rest, m/s and rad/s.
REST_MPS, REST_RADPS = 0.02, 0.05


def contact_row(log: TrialLog) -> dict[str, Any]:
    """Returns how a trial ended, and for a contact with a person how fast the robot was then."""
    row = trial_identity(log) | {
        "arrived": log.outcome is Outcome.SUCCEEDED,
        "contact": False,
        "robot_drove": False,
        "speed_mps": np.nan,
        "at_rest": False,
    }
    if log.outcome is not Outcome.COLLIDED or log.info["contact"]["kind"] != "person":
        return row
    contact = log.info["contact"]
    last = log.samples.iloc[-1]
    return row | {
        "contact": True,
        "robot_drove": contact["robot_closing_mps"] >= contact["other_closing_mps"],
        "speed_mps": abs(float(last.v_mps)),
        "at_rest": abs(last.v_mps) <= REST_MPS and abs(last.w_radps) <= REST_RADPS,
    }


def table(rows: pd.DataFrame) -> str:
    """Returns a row a controller: trials, arrivals, contacts, and the robot's speed in them."""
    lines = [
        "| column | arrived | contacts with people | of them the robot drove into | "
        "of them at rest | speed then, median [m/s] | most [m/s] |",
        "|---|---|---|---|---|---|---|",
    ]
    for column in dict.fromkeys(rows.controller):
        trials = rows[rows.controller == column]
        met = trials[trials.contact]
        shown = [
            f"`{column}`",
            f"{trials.arrived.sum()} of {len(trials)}",
            f"{len(met)}",
            f"{int(met.robot_drove.sum())}" if len(met) else "",
            f"{int(met.at_rest.sum())}" if len(met) else "",
            f"{met.speed_mps.median():.2f}" if len(met) else "",
            f"{met.speed_mps.max():.2f}" if len(met) else "",
        ]
        lines.append("| " + " | ".join(shown) + " |")
    return "\n".join(lines)


def main() -> None:
    """Prints the table, or the scenarios."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, help="results of the campaign")
    parser.add_argument("--scenarios", action="store_true", help="print what to drive, and end")
    arguments = parser.parse_args()
    if arguments.scenarios:
        print(*SCENARIOS)
        return
    if arguments.folder is None:
        parser.error("expected a results folder")
    paths = sorted((arguments.folder / "trials").glob("*/*/trial_*.parquet"))
    if not paths:
        parser.error(f"{arguments.folder}: holds no logs of trials")
    print(table(pd.DataFrame([contact_row(TrialLog.read(path)) for path in paths])))


if __name__ == "__main__":
    main()
