"""What must hold in every log is checked, and what does not hold is counted, never a crash."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from results_folders import measured_folder, report_html
from synthetic_logs import FOOTPRINT, log_times, make_log

from drake_navbench.analysis.invariants import Violation, violations_of, warnings_of
from drake_navbench.analysis.trial_rows import trial_row
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.results import ResultsFolder

DRIVE = {
    "max_linear_velocity_mps": 0.5,
    "min_linear_velocity_mps": -0.2,
    "max_angular_velocity_radps": 2.0,
    "max_linear_acceleration_mps2": 2.5,
    "max_angular_acceleration_radps2": 3.0,
}
WALL_X_M = 3.0
FRONT_M = 0.85


def sample_times(time_s: np.ndarray) -> np.ndarray:
    """Returns when the clearance in each row was sampled: every 0.05 s, seen from the row after."""
    return np.maximum(0.05 * np.floor((time_s - 1e-9) / 0.05), 0.0)


def drive_towards_a_wall(end_time_s: float = 4.0, **changes) -> TrialLog:
    """Returns a drive along x at 0.5 m/s, with the clearance sampled every 0.05 s and held.

    changes: column -> (row, value), planted; info: entries of the log's info.
    """
    time_s = log_times(end_time_s)
    speeding_s = 0.2
    v = np.minimum(time_s / speeding_s, 1.0) * 0.5
    x = 0.5 * np.minimum(time_s, speeding_s) ** 2 / (2.0 * speeding_s)
    x += 0.5 * np.maximum(time_s - speeding_s, 0.0)
    columns = {
        "x_m": x,
        "v_mps": v,
        "command_v_mps": np.full_like(time_s, 0.5),
        "clearance_m": WALL_X_M - FRONT_M - np.interp(sample_times(time_s), time_s, x),
    }
    info = changes.pop("info", {})
    for name, (row, value) in changes.items():
        columns.setdefault(name, np.zeros_like(time_s))[row] = value
    log = make_log(time_s, info=info, **columns)
    log.info["robot"]["drive"] = DRIVE
    return log


def test_an_honest_drive_breaks_nothing():
    assert violations_of(drive_towards_a_wall()) == []


@pytest.mark.parametrize(
    ("changes", "kind", "count", "first_s"),
    [
        ({"command_v_mps": (slice(100, 103), 0.51)}, "command beyond", 3, 2.0),
        ({"command_v_mps": (100, -0.21)}, "command beyond", 1, 2.0),
        ({"command_w_radps": (100, -2.1)}, "command beyond", 1, 2.0),
        ({"command_w_radps": (100, np.nan)}, "command beyond", 1, 2.0),
        # The last row within 50 ms of the end is at 3.04 s.
        ({"info": {"end_time_s": 3.0}}, "motion after the end", 48, 3.06),
        # Away by more than the 0.5 m/s of the outline take in 0.07 s, and back.
        ({"clearance_m": (100, 1.0)}, "clearance jumps", 2, 2.0),
        ({"clearance_m": (slice(100, None), np.inf)}, "clearance jumps", 1, 2.0),
        ({"clearance_m": (100, np.nan)}, "clearance jumps", 2, 2.0),
        ({"x_m": (slice(100, None), 2.0)}, "kinetic energy", 1, 2.0),
        ({"yaw_rad": (slice(100, None), 0.1)}, "kinetic energy", 1, 2.0),
        ({"v_mps": (100, 0.6)}, "kinetic energy", 1, 2.0),
        # From 0.05 to 0.45 m/s in 20 ms; 2.5 m/s^2 allow 0.05 m/s. Back again is braking.
        ({"v_mps": (1, 0.45)}, "kinetic energy", 1, 0.02),
    ],
)
def test_a_planted_violation_is_counted_with_its_time(changes, kind, count, first_s):
    (found,) = violations_of(drive_towards_a_wall(**changes))
    assert found.kind.startswith(kind)
    assert found.row_count == count
    assert found.first_s == pytest.approx(first_s)


@pytest.mark.parametrize("planted_s", [0.98, 0.5, np.nan])
def test_a_time_that_is_not_later_than_the_last_is_counted(planted_s):
    time_s = log_times(2.0)
    time_s[50] = planted_s
    found = violations_of(make_log(time_s))
    assert found[0].kind == "time stands still"
    assert found[0].first_s == pytest.approx(planted_s, nan_ok=True)


def test_standing_after_the_end_is_no_motion():
    time_s = log_times(5.0)
    log = make_log(time_s, info={"end_time_s": 1.0})
    assert violations_of(log) == []


def test_a_clearance_may_shrink_as_fast_as_a_corner_turns_and_no_faster():
    time_s = log_times(2.0)
    corner_m = float(np.hypot(*FOOTPRINT[0]))
    for share, expected in ((1.0, []), (1.8, ["clearance jumps"])):
        clearance_m = 4.0 - share * corner_m * sample_times(time_s)
        log = make_log(time_s, w_radps=1.0, yaw_rad=time_s, clearance_m=clearance_m)
        assert [violation.kind for violation in violations_of(log)] == expected


def test_without_limits_on_the_acceleration_a_jump_of_the_speed_is_believed():
    log = drive_towards_a_wall(v_mps=(1, 0.45))
    log.info["robot"]["drive"] = DRIVE | {"max_linear_acceleration_mps2": None}
    assert violations_of(log) == []


def test_a_trial_that_never_ran_breaks_nothing():
    log = drive_towards_a_wall()
    assert violations_of(replace(log, samples=log.samples.iloc[:0])) == []


def test_the_warnings_are_a_line_a_kind():
    jump, command = Violation("clearance jumps", 2, 1.0), Violation("command", 1, 0.5)
    lines = warnings_of(
        [("a, rpp, trial 0", [command]), ("b, rpp, trial 1", [command, jump]), ("c", [])]
    )
    assert lines == [
        "command: 2 rows in 2 trials; first in a, rpp, trial 0, at 0.50 s",
        "clearance jumps: 2 rows in 1 trial; first in b, rpp, trial 1, at 1.00 s",
    ]


def test_the_table_of_trials_counts_violations():
    assert trial_row(drive_towards_a_wall())["violations"] == 0
    assert trial_row(drive_towards_a_wall(clearance_m=(100, 1.0)))["violations"] == 2


def test_the_report_warns_of_a_violation(tmp_path):
    folder = ResultsFolder(measured_folder(tmp_path / "campaign", slower=2.0))
    assert 'id="warnings"' not in report_html(folder.path)
    log = TrialLog.read(folder.log_path("empty", "rpp", 1))
    log.samples.loc[3, "command_w_radps"] = 9.0
    log.info["robot"]["drive"] = DRIVE
    folder.write_log(log)
    page = report_html(folder.path)
    assert 'id="warnings"' in page
    assert (
        "command beyond the limits of the drive: 1 row in 1 trial; "
        "first in empty, rpp, trial 1, at 0.06 s" in page
    )


def test_a_robot_that_moves_sideways_is_held_to_its_own_limits():
    time_s = log_times(4.0)
    drive = DRIVE | {"max_lateral_velocity_mps": 0.3, "max_lateral_acceleration_mps2": 2.5}
    columns = {"vy_mps": 0.2, "y_m": 0.2 * time_s, "command_vy_mps": 0.2}
    log = make_log(time_s, **columns)
    log.info["robot"]["drive"] = drive
    assert violations_of(log) == []
    log.samples.loc[100, "command_vy_mps"] = -0.31
    (found,) = violations_of(log)
    assert (found.kind, found.row_count) == ("command beyond the limits of the drive", 1)
    wheelchair = make_log(time_s, **columns)
    wheelchair.info["robot"]["drive"] = DRIVE
    assert violations_of(wheelchair)[0].row_count == len(time_s)
