"""The published metrics against numbers worked out by hand."""

from __future__ import annotations

import math
import tracemalloc

import numpy as np
import pytest
from scenes import straight_plan
from synthetic_logs import circle_log, log_times, make_log, straight_log

from drake_navbench.analysis.metrics import Undefined
from drake_navbench.analysis.reproduction import published
from drake_navbench.analysis.reproduction.published import published_metrics, published_samples
from drake_navbench.logs.plans import Plan

PERIOD_S = 0.115


def log_of_samples(v, *, x=None, w=None, outcome="aborted", **columns):
    """Returns a log in which the published sample k sees v[k]: one row a sample, held."""
    count = len(v)
    times = 0.06 + PERIOD_S * np.arange(count)
    time_s = np.concatenate([[0.0], times, [times[-1] + 0.05]])

    def stretched(values):
        return np.concatenate([[values[0]], values, [values[-1]]])

    columns = {name: stretched(np.asarray(c, float)) for name, c in columns.items()}
    return make_log(
        time_s,
        command_v_mps=stretched(np.asarray(v, float)),
        command_w_radps=stretched(np.zeros(count) if w is None else np.asarray(w, float)),
        x_m=stretched(np.zeros(count) if x is None else np.asarray(x, float)),
        outcome=outcome,
        **columns,
    )


def test_samples_start_60_ms_after_the_start_and_end_strictly_before_the_end():
    # 0.06 + 4 * 0.115 = 0.52: at an end time of 0.52 that sample is no longer taken.
    log = straight_log(end_time_s=0.52)
    assert published_samples(log).time_s == pytest.approx([0.06, 0.175, 0.29, 0.405])
    log = straight_log(end_time_s=0.54)
    assert len(published_samples(log).time_s) == 5


def test_samples_count_from_the_start_of_the_task():
    log = straight_log(end_time_s=1.0, info={"start_time_s": 0.02})
    assert published_samples(log).time_s[0] == pytest.approx(0.08)


def test_poses_are_interpolated_and_commands_held():
    time_s = log_times(0.2)
    command = np.where(time_s < 0.17, 0.1, 0.4)
    samples = published_samples(make_log(time_s, x_m=time_s**2, command_v_mps=command))
    # 0.175 lies between the rows at 0.16 and 0.18: 0.0256 + 0.75 * (0.0324 - 0.0256) = 0.0307.
    assert samples.pose[1, 0] == pytest.approx(0.0307)
    assert samples.v_mps[1] == 0.1


def test_a_trial_that_ends_before_the_first_sample_has_no_metrics():
    values = published_metrics(straight_log(end_time_s=0.06, outcome="aborted"))
    assert values.pop("success_rate") == 0.0
    assert all(math.isnan(value) for value in values.values())


@pytest.mark.parametrize(
    ("outcome", "expected"), [("succeeded", 100.0), ("aborted", 0.0), ("timed_out", 0.0)]
)
def test_success_rate_of_one_trial_is_all_or_nothing(outcome, expected):
    assert published.success_rate(straight_log(outcome=outcome)) == expected


def test_a_straight_drive_has_the_known_speed_length_time_and_energy():
    log = straight_log(speed_mps=0.5, end_time_s=10.0)
    # (10 - 0.06) / 0.115 = 86.4: samples 0 to 86, so n = 87 and T = 86 * 0.115 = 9.89 s.
    assert published.time_taken(log) == pytest.approx(9.89)
    assert published.path_length(log) == pytest.approx(0.5 * 9.89)
    assert published.avg_linear_speed(log) == pytest.approx(0.5)
    assert published.max_velocity(log) == pytest.approx(100.0)
    # 86 steps of 0.0575 m; dt = 9.89 / 87.
    assert published.energy(log) == pytest.approx(86 * 0.0575**2 / (9.89 / 87))
    assert published.rms_linear_jerk(log) == pytest.approx(0.0)


def test_energy_of_six_samples_is_six_fifths_of_the_integral_of_squared_speed():
    # The publication's own check: energy / (length^2 / time) = n / (n - 1) = 1.2.
    log = log_of_samples([0.5] * 6, x=0.0575 * np.arange(6))
    ratio = published.energy(log) / (published.path_length(log) ** 2 / published.time_taken(log))
    assert ratio == pytest.approx(1.2)


def test_jerk_divides_by_the_duration_over_the_number_of_samples():
    # v = 0, 0, 0.1, 0.3: second differences 0.1 and 0.1; dt = 3 * 0.115 / 4 = 0.08625 s.
    log = log_of_samples([0.0, 0.0, 0.1, 0.3])
    assert published.rms_linear_jerk(log) == pytest.approx(0.1 / 0.08625**2)


def test_jerk_needs_three_samples():
    with pytest.raises(Undefined, match="fewer than 3"):
        published.rms_linear_jerk(log_of_samples([0.1, 0.2]))


def test_centripetal_acceleration_on_a_circle_is_v_times_w():
    log = circle_log(radius_m=2.0, speed_mps=0.4)
    assert published.max_centripetal_acceleration(log) == pytest.approx(0.4 * 0.4 / 2.0)


def test_centripetal_acceleration_leaves_out_slow_turns_tight_radii_and_backing():
    # |w| = 0.009 is no turn; r = 0.009 / 1 is too tight; v < 0 gives r < 0; the last one counts.
    log = log_of_samples([0.5, 0.009, -0.4, 0.2], w=[0.009, 1.0, 0.5, -0.5])
    assert published.max_centripetal_acceleration(log) == pytest.approx(0.2 * 0.5)
    assert published.max_centripetal_acceleration(log_of_samples([0.5], w=[0.0])) == 0.0


def test_obstacle_distance_is_over_the_samples_that_see_one():
    corners, centres = [np.inf, 2.0, 1.0, 3.0], [np.inf, 1.9, 0.9, 2.9]
    log = log_of_samples(
        [0.5] * 4, obstacle_corner_distance_m=corners, obstacle_cell_distance_m=centres
    )
    assert published.min_obstacle_distance(log) == 1.0
    # Deviations 0, -1, 1 from the mean 2.
    assert published.std_obstacle_distance(log) == pytest.approx(math.sqrt(2 / 3))


def test_obstacle_distance_without_obstacles_says_why_it_is_empty():
    measured = published.min_obstacle_distance.measure(straight_log())
    assert math.isnan(measured.value)
    assert "no obstacle" in measured.reason


def test_path_error_drops_the_last_four_plan_poses():
    # The robot stands at 0; plan poses at 0, 1, ... 9, of which 0 to 5 count.
    log = make_log(log_times(1.0), plan=straight_plan(9.0, spacing_m=1.0))
    assert published.max_path_error(log) == pytest.approx(5.0)
    assert published.min_path_error(log) == pytest.approx(0.0)
    assert published.avg_path_error(log) == pytest.approx((0 + 1 + 2 + 3 + 4 + 5) / 6)


def test_path_error_of_a_perfect_line_is_a_quarter_of_the_distance_between_samples():
    log = straight_log(plan=straight_plan(4.0, spacing_m=0.001))
    assert published.avg_path_error(log) == pytest.approx(0.0575 / 4, rel=0.02)


def test_path_error_of_a_short_plan_is_undefined():
    with pytest.raises(Undefined, match="4 poses"):
        published.max_path_error(straight_log(plan=straight_plan(0.15)))


def test_heading_error_folds_the_sign_of_the_heading():
    plan = [[0.0, 0.0, -math.radians(30.0)]]
    log = make_log(log_times(1.0), plan=plan, yaw_rad=math.radians(20.0))
    # | |20| - |-30| | = 10, not 50.
    assert published.avg_heading_error(log) == pytest.approx(10.0)


def test_heading_error_wraps_headings_before_it_compares_them():
    log = make_log(log_times(1.0), plan=[[0.0, 0.0, 0.1]], yaw_rad=2.0 * math.pi + 0.1)
    assert published.avg_heading_error(log) == pytest.approx(0.0, abs=1e-9)


def test_plan_errors_are_those_of_the_first_plan_to_the_last_bit():
    plan = straight_plan(5.0, y_m=0.1)
    once = straight_log(plan=plan, outcome="aborted", end_time_s=6.0)
    later = [Plan(float(t), plan[10 * t :]) for t in range(1, 6)]
    again = straight_log(plan=plan, plans=[*once.plans, *later], outcome="aborted", end_time_s=6.0)
    assert published_metrics(again) == published_metrics(once)


def test_plan_errors_of_a_long_trial_take_little_memory():
    """4000 plan poses and 8696 samples: all distances at once would take 280 MB."""
    log = make_log(log_times(1000.0), plan=straight_plan(199.95, spacing_m=0.05))
    tracemalloc.start()
    assert published.max_path_error(log) == pytest.approx(199.75)
    assert published.avg_heading_error_last(log) == 0.0
    peak_bytes = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak_bytes < 100e6


def test_plan_errors_of_a_mission_look_at_the_first_plans_of_all_legs():
    # 0.3 m beside the way to the waypoint, 0.1 m beside the rest.
    plans = [
        Plan(0.0, straight_plan(2.0, y_m=0.3)),
        Plan(2.0, straight_plan(1.0, x_m=1.0, y_m=0.2)),
        Plan(4.0, straight_plan(3.0, x_m=2.0, y_m=0.1), 1),
    ]
    log = straight_log(plans=plans)
    assert published.max_path_error(log) == pytest.approx(0.3, abs=2e-3)
    assert published.min_path_error(log) == pytest.approx(0.1, abs=2e-3)


def test_abort_time_runs_from_the_first_slowest_sample_to_the_last():
    log = log_of_samples([0.5, 0.3, 0.1, 0.2, 0.1, 0.4])
    assert published.abort_time(log) == pytest.approx(3 * PERIOD_S)


def test_abort_time_is_zero_when_the_speed_never_drops():
    assert published.abort_time(log_of_samples([0.5] * 6)) == 0.0


def test_abort_time_has_no_value_where_the_last_sample_is_the_slowest():
    with pytest.raises(Undefined, match="slowest in the last published sample"):
        published.abort_time(log_of_samples([0.5, 0.3, 0.1]))
    # The first of equals counts.
    assert published.abort_time(log_of_samples([0.5, 0.1, 0.1])) == pytest.approx(PERIOD_S)


def test_the_highest_yaw_rate_counts_turns_to_either_side():
    log = log_of_samples([0.5] * 3, w=[0.1, -0.55, 0.3])
    assert published.max_yaw_rate(log) == 0.55


def test_abort_time_of_a_success_is_undefined():
    with pytest.raises(Undefined, match="reached its goal"):
        published.abort_time(straight_log())
