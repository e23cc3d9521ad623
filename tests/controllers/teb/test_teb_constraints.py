import math

import numpy as np
import pytest
from teb_bands import make_scene, numeric_jacobian, random_band, round_obstacles_field

from drake_navbench.controllers.teb.arcs import arc_ratio, band_geometry
from drake_navbench.controllers.teb.constraints import band_constraints, sparsity_pattern
from drake_navbench.controllers.teb.layout import (
    pack_band,
    row_count,
    row_slices,
    unpack_poses,
    variable_count,
)

KINDS = ["arc", "speed", "turn_rate", "acceleration", "angular_acceleration", "clearance"]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(5))
def test_jacobian_of_every_row_kind_agrees_with_finite_differences(kind, seed):
    rng = np.random.default_rng(seed)
    count = int(rng.integers(3, 9))
    z, scene = random_band(rng, count)
    rows = row_slices(count, len(scene.discs))[kind]
    _, jacobian = band_constraints(z, count, scene)
    numeric = numeric_jacobian(lambda z: band_constraints(z, count, scene)[0], z)
    scale = np.maximum(1.0, np.abs(numeric[rows]))
    assert np.max(np.abs(jacobian[rows] - numeric[rows]) / scale) < 1e-6


@pytest.mark.parametrize("count", [3, 4, 9])
def test_declared_sparsity_holds_every_nonzero_of_the_numeric_jacobian(count):
    declared = np.zeros((row_count(count, 2), variable_count(count)), dtype=bool)
    declared[tuple(np.array(sparsity_pattern(count, 2)).T)] = True
    seen = np.zeros_like(declared)
    for seed in range(10):
        z, scene = random_band(np.random.default_rng(seed), count)
        seen |= numeric_jacobian(lambda z, s=scene: band_constraints(z, count, s)[0], z) != 0.0
    assert not np.any(seen & ~declared)
    # Nothing is declared in vain either, but for the slopes of a flat distance field.
    clearance = row_slices(count, 2)["clearance"]
    np.testing.assert_array_equal(
        np.delete(seen, np.r_[clearance], axis=0), np.delete(declared, np.r_[clearance], axis=0)
    )


def test_declared_pairs_are_unique():
    pairs = sparsity_pattern(6, 2)
    assert len(pairs) == len(np.unique(pairs, axis=0))


@pytest.mark.parametrize("is_car", [False, True])
@pytest.mark.parametrize("meets_moving", [False, True])
def test_declared_pairs_come_row_by_row_with_ascending_columns(is_car, meets_moving):
    pairs = sparsity_pattern(6, 2, is_car, meets_moving)
    np.testing.assert_array_equal(pairs, sorted(pairs.tolist()))
    assert pairs[-1, 0] == row_count(6, 2, is_car, meets_moving) - 1


def test_rows_of_a_straight_run_are_the_quantities_they_are_named_after():
    # Poses at x = 0, 0.1, 0.3, 0.3 m in steps of 0.5 s: speeds 0.2, 0.4, 0 m/s.
    poses = np.zeros((4, 3))
    poses[:, 0] = [0.0, 0.1, 0.3, 0.3]
    scene = make_scene(poses[0], poses[-1], start_twist=(0.1, 0.0))
    values, _ = band_constraints(pack_band(poses, np.full(3, 0.5), 0.0), 3, scene)
    rows = row_slices(3, 2)
    np.testing.assert_allclose(values[rows["arc"]], 0.0, atol=1e-15)
    np.testing.assert_allclose(values[rows["speed"]], [0.2, 0.4, 0.0], atol=1e-15)
    # From 0.1 m/s in half a step, between middles in a whole one, to rest in half a step:
    # 0.1/0.25, 0.2/0.5, -0.4/0.5, 0/0.25.
    np.testing.assert_allclose(values[rows["acceleration"]], [0.4, 0.4, -0.8, 0.0], atol=1e-14)
    np.testing.assert_allclose(values[rows["turn_rate"]], 0.0)
    np.testing.assert_allclose(values[rows["angular_acceleration"]], 0.0)


def test_clearance_row_is_the_distance_of_the_disc_plus_the_slack():
    # Obstacle of radius 0.2 at (1.05, 1): the rear disc of a pose at (1, 0) stands at (1.05, 0),
    # 1 - 0.2 - 0.3 = 0.5 m away; the front disc 0.5 m ahead: hypot(0.5, 1) - 0.5 = 0.6180 m.
    poses = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.5, 0.0, 0.0]])
    scene = make_scene(poses[0], poses[-1], field=round_obstacles_field([(1.05, 1.0, 0.2)]))
    values, _ = band_constraints(pack_band(poses, np.ones(3), 0.07), 3, scene)
    rear, front = values[row_slices(3, 2)["clearance"]][:2]
    assert rear == pytest.approx(0.5 + 0.07, abs=1e-3)
    assert front == pytest.approx(math.hypot(0.5, 1.0) - 0.5 + 0.07, abs=1e-3)


def test_quarter_circle_has_no_offset_and_the_length_of_its_arc():
    poses = np.array([[0.0, 0.0, 0.0], [1.0, 1.0, 0.5 * math.pi]])
    lengths, offsets, turns, _, _ = band_geometry(poses)
    assert lengths[0] == pytest.approx(0.5 * math.pi)
    assert offsets[0] == pytest.approx(0.0, abs=1e-15)
    assert turns[0] == pytest.approx(0.5 * math.pi)


def test_backward_motion_has_negative_length():
    poses = np.array([[0.0, 0.0, 0.0], [-0.5, 0.0, 0.0]])
    assert band_geometry(poses)[0][0] == pytest.approx(-0.5)


@pytest.mark.parametrize("delta", [1e-3, -1e-3])
def test_arc_ratio_is_continuous_where_its_series_ends(delta):
    inside, outside = arc_ratio(delta * (1.0 - 1e-9)), arc_ratio(delta * (1.0 + 1e-9))
    # The quotient loses about 1e-10 to cancellation here; the series does not.
    np.testing.assert_allclose(inside, outside, rtol=1e-8, atol=1e-10)


def test_packing_and_unpacking_a_band_are_inverse():
    rng = np.random.default_rng(7)
    poses = rng.uniform(-1.0, 1.0, (6, 3))
    z = pack_band(poses, np.full(5, 0.3), 0.0)
    assert len(z) == variable_count(5)
    np.testing.assert_array_equal(unpack_poses(z, poses[0], poses[-1], 5), poses)
