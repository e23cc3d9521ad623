"""The verdict in words: it says who arrives, who is best where, how sure, and at what price."""

from __future__ import annotations

from drake_navbench.analysis.lead import lead_of, listed
from drake_navbench.analysis.metrics.registry import all_metrics
from drake_navbench.analysis.overview import overview_of
from drake_navbench.analysis.scenario_analysis import TrialEntry, analyse

NAMES = [entry.name for entry in all_metrics()]


def scenario(name, *, outcomes=None, is_impossible=False, **metrics):
    """Returns the analysis of trials; metrics: name -> controller -> values; outcomes likewise."""
    controllers = list(dict.fromkeys(c for values in metrics.values() for c in values))
    count = len(next(iter(next(iter(metrics.values())).values())))
    entries = []
    for controller in controllers:
        for trial in range(count):
            row = dict.fromkeys(NAMES, float("nan")) | {
                "scenario": name,
                "controller": controller,
                "trial": trial,
                "seed": trial,
                "outcome": (outcomes or {}).get(controller, ["succeeded"] * count)[trial],
                "reason": "",
            }
            for metric, values in metrics.items():
                row[metric] = values.get(controller, [float("nan")] * count)[trial]
            entries.append(TrialEntry(row, {}, f"{controller}/{trial}"))
    found = analyse(name, entries, [])
    found.is_impossible = is_impossible
    return found


TIMES = {"rpp": [10.0, 10.1, 9.9, 10.0], "dwb": [12.0, 12.2, 11.8, 12.1]}
JERKS = {"rpp": [4.0, 4.1, 4.0, 3.9], "dwb": [1.0, 1.1, 1.0, 0.9]}
NEVER = {"dwb": ["aborted"] * 4}


def test_who_is_best_where_how_sure_and_at_what_price():
    lead = lead_of([scenario("bend", time_to_goal_s=TIMES, jerk_rms_mps3=JERKS)])
    text = " ".join(lead.sentences)
    assert text.startswith("All 2 controllers reached every goal that can be reached.")
    assert "rpp is quickest; dwb is smoothest." in text
    assert "with 95% confidence against all others together" in text
    assert "rests on 4 trials of each controller" in text
    assert "The price of rpp is highest where it has 4.0 times the jerk of dwb in bend." in text
    assert lead.tasks[0].sentence == (
        "all arrive; rpp is quickest (10.0 s); dwb is smoothest (1.00 m/s³)."
    )


def test_with_several_tasks_it_says_in_which():
    scenarios = [
        scenario("bend", time_to_goal_s=TIMES, jerk_rms_mps3=JERKS),
        scenario("door", time_to_goal_s=TIMES),
    ]
    first = lead_of(scenarios).sentences[1]
    assert first == "rpp is quickest in all 2 tasks; dwb is smoothest in bend."


def test_if_only_one_arrives_it_says_that():
    lead = lead_of([scenario("bend", outcomes=NEVER, time_to_goal_s=TIMES)])
    assert lead.sentences[0] == (
        "Only rpp arrives, in 4 of 4 trials; dwb never reached a goal. "
        "For these tasks it is the one to take."
    )
    assert lead.tasks[0].sentence.startswith("only rpp arrives (4 of 4 trials reach the goal: ")


def test_if_nobody_arrives_nobody_is_best():
    outcomes = {"rpp": ["collided"] * 4} | NEVER
    lead = lead_of([scenario("bend", outcomes=outcomes, time_to_goal_s=TIMES)])
    assert lead.sentences == ["No controller reached any goal, so that none is best."]
    assert lead.tasks[0].sentence == "nobody reaches the goal."


def test_who_missed_some_is_told_with_the_count():
    outcomes = {"dwb": ["succeeded"] * 3 + ["aborted"]}
    lead = lead_of([scenario("bend", outcomes=outcomes, time_to_goal_s=TIMES)])
    assert (
        lead.sentences[0] == "Only rpp reached every goal that can be reached; dwb missed 1 of 4."
    )
    assert lead.tasks[0].sentence.startswith("rpp always arrives, dwb 3 of 4; ")


def test_an_impossible_task_counts_for_nobody():
    walled = scenario(
        "walled",
        outcomes={"rpp": ["aborted"] * 4, "dwb": ["aborted"] * 3 + ["collided"]},
        is_impossible=True,
        time_to_goal_s=TIMES,
    )
    lead = lead_of([scenario("bend", time_to_goal_s=TIMES), walled])
    assert lead.sentences[0].startswith("All 2 controllers")
    assert lead.tasks[1].sentence == (
        "impossible on purpose; 7 of 8 trials were given up, as they should be, but 1 collided."
    )
    alone = lead_of([walled]).sentences[0]
    assert alone.startswith("Every task here is impossible on purpose")


def test_what_is_not_decided_is_not_claimed():
    close = {"rpp": [10.0, 12.0, 11.0, 10.5], "dwb": [12.0, 11.0, 11.5, 10.9]}
    lead = lead_of([scenario("bend", time_to_goal_s=close)])
    assert lead.sentences[1:] == [
        "More trials would be needed to say who is quickest in every task."
    ]


def test_one_trial_each_shows_nothing():
    times = {"rpp": [10.0], "dwb": [12.0]}
    found = scenario("bend", time_to_goal_s=times)
    assert lead_of([found]).sentences[1] == "One trial of each cannot show who is quickest."


def test_the_overview_has_a_bar_a_controller_as_long_as_its_share_of_the_longest():
    row = overview_of([scenario("bend", time_to_goal_s=TIMES)]).rows[0]
    arrived, time = row.cells[:2]
    assert [bar.text for bar in arrived] == ["4 of 4", "4 of 4"]
    assert [bar.is_best for bar in time] == [True, False]
    assert time[1].share == 1.0
    assert abs(time[0].share - 10.0 / 12.025) < 1e-9
    assert [bar.text for bar in time] == ["10.0 s", "12.0 s"]


def test_bars_of_those_that_did_not_always_arrive_are_marked():
    outcomes = {"dwb": ["succeeded"] * 3 + ["aborted"]}
    row = overview_of([scenario("bend", outcomes=outcomes, time_to_goal_s=TIMES)]).rows[0]
    assert [bar.is_partial for bar in row.cells[1]] == [False, True]


def test_what_is_less_than_matters_is_shown_as_such():
    compute = {"rpp": [0.02] * 4, "dwb": [5.0] * 4}
    row = overview_of([scenario("bend", compute_time_p95_ms=compute)]).rows[0]
    assert [bar.text for bar in row.cells[-1]] == ["<0.1 ms", "5.00 ms"]


def test_lists_read_as_sentences():
    assert listed(["a"]) == "a"
    assert listed(["a", "b"]) == "a and b"
    assert listed(["a", "b", "c"], "or") == "a, b or c"
