"""harmony learns its base's response; until then its prediction has a larger error bound."""

from __future__ import annotations

import numpy as np
import pytest

from drake_navbench.controllers.harmony.base_response import Response, follow
from drake_navbench.controllers.harmony.learning import (
    candidates_of,
    learnt,
    possible_bases,
    prediction_error,
    way_to_rest,
)
from drake_navbench.controllers.harmony.prediction import with_command

TOLD = Response(0.1, 2.5, 3.0)
CANDIDATES = candidates_of(TOLD, 0.3)


def possible_after(base, commands, *, latency_s=0.0, noise_mps=0.0):
    """Returns the possible bases after commands of 0.05 s each and the speeds measured then."""
    random, state = np.random.default_rng(0), np.zeros(5)
    sent, found = None, None
    for cycle, command in enumerate(commands):
        twist = state[3:] + noise_mps * random.standard_normal(2)
        found = learnt(
            found, CANDIDATES, sent, twist=twist, time_s=0.05 * cycle, latency_s=latency_s
        )
        sent = with_command(sent, twist, 0.05 * cycle, np.array([command, 0.0]))
        late = max(cycle - round(latency_s / 0.05), -1)
        for _ in range(5):
            follow(base, state, commands[late] if late >= 0 else 0.0, 0.0, 0.01)
    return possible_bases(found, CANDIDATES)


def test_a_base_that_has_not_moved_may_be_any_candidate():
    # 13 time constants times 3 accelerations; the first is what the robot's file says.
    assert len(CANDIDATES) == 39
    possible = possible_after(TOLD, [0.0] * 20)
    assert len(possible) == 39
    np.testing.assert_allclose(possible[0], [0.1, 2.5, 3.0])
    np.testing.assert_allclose(possible.min(axis=0), [0.07, 1.75, 2.1])
    np.testing.assert_allclose(possible.max(axis=0), [0.13, 3.25, 3.9])


@pytest.mark.parametrize("latency_s", [0.0, 0.1])
@pytest.mark.parametrize("ratio", [0.7, 0.85, 1.0, 1.3])
def test_the_time_constant_is_learnt_from_one_start(ratio, latency_s):
    base = TOLD._replace(time_constant_s=0.1 * ratio)
    # To 0.5 m/s within a second.
    commands = np.minimum(0.5, 0.025 * np.arange(1, 31))
    possible = possible_after(base, commands, latency_s=latency_s)
    assert possible[0, 0] == pytest.approx(0.1 * ratio)
    assert np.ptp(possible[:, 0]) <= 0.0101
    # No acceleration was at its limit: all are possible still.
    assert set(np.round(possible[:, 1], 2)) == {1.75, 2.5, 3.25}


def test_weak_brakes_are_learnt_where_they_are_used():
    weak = Response(0.1, 1.75, 2.1)
    commands = np.concatenate([np.minimum(0.5, 0.025 * np.arange(1, 31)), np.zeros(10)])
    possible = possible_after(weak, commands)
    np.testing.assert_allclose(possible, [[0.1, 1.75, 2.1]])


def test_noise_leaves_more_possible_and_not_the_wrong_one():
    slow = TOLD._replace(time_constant_s=0.12)
    commands = np.tile(np.repeat([0.0, 0.3], 20), 5)
    quiet, noisy = (possible_after(slow, commands, noise_mps=n)[:, 0] for n in (0.0, 0.02))
    assert np.ptp(noisy) > np.ptp(quiet)
    assert noisy.min() <= 0.12 + 1e-9
    assert noisy.max() >= 0.12 - 1e-9


def test_a_known_base_is_not_learnt():
    np.testing.assert_allclose(candidates_of(TOLD, 0.0), [[0.1, 2.5, 3.0]])
    assert prediction_error(candidates_of(TOLD, 0.0), np.array([[0.5, 1.0]]), 0.9) == 0.0
    # A base without a limit of its acceleration is one of numbers, too.
    assert np.isfinite(candidates_of(Response(0.1, np.inf, np.inf), 0.3)).all()


def test_the_way_to_rest_is_the_one_driven():
    bases = np.array([[0.1, 2.5, 3.0], [0.1, 1.75, 2.1]])
    # 0.25 m/s is where 2.5 m/s^2 ends: (0.5^2 - 0.25^2) / 5 m, then 0.25 * 0.1 m.
    speeds = np.array([0.5, 0.2])
    np.testing.assert_allclose(way_to_rest(bases, 1, speeds)[0], [0.0375 + 0.025, 0.02])
    for base, way_m in zip(bases, way_to_rest(bases, 1, speeds)[:, 0], strict=True):
        state = np.array([0.0, 0.0, 0.0, 0.5, 0.0])
        for _ in range(400):
            follow(Response(*base), state, 0.0, 0.0, 0.01)
        assert state[0] == pytest.approx(way_m, abs=2e-3)


def test_the_error_is_the_way_driven_in_that_of_the_time_constant_or_of_the_brakes():
    slower = np.array([[0.1, 2.5, 3.0], [0.13, 2.5, 3.0]])
    velocities = np.array([[0.2, 0.0], [0.2, 0.5], [0.0, 0.0]])
    expected = [0.03 * 0.2, 0.03 * (0.2 + 0.9 * 0.5), 0.0]
    np.testing.assert_allclose(prediction_error(slower, velocities, 0.9), expected)
    weaker = np.array([[0.1, 2.5, 3.0], [0.1, 1.75, 2.1]])
    # Rest after 0.25 / 3.5 + 0.00875 m in place of 0.0625 m.
    fast = np.array([[0.5, 0.0]])
    assert prediction_error(weaker, fast, 0.9) == pytest.approx(0.25 / 3.5 + 0.00875 - 0.0625)
