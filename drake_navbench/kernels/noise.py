"""Random numbers as a pure function of (seed, stream, step).

No generator is kept anywhere, so adding a noise source or a controller never shifts the numbers
of another, and a Context can be cloned and replayed.
"""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.random.bit_generator import ISeedSequence
from numpy.typing import DTypeLike


class NoiseStream(IntEnum):
    """The independent sources of randomness in a trial."""

    START_POSE = 1
    LOCALIZATION = 2
    LIDAR = 3
    CONTROLLER = 4
    DRIFT = 5
    FIX = 6
    SCAN_LOSS = 7
    WHEELS = 8
    SCAN_DELAY = 9
    ODOMETRY_DELAY = 10
    COMMAND_DELAY = 11
    STUCK_BEAMS = 13
    PEOPLE = 16
    PARTICLES = 17
    WHEEL_NOISE = 18
    LIFT = 24
    LIFT_LOCALIZATION = 25
    RANGE_SENSORS = 26


# Philox is a counter-based generator with a key of two words: here the seed, and stream with step.
STEP_SHIFT = 32


class NoiseKey(NamedTuple):
    """The key of one step's random numbers: equal keys give equal numbers, on any machine.

    seed: below 2**64. stream, step: below 2**32, none negative.
    """

    seed: int
    stream: int
    step: int

    def generator(self) -> np.random.Generator:
        """Returns a fresh generator that depends on the key alone."""
        words = _PhiloxKey((self.seed, self.stream | self.step << STEP_SHIFT))
        # Philox takes any ISeedSequence; numpy's stubs know only its own class.
        return np.random.Generator(np.random.Philox(words))  # type: ignore[arg-type]


class _PhiloxKey(ISeedSequence):
    """Hands Philox its key as it is.

    Philox(key=...) gives the same generator, but asks the operating system for entropy first, which
    takes several times as long as the rest.
    """

    def __init__(self, words: tuple[int, int]) -> None:
        self._words = words

    # Any two words will do, and a tuple is made sooner than an array.
    def generate_state(  # type: ignore[override]
        self, n_words: int, dtype: DTypeLike = np.uint64
    ) -> tuple[int, int]:
        """Returns the two words of the key, whatever the arguments."""
        return self._words


NO_NOISE = NoiseKey(seed=0, stream=0, step=0)
