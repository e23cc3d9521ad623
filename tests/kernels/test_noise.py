"""Random numbers depend on their key and on nothing else."""

import numpy as np

from drake_navbench.kernels.noise import NoiseKey, NoiseStream


def draw(key: NoiseKey) -> np.ndarray:
    return key.generator().standard_normal(4)


def test_equal_keys_give_equal_numbers():
    key = NoiseKey(7, NoiseStream.LIDAR, 3)
    np.testing.assert_array_equal(draw(key), draw(NoiseKey(7, NoiseStream.LIDAR, 3)))


def test_seed_stream_and_step_each_change_the_numbers():
    base = NoiseKey(7, NoiseStream.LIDAR, 3)
    for other in (
        base._replace(seed=8),
        base._replace(stream=NoiseStream.LOCALIZATION),
        base._replace(step=4),
    ):
        assert not np.array_equal(draw(base), draw(other))


def test_a_known_key_gives_the_same_numbers_on_every_machine():
    # Philox is specified bit for bit, so this value may never change.
    value = NoiseKey(1, 2, 3).generator().integers(1_000_000)
    assert value == 782_180


def test_seed_stream_and_step_are_the_words_of_the_generators_key():
    seed, stream, step = 2**63 + 5, 3, 2**32 - 1
    expected = np.random.Philox(key=[seed, stream + step * 2**32])
    np.testing.assert_array_equal(
        draw(NoiseKey(seed, stream, step)), np.random.Generator(expected).standard_normal(4)
    )
