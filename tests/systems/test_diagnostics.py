"""Of a controller's diagnostics, arrays are kept now and then, and thinned."""

import numpy as np

from drake_navbench.trial.systems.diagnostics import (
    MAX_TRAJECTORY_POSES,
    with_thinned_arrays,
    without_arrays,
)
from drake_navbench.trial.systems.recorder import Recording


def test_numbers_text_and_flags_stay_and_arrays_go():
    diagnostics = {"lookahead": 0.6, "branch": "track", "ok": True, "carrot": np.zeros(2)}
    assert without_arrays(diagnostics) == {"lookahead": 0.6, "branch": "track", "ok": True}


def test_a_long_trajectory_keeps_its_ends_and_a_few_poses():
    sampled = np.arange(2 * 70 * 3, dtype=float).reshape(2, 70, 3)
    kept = with_thinned_arrays({"sampled_trajectories": sampled})["sampled_trajectories"]
    assert kept.shape == (2, MAX_TRAJECTORY_POSES, 3)
    np.testing.assert_array_equal(kept[:, [0, -1]], sampled[:, [0, -1]])


def test_what_is_kept_is_a_copy():
    costs = np.array([1, 2])
    kept = with_thinned_arrays({"costs": costs})["costs"]
    costs[0] = 9
    assert kept[0] == 1


def test_arrays_are_kept_every_fifth_of_a_second_and_numbers_every_cycle():
    recording = Recording()
    for cycle in range(1, 9):
        recording.note(0.05 * cycle, cycle, {"cost": cycle, "carrot": np.zeros(2)})
    assert [d["cost"] for _, d in recording.diagnostics] == list(range(1, 9))
    assert [t for t, d in recording.diagnostics if "carrot" in d] == [0.05, 0.25]


def test_a_cycle_seen_twice_is_noted_once():
    recording = Recording()
    recording.note(0.02, 1, {"cost": 1.0})
    recording.note(0.04, 1, {"cost": 1.0})
    assert len(recording.diagnostics) == 1
