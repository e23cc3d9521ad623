"""The table of legs of a scenario whose missions lead over several floors."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from drake_navbench.analysis.scenario_analysis import TrialEntry


def legs_table(trials: Sequence[TrialEntry]) -> pd.DataFrame:
    """Returns a row for each finished leg of a mission: controller, trial, leg counted from 1.

    Then come the fields of `journey.Leg` except the goal; `lift_s` is the time at the lift.
    """
    rows = [
        {"controller": entry.row["controller"], "trial": entry.row["trial"], "leg": number}
        | {name: value for name, value in leg._asdict().items() if name != "goal"}
        for entry in trials
        for number, leg in enumerate(entry.legs, start=1)
        if leg.floor
    ]
    return pd.DataFrame(rows)
