"""The terminal tells which trials did not reach the goal, and for what reason."""

import pandas as pd

from drake_navbench.campaign.console import MAX_LINES, unsuccessful_lines


def trials(*rows):
    return pd.DataFrame(rows, columns=["scenario", "controller", "outcome", "reason"])


def test_reasons_that_differ_in_numbers_alone_are_one_line():
    table = trials(
        ("hall_1", "dwb", "timed_out", "no time left"),
        ("hall_1", "rpp", "aborted", "collision ahead in 0.80 s"),
        ("hall_2", "rpp", "aborted", "collision ahead in 1.25 s"),
        ("hall_3", "rpp", "succeeded", ""),
    )
    assert unsuccessful_lines(table, ()) == [
        "rpp, 2 trials aborted in hall_1, hall_2: collision ahead in 0.80 s",
        "dwb, 1 trial timed out in hall_1: no time left",
    ]


def test_giving_up_where_that_is_right_and_errors_are_not_told():
    table = trials(
        ("closed", "rpp", "aborted", "collision ahead"), ("hall", "rpp", "error", "ValueError: x")
    )
    assert unsuccessful_lines(table, {"closed"}) == []


def test_a_long_list_is_cut_and_says_so():
    reasons = ["wall", "door", "box", "cart", "bed", "lamp", "desk", "stair"]
    table = trials(*(("hall", "rpp", "aborted", reason) for reason in reasons))
    lines = unsuccessful_lines(table, ())
    assert len(lines) == MAX_LINES + 1
    assert lines[-1] == "2 more reasons are in the report"


def test_many_scenarios_are_counted():
    table = trials(*((f"hall_{n}", "rpp", "collided", "touched") for n in range(1, 6)))
    assert unsuccessful_lines(table, ()) == [
        "rpp, 5 trials collided in hall_1, hall_2, hall_3 and 2 more: touched"
    ]
