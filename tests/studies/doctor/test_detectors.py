"""Symptoms as numbers: drives made by hand, whose severity one can work out."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from drake_navbench.logs.outcome import Outcome
from drake_navbench.studies.doctor import drives
from drake_navbench.studies.doctor.detectors import DETECTORS, severities
from drake_navbench.studies.doctor.drives import Drive, drive_of
from drake_navbench.studies.doctor.symptoms import Symptom

STEP_S = 0.05


def drive(v, w, *, goal=(5.0, 0.0, 0.0), outcome=Outcome.SUCCEEDED, clearance=9.0, **changed):
    """Returns the drive of commanded speeds (N,) from the origin along x, exactly followed."""
    v, w = np.asarray(v, dtype=float), np.asarray(w, dtype=float)
    yaw = np.concatenate([[0.0], np.cumsum(w)[:-1] * STEP_S])
    steps = np.column_stack([v * np.cos(yaw), v * np.sin(yaw)]) * STEP_S
    xy = np.vstack([[0.0, 0.0], np.cumsum(steps, axis=0)[:-1]])
    plan = np.column_stack([np.arange(0.0, 5.01, 0.05), np.zeros(101)])
    values = {
        "time_s": np.arange(len(v)) * STEP_S,
        "xy_m": xy,
        "yaw_rad": yaw,
        "v_mps": v,
        "w_radps": w,
        "command_v_mps": v,
        "clearance_m": np.full(len(v), clearance),
        "goal": np.array(goal),
        "plan_m": plan,
        "outcome": outcome,
        "asked_mps": 0.5,
        "tolerance_m": 0.25,
        "cycle_ms": np.full(len(v), 5.0),
        "period_ms": 50.0,
        "is_impossible": False,
    }
    return Drive(**(values | changed))


def seen(one):
    return {d.symptom for d in DETECTORS if d.measure(one) > d.threshold}


def test_a_straight_drive_at_the_asked_speed_shows_nothing():
    assert seen(drive(np.full(195, 0.5), np.zeros(195))) == set()


def test_a_heading_that_swings_every_second_wobbles():
    # Yaw rate +-0.5 rad/s, changing each 0.5 s: swings of 0.25 rad, 20 reversals in 10 s.
    w = np.where(np.arange(180) // 10 % 2 == 0, 0.5, -0.5)
    assert Symptom.WOBBLE_STRAIGHT in seen(drive(np.full(180, 0.5), w))


def test_one_correction_on_each_of_two_straight_pieces_is_no_wobble():
    # Straight, a bend of 0.6 rad, straight: the heading is 0.1 rad off and comes back on each.
    plan = np.vstack([
        np.column_stack([np.arange(0.0, 2.0, 0.05), np.zeros(40)]),
        np.outer(np.arange(0.0, 2.0, 0.05), [np.cos(0.6), np.sin(0.6)]) + np.array([2.0, 0.0]),
    ])  # fmt: skip
    once = np.concatenate([np.zeros(20), np.full(20, 0.1), np.full(20, -0.1), np.zeros(20)])
    bend = np.full(20, 0.6)
    one = drive(np.full(180, 0.5), np.concatenate([once, bend, once]), plan_m=plan)
    assert Symptom.WOBBLE_STRAIGHT not in seen(one)


def test_who_turns_to_a_plan_behind_by_an_arc_cuts_no_corner():
    # The plan leads back along x; the robot drives half a circle of 0.5 m to it.
    plan = np.column_stack([-np.arange(0.0, 3.0, 0.05), np.zeros(60)])
    arc = drive(np.full(63, 0.5), np.ones(63), plan_m=plan, goal=(-3.0, 0.0, 3.14))
    assert Symptom.CORNER_CUTTING not in seen(arc)
    # The same way off a plan that leads ahead is off the plan.
    ahead = drive(np.full(63, 0.5), np.ones(63))
    assert Symptom.CORNER_CUTTING in seen(ahead)


def test_a_touch_while_driving_counts_and_one_while_standing_does_not():
    moving = drive(np.full(60, 0.5), np.zeros(60), outcome=Outcome.COLLIDED)
    standing = drive(np.zeros(60), np.zeros(60), outcome=Outcome.COLLIDED)
    assert Symptom.COLLISION in seen(moving)
    assert Symptom.COLLISION not in seen(standing)


def test_a_robot_that_stands_for_20_s_does_not_start_nor_recover():
    found = seen(drive(np.zeros(400), np.zeros(400), outcome=Outcome.TIMED_OUT))
    assert {Symptom.NO_START, Symptom.NO_RECOVERY} <= found
    assert Symptom.GOAL_NOT_REACHED not in found


@pytest.mark.parametrize(("speed", "is_stuck"), [(0.3, False), (0.2, True)])
def test_who_nears_the_goal_at_half_of_the_speed_when_time_ends_is_not_stuck(speed, is_stuck):
    """5 s at 0.3 or 0.2 of 0.5 m/s leave more than 3 m of 5."""
    found = seen(drive(np.full(100, speed), np.zeros(100), outcome=Outcome.TIMED_OUT))
    assert (Symptom.NO_RECOVERY in found) == is_stuck


def test_to_stop_before_a_closed_way_is_no_fault_but_to_wait_there_for_ever_is():
    standing = drive(np.zeros(400), np.zeros(400), outcome=Outcome.ABORTED, is_impossible=True)
    assert seen(standing) == set()
    waiting = standing._replace(outcome=Outcome.TIMED_OUT)
    assert seen(waiting) == {Symptom.GIVES_UP_LATE}


def test_to_refuse_every_command_is_to_stop_and_to_run_out_of_patience_is_to_give_up():
    stopped = drive(np.full(60, 0.5), np.zeros(60), outcome=Outcome.ABORTED)
    refused = stopped._replace(reason="collision ahead in 0.9 s with v 0.5 m/s, w 0 rad/s")
    assert seen(refused) == {Symptom.DOOR_STOP}
    assert seen(stopped._replace(reason="failed to make progress")) == {Symptom.FALSE_ABORT}


def test_to_refuse_every_command_is_a_weak_sign_of_giving_up_and_after_recoveries_of_being_stuck():
    # It drives 1.5 m of 5 m.
    stopped = drive(np.full(60, 0.5), np.zeros(60), outcome=Outcome.ABORTED)
    refused = stopped._replace(reason="no valid control for 0.4 s: collision ahead in 0.9 s")
    measured = {d.symptom: d.measure(refused) / d.threshold for d in DETECTORS}
    assert measured[Symptom.FALSE_ABORT] == measured[Symptom.NO_RECOVERY] == 0.8
    assert Symptom.NO_RECOVERY in seen(refused._replace(recovers=True))
    # At the goal it is not stuck on the way, and before a closed way it is right.
    assert Symptom.NO_RECOVERY not in seen(
        refused._replace(recovers=True, goal=np.array([2.0, 0, 0]))
    )
    assert seen(refused._replace(recovers=True, is_impossible=True)) == set()


def test_a_robot_that_drives_past_the_goal_and_comes_back_overshoots():
    # 0.5 m/s for 6 s is 3 m, the goal is at 2 m: 0.75 m beyond the tolerance, then back.
    v = np.concatenate([np.full(120, 0.5), np.full(40, -0.5)])
    found = seen(drive(v, np.zeros(160), goal=(2.0, 0.0, 0.0)))
    assert Symptom.GOAL_OVERSHOOT in found


def test_half_the_asked_speed_is_too_slow_unless_something_stands_near():
    slow = np.full(300, 0.25)
    assert Symptom.TOO_SLOW in seen(drive(slow, np.zeros(300)))
    assert Symptom.TOO_SLOW not in seen(drive(slow, np.zeros(300), clearance=0.3))


def test_half_the_speed_in_a_zone_of_half_speed_is_not_too_slow():
    half = drive(np.full(300, 0.25), np.zeros(300))
    assert Symptom.TOO_SLOW in seen(half)
    assert Symptom.TOO_SLOW not in seen(half._replace(zone_share=0.5))
    areas = [{"value": 50, "polygon": []}, {"value": 0, "polygon": []}]
    assert drives._zone_share([{"type": "speed_percent", "areas": areas}]) == 0.5
    assert drives._zone_share([{"type": "keepout", "areas": areas}]) == 1.0


def test_three_turns_on_the_spot_are_a_spin():
    # 1 rad/s for 18.8 s.
    assert Symptom.SPINS in seen(drive(np.zeros(377), np.ones(377)))


def test_two_stops_on_the_way_are_stop_and_start():
    v = np.concatenate([np.full(30, 0.5), np.zeros(10)] * 2 + [np.full(60, 0.5)])
    assert Symptom.STOP_START_JERK in seen(drive(v, np.zeros(len(v))))


def surging(times, low):
    """Returns the speeds of a drive of 0.5 m/s that slows down so many times, for half a second."""
    piece = np.concatenate([np.full(20, 0.5), np.full(10, low)])
    return np.concatenate([*[piece] * times, np.full(20, 0.5)])


def test_four_slow_downs_without_a_stop_are_jerky_and_two_are_wanted():
    def jerky(v):
        return Symptom.STOP_START_JERK in seen(drive(v, np.zeros(len(v))))

    # From 0.5 to 0.3 m/s is 0.4 of the speed that is asked for; to 0.4 m/s nobody sees.
    assert jerky(surging(4, 0.3))
    assert not jerky(surging(2, 0.3))
    assert not jerky(surging(6, 0.4))
    # The larger of both numbers counts: two slow-downs beyond two, over 1.5.
    v = surging(4, 0.3)
    values = {d.measure(drive(v, 0.0 * v)) for d in DETECTORS if d.symptom == "stop_start_jerk"}
    assert values == {0.0, 2.0}


@pytest.mark.parametrize(
    ("half_width_m", "cuts"),
    [(0.03, True), (0.175, True), (0.3, False), (0.6, False), (float("nan"), False)],
)
def test_who_is_off_the_plan_by_more_than_the_robots_half_width_cuts_corners(half_width_m, cuts):
    # 0.2 m beside the plan; a small robot counts as 0.05 m wide, a large or unknown one as 0.35 m.
    beside = drive(np.full(100, 0.5), np.zeros(100))
    beside = beside._replace(xy_m=np.add(beside.xy_m, [0.0, 0.2]), half_width_m=half_width_m)
    assert (Symptom.CORNER_CUTTING in seen(beside)) is cuts


def test_stops_for_a_turn_on_the_spot_are_wanted():
    # A square of 1 m: each corner is a stop with a quarter turn, 1.57 rad/s for a second.
    side, corner = np.full(40, 0.5), np.zeros(20)
    v = np.concatenate([side, corner] * 3 + [side])
    w = np.concatenate([0.0 * side, corner + 1.57] * 3 + [0.0 * side])
    assert Symptom.STOP_START_JERK not in seen(drive(v, w))


def test_without_a_goal_only_driving_that_was_asked_for_can_be_too_slow():
    # It stands for 10 of 13 s, as it is told to; driving, it does what the commands ask.
    nowhere = (np.inf, np.inf, np.nan)
    v = np.concatenate([np.full(60, 0.5), np.zeros(200)])
    assert Symptom.TOO_SLOW not in seen(drive(v, np.zeros(260), goal=nowhere))
    # A base that does a quarter of what it is told is too slow.
    told = np.full(260, 0.5)
    slow = drive(0.25 * told, np.zeros(260), goal=nowhere, command_v_mps=told)
    assert Symptom.TOO_SLOW in seen(slow)


@pytest.mark.parametrize("detector", DETECTORS, ids=lambda detector: detector.symptom.value)
def test_every_threshold_has_a_unit_and_a_reason(detector):
    assert detector.threshold > 0.0
    assert detector.unit
    assert detector.reason


def log_of_cycles(compute_ms, **timing):
    """Returns what detectors read of a log: ten seconds straight ahead, and its cycles' times."""
    count = 200
    columns = {
        name: np.zeros(count) for name in ("y_m", "yaw_rad", "w_radps")
    } | {
        "time_s": np.arange(count) * STEP_S,
        "x_m": np.arange(count) * 0.5 * STEP_S,
        "v_mps": np.full(count, 0.5),
        "command_v_mps": np.full(count, 0.5),
        "clearance_m": np.full(count, 9.0),
        "compute_time_ms": np.full(count, compute_ms),
    }  # fmt: skip
    info = {"scenario": {"goal": [5.0, 0.0, 0.0]}, "robot": {"timing": timing}}
    return SimpleNamespace(
        samples=pd.DataFrame(columns), info=info, first_plans=(), plans=(),
        outcome=Outcome.SUCCEEDED,
    )  # fmt: skip


def test_cycles_are_late_where_the_robots_computer_is_so_much_slower():
    # 20 ms here, four times as long there: 80 ms of a period of 50 ms, all late; one in ten may be.
    slow = log_of_cycles(20.0, compute_time="scaled", compute_time_scale=4.0)
    assert severities(slow)["late_cycles"] == pytest.approx(10.0)
    fast = log_of_cycles(20.0, compute_time="scaled", compute_time_scale=2.0)
    assert severities(fast)["late_cycles"] == 0.0
    # Without a board this computer's load would count.
    assert "late_cycles" not in severities(log_of_cycles(80.0))


def test_the_speed_that_nobody_names_is_the_one_that_is_commanded():
    assert drive_of(log_of_cycles(1.0)).asked_mps == pytest.approx(0.5)
