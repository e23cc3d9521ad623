"""Computing time of the controller; it is measured with a clock, so it differs from run to run."""

from __future__ import annotations

import numpy as np

from drake_navbench.analysis.metrics.definition import Undefined, metric
from drake_navbench.analysis.metrics.signals import column
from drake_navbench.kernels.arrays import Array
from drake_navbench.logs.log import TrialLog

MS_PER_S = 1000.0
# The plugin that runs a controller in a process of its own.
EXTERNAL = "external"


def cycle_times_ms(log: TrialLog, measure: str = "compute_time_ms") -> Array:
    """Returns the compute time of every control cycle in the log, (C,) ms.

    measure: the column, wall-clock time or the thread's processor time.
    """
    cycles = column(log, "cycle_count")
    is_new = np.diff(cycles, prepend=0.0) > 0
    if not is_new.any():
        if "running_stack" in log.info:
            raise Undefined("a running stack keeps its control cycles to itself")
        raise Undefined("the controller was never called")
    return column(log, measure)[is_new]


@metric(unit="ms", better="lower", is_repeatable=False, title="Compute time, median")
def compute_time_p50_ms(log: TrialLog) -> float:
    """Median compute time of a control cycle.

    Formula: 50th percentile.
    """
    return np.percentile(cycle_times_ms(log), 50)


@metric(
    unit="ms",
    better="lower",
    is_repeatable=False,
    title="Compute time, 95th percentile",
    relevant=0.1,
)
def compute_time_p95_ms(log: TrialLog) -> float:
    """Compute time that 95 of 100 control cycles do not exceed.

    Formula: 95th percentile over the cycles.
    """
    return np.percentile(cycle_times_ms(log), 95)


@metric(unit="ms", better="lower", is_repeatable=False, title="Compute time, 99th percentile")
def compute_time_p99_ms(log: TrialLog) -> float:
    """Compute time that 99 of 100 control cycles do not exceed.

    Formula: 99th percentile.
    """
    return np.percentile(cycle_times_ms(log), 99)


@metric(unit="", better="lower", is_repeatable=False, title="Share of late cycles")
def missed_period_ratio(log: TrialLog) -> float:
    """Share of the control cycles that took longer than the control period.

    Formula: cycles with compute time > 1/controller_frequency / cycles.
    """
    frequency = log.info["robot"]["navigation"]["controller_server"]["controller_frequency"]
    return float(np.mean(cycle_times_ms(log) > MS_PER_S / frequency))


@metric(
    unit="ms",
    better="lower",
    is_repeatable=False,
    title="Processor time, 95th percentile",
    relevant=0.1,
)
def compute_cpu_time_p95_ms(log: TrialLog) -> float:
    """Processor time that 95 of 100 control cycles do not exceed; waiting does not count.

    Formula: 95th percentile over the cycles of the thread's processor time. No value for
    `external`, which computes in another process.
    """
    if log.info.get("controller_plugin") == EXTERNAL:
        raise Undefined("the controller runs in a process of its own, which is not measured")
    times_ms = cycle_times_ms(log, "compute_cpu_time_ms")
    if np.isnan(times_ms).any():
        raise Undefined("the log is from before processor time was measured")
    return np.percentile(times_ms, 95)
