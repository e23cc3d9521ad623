"""The motions of Hybrid-A*: a car's moves from one cell to the next, tabulated by heading.

Lengths are in cells, headings in bins. Every motion is straight or an arc that turns by a whole
number of bins; all have chords of one length, long enough to leave a cell. Arithmetic is float32
where Nav2's is.
Source: nav2_smac_planner (HybridMotionTable::initDubin, initReedsShepp).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

F32 = np.float32
# The directions of turns that are told apart.
FORWARD, TO_LEFT, TO_RIGHT, REVERSE, REVERSE_LEFT, REVERSE_RIGHT = 1, 2, 3, 4, 5, 6


class Motions(NamedTuple):
    """M motions and B headings.

    bin_size: rad. bins: B. radius: radius of the tightest turn. reverses: whether any goes
    backwards.
    step_x, step_y: (M, B) the way, by the heading at its start. turn_bins: (M,) float32.
    directions: (M,) FORWARD ... travel_costs: (M,) float32, length along the arc.
    cosines, sines: (B,) of the headings.
    """

    bin_size: np.float32
    bins: int
    radius: np.float32
    reverses: bool
    step_x: NDArray[np.float64]
    step_y: NDArray[np.float64]
    turn_bins: NDArray[np.float32]
    directions: NDArray[np.int8]
    travel_costs: NDArray[np.float32]
    cosines: NDArray[np.float64]
    sines: NDArray[np.float64]


def motions(
    radius: float, bins: int, *, reverses: bool, interpolates: bool, costs_chords: bool = False
) -> Motions:
    """Returns the motions of a car that turns on `radius` cells, at least sqrt(1/2).

    interpolates: whether there are also wider arcs, one for each bin between straight on and the
    tightest arc. costs_chords: whether an arc costs no more than its chord, as before Jazzy.
    """
    radius32 = F32(radius)
    bin_size = F32(F32(2.0) * F32(math.pi)) / F32(bins)
    angle = F32(2.0 * math.asin(math.sqrt(2.0) / float(F32(2.0) * radius32)))
    increments = F32(1.0) if angle < bin_size else F32(math.ceil(F32(angle / bin_size)))
    angle = F32(increments * bin_size)
    ahead = F32(radius32 * sin32(angle))
    aside = F32(radius32 - F32(radius32 * cos32(angle)))
    chord = F32(math.sqrt(float(ahead) ** 2 + float(aside) ** 2))
    ways = [(chord, F32(0.0), F32(0.0), FORWARD)]
    ways += [(ahead, aside, increments, TO_LEFT), (ahead, -aside, -increments, TO_RIGHT)]
    if reverses:
        ways.append((-chord, F32(0.0), F32(0.0), REVERSE))
        ways.append((-ahead, aside, -increments, REVERSE_LEFT))
        ways.append((-ahead, -aside, increments, REVERSE_RIGHT))
    if interpolates:
        for count in range(1, int(increments)):
            ways += _wider(F32(count), F32(count) * bin_size, chord, reverses=reverses)
    table = _tabulated(ways, chord, bin_size, bins, radius32, reverses=reverses)
    if costs_chords:
        return table._replace(travel_costs=np.full(len(ways), chord, np.float32))
    return table


Way = tuple[np.float32, np.float32, np.float32, int]


def _wider(count: np.float32, angle: np.float32, chord: np.float32, *, reverses: bool) -> list[Way]:
    """Returns the motions that turn by `angle`."""
    radius = F32(chord / F32(F32(2.0) * sin32(F32(angle / F32(2.0)))))
    ahead = F32(radius * sin32(angle))
    aside = F32(radius - F32(radius * cos32(angle)))
    ways = [(ahead, aside, count, TO_LEFT), (ahead, -aside, -count, TO_RIGHT)]
    if reverses:
        ways.append((-ahead, aside, -count, REVERSE_LEFT))
        ways.append((-ahead, -aside, count, REVERSE_RIGHT))
    return ways


def _tabulated(
    ways: list[Way],
    chord: np.float32,
    bin_size: np.float32,
    bins: int,
    radius: np.float32,
    *,
    reverses: bool,
) -> Motions:
    headings = [F32(bin_size * F32(j)) for j in range(bins)]
    cosines = np.array([float(cos32(heading)) for heading in headings])
    sines = np.array([float(sin32(heading)) for heading in headings])
    x = np.array([float(way[0]) for way in ways])[:, None]
    y = np.array([float(way[1]) for way in ways])[:, None]
    costs = []
    for _, _, turn, direction in ways:
        arc = F32(turn * bin_size)
        is_straight = direction in (FORWARD, REVERSE)
        if not is_straight:
            own_radius = F32(chord / F32(F32(2.0) * sin32(F32(arc / F32(2.0)))))
        costs.append(chord if is_straight else F32(own_radius * arc))
    return Motions(
        bin_size,
        bins,
        radius,
        reverses,
        x * cosines - y * sines,
        x * sines + y * cosines,
        np.array([way[2] for way in ways], np.float32),
        np.array([way[3] for way in ways], np.int8),
        np.array(costs, np.float32),
        cosines,
        sines,
    )


@njit(cache=True)
def sin32(angle):
    """Returns the sine of a float32 as the C library rounds it, which is not always best."""
    return np.float32(math.sin(np.float32(angle)))


@njit(cache=True)
def cos32(angle):
    """Returns the cosine of a float32 as the C library rounds it."""
    return np.float32(math.cos(np.float32(angle)))
