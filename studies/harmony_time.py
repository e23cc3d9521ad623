"""The time that `harmony` loses to `teb` in S-curves, by part.

`python studies/harmony_time.py FIRST LAST` drives the worlds of these numbers once by each, and
prints the mean time, way and parts of the lost time (docs/harmony.md).
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

import pandas as pd
from harmony_comparison import COLUMNS
from harmony_families import write_world
from harmony_judgement import OURS, markdown

from drake_navbench import TrialLog, run_trial
from drake_navbench.analysis.metrics.efficiency import driven_length_m
from drake_navbench.analysis.metrics.signals import column, times
from drake_navbench.analysis.metrics.tracking import cross_track_error_mean_m
from drake_navbench.kernels.arrays import Array

RIVAL, SEED, TOP_MPS = "teb", 1000, 0.5
# The start is the first START_S of a trial, the goal its last GOAL_S.
START_S, GOAL_S = 2.5, 2.0


def parts_of(time_s: Array, speed_mps: Array) -> dict[str, float]:
    """Returns the time, s, that a drive loses to one at TOP_MPS, by part.

    time_s, speed_mps: (N,) from the start to the end. With the time for the way at TOP_MPS the
    parts sum up to the whole time.
    """
    steps_s, at_s = time_s[1:] - time_s[:-1], time_s[:-1] - time_s[0]
    lost_s = steps_s * (1.0 - 0.5 * (speed_mps[1:] + speed_mps[:-1]) / TOP_MPS)
    is_start, is_goal = at_s < START_S, at_s >= time_s[-1] - time_s[0] - GOAL_S
    return {
        "start [s]": float(lost_s[is_start].sum()),
        "between [s]": float(lost_s[~is_start & ~is_goal].sum()),
        "goal [s]": float(lost_s[is_goal & ~is_start].sum()),
    }


def drive_of(path: Path, name: str) -> dict[str, float]:
    """Returns the time of a drive, the way, the time for this way at TOP_MPS, and `parts_of`."""
    log: TrialLog = run_trial(str(path), COLUMNS[name], seed=SEED)
    time_s, way_m = times(log), driven_length_m(log)
    return {
        "time [s]": float(time_s[-1] - time_s[0]),
        "way [m]": way_m,
        "path error [m]": cross_track_error_mean_m(log),
        "way [s]": way_m / TOP_MPS,
        **parts_of(time_s, column(log, "v_mps")),
    }


def main() -> None:
    """Drives the worlds and prints the means of both, and the difference."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("first", type=int)
    parser.add_argument("last", type=int)
    arguments = parser.parse_args()
    if not 0 <= arguments.first <= arguments.last:
        parser.error(
            f"LAST: got {arguments.last}, expected at least FIRST ({arguments.first} >= 0)"
        )
    means = {}
    with tempfile.TemporaryDirectory() as folder:
        numbers = range(arguments.first, arguments.last + 1)
        paths = [write_world(Path(folder), "s_curve", number) for number in numbers]
        for name in (OURS, RIVAL):
            means[name] = pd.DataFrame([drive_of(path, name) for path in paths]).mean()
    means["difference"] = means[OURS] - means[RIVAL]
    print(markdown(pd.DataFrame(means).T.reset_index(names="column")))


if __name__ == "__main__":
    main()
