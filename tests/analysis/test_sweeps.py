"""Responses and slopes of a sweep, with numbers that can be checked by hand."""

import math
import re

import numpy as np
import pandas as pd
import pytest

from drake_navbench.analysis.figures.style import Look
from drake_navbench.analysis.figures.sweeps import ResponsePanel, response_figure
from drake_navbench.analysis.metrics.registry import all_metrics
from drake_navbench.analysis.sweep_page import write_sweep
from drake_navbench.analysis.sweeps import (
    SUCCEEDED,
    constants,
    heat_maps,
    long_table,
    response_table,
    responses,
    slope_differences,
    slopes,
)

NOISE, LOOKAHEAD, TIME = "localization.xy_std_m", "rpp.lookahead_dist", "time_to_goal_s"
SWEEP = {
    "scenarios": {
        f"door@{NOISE}={noise:g}": {"of": "door", "values": {NOISE: noise}} for noise in (0.0, 1.0)
    },
    "controllers": {
        "dwb": {"of": "dwb", "values": {}},
        "rpp:a": {"of": "rpp", "values": {LOOKAHEAD: 0.5}},
        "rpp:b": {"of": "rpp", "values": {LOOKAHEAD: 1.5}},
    },
}


def time_of(controller, noise, seed):
    """dwb loses 2 s a unit of noise; rpp 10 s, and gains 4 s by the longer lookahead."""
    base = 20.0 + seed
    if controller == "dwb":
        return base + 2.0 * noise
    return base + (10.0 + seed) * noise - (4.0 if controller == "rpp:b" else 0.0)


def trials(seeds=(1, 2, 3)):
    nothing = {entry.name: math.nan for entry in all_metrics()}
    rows = [
        nothing
        | {
            "scenario": f"door@{NOISE}={noise:g}",
            "controller": controller,
            "trial": seed,
            "seed": seed,
            "outcome": "succeeded" if noise == 0.0 or seed > 1 else "aborted",
            "reason": "",
            TIME: time_of(controller, noise, seed),
        }
        for noise in (0.0, 1.0)
        for controller in SWEEP["controllers"]
        for seed in seeds
    ]
    front = ["scenario", "controller", "trial", "seed", "outcome", "reason"]
    return pd.DataFrame(rows)[[*front, *nothing]]


def test_the_long_table_has_a_column_a_field_under_the_names_before_the_sweep():
    table = long_table(trials(), SWEEP)
    assert list(table.columns[:4]) == ["scenario", "controller", NOISE, LOOKAHEAD]
    assert set(table["scenario"]) == {"door"}
    assert set(table["controller"]) == {"dwb", "rpp"}
    assert table.loc[table["controller"] == "dwb", LOOKAHEAD].isna().all()


def test_a_response_is_the_mean_over_seeds_with_other_fields_averaged_first():
    found = {
        entry.controller: entry for entry in responses(long_table(trials(), SWEEP), NOISE, TIME)
    }
    assert found["rpp"].values == [0.0, 1.0]
    # Seeds 1, 2, 3 at no noise: 21, 22, 23 and 4 less, so 19, 20, 21.
    assert found["rpp"].means[0] == pytest.approx(20.0)
    assert found["rpp"].counts == [3, 3]
    # Student: 20 +- 4.303 / sqrt(3).
    assert found["rpp"].intervals[0] == pytest.approx((17.516, 22.484), abs=1e-3)


def test_the_share_that_succeeded_has_wilsons_interval():
    dwb = responses(long_table(trials(), SWEEP), NOISE, SUCCEEDED)[0]
    assert dwb.means == pytest.approx([1.0, 2 / 3])
    assert dwb.intervals[1] == pytest.approx((0.2077, 0.9385), abs=1e-3)


def test_only_who_has_a_field_answers_to_it():
    found = responses(long_table(trials(), SWEEP), LOOKAHEAD, TIME)
    assert [entry.controller for entry in found] == ["rpp"]


def test_who_does_not_have_a_field_is_the_same_all_along_it():
    (found,) = constants(long_table(trials(), SWEEP), LOOKAHEAD, TIME)
    assert (found.controller, found.values) == ("dwb", [None])
    table = response_table(long_table(trials(), SWEEP), [LOOKAHEAD], {TIME: "s"})
    assert list(table.columns) == ["dwb", "rpp"]
    # Half of the table was dashes.
    assert table.notna().all(axis=None)
    assert set(table["dwb"]) == {found.means[0]}


def test_a_table_of_real_trials_begins_with_the_suite_and_has_no_other_fields():
    """The suite and its density stand before the scenario: these became fields of the sweep."""
    real = trials()
    real.insert(0, "suite", "")
    real.insert(1, "density", "")
    table = long_table(real, SWEEP)
    assert list(table.columns[2:6]) == ["scenario", "controller", NOISE, LOOKAHEAD]
    told = response_table(table, [NOISE, LOOKAHEAD], {TIME: "s"}).index.get_level_values("metric")
    assert {name.split("=")[0] for name in told} == {f"{TIME} at {NOISE}", f"{TIME} at {LOOKAHEAD}"}


def test_a_column_without_the_field_is_drawn_as_a_level_line():
    table = long_table(trials(), SWEEP)
    both = [*responses(table, LOOKAHEAD, TIME), *constants(table, LOOKAHEAD, TIME)]
    figure = response_figure([ResponsePanel(TIME, both)], LOOKAHEAD, Look(["rpp", "dwb"]))
    (axes,) = figure.axes
    level = [line for line in axes.lines if len(set(line.get_ydata())) == 1]
    assert len(level) == 1
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["rpp", "dwb"]


def test_slopes_are_those_of_each_seed():
    found = {entry.controller: entry for entry in slopes(long_table(trials(), SWEEP), NOISE, TIME)}
    assert found["dwb"].mean == pytest.approx(2.0)
    assert found["dwb"].seeds == 3
    # 11, 12 and 13 for the seeds 1, 2, 3.
    assert found["rpp"].mean == pytest.approx(12.0)
    assert found["rpp"].interval == pytest.approx((9.516, 14.484), abs=1e-3)


def test_slopes_of_two_controllers_are_compared_seed_by_seed():
    (found,) = slope_differences(long_table(trials(), SWEEP), NOISE, TIME)
    assert (found.first, found.second) == ("dwb", "rpp")
    assert found.comparison.difference == pytest.approx(10.0)
    assert found.is_shown


def test_slopes_that_do_not_differ_are_not_apart():
    table = trials()
    table[TIME] = np.tile(np.random.default_rng(0).normal(20.0, 1.0, 9), 2)
    assert not any(e.is_shown for e in slope_differences(long_table(table, SWEEP), NOISE, TIME))


def test_a_heat_map_has_the_mean_of_each_cell():
    (found,) = heat_maps(long_table(trials(), SWEEP), (NOISE, LOOKAHEAD), TIME)
    assert found.controller == "rpp"
    assert found.means == pytest.approx(np.array([[22.0, 34.0], [18.0, 30.0]]))


def test_the_page_shows_curves_slopes_and_maps(tmp_path):
    page = write_sweep(tmp_path, trials(seeds=(1, 2, 3, 4)), SWEEP).read_text()
    assert page.count("<svg") == 4
    # Slopes of the seeds 2 to 4, which always arrive: 12, 13 and 14 s against 2 s.
    assert "rpp changes by 11.00 s a unit more than dwb" in page
    assert (tmp_path / "tables" / "sweep.csv").is_file()


@pytest.mark.long
def test_who_gives_up_at_once_is_not_smooth_on_the_page(tmp_path):
    """At noise 1 the trials of seed 1 are aborted: their jerk of 0 is no slope."""
    table = trials()
    table["jerk_rms_mps3"] = np.where(table["outcome"] == "aborted", 0.0, 1.0)
    page = write_sweep(tmp_path, table, SWEEP).read_text()
    cell = page.partition('<th scope="row">jerk_rms_mps3</th>')[2].partition("</td><td")[2]
    assert re.findall(r'class="n">(\S+) <span', cell.partition("</tr>")[0]) == ["0", "0"]


@pytest.mark.long
def test_the_page_has_typeset_units_and_no_interval_of_one_seed(tmp_path):
    many = write_sweep(tmp_path, trials(), SWEEP).read_text()
    assert "m/s^3" not in many
    assert '<span class="muted">[' in many
    one = write_sweep(tmp_path, trials(seeds=(2,)), SWEEP).read_text()
    assert "Slopes, for one unit" in one
    assert "[–, –]" not in one
