"""Metrics of compute time: one value a control cycle."""

from __future__ import annotations

import numpy as np
import pyarrow.parquet as pq
import pytest
from synthetic_logs import log_times, make_log

from drake_navbench.analysis.metrics import Undefined, compute
from drake_navbench.logs.log import TrialLog


def log_of_cycles(times_ms):
    """Returns a log at 50 Hz in which a cycle of 20 Hz stands in two or three rows."""
    time_s = log_times(len(times_ms) / 20.0 - 0.02)
    cycle = np.floor(time_s * 20.0 + 1e-9).astype(int)
    return make_log(
        time_s, cycle_count=cycle + 1, compute_time_ms=np.asarray(times_ms, dtype=float)[cycle]
    )


def test_every_cycle_counts_once():
    values = [1.0, 5.0, 2.0, 9.0]
    assert list(compute.cycle_times_ms(log_of_cycles(values))) == values


def test_percentiles_are_those_of_the_cycles():
    log = log_of_cycles(np.arange(101.0))
    assert compute.compute_time_p50_ms(log) == pytest.approx(50.0)
    assert compute.compute_time_p95_ms(log) == pytest.approx(95.0)
    assert compute.compute_time_p99_ms(log) == pytest.approx(99.0)


def test_missed_periods_are_the_cycles_longer_than_the_control_period():
    # 20 Hz: 50 ms.
    assert compute.missed_period_ratio(log_of_cycles([10.0, 50.0, 51.0, 90.0])) == 0.5


def test_rows_before_the_first_cycle_are_no_cycle():
    log = make_log(log_times(1.0), compute_time_ms=0.0)
    with pytest.raises(Undefined, match="never called"):
        compute.compute_time_p50_ms(log)


def test_compute_times_are_marked_as_not_repeatable():
    assert not compute.compute_time_p50_ms.is_repeatable


def test_processor_time_has_a_percentile_of_its_own():
    times_ms = np.arange(101.0)
    log = log_of_cycles(times_ms)
    cycle = log.samples["cycle_count"].to_numpy().astype(int) - 1
    log.samples["compute_cpu_time_ms"] = 0.5 * times_ms[cycle]
    assert compute.compute_cpu_time_p95_ms(log) == pytest.approx(47.5)


def test_a_log_from_before_processor_time_was_measured_is_read_and_has_no_value(tmp_path):
    log = log_of_cycles([1.0, 2.0])
    path = tmp_path / "old.parquet"
    log.write(path)
    table = pq.read_table(path)
    pq.write_table(table.drop_columns(["compute_cpu_time_ms"]), path)
    old = TrialLog.read(path)
    assert list(old.samples) == list(log.samples)
    assert compute.compute_time_p50_ms(old) == 1.5
    with pytest.raises(Undefined, match="before processor time was measured"):
        compute.compute_cpu_time_p95_ms(old)
