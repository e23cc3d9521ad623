"""The legs of a scenario's trials as a table, where they lead over several floors."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd

from drake_navbench.analysis.scenario_analysis import TrialEntry


def legs_table(trials: Sequence[TrialEntry]) -> pd.DataFrame:
    """Returns a row for each leg that ended, of missions alone: controller, trial, leg from 1 on.

    Then come the fields of `journey.Leg` but for the goal; `lift_s` is the time at the lift.
    """
    rows = [
        {"controller": entry.row["controller"], "trial": entry.row["trial"], "leg": number}
        | {name: value for name, value in leg._asdict().items() if name != "goal"}
        for entry in trials
        for number, leg in enumerate(entry.legs, start=1)
        if leg.floor
    ]
    return pd.DataFrame(rows)
