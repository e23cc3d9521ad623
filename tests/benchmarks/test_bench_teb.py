"""How long a cycle of TEB takes, and how much faster than real time it drives a trial.

The aim, on one core: a warm-started cycle with 20 to 25 poses and 20 obstacles at most 10 ms in
the median and 40 ms at the 99th percentile, a drive of 30 s at least 3 times faster than real time.
"""

import sys
import time
from pathlib import Path

import numpy as np
import pytest

from drake_navbench.controllers.teb import TimedElasticBand
from drake_navbench.inputs.presets import load_preset
from drake_navbench.kernels.distance_field import distance_field

sys.path.insert(0, str(Path(__file__).parents[1] / "controllers" / "teb"))
from controller_scenes import make_setup
from teb_closed_loop import PERIOD_S, drive, plan_from_elements, window

BENDS = [("s", 2.7), ("a", 45, 0.7), ("s", 1.2), ("a", -45, 0.7), ("s", 1.4), ("a", -45, 0.7)]
BENDS += [("s", 2.1), ("a", 45, 0.7), ("s", 2.0)]
BOX_COUNT = 20


def make_controller():
    return TimedElasticBand(load_preset("teb").parameters, make_setup())


def boxes_beside(plan):
    """Returns 20 boxes of 0.3 m along the plan, 0.75 m to its left and right in turn."""
    poses = plan[np.linspace(0, len(plan) - 1, BOX_COUNT).astype(int)]
    sides = np.where(np.arange(BOX_COUNT) % 2, 0.9, -0.9)
    x = poses[:, 0] - sides * np.sin(poses[:, 2])
    y = poses[:, 1] + sides * np.cos(poses[:, 2])
    return np.column_stack([x - 0.15, y - 0.15, x + 0.15, y + 0.15])


@pytest.mark.benchmark(group="teb")
def test_bench_drive_among_20_boxes(benchmark):
    plan = plan_from_elements(BENDS)
    boxes = boxes_beside(plan)
    controller = make_controller()
    drive(controller, plan, boxes, duration_s=2.0)
    record = benchmark.pedantic(
        lambda: drive(controller, plan, boxes, clock=time.perf_counter), rounds=3
    )
    assert record.outcome == "succeeded"
    warm_ms = 1e3 * np.array(record.step_times_s[1:])
    benchmark.extra_info["cycle_median_ms"] = round(float(np.median(warm_ms)), 2)
    benchmark.extra_info["cycle_p99_ms"] = round(float(np.percentile(warm_ms, 99)), 2)
    benchmark.extra_info["poses_median"] = 1 + int(
        np.median([d["interval_count"] for d in record.diagnostics])
    )
    driven_s = len(record.times_s) * PERIOD_S
    benchmark.extra_info["times_faster_than_real_time"] = round(
        driven_s / float(np.sum(record.step_times_s)), 1
    )


@pytest.mark.benchmark(group="teb")
def test_bench_distance_field(benchmark):
    costmap = window(boxes_beside(plan_from_elements(BENDS)), 2.0, 0.0)
    field = benchmark(distance_field, costmap)
    assert field.distances.shape == costmap.costs.shape
