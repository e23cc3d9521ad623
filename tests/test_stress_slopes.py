"""The page of stresses is what its command writes."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

import pandas as pd
import pytest

REPOSITORY = Path(__file__).parents[1]
PAGE = REPOSITORY / "docs" / "stress_slopes.md"


@pytest.fixture
def slopes(monkeypatch):
    monkeypatch.syspath_prepend(str(REPOSITORY / "studies"))
    return import_module("stress_slopes")


def arrivals(slopes, **lost) -> pd.DataFrame:
    """32 trials of two columns; lost: how many of a column's do not arrive."""
    rows = [
        {
            "scenario": "doorway",
            "controller": name,
            "seed": seed,
            "outcome": "aborted" if seed < lost.get(name, 0) else "succeeded",
            "reason": "",
            **dict.fromkeys((metric.name for metric in slopes.METRICS), 1.0 + seed),
        }
        for name in ("rpp", "dwb")
        for seed in range(slopes.SEEDS)
    ]
    return pd.DataFrame(rows)


def test_the_page_begins_as_its_command_writes_it_and_tells_every_field(slopes):
    text = PAGE.read_text(encoding="utf-8")
    assert text.startswith(slopes.INTRODUCTION)
    assert all(f"`{field}`" in text for field in slopes.AXES)


def test_a_field_that_costs_every_arrival_is_bold_and_one_without_effect_is_only_named(slopes):
    stressed = {field: arrivals(slopes) for field in slopes.AXES}
    stressed["lidar.range_bias_m"] = arrivals(slopes, rpp=32)
    found = slopes.judge(arrivals(slopes), stressed)
    assert slopes.decided(found) == {("lidar.range_bias_m", "rpp")}
    text = slopes.page(found, ["rpp", "dwb"])
    row = "| `lidar.range_bias_m` 0.05 | **-1.00 [-1.00, -0.75]** | +0.00 [-0.11, 0.11] |"
    assert row in text.split("\n")
    assert "No controller is shown to answer to: `localization.drift`, " in text
