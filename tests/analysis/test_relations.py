"""Every kind of relation comes down to one margin, by hand."""

from __future__ import annotations

import numpy as np
import pytest

from drake_navbench.analysis.relations import Equals, Ordering, Within, parse_relation

EVERYONE = ("dwb", "rpp", "teb", "mppi")


def parse(relation, controllers):
    return parse_relation(relation, controllers, everyone=EVERYONE)


def margin_of(relation, **means):
    """The margin of a relation, given the means by controller."""
    return float(relation.margin(np.array([means[name] for name in relation.controllers])))


def deciding_of(relation, **means):
    return relation.deciding(np.array([means[name] for name in relation.controllers]))


def test_equals_has_half_a_printed_unit_to_spare():
    relation = parse("equals 100", "dwb rpp")
    assert relation == Equals(("dwb", "rpp"), 100.0)
    assert margin_of(relation, dwb=100.0, rpp=100.0) == 0.5
    # The farthest counts: 0.5 - |99.7 - 100| = 0.2.
    assert margin_of(relation, dwb=100.1, rpp=99.7) == pytest.approx(0.2)
    assert deciding_of(relation, dwb=100.1, rpp=99.7) == "rpp = 100"
    # One of 32 trials failed: 0.5 - 3.125.
    assert margin_of(relation, dwb=100.0, rpp=96.875) == pytest.approx(-2.625)


def test_within_counts_the_spread_from_the_lowest():
    relation = parse("within 3%", "dwb rpp teb")
    assert relation == Within(("dwb", "rpp", "teb"), 3.0)
    # 30.6 exceeds 30.0 by 2%: 1% is left.
    assert margin_of(relation, dwb=30.3, rpp=30.0, teb=30.6) == pytest.approx(1.0)
    assert margin_of(relation, dwb=31.5, rpp=30.0, teb=30.6) == pytest.approx(-2.0)
    assert deciding_of(relation, dwb=31.5, rpp=30.0, teb=30.6) == "rpp and dwb within 3%"
    assert relation.margin_unit == "%"


def test_lowest_is_below_every_other():
    relation = parse("lowest", "rpp")
    # The nearest other is 0.3 above.
    assert margin_of(relation, dwb=1.5, rpp=1.0, teb=1.3, mppi=4.0) == pytest.approx(0.3)
    assert deciding_of(relation, dwb=1.5, rpp=1.0, teb=1.3, mppi=4.0) == "rpp < teb"
    assert margin_of(relation, dwb=1.5, rpp=1.0, teb=0.8, mppi=4.0) == pytest.approx(-0.2)


def test_highest_is_above_every_other():
    relation = parse("highest", "dwb")
    assert margin_of(relation, dwb=5.0, rpp=1.0, teb=4.0, mppi=2.0) == 1.0
    assert deciding_of(relation, dwb=5.0, rpp=1.0, teb=4.0, mppi=2.0) == "teb < dwb"
    assert margin_of(relation, dwb=3.0, rpp=1.0, teb=4.0, mppi=2.0) == -1.0


def test_an_order_needs_every_step_of_it():
    falling = parse("order high to low", "mppi teb dwb")
    assert falling == Ordering((("dwb", "teb"), ("teb", "mppi")))
    assert margin_of(falling, mppi=9.0, teb=6.0, dwb=5.0) == 1.0
    # mppi > dwb does not help where teb is above mppi.
    assert margin_of(falling, mppi=9.0, teb=9.5, dwb=5.0) == -0.5
    rising = parse("order low to high", "mppi teb dwb")
    assert margin_of(rising, mppi=1.0, teb=3.0, dwb=4.0) == 1.0
    assert margin_of(rising, mppi=1.0, teb=3.0, dwb=2.0) == -1.0


def test_lower_than_compares_each_left_with_each_right():
    relation = parse("lower than", "teb mppi < dwb rpp")
    # The closest pair is teb and rpp: 3.5 - 2.0.
    assert margin_of(relation, teb=2.0, mppi=1.0, dwb=4.0, rpp=3.5) == 1.5
    assert deciding_of(relation, teb=2.0, mppi=1.0, dwb=4.0, rpp=3.5) == "teb < rpp"
    assert margin_of(relation, teb=2.0, mppi=3.75, dwb=4.0, rpp=3.5) == -0.25


def test_a_tie_is_exactly_zero_even_after_rounding():
    relation = parse("lowest", "rpp")
    tied = {"dwb": 0.1 + 0.2, "rpp": 0.3, "teb": 1.0, "mppi": 1.0}
    assert tied["dwb"] != tied["rpp"]
    assert margin_of(relation, **tied) == 0.0


def test_margins_of_many_means_at_once_are_those_of_each():
    relation = parse("order high to low", "dwb rpp")
    means = np.array([[1.0, 3.0], [2.0, 1.5]])  # columns: rpp, dwb
    assert relation.controllers == ("rpp", "dwb")
    np.testing.assert_allclose(relation.margin(means), [2.0, -0.5])


def test_an_unknown_relation_is_refused():
    with pytest.raises(ValueError, match="relation 'about equal' is not known; expected"):
        parse("about equal", "dwb rpp")
