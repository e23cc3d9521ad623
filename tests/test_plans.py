"""The plans of a trial: which of them a log keeps, how exactly, and in how little space."""

from __future__ import annotations

import dataclasses
import itertools
import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

sys.path.insert(0, str(Path(__file__).parent / "analysis"))

from scenes import straight_plan
from synthetic_logs import make_log

from drake_navbench.errors import InputError
from drake_navbench.logs.header import METADATA_KEY
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.plans import Plan, as_logged

MAX_BYTES_OF_600_REPLANS = 5_000_000


def poses_of(plans) -> list[list]:
    return [plan.poses.tolist() for plan in plans]


def written(log: TrialLog, path: Path) -> TrialLog:
    log.write(path)
    return TrialLog.read(path)


def test_the_first_plan_of_a_leg_is_kept_as_it_is_and_later_ones_to_a_micrometre():
    third = np.array([[1 / 3, -2 / 3, 1 / 3]])
    plans = [Plan(0.0, third), Plan(1.0, third + 1.0), Plan(2.0, third, leg=1)]
    first, later, next_leg = as_logged(plans)
    np.testing.assert_array_equal(first.poses, third)
    np.testing.assert_array_equal(next_leg.poses, third)
    np.testing.assert_array_equal(later.poses, [[1.333333, 0.333333, 1.3333]])


def test_a_plan_equal_to_the_one_before_it_is_not_kept_again():
    straight, moved = straight_plan(1.0), straight_plan(1.0, y_m=1e-9)
    given = [straight, straight.copy(), moved, moved.copy(), straight]
    kept = as_logged(Plan(float(i), poses) for i, poses in enumerate(given))
    assert [plan.time_s for plan in kept] == [0.0, 2.0, 4.0]


def test_the_first_plan_of_a_leg_is_kept_though_equal_to_the_last_of_the_leg_before():
    straight = straight_plan(1.0)
    kept = as_logged([Plan(0.0, straight), Plan(3.0, straight, leg=1)])
    assert [plan.leg for plan in kept] == [0, 1]


def test_the_course_is_the_first_plan_of_each_leg_that_has_one():
    a, b, c = (straight_plan(length_m) for length_m in (1.0, 2.0, 3.0))
    # Nothing was found on the way to the second goal.
    log = make_log([0.0, 9.0], plans=[Plan(0.0, a), Plan(1.0, b), Plan(2.0, c, 2), Plan(3.0, b, 2)])
    assert [plan.time_s for plan in log.first_plans] == [0.0, 2.0]
    np.testing.assert_array_equal(log.course, np.concatenate([a, c]))
    assert make_log([0.0], plans=[]).course.shape == (0, 3)


@st.composite
def any_plans(draw) -> list[Plan]:
    numbers = st.floats(-1e4, 1e4)
    shapes = st.tuples(st.integers(1, 4), st.just(3))
    poses = draw(st.lists(arrays(np.float64, shapes, elements=numbers), max_size=8))
    legs = sorted(draw(st.lists(st.integers(0, 3), min_size=len(poses), max_size=len(poses))))
    # Several may be given between two samples, and the last one after the last sample.
    return [Plan(0.3 * i, p, leg) for i, (p, leg) in enumerate(zip(poses, legs, strict=True))]


@settings(max_examples=20, deadline=None)
@given(given_plans=any_plans())
def test_plans_read_back_are_to_the_last_bit_those_that_were_written(given_plans, tmp_path_factory):
    log = make_log([0.0, 1.0, 2.0], plans=as_logged(given_plans))
    again = written(log, tmp_path_factory.getbasetemp() / "trial.parquet").plans
    assert [(p.time_s, p.leg) for p in again] == [(p.time_s, p.leg) for p in log.plans]
    assert poses_of(again) == poses_of(log.plans)
    assert poses_of(as_logged(again)) == poses_of(again)


def replans_of_ten_minutes() -> list[Plan]:
    """Returns a plan a second on a winding course of 100 m: what is left of it, never the same.

    Each has its own noise of 0.1 mm a pose; that of a planner is less, and so takes less space.
    """
    random = np.random.default_rng(1)
    x_m = 0.05 * np.arange(2000)
    course = np.column_stack([x_m, 2.0 * np.sin(x_m / 3.0)])
    plans = []
    for second in range(601):
        rest = course[3 * second :]
        rest = rest + random.normal(0.0, 1e-4, rest.shape)
        yaw = np.arctan2(*np.gradient(rest, axis=0).T[::-1])
        plans.append(Plan(float(second), np.column_stack([rest, yaw])))
    return plans


def test_six_hundred_replans_take_at_most_5_mb(tmp_path):
    plans = as_logged(replans_of_ten_minutes())
    assert len(plans) == 601
    log = make_log(np.arange(0.0, 601.0, 0.5), plans=plans)
    bare = dataclasses.replace(log, plans=plans[:1])
    log.write(tmp_path / "log.parquet")
    bare.write(tmp_path / "bare.parquet")
    sizes = [(tmp_path / f"{name}.parquet").stat().st_size for name in ("log", "bare")]
    assert sizes[0] - sizes[1] <= MAX_BYTES_OF_600_REPLANS


def test_equal_logs_with_plans_are_equal_bytes(tmp_path):
    plans = as_logged(itertools.islice(replans_of_ten_minutes(), 3))
    for name in ("a", "b"):
        make_log([0.0, 5.0], plans=plans).write(tmp_path / name)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


def test_a_log_of_the_schema_with_one_plan_is_refused_in_one_line(tmp_path):
    path = tmp_path / "trial.parquet"
    make_log([0.0, 1.0]).write(path)
    table = pq.read_table(path).drop_columns(["first_plans", "replans"])
    header = table.schema.metadata[METADATA_KEY]
    old = header.replace(b'"schema_version": 2', b'"schema_version": 1, "plan": [[0, 0, 0]]')
    pq.write_table(table.replace_schema_metadata({METADATA_KEY: old}), path)
    with pytest.raises(InputError, match=r"schema version 1, expected 2; run the trial again$"):
        TrialLog.read(path)
