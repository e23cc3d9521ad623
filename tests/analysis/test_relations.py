"""Every kind of claim comes down to inequalities between two means, by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from drake_navbench.analysis.reproduction.relations import (
    Equals,
    Inequality,
    parse_relation,
    relative_difference,
)

EVERYONE = ("dwb", "rpp", "teb", "mppi")


def parse(relation, controllers):
    return parse_relation(relation, controllers, everyone=EVERYONE)


def texts(relation):
    return [part.text for part in relation.parts]


def test_equals_is_about_every_value_to_half_a_printed_unit():
    relation = parse("equals 100", "dwb rpp")
    assert relation == Equals(("dwb", "rpp"), 100.0)
    assert list(relation.holds(np.array([100.0, 99.5, 99.4, 100.6]))) == [True, True, False, False]


def test_within_compares_every_two_both_ways():
    relation = parse("within 3%", "dwb rpp")
    assert relation.parts == (Inequality("dwb", "rpp", 1.03), Inequality("rpp", "dwb", 1.03))
    assert relation.controllers == ("dwb", "rpp")
    part = relation.parts[0]
    assert part.text == "dwb < 1.03 rpp"
    # 1.03 * 30 - 30.6.
    assert part.difference(30.6, 30.0) == pytest.approx(0.3)
    assert part.size(30.6, 30.0) == pytest.approx(1.02)


def test_at_most_limits_a_share_of_another_mean():
    relation = parse("at most 35% of", "dwb teb < rpp")
    assert texts(relation) == ["dwb < 0.35 rpp", "teb < 0.35 rpp"]
    part = relation.parts[1]
    assert part.difference(0.44, 0.5) == pytest.approx(0.35 * 0.5 - 0.44)
    assert part.size(0.44, 0.5) == pytest.approx(0.88)
    assert math.isnan(part.size(0.44, 0.0))


def test_lowest_is_below_every_other():
    assert texts(parse("lowest", "rpp")) == ["rpp < dwb", "rpp < teb", "rpp < mppi"]


def test_highest_is_above_every_other():
    assert texts(parse("highest", "dwb")) == ["rpp < dwb", "teb < dwb", "mppi < dwb"]


def test_an_order_is_about_every_two_of_its_controllers():
    # The neighbours alone would leave out mppi < rpp, which may be sure where they are not.
    assert texts(parse("order high to low", "rpp teb mppi")) == [
        "mppi < teb",
        "mppi < rpp",
        "teb < rpp",
    ]
    assert texts(parse("order low to high", "mppi teb")) == ["mppi < teb"]


def test_lower_than_compares_every_one_on_the_left_with_every_one_on_the_right():
    assert texts(parse("lower than", "teb mppi < dwb rpp")) == [
        "teb < dwb",
        "teb < rpp",
        "mppi < dwb",
        "mppi < rpp",
    ]


def test_the_size_of_an_ordering_is_the_difference_as_a_share_of_the_larger():
    part = Inequality("rpp", "dwb")
    assert part.size(0.9, 1.0) == pytest.approx(0.1)
    assert part.size(1.0, 0.9) == pytest.approx(-0.1)
    assert part.size(0.0, 0.0) == 0.0
    assert relative_difference(-2.0, -1.0) == pytest.approx(0.5)
    assert math.isnan(relative_difference(math.nan, 1.0))
    assert math.isnan(relative_difference(1.0, math.nan))


def test_an_unknown_relation_is_refused():
    with pytest.raises(ValueError, match="relation 'about equal' is not known; expected"):
        parse("about equal", "dwb rpp")
