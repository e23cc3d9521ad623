"""Adaptive Monte Carlo localization: motion, weights, resampling, the heaviest cluster.

Source: nav2_amcl, whose behaviour this follows, oddities included; see docs/stress.md. Fox,
"KLD-Sampling: Adaptive Particle Filters", NIPS 2001, is where the number of particles comes from;
Thrun, Burgard, Fox, "Probabilistic Robotics", 2005, holds the motion model (5.4), the likelihood
field (6.4) and the recovery by random poses (8.3).

Particles are (N, 3) x m, y m, yaw rad in the map's frame; their yaw is not wrapped.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from drake_navbench.kernels.angles import wrap
from drake_navbench.kernels.arrays import Array

# The size of a histogram's cells, by which the number of particles and the clusters are found.
BIN_M, BIN_RAD = 0.5, math.radians(10.0)
# A motion shorter than this has no direction, m.
LEAST_WAY_M = 0.01
# Bins are packed into one number, with these bits for the heading and for y.
YAW_BITS, Y_BITS = 16, 24
FREE_PLACE = np.int64(np.iinfo(np.int64).min)
# 2^60 over the golden ratio (Knuth, "The Art of Computer Programming" 3, 6.4).
SPREADING_FACTOR = np.int64(0x9E3779B97F4A7C1)


def hit_points(
    ranges: NDArray[np.floating],
    angles: Array,
    mounting: Array,
    *,
    max_beams: int,
    range_min: float,
    range_max: float,
) -> Array:
    """Returns (B, 2) m in the base frame: the hits of a scan that are used, about max_beams.

    ranges (N,) m, angles (N,) rad from the axis of a sensor that is mounted at (3,). Every n-th
    beam counts, n = (N - 1) // (max_beams - 1), if it is above range_min and below range_max.
    """
    step = max((ranges.size - 1) // (max_beams - 1), 1)
    chosen = np.asarray(ranges[::step], dtype=float)
    counts = (chosen > range_min) & (chosen < range_max)
    headings = mounting[2] + angles[::step][counts]
    lengths = chosen[counts]
    return np.column_stack(
        [mounting[0] + lengths * np.cos(headings), mounting[1] + lengths * np.sin(headings)]
    )


@njit(cache=True)
def weigh(particles, weights, points, field, off_map, origin_x, origin_y, resolution):
    """Multiplies weights (N,), in place, by the points' likelihoods; returns the weights' sum.

    points: (B, 2) m in the base frame. field: (rows, columns) the term that a hit in a cell adds to
    the likelihood 1; off_map: the term of a hit beside the map. As in nav2_amcl, a cell reaches
    half a cell to either side of its lower left corner.
    """
    rows, columns = field.shape
    total = 0.0
    for i in range(particles.shape[0]):
        x, y = particles[i, 0], particles[i, 1]
        c, s = math.cos(particles[i, 2]), math.sin(particles[i, 2])
        likelihood = 1.0
        for b in range(points.shape[0]):
            hit_x = x + points[b, 0] * c - points[b, 1] * s
            hit_y = y + points[b, 0] * s + points[b, 1] * c
            column = math.floor((hit_x - origin_x) / resolution + 0.5)
            row = math.floor((hit_y - origin_y) / resolution + 0.5)
            if 0 <= row < rows and 0 <= column < columns:
                likelihood += field[row, column]
            else:
                likelihood += off_map
        weights[i] *= likelihood
        total += weights[i]
    return total


@njit(cache=True)
def _turn_size(angle):
    """Returns the least angle between a turn and none or half a turn, rad."""
    return min(abs(wrap(angle)), abs(wrap(angle - math.pi)))


@njit(cache=True)
def move_differential(particles, yaw_before, delta, alphas, normals):
    """Moves particles, in place, as the odometry moved: turn, way, turn.

    yaw_before: yaw of the odometry before the motion, rad. delta: (3,) motion of the odometry, m,
    m, rad, in its own frame. normals: (N, 3) of standard deviation 1. alphas: (5,), of which four
    count here.
    """
    way = math.hypot(delta[0], delta[1])
    first = 0.0
    if way >= LEAST_WAY_M:
        first = wrap(math.atan2(delta[1], delta[0]) - yaw_before)
    second = wrap(delta[2] - first)
    first_size, second_size = _turn_size(first), _turn_size(second)
    by_way = alphas[1] * way * way
    first_std = math.sqrt(alphas[0] * first_size * first_size + by_way)
    second_std = math.sqrt(alphas[0] * second_size * second_size + by_way)
    way_std = math.sqrt(
        alphas[2] * way * way
        + alphas[3] * first_size * first_size
        + alphas[3] * second_size * second_size
    )
    for i in range(particles.shape[0]):
        turned = wrap(first - first_std * normals[i, 0])
        moved = way - way_std * normals[i, 1]
        heading = particles[i, 2] + turned
        particles[i, 0] += moved * math.cos(heading)
        particles[i, 1] += moved * math.sin(heading)
        particles[i, 2] = heading + wrap(second - second_std * normals[i, 2])


@njit(cache=True)
def move_omnidirectional(particles, yaw_before, delta, alphas, normals):
    """Moves particles, in place, as the odometry of a base moved that can drive sideways.

    Arguments as for `move_differential`.
    """
    way, turn = math.hypot(delta[0], delta[1]), delta[2]
    way_std = math.sqrt(alphas[2] * way * way + alphas[3] * turn * turn)
    turn_std = math.sqrt(alphas[0] * turn * turn + alphas[1] * way * way)
    sideways_std = math.sqrt(alphas[3] * turn * turn + alphas[4] * way * way)
    direction = wrap(math.atan2(delta[1], delta[0]) - yaw_before)
    for i in range(particles.shape[0]):
        c, s = math.cos(direction + particles[i, 2]), math.sin(direction + particles[i, 2])
        along, across = way + way_std * normals[i, 0], sideways_std * normals[i, 2]
        particles[i, 0] += along * c + across * s
        particles[i, 1] += along * s - across * c
        particles[i, 2] += turn + turn_std * normals[i, 1]


@njit(cache=True)
def particle_limit(bin_count, error, quantile, least, most):
    """Returns the number of particles for so many occupied bins; Fox 2001, equation 7."""
    if bin_count <= 1:
        return most
    spread = 2.0 / (9.0 * (bin_count - 1))
    root = 1.0 - spread + math.sqrt(spread) * quantile
    count = math.ceil((bin_count - 1) / (2.0 * error) * root * root * root)
    return int(min(max(count, least), most))


@njit(cache=True)
def _bin_of(pose):
    """Returns the bin of a pose (3,) as one number, in which neighbours differ by known steps."""
    column = math.floor(pose[0] / BIN_M)
    row = math.floor(pose[1] / BIN_M)
    turn = math.floor(pose[2] / BIN_RAD)
    return (np.int64(column) << (Y_BITS + YAW_BITS)) + (np.int64(row) << YAW_BITS) + np.int64(turn)


@njit(cache=True)
def _place_of(bins, key):
    """Returns a key's index in a hash table of 2^n bins, or the index of its free place."""
    mask = bins.size - 1
    # The upper bits of the product depend on all of the key's.
    place = ((key * SPREADING_FACTOR) >> 33) & mask
    while bins[place] != key and bins[place] != FREE_PLACE:
        place = (place + 1) & mask
    return place


@njit(cache=True)
def resample(particles, weights, draws, random_share, strangers, limits):
    """Returns (M, 3) particles drawn by weight (N,), as many as the bins they fill require.

    draws: (most, 2) uniform in [0, 1). Where the first number is below random_share, the next pose
    of strangers (most, 3) is taken; otherwise the second number chooses a particle by weight. One
    particle more than the limit is drawn, as in nav2_amcl. limits: error, quantile, least and most,
    see `particle_limit`.
    """
    most = limits[3]
    sums = np.cumsum(weights)
    drawn = np.empty((most, 3))
    size = 16
    while size < 4 * most:
        size *= 2
    bins = np.full(size, FREE_PLACE)
    bin_count = count = 0
    while count < most:
        if draws[count, 0] < random_share:
            pose = strangers[count]
        else:
            chosen = np.searchsorted(sums, draws[count, 1], side="right")
            pose = particles[min(chosen, particles.shape[0] - 1)]
        # One by one: a row would have numba compile its strings, for an error message.
        for axis in range(3):
            drawn[count, axis] = pose[axis]
        key = _bin_of(drawn[count])
        place = _place_of(bins, key)
        if bins[place] != key:
            bins[place] = key
            bin_count += 1
        count += 1
        if count > particle_limit(bin_count, *limits):
            break
    return drawn[:count].copy()


@njit(cache=True)
def _root(parents, label):
    while parents[label] != label:
        parents[label] = parents[parents[label]]
        label = parents[label]
    return label


def heaviest_cluster(particles: Array, weights: Array) -> Array:
    """Returns (4,): the mean x m, y m, yaw rad of the heaviest cluster, and its share of all.

    A cluster is a set of bins that touch in the histogram, at corners, too. Headings on either side
    of a half turn do not touch, as in nav2_amcl. Bins are sorted here, as numba would compile a
    sort for them.
    """
    keys = _bins_of(particles)
    return _heaviest(particles, weights, keys, np.unique(keys))


@njit(cache=True)
def _bins_of(particles):
    keys = np.empty(particles.shape[0], dtype=np.int64)
    for i in range(keys.size):
        keys[i] = _bin_of(particles[i])
    return keys


@njit(cache=True)
def _heaviest(particles, weights, keys, bins):
    """Returns (4,): the mean pose of the heaviest cluster, and its share.

    keys: (N,) the bin of each particle. bins: (B,) those of all particles, each once, sorted.
    """
    parents = np.arange(bins.size)
    for place in range(bins.size):
        for step_x in range(-1, 2):
            for step_y in range(-1, 2):
                for step_yaw in range(-1, 2):
                    step = (step_x << (Y_BITS + YAW_BITS)) + (step_y << YAW_BITS) + step_yaw
                    other = np.searchsorted(bins, bins[place] + step)
                    if other < bins.size and bins[other] == bins[place] + step:
                        parents[_root(parents, other)] = _root(parents, place)
    sums = np.zeros((bins.size, 5))
    for i in range(keys.size):
        own = sums[_root(parents, np.searchsorted(bins, keys[i]))]
        own[0] += weights[i]
        own[1] += weights[i] * particles[i, 0]
        own[2] += weights[i] * particles[i, 1]
        own[3] += weights[i] * math.cos(particles[i, 2])
        own[4] += weights[i] * math.sin(particles[i, 2])
    best = np.argmax(sums[:, 0])
    weight, x, y, along, across = sums[best]
    share = weight / weights.sum()
    return np.array([x / weight, y / weight, math.atan2(across, along), share])
