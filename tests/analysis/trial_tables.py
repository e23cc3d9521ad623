"""Tables of trials with known numbers, as `trials.parquet` holds them."""

from __future__ import annotations

import numpy as np
import pandas as pd

from drake_navbench.analysis.reproduction.lineups import PUBLISHED_SETTINGS
from drake_navbench.analysis.tables import published_table


def trials(scenario, metric, **values):
    """Rows of one metric; values: by preset, one a trial."""
    return pd.DataFrame(
        [
            {"scenario": scenario, "controller": name, "trial": trial, metric: value}
            for name, column in values.items()
            for trial, value in enumerate(column)
        ]
    )


def times(**values):
    return trials("empty", "time_taken", **values)


def published_trials(count=2, *, noise=0.0, seed=0):
    """Trials that have the published numbers; noise: the relative spread around them."""
    generator = np.random.default_rng(seed)
    rows = []
    for scenario, table in published_table().groupby("scenario", sort=False):
        for controller, preset in PUBLISHED_SETTINGS.presets.items():
            numbers = table[controller].astype(float).to_numpy()
            for trial in range(count):
                spread = 1.0 + noise * generator.standard_normal(len(numbers))
                values = dict(zip(table["metric"], numbers * spread, strict=True))
                rows.append({"scenario": scenario, "controller": preset, "trial": trial, **values})
    frame = pd.DataFrame(rows).assign(outcome="succeeded", duration_s=30.0)
    # What the text alone tells: DWB turns fastest.
    return frame.assign(max_yaw_rate=np.where(frame["controller"] == "dwb", 0.55, 0.4))
