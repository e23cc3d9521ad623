"""Colours of controllers."""

from __future__ import annotations

import colorsys
from itertools import combinations

import pytest

from drake_navbench.analysis.colors import CONTROLLER_COLORS, controller_color

OTHERS = ["rpp@mine", "teb_fast", "graceful", "vector_pursuit", "learned", *map(str, range(50))]


def channels(color: str) -> list[float]:
    return [int(color[place : place + 2], 16) / 255.0 for place in (1, 3, 5)]


def apart_deg(first: str, second: str) -> float:
    hues = [360.0 * colorsys.rgb_to_hls(*channels(color))[0] for color in (first, second)]
    turn = abs(hues[0] - hues[1])
    return min(turn, 360.0 - turn)


def distance(first: str, second: str) -> float:
    return sum((a - b) ** 2 for a, b in zip(channels(first), channels(second), strict=True)) ** 0.5


@pytest.mark.parametrize("name", OTHERS)
def test_nobody_elses_colour_is_like_that_of_a_controller_of_the_table(name):
    color = controller_color(name)
    for known, of_known in CONTROLLER_COLORS.items():
        assert apart_deg(color, of_known) > 10.0, known
        assert distance(color, of_known) > 0.15, known


def test_those_of_the_table_are_told_apart():
    for first, second in combinations(CONTROLLER_COLORS.values(), 2):
        assert distance(first, second) > 0.2


def test_a_name_keeps_its_colour():
    assert controller_color("rpp@mine") == controller_color("rpp@mine")
    assert controller_color("rpp") == "#0072b2"
