"""The verdict in words: who arrives, who touches, who is best where, and the weak points."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from drake_navbench.analysis.figures.ranking import rank_rows
from drake_navbench.analysis.metrics.registry import all_metrics
from drake_navbench.analysis.overview import overview_of
from drake_navbench.analysis.report_summary import summary_of
from drake_navbench.analysis.scenario_analysis import TrialEntry, analyse
from drake_navbench.analysis.task_summary import best_ones, listed

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


def test_who_is_best_where_how_sure_and_with_which_weak_points():
    lead = summary_of([scenario("bend", time_to_goal_s=TIMES, jerk_rms_mps3=JERKS)])
    text = " ".join(lead.sentences)
    assert text.startswith("Both controllers reached every goal that can be reached.")
    # Whoever is praised has the weak point in the same sentence.
    assert "rpp is quickest, but has 4.0 times dwb's jerk (4.00 against 1.00 m/s³)." in text
    assert "dwb is smoothest, but has 1.2 times rpp's time (12.0 against 10.0 s)." in text
    assert "Each of these 2 statements rests on 4 trials of each controller and task. " in text
    assert "With 95% confidence the controller beats each of the others by more than 1%" in text
    assert lead.tasks[0].sentence == (
        "all arrive. rpp is quickest (10.0 s), but has 4.0 times dwb's jerk (4.00 against "
        "1.00 m/s³). dwb is smoothest (1.00 m/s³), but has 1.2 times rpp's time (12.0 against "
        "10.0 s)."
    )


def test_a_weak_point_that_is_not_shown_is_not_told():
    # On average dwb has 1.75 times the jerk; with this spread that shows nothing.
    jerks = {"rpp": [1.0, 3.0, 0.5, 1.5], "dwb": [4.0, 1.0, 3.5, 2.0]}
    found = scenario(
        "bend", time_to_goal_s={"dwb": TIMES["rpp"], "rpp": TIMES["dwb"]}, jerk_rms_mps3=jerks
    )
    assert summary_of([found]).sentences[1] == (
        "dwb is quickest, and is nowhere shown to be 10% behind another controller."
    )


def test_a_difference_beyond_one_percent_that_the_interval_does_not_show_is_no_word():
    # The mean difference is 1.2% of the larger mean; its interval begins at 0.5%.
    times = {"rpp": [10.0] * 4, "dwb": [10.08, 10.16, 10.08, 10.16]}
    paths = {"rpp": [0.5] * 4, "dwb": [0.5 * value / 10.0 for value in times["dwb"]]}
    found = scenario("bend", cross_track_error_mean_m=paths)
    assert found.verdicts[0].standing == "not decided"
    assert "which may be less than 0.00506 m (1%)" in found.verdicts[0].text
    surely = {"rpp": [0.5] * 4, "dwb": [0.512, 0.513, 0.512, 0.513]}
    assert scenario("bend", cross_track_error_mean_m=surely).verdicts[0].best == "rpp"


def test_weak_points_of_the_praised_tasks_come_first():
    near = {"rpp": [0.2, 0.21, 0.19, 0.2], "dwb": [0.1, 0.11, 0.1, 0.09]}
    scenarios = [
        scenario("door", time_to_goal_s=TIMES, cross_track_error_mean_m=near),
        scenario("hall", jerk_rms_mps3={"rpp": JERKS["rpp"], "dwb": [0.1, 0.11, 0.1, 0.09]}),
    ]
    assert summary_of(scenarios).sentences[2] == (
        "rpp is quickest in door, but has 2.0 times dwb's distance from the plan in door "
        "(0.200 against 0.100 m) and 40 times dwb's jerk in hall (4.00 against 0.100 m/s³)."
    )


def test_compute_times_are_compared_as_processor_time_over_all_trials():
    # On the wall rpp is slower, as the machine was loaded; one trial of dwb's failed.
    wall = {"rpp": [9.0, 9.1, 9.0, 9.1], "dwb": [5.0, 5.1, 5.0, 5.1]}
    processor = {"rpp": [1.0, 1.1, 1.0, 1.1], "dwb": [3.0, 3.1, 3.0, 7.0]}
    found = scenario(
        "bend",
        outcomes={"dwb": ["succeeded"] * 3 + ["aborted"]},
        compute_time_p95_ms=wall,
        compute_cpu_time_p95_ms=processor,
    )
    more = {"rpp": [1.0, 1.1, 1.0, 1.1], "dwb": [3.0, 3.1, 3.0, 3.1]}
    text = " ".join(summary_of([found, scenario("door", compute_cpu_time_p95_ms=more)]).sentences)
    assert "rpp is cheapest to compute over all trials, and is nowhere shown to be" in text
    (verdict,) = found.verdicts
    assert "in 4 trials" in verdict.text
    in_vain = scenario("bend", outcomes={"rpp": ["aborted"] * 4}, compute_cpu_time_p95_ms=more)
    assert "cheapest" not in " ".join(summary_of([in_vain]).sentences)
    undecided = {"rpp": [1.0, 1.1, 1.0, 1.1], "dwb": [0.2, 9.0, 3.0, 0.1]}
    unsure = summary_of([scenario("bend", compute_cpu_time_p95_ms=undecided)])
    assert unsure.sentences[1] == ("More trials are needed to say who is cheapest to compute.")


def test_a_touch_is_told_with_what_the_preset_says_and_takes_the_first_place():
    found = scenario(
        "bend",
        outcomes={"rpp": ["succeeded"] * 3 + ["collided"]},
        time_to_goal_s={"rpp": [10.0, 10.1, 9.9, float("nan")], "dwb": TIMES["dwb"]},
    )
    (verdict,) = found.verdicts
    assert (verdict.standing, verdict.best, verdict.leaders) == ("faulty", None, ("rpp",))
    assert "rpp touched something in 1 trial, so that nobody is best" in verdict.text
    lead = summary_of([found], descriptions={"rpp": "looks at its centre alone"})
    assert lead.sentences[1:] == [
        "rpp touched something in bend (1 of 4 trials). A controller may stop where the way is "
        "closed; it must never touch anything.",
        "The preset rpp: looks at its centre alone.",
    ]
    assert lead.tasks[0].sentence == (
        "dwb always arrives, rpp 3 of 4. rpp touched something in 1 of 4 trials. In how they "
        "drive nobody is shown to be best."
    )


# Each example is a whole summary, 0.1 s.
@settings(max_examples=3)
@given(st.integers(0, 2**32 - 1))
def test_words_and_places_never_contradict_each_other(seed):
    generator = np.random.default_rng(seed)
    names = [f"c{number}" for number in range(generator.integers(2, 6))]
    count = int(generator.integers(1, 9))
    spread = 10.0 ** generator.uniform(-4.0, 0.0)

    def values():
        means = generator.choice([1.0, 1.005, 1.01, 1.02, 1.5], len(names))
        return {
            name: list(mean * (1.0 + spread * generator.standard_normal(count)))
            for name, mean in zip(names, means, strict=True)
        }

    outcomes = {
        name: list(generator.choice(["succeeded", "aborted", "collided"], count, p=[0.8, 0.1, 0.1]))
        for name in names
    }
    found = scenario("bend", outcomes=outcomes, time_to_goal_s=values(), jerk_rms_mps3=values())
    line = summary_of([found]).tasks[0].sentence
    words = {"time_to_goal_s": "quickest", "jerk_rms_mps3": "smoothest"}
    metrics = [entry for entry in all_metrics() if entry.name in words]
    rows = {row.metric.name: row for row in rank_rows(found.verdicts, metrics)}
    praised = best_ones(found)
    for metric, word in words.items():
        assert (word in line) <= (metric in praised)
        if metric in praised:
            # Who is praised is first in the figure, alone in front, and has touched nothing.
            row = rows[metric]
            assert row.in_front == (praised[metric],)
            assert row.places[praised[metric]] == 1
            assert "collided" not in outcomes[praised[metric]]
        elif metric in rows and len(rows[metric].in_front) == 1 and found.anyone_arrived:
            assert "collided" in outcomes[rows[metric].in_front[0]]


def test_a_smaller_clearance_is_a_share_of_the_best_one_and_jerk_beside_none_is_more_jerk():
    clearances = {"rpp": [0.5, 0.51, 0.49, 0.5], "dwb": [0.2, 0.21, 0.2, 0.19]}
    lead = summary_of([scenario("bend", min_clearance_m=clearances, jerk_rms_mps3=JERKS)])
    text = " ".join(lead.sentences)
    assert (
        "dwb is smoothest, but has 40% of rpp's smallest clearance (0.200 against 0.500 m)" in text
    )
    still = {"rpp": JERKS["rpp"], "dwb": [0.0] * 4}
    lead = summary_of([scenario("bend", min_clearance_m=clearances, jerk_rms_mps3=still)])
    assert "but has more jerk than dwb (4.00 against 0 m/s³)" in " ".join(lead.sentences)


def test_with_several_tasks_it_says_in_which():
    scenarios = [
        scenario("bend", time_to_goal_s=TIMES, jerk_rms_mps3=JERKS),
        scenario("door", time_to_goal_s=TIMES),
    ]
    first, second = summary_of(scenarios).sentences[1:3]
    assert first.startswith("rpp is quickest in all 2 tasks, but has 4.0 times dwb's jerk in ")
    assert second.startswith("dwb is smoothest in bend, but has 1.2 times rpp's time in bend ")


def test_if_only_one_arrives_it_says_that():
    lead = summary_of([scenario("bend", outcomes=NEVER, time_to_goal_s=TIMES)])
    assert lead.sentences[0] == ("Only rpp arrived, in 4 of 4 trials; dwb never reached a goal.")
    assert lead.tasks[0].sentence.startswith("only rpp arrives: 4 of 4 trials reach the goal; ")


def test_if_nobody_arrives_nobody_is_best():
    outcomes = {"rpp": ["collided"] * 4} | NEVER
    lead = summary_of([scenario("bend", outcomes=outcomes, time_to_goal_s=TIMES)])
    assert lead.sentences == [
        "No controller reached any goal, so none is best.",
        "rpp touched something in bend (4 of 4 trials). A controller may stop where the way is "
        "closed; it must never touch anything.",
    ]
    assert lead.tasks[0].sentence == (
        "nobody reaches the goal. rpp touched something in 4 of 4 trials."
    )


def test_who_missed_some_is_told_with_the_count():
    outcomes = {"dwb": ["succeeded"] * 3 + ["aborted"]}
    lead = summary_of([scenario("bend", outcomes=outcomes, time_to_goal_s=TIMES)])
    assert (
        lead.sentences[0] == "Only rpp reached every goal that can be reached; dwb missed 1 of 4."
    )
    assert lead.tasks[0].sentence.startswith("rpp always arrives, dwb 3 of 4. ")


def test_an_impossible_task_counts_for_nobody():
    walled = scenario(
        "walled",
        outcomes={"rpp": ["aborted"] * 4, "dwb": ["aborted"] * 3 + ["collided"]},
        is_impossible=True,
        time_to_goal_s=TIMES,
    )
    lead = summary_of([scenario("bend", time_to_goal_s=TIMES), walled])
    assert lead.sentences[0].startswith("Both controllers")
    assert lead.tasks[1].sentence == (
        "impossible on purpose. 7 of 8 trials ended with giving up, as they should. dwb touched "
        "something in 1 of 4 trials."
    )
    alone = summary_of([walled]).sentences[0]
    assert alone.startswith("Every task here is impossible on purpose")


def test_what_is_not_decided_is_not_claimed():
    close = {"rpp": [10.0, 12.0, 11.0, 10.5], "dwb": [12.0, 11.0, 11.5, 10.9]}
    lead = summary_of([scenario("bend", time_to_goal_s=close)])
    assert lead.sentences[1:] == ["More trials are needed to say who is quickest."]


def test_one_trial_each_shows_nothing():
    times = {"rpp": [10.0], "dwb": [12.0]}
    found = scenario("bend", time_to_goal_s=times)
    assert summary_of([found]).sentences[1] == "One trial of each cannot show who is quickest."


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
    row = overview_of([scenario("bend", compute_cpu_time_p95_ms=compute)]).rows[0]
    assert [bar.text for bar in row.cells[-1]] == ["<0.1 ms", "5.00 ms"]


def test_lists_read_as_sentences():
    assert listed(["a"]) == "a"
    assert listed(["a", "b"]) == "a and b"
    assert listed(["a", "b", "c"], "or") == "a, b or c"
