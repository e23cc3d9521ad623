"""Orderings are counted over all published pairs; the ceiling is what our own halves agree in."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest
from trial_tables import published_trials, trials

from drake_navbench.analysis.reproduction.concordance import (
    EXCLUDED_METRICS,
    Ordering,
    ceilings,
    concordance,
    is_covered,
    permutation_baseline,
    published_orderings,
)
from drake_navbench.analysis.reproduction.findings import findings
from drake_navbench.analysis.tables import PUBLISHED_CONTROLLERS, published_table, published_units


def test_the_tables_imply_297_orderings_of_which_275_are_no_ties():
    table = published_table()
    rows = table[~table["metric"].isin(EXCLUDED_METRICS)]
    values = rows[list(PUBLISHED_CONTROLLERS)].to_numpy(float)
    different = [values[:, i] != values[:, j] for i in range(4) for j in range(i)]
    assert np.sum(different) == 297
    found = published_orderings(published_trials())
    assert len(found) == 275
    counted = concordance(found)
    assert (counted.orderings, counted.agreeing, counted.without_value) == (275, 275.0, 0)
    assert counted.ratio == 1.0


def test_reversed_numbers_agree_in_nothing():
    table = published_trials()
    metrics = [name for name in published_table()["metric"].unique() if name in table]
    table[metrics] = -table[metrics]
    # Zeros stay zeros, but no two of them are an ordering.
    assert concordance(published_orderings(table)).agreeing == 0.0


def test_agreement_by_hand():
    # Printed: dwb 30.704, rpp 30.107, teb 30.637, mppi 30.049: of the six pairs dwb-rpp, dwb-mppi,
    # rpp-teb and teb-mppi differ by 1.9, 2.1, 1.7 and 1.9%, the others by 0.2%.
    table = trials("static_obstacles", "time_taken", dwb=[31.0], rpp=[30.0], teb_upstream=[30.0],
                   mppi_nav2=[30.9])  # fmt: skip
    found = [o for o in published_orderings(table) if o.metric == "time_taken"
             and o.scenario == "static_obstacles"]  # fmt: skip
    pairs = {(o.first, o.second): o for o in found}
    assert set(pairs) == {("dwb", "rpp"), ("dwb", "mppi"), ("rpp", "teb"), ("teb", "mppi")}
    assert pairs["dwb", "rpp"].published == pytest.approx(-0.597 / 30.704)
    assert pairs["dwb", "rpp"].ours == pytest.approx(-1.0 / 31.0)
    agreement = {pair: o.agreement for pair, o in pairs.items()}
    assert agreement == {
        ("dwb", "rpp"): 1.0,
        ("dwb", "mppi"): 1.0,
        ("rpp", "teb"): 0.5,
        ("teb", "mppi"): 0.0,
    }
    counted = concordance(found)
    assert (counted.orderings, counted.agreeing) == (4, 2.5)
    # dwb against mppi and rpp against teb are less than 1% apart.
    assert counted.level == 2


def test_what_was_not_driven_is_counted_apart():
    table = published_trials()
    table = table[table["controller"] != "teb_upstream"]
    counted = concordance(published_orderings(table))
    assert counted.without_value == 275 - counted.orderings > 100
    assert counted.ratio == 1.0
    assert math.isnan(concordance([]).ratio)


def test_an_ordering_is_covered_by_a_finding_that_claims_it():
    def ordering(scenario, metric, first, second):
        return Ordering(scenario, metric, first, second, 0.1, 0.1)

    claimed = findings()
    # Finding 2, rpp is the fastest; finding 7 orders all jerks; 56 is about all goal scenarios.
    assert is_covered(ordering("empty", "time_taken", "dwb", "rpp"), claimed)
    assert not is_covered(ordering("empty", "time_taken", "dwb", "teb"), claimed)
    assert is_covered(ordering("empty", "avg_path_error", "dwb", "rpp"), claimed)
    assert not is_covered(ordering("restricted_small", "avg_path_error", "dwb", "rpp"), claimed)
    # "Within 3%" is no claim about an order.
    assert not is_covered(ordering("static_obstacles", "time_taken", "dwb", "rpp"), claimed)


def test_units_are_those_of_the_longest_number_in_a_row():
    units = published_units()
    assert units["one_obstacle", "max_path_error"] == pytest.approx(0.001)  # 0.07 beside 0.254
    assert units["empty", "max_velocity"] == 1.0
    assert units["empty", "min_path_error"] == pytest.approx(0.01)


def test_two_halves_of_steady_trials_agree_in_everything():
    ceiling = ceilings(published_trials(8, noise=1e-5))[""]
    assert (ceiling.ratio, ceiling.low, ceiling.high) == (1.0, 1.0, 1.0)
    # Ties by the rule for the publication are ties between halves, too.
    assert ceiling.orderings == pytest.approx(275, abs=3)


def test_two_halves_of_mere_noise_agree_in_half_of_their_orderings():
    table = published_trials(8)
    metrics = [name for name in published_table()["metric"].unique() if name in table]
    generator = np.random.default_rng(4)
    table[metrics] = 10.0 + generator.standard_normal((len(table), len(metrics)))
    found = ceilings(table)
    assert found[""].ratio == pytest.approx(0.5, abs=0.08)
    assert set(found) == {"", *published_table()["scenario"], *PUBLISHED_CONTROLLERS}


def test_pairs_in_which_nothing_is_random_say_nothing_of_the_ceiling():
    table = published_trials(8, noise=1e-5)
    still = published_trials(8)
    is_wall = table["scenario"] == "restricted_small"
    table = pd.concat([table[~is_wall], still[is_wall.to_numpy()]])
    assert "restricted_small" not in ceilings(table)
    assert "restricted_large" in ceilings(table)


def test_there_is_no_ceiling_with_fewer_than_two_times_four_trials():
    assert ceilings(published_trials(7, noise=0.01)) == {}


def test_exchanged_names_find_fewer_orderings_again_than_the_right_ones():
    trials = published_trials()
    assert concordance(published_orderings(trials)).ratio == 1.0
    baseline = permutation_baseline(trials)
    assert baseline.permutations == 23
    # About half is what chance gives; exchanging two that are alike costs least.
    assert 0.4 < baseline.median < 0.6
    assert baseline.median < baseline.best < 0.95


def test_a_table_of_equal_controllers_has_no_ordering_to_find():
    trials = published_trials()
    numbers = trials.select_dtypes("number").columns.drop("trial")
    baseline = permutation_baseline(trials.assign(**dict.fromkeys(numbers, 1.0)))
    # An exact tie counts one half, under every name.
    assert (baseline.median, baseline.best) == (0.5, 0.5)
