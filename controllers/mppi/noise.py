"""Gaussian noise as a pure function of a key: the same on every machine and in every process.

64 xoshiro128++ generators (Blackman and Vigna, "Scrambled linear pseudorandom number generators",
ACM TOMS 47, 2021) run side by side, one a lane, seeded through numpy's SeedSequence; pairs of
uniforms become pairs of normals by Box and Muller's transform. Everything is 32-bit and free of
branches, so the compiler vectorises it: about 1 ns a number, where numpy's ziggurat takes 4.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numba.extending import register_jitable

from drake_navbench.controllers.mppi.float32_math import F32, HALF, ONE, TWO, TWO_PI, ZERO, sin_cos
from drake_navbench.controllers.mppi.lanes import LANES, Lanes, block_count

_STATE_WORDS = 4
_ROTATION_OUTPUT = np.uint32(7)
_ROTATION_STATE = np.uint32(11)
_SHIFT_STATE = np.uint32(9)
_WORD_BITS = np.uint32(32)
# 24 bits fill a float32 mantissa, so that the conversion to [0, 1) is exact.
_DROPPED_BITS = np.uint32(8)
_TO_UNIT = F32(2.0**-24)
_HALF_STEP = F32(2.0**-25)

_MANTISSA_BITS = np.uint32(23)
_MANTISSA_MASK = np.uint32(0x007FFFFF)
_EXPONENT_OF_ONE = np.uint32(0x3F800000)
_EXPONENT_BIAS = np.int32(127)
_SQRT_2 = F32(math.sqrt(2.0))
_LN_2 = F32(math.log(2.0))
_THIRD, _FIFTH, _SEVENTH, _NINTH = F32(1 / 3), F32(1 / 5), F32(1 / 7), F32(1 / 9)


def fill_normal(key: tuple[int, ...], deviation: float, blocks: Lanes) -> None:
    """Fills `blocks` (blocks, N, LANES) with normals N(0, deviation^2) that depend on `key` alone.

    key: seed, then any number of non-negative words that name the draw (stream, cycle, axis...).
    """
    seed, *names = key
    sequence = np.random.SeedSequence(seed, spawn_key=tuple(names))
    state = sequence.generate_state(_STATE_WORDS * LANES).reshape(_STATE_WORDS, LANES)
    _fill(state, F32(deviation), blocks)


@register_jitable
def _rotate(word, count):
    return np.uint32((word << count) | (word >> (_WORD_BITS - count)))


@register_jitable(forceinline=True)
def _uniform_row(state, row):
    """Advances every lane's xoshiro128++ by one and writes uniforms in (0, 1).

    Numba widens 32-bit integer arithmetic to 64 bits; the casts bring it back.
    """
    for lane in range(LANES):
        s0, s1, s2, s3 = state[0, lane], state[1, lane], state[2, lane], state[3, lane]
        output = np.uint32(_rotate(np.uint32(s0 + s3), _ROTATION_OUTPUT) + s0)
        shifted = np.uint32(s1 << _SHIFT_STATE)
        s2 = np.uint32(s2 ^ s0)
        s3 = np.uint32(s3 ^ s1)
        state[1, lane] = np.uint32(s1 ^ s2)
        state[0, lane] = np.uint32(s0 ^ s3)
        state[2, lane] = np.uint32(s2 ^ shifted)
        state[3, lane] = _rotate(s3, _ROTATION_STATE)
        row[lane] = F32(np.int32(np.uint32(output >> _DROPPED_BITS))) * _TO_UNIT + _HALF_STEP


@register_jitable(forceinline=True)
def _split_row(bits, exponents):
    """Takes positive normal floats apart: leaves the bits of m in [1, 2), writes e of 2^e m."""
    for lane in range(LANES):
        word = bits[lane]
        exponents[lane] = F32(np.int32(np.uint32(word >> _MANTISSA_BITS)) - _EXPONENT_BIAS)
        bits[lane] = np.uint32((word & _MANTISSA_MASK) | _EXPONENT_OF_ONE)


@register_jitable(error_model="numpy", forceinline=True)
def _log_row(mantissas, exponents, logarithms):
    """Writes ln(2^e m) = e ln 2 + 2 atanh((m - 1) / (m + 1)), m moved to [sqrt(1/2), sqrt(2))."""
    for lane in range(LANES):
        m = mantissas[lane]
        large = m > _SQRT_2
        m = m * HALF if large else m
        exponent = exponents[lane] + (ONE if large else ZERO)
        s = (m - ONE) / (m + ONE)
        s2 = s * s
        series = ONE + s2 * (_THIRD + s2 * (_FIFTH + s2 * (_SEVENTH + s2 * _NINTH)))
        logarithms[lane] = exponent * _LN_2 + TWO * s * series


@njit(cache=True)
def _fill(state, deviation, blocks):
    rows = blocks.reshape(-1, LANES)
    uniform = np.empty(LANES, np.float32)
    uniform_bits = uniform.view(np.uint32)
    exponents = np.empty(LANES, np.float32)
    logarithms = np.empty(LANES, np.float32)
    turn = np.empty(LANES, np.float32)
    spare = np.empty(LANES, np.float32)
    row_count = rows.shape[0]
    for first in range(0, row_count, 2):
        _uniform_row(state, uniform)
        _split_row(uniform_bits, exponents)
        _log_row(uniform, exponents, logarithms)
        _uniform_row(state, turn)
        even = rows[first]
        odd = rows[first + 1] if first + 1 < row_count else spare
        _box_muller_row(logarithms, turn, deviation, even, odd)


@register_jitable(forceinline=True)
def _box_muller_row(logarithms, turn, deviation, even, odd):
    for lane in range(LANES):
        length = deviation * np.sqrt(max(-TWO * logarithms[lane], ZERO))
        sine, cosine = sin_cos(TWO_PI * turn[lane])
        even[lane] = length * cosine
        odd[lane] = length * sine


class Noise(NamedTuple):
    """Control noise of a batch: vx, vy m/s and wz rad/s, each (blocks, N, LANES).

    vy has no blocks unless the motion model is omnidirectional.
    """

    vx: Lanes
    vy: Lanes
    wz: Lanes

    @classmethod
    def empty(cls, batch_size: int, steps: int, *, holonomic: bool) -> Noise:
        """Allocates zeros for a batch."""
        blocks = block_count(batch_size)
        shapes = ((blocks, steps, LANES), (blocks if holonomic else 0, steps, LANES))
        return cls(*(np.zeros(shapes[k], np.float32) for k in (0, 1, 0)))

    def draw(self, key: tuple[int, ...], deviations: tuple[float, float, float]) -> None:
        """Fills the arrays with noise of the given deviations that depends on `key` alone."""
        for axis, (blocks, deviation) in enumerate(zip(self, deviations, strict=True)):
            if blocks.size:
                fill_normal((*key, axis), deviation, blocks)
