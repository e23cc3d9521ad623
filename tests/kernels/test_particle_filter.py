"""The parts of Monte Carlo localization."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drake_navbench.kernels.particle_filter import (
    heaviest_cluster,
    hit_points,
    move_differential,
    move_omnidirectional,
    particle_limit,
    resample,
    weigh,
)

NO_ERROR = np.zeros(5)
LIMITS = (0.05, 0.99, 10, 100)
angles = st.floats(-3.0, 3.0)
lengths = st.floats(-2.0, 2.0)


def at(*pose: float) -> np.ndarray:
    return np.array([pose], dtype=float)


def test_the_number_of_particles_follows_from_the_occupied_bins():
    # Two bins: 1 / 0.1 (1 - 2/9 + sqrt(2/9) 0.99)^3 = 19.3.
    assert particle_limit(2, 0.05, 0.99, 1, 2000) == 20
    assert particle_limit(2, 0.05, 0.99, 500, 2000) == 500
    assert particle_limit(1000, 0.05, 0.99, 500, 2000) == 2000
    # One bin tells nothing of how many are needed.
    assert particle_limit(1, 0.05, 0.99, 500, 2000) == 2000


@pytest.mark.parametrize("move", [move_differential, move_omnidirectional])
@given(x=lengths, y=lengths, yaw=angles, turn=angles)
def test_without_error_a_particle_moves_as_the_odometry_did(move, x, y, yaw, turn):
    delta = np.array([x, y, turn])
    particles = at(1.0, 2.0, yaw)
    move(particles, yaw, delta, NO_ERROR, np.zeros((1, 3)))
    moved, wanted = particles[0] - (1.0, 2.0, yaw), delta
    # Of a way below a centimetre a differential base knows no direction.
    tolerance = 1e-9 if math.hypot(x, y) >= 0.01 or move is move_omnidirectional else 0.02
    assert moved[:2] == pytest.approx(wanted[:2], abs=tolerance)
    assert math.cos(moved[2]) == pytest.approx(math.cos(turn), abs=1e-9)
    assert math.sin(moved[2]) == pytest.approx(math.sin(turn), abs=1e-9)


def test_a_particle_moves_in_its_own_direction():
    particles = at(0.0, 0.0, math.pi / 2.0)
    move_differential(particles, 0.0, np.array([1.0, 0.0, 0.0]), NO_ERROR, np.zeros((1, 3)))
    assert particles[0] == pytest.approx([0.0, 1.0, math.pi / 2.0])


@pytest.mark.parametrize("way", [2.0, -2.0])
def test_errors_of_a_way_grow_with_it_forwards_and_backwards_alike(way):
    # alpha3 0.25: the way is off by sqrt(0.25 * 2^2) = 1 m of spread, so by a metre at one sigma.
    particles = at(0.0, 0.0, 0.0)
    alphas = np.array([0.0, 0.0, 0.25, 0.0, 0.0])
    move_differential(
        particles, 0.0, np.array([way, 0.0, 0.0]), alphas, np.array([[0.0, -1.0, 0.0]])
    )
    assert abs(particles[0, 0]) == pytest.approx(3.0)
    # alpha2 0.04: each turn is off by sqrt(0.04 * 2^2) = 0.4 rad, there and back to the same side.
    particles = at(0.0, 0.0, 0.0)
    alphas = np.array([0.0, 0.04, 0.0, 0.0, 0.0])
    move_differential(
        particles, 0.0, np.array([way, 0.0, 0.0]), alphas, np.array([[-1.0, 0.0, -1.0]])
    )
    assert math.remainder(particles[0, 2], 2.0 * math.pi) == pytest.approx(0.8)


def test_turning_on_the_spot_is_off_by_the_turn():
    # alpha1 0.01: sqrt(0.01) = 0.1 of the turn.
    particles = at(0.0, 0.0, 0.0)
    alphas = np.array([0.01, 0.0, 0.0, 0.0, 0.0])
    delta = np.array([0.001, 0.0, 1.0])
    move_differential(particles, 0.0, delta, alphas, np.array([[1.0, 0.0, -1.0]]))
    assert particles[0, 2] == pytest.approx(1.1)


def test_an_omnidirectional_base_errs_sideways():
    particles = at(0.0, 0.0, 0.0)
    alphas = np.array([0.0, 0.0, 0.0, 0.0, 0.25])
    move_omnidirectional(
        particles, 0.0, np.array([2.0, 0.0, 0.0]), alphas, np.array([[0.0, 0.0, 1.0]])
    )
    assert particles[0] == pytest.approx([2.0, -1.0, 0.0])


def test_about_so_many_beams_count_and_only_hits():
    # 360 // 59 = 6: every sixth of 361, so 61, less the one that hit nothing and the near one.
    ranges = np.full(361, 5.0, dtype=np.float32)
    ranges[0], ranges[6], ranges[7] = np.inf, 0.05, np.nan
    points = hit_points(
        ranges,
        np.linspace(-math.pi, math.pi, 361),
        np.array([0.4, 0.0, 0.0]),
        max_beams=60,
        range_min=0.1,
        range_max=10.0,
    )
    assert points.shape == (59, 2)
    assert np.hypot(points[:, 0] - 0.4, points[:, 1]) == pytest.approx(np.full(59, 5.0))


def test_a_cell_reaches_half_a_cell_to_either_side_of_its_corner():
    # As in nav2_amcl: cell (0, 2) of a grid from x = 0 with cells of 1 m is [1.5, 2.5).
    field = np.zeros((1, 4))
    field[0, 2] = 0.5
    for hit_x, likelihood in ((1.49, 1.0), (1.51, 1.5), (2.49, 1.5), (2.51, 1.0)):
        weights = np.array([0.25])
        total = weigh(
            at(0.0, 0.0, 0.0), weights, np.array([[hit_x, 0.0]]), field, 0.125, 0.0, 0.0, 1.0
        )
        assert total == weights[0] == pytest.approx(0.25 * likelihood)
    weights = np.ones(1)
    weigh(at(0.0, 0.0, math.pi), weights, np.array([[2.0, 0.0]]), field, 0.125, 0.0, 0.0, 1.0)
    assert weights[0] == pytest.approx(1.125)  # Off the map.


def test_particles_are_drawn_by_their_weights():
    generator = np.random.default_rng(0)
    particles = np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [20.0, 0.0, 0.0]])
    weights = np.array([0.5, 0.0, 0.5])
    drawn = resample(
        particles, weights, generator.random((4000, 2)), 0.0, particles, (0.05, 0.99, 4000, 4000)
    )
    assert len(drawn) == 4000
    assert set(drawn[:, 0]) == {0.0, 20.0}
    assert np.mean(drawn[:, 0] == 0.0) == pytest.approx(0.5, abs=0.03)


def test_it_ends_one_above_what_the_bins_need():
    particles = np.array([[0.1, 0.1, 0.0], [5.1, 0.1, 0.0]])
    draws = np.tile([[0.9, 0.25], [0.9, 0.75]], (50, 1))
    drawn = resample(particles, np.array([0.5, 0.5]), draws, 0.0, particles, LIMITS)
    assert len(drawn) == particle_limit(2, *LIMITS) + 1 == 21


def test_strangers_come_in_by_their_share():
    particles, strangers = np.zeros((1, 3)), np.full((100, 3), 7.0)
    draws = np.zeros((100, 2))
    draws[::4, 0] = 0.9
    drawn = resample(particles, np.ones(1), draws, 0.5, strangers, (0.05, 0.99, 100, 100))
    assert np.mean(drawn[:, 0] == 7.0) == pytest.approx(0.75)


def test_the_heaviest_cluster_is_told_with_its_share():
    here = np.array([[0.1, 0.1, 0.0], [0.6, 0.6, 0.2]])  # Bins that touch at a corner.
    there = np.array([[9.0, 9.0, 1.0]])
    x, y, yaw, share = heaviest_cluster(np.vstack([here, there]), np.array([0.3, 0.3, 0.4]))
    assert (x, y, yaw, share) == pytest.approx((0.35, 0.35, 0.1, 0.6))


def test_headings_on_either_side_of_a_half_turn_do_not_touch():
    particles = np.array([[0.1, 0.1, math.pi - 0.01], [0.1, 0.1, -math.pi + 0.01]])
    *_, share = heaviest_cluster(particles, np.array([0.6, 0.4]))
    assert share == pytest.approx(0.6)


@given(st.integers(0, 2**32 - 1))
def test_clusters_do_not_depend_on_where_the_map_begins(seed):
    generator = np.random.default_rng(seed)
    particles = generator.uniform(-3.0, 3.0, (40, 3))
    weights = generator.random(40)
    moved = heaviest_cluster(particles + np.array([1000.0, -500.0, 0.0]), weights)
    found = heaviest_cluster(particles, weights)
    assert moved - (1000.0, -500.0, 0.0, 0.0) == pytest.approx(found, abs=1e-9)
