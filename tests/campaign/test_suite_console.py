"""Totals of suites on narrow terminals: controllers keep their names."""

from __future__ import annotations

import io

import numpy as np
import pandas as pd
import pytest
from rich.console import Console

from drake_navbench.analysis.totals import totals
from drake_navbench.campaign.suite_console import print_totals

NAMES = ["rpp", "teb_upstream", "mppi_nav2", "rpp:lookahead_dist=0.35"]


def printed(width: int, densities: tuple[str, ...] = ("15%", "30%")) -> list[str]:
    rows = [
        {
            "suite": "BARN",
            "density": density,
            "scenario": f"barn_{density}_{world}",
            "controller": name,
            "trial": 0,
            "outcome": "succeeded" if world % 2 else "collided",
            "barn_score": 0.123 * (world % 2),
            "time_to_goal_s": 20.0 if world % 2 else np.nan,
        }
        for name in NAMES
        for density in densities
        for world in range(40)
    ]
    output = io.StringIO()
    print_totals(Console(file=output, width=width), totals(pd.DataFrame(rows)))
    return output.getvalue().splitlines()


@pytest.mark.parametrize("width", [80, 100, 160])
def test_controllers_keep_their_names(width):
    lines = printed(width)
    assert max(map(len, lines)) <= width
    text = "\n".join(lines)
    # The interval of 20 of 40 worlds, whole on one line or below its share.
    assert "35 to 65" in text
    assert "…" not in text
    for name in ("rpp ", "teb_upstream", "mppi_nav2"):
        assert name in text
    starts = [line.partition(" ")[0] for line in lines]
    place = next(place for place, start in enumerate(starts) if start.startswith("rpp:"))
    assert "".join(starts[place : place + 3]).startswith("rpp:lookahead_dist=0.35")


def test_wide_enough_each_total_is_a_line():
    assert len(printed(160)) == 3 + 3 * len(NAMES) + 1


def test_worlds_of_a_single_density_have_scores_too():
    assert printed(160, ("15%",))[1].split()[-2:] == ["BARN", "score"]


def test_worlds_without_densities_have_times_in_place_of_scores():
    lines = printed(80, ("",))
    # 20 of 40 worlds reach the goal, each in 20 s.
    assert lines[1] == "controller    worlds   success  collided  time to goal, s"
    assert lines[3].split()[:3] == ["rpp", "40", "50%"]
    assert "20.00" in lines[3]
