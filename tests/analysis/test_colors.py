"""Colours of controllers."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from drake_navbench.analysis.colors import CONTROLLER_COLORS, OTHER_COLORS, controller_color

# Of OKLab: neighbours in the palette of Okabe and Ito are 0.16 apart.
CLEARLY_APART = 0.14
VARIANTS = [f"rpp:lookahead_dist={place / 10}" for place in range(1, 10)]


def oklab(color: str) -> np.ndarray:
    """Returns a colour in a space where distances are as large as they look (Ottosson, 2020)."""
    channels = np.array([int(color[place : place + 2], 16) / 255.0 for place in (1, 3, 5)])
    linear = np.where(channels <= 0.04045, channels / 12.92, ((channels + 0.055) / 1.055) ** 2.4)
    cones = np.cbrt(
        [
            [0.4122214708, 0.5363325363, 0.0514459929],
            [0.2119034982, 0.6806995451, 0.1073969566],
            [0.0883024619, 0.2817188376, 0.6299787005],
        ]
        @ linear
    )
    return (
        np.array(
            [
                [0.2104542553, 0.7936177850, -0.0040720468],
                [1.9779984951, -2.4285922050, 0.4505937099],
                [0.0259040371, 0.7827717662, -0.8086757660],
            ]
        )
        @ cones
    )


def test_all_colours_are_told_apart():
    everybody = [*CONTROLLER_COLORS.values(), *OTHER_COLORS]
    for first, second in combinations(everybody, 2):
        assert np.linalg.norm(oklab(first) - oklab(second)) > CLEARLY_APART, (first, second)


def test_variants_of_a_controller_have_colours_of_their_own():
    """By name alone two of nine mostly had the same one."""
    columns = ["rpp", *VARIANTS]
    assert len({controller_color(name, columns) for name in columns}) == 10


def test_the_order_of_the_columns_does_not_matter():
    for name in VARIANTS:
        assert controller_color(name, VARIANTS) == controller_color(name, VARIANTS[::-1])


def test_a_name_keeps_its_colour():
    assert controller_color("rpp", VARIANTS) == controller_color("rpp") == "#0072b2"
    assert controller_color("mine", ["rpp", "dwb"]) == controller_color("mine")
