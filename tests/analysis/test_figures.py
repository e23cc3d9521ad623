"""What figures show is computed apart from drawing; drawing is repeatable."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
import pytest
from results_folders import CONTROLLERS, SEEDS, trial_log
from scenes import straight_plan
from synthetic_logs import circle_log, log_times, make_log, straight_log

from drake_navbench.analysis.colors import controller_color
from drake_navbench.analysis.figures.album import (
    FigureChoice,
    headline_metrics,
    write_scenario_figures,
)
from drake_navbench.analysis.figures.comparison import (
    box_figure,
    box_panels,
    clearance_curves,
    clearance_figure,
    compute_figure,
    compute_times,
)
from drake_navbench.analysis.figures.maps import bounds, paths_figure, paths_map
from drake_navbench.analysis.figures.motion import MotionSheet, motion_curves, sheet_of, shown_trial
from drake_navbench.analysis.figures.ranking import (
    pareto_figure,
    pareto_points,
    rank_rows,
)
from drake_navbench.analysis.figures.style import (
    PLAN_COLOR,
    Look,
    figure_style,
    new_figure,
    write_figure,
)
from drake_navbench.analysis.metrics import efficiency
from drake_navbench.analysis.trial_rows import trial_row
from drake_navbench.analysis.verdicts import verdict
from drake_navbench.errors import CannotBeWritten
from drake_navbench.logs.plans import Plan


@pytest.fixture(scope="module")
def logs():
    return {c: [trial_log("own_corridor", c, t) for t in range(len(SEEDS))] for c in CONTROLLERS}


@pytest.fixture(scope="module")
def trials(logs):
    return pd.DataFrame([trial_row(log) for own in logs.values() for log in own])


def test_controllers_differ_in_colour_line_and_marker():
    names = ["dwb", "rpp", "teb", "mppi", "mppi_nav2"]
    look = Look(names)
    assert len({look.line(name)["color"] for name in names}) == 5
    assert len({str(look.line(name)["linestyle"]) for name in names}) == 5
    assert len({look.marker(name) for name in names}) == 5
    assert look.line("rpp")["color"] == controller_color("rpp")


@pytest.mark.usefixtures("real_pngs")
def test_a_figure_is_written_twice_to_the_same_bytes(tmp_path):
    written = []
    for name in ("a", "b"):
        with figure_style():
            figure, (axes,) = new_figure()
            axes.plot([0.0, 1.0], [1.0, 2.0], label="line")
            paths = write_figure(figure, tmp_path / name / "figure.of.1")
        written.append([path.read_bytes() for path in paths])
        assert [path.name for path in paths] == ["figure.of.1.svg", "figure.of.1.png"]
    assert written[0] == written[1]
    assert len(written[0][1]) > 5000


def test_a_figure_that_cannot_be_written_is_one_line_and_leaves_nothing(tmp_path):
    (tmp_path / "figures").write_text("a file stands where the folder should be")
    with figure_style(), pytest.raises(CannotBeWritten, match=r"line\.svg: cannot be written"):
        write_figure(new_figure()[0], tmp_path / "figures" / "line")
    assert [path.name for path in tmp_path.iterdir()] == ["figures"]


def test_the_map_shows_everything_that_was_driven_and_planned():
    low, high = bounds([straight_log(), straight_log(y_m=3.0)])
    # Reach of the footprint 0.9014 m and a margin of 0.6 m.
    reach_m = math.hypot(0.85, 0.3) + 0.6
    assert low == pytest.approx([-reach_m, -reach_m])
    assert high == pytest.approx([5.0 + reach_m, 3.0 + reach_m])


def test_the_map_holds_every_path_and_where_the_first_trial_of_each_ended():
    shown = paths_map({"dwb": [straight_log(), straight_log(y_m=3.0)], "rpp": [straight_log()]})
    assert [(own.controller, len(own.paths)) for own in shown.driven] == [("dwb", 2), ("rpp", 1)]
    (outline,) = shown.driven[0].outlines
    # The wheelchair's corners around its last pose, (5, 0) m.
    assert sorted(outline[:, 0]) == pytest.approx([4.75, 4.75, 5.85, 5.85])
    assert not shown.course.is_replanned
    assert shown.course.goal.tolist() == [5.0, 0.0]


def test_the_map_shows_the_first_plan_of_each_leg_and_all_goals():
    legs = [
        Plan(0.0, straight_plan(2.0)),
        Plan(1.0, straight_plan(1.5, x_m=0.5)),
        Plan(4.0, straight_plan(3.0, x_m=2.0), 1),
    ]
    log = straight_log(plans=legs)
    log.info["scenario"]["waypoints"] = [[2.0, 0.0, 0.0]]
    # The other one never planned its second leg.
    logs = {"dwb": [straight_log(plans=legs[:2])], "rpp": [log]}
    with figure_style():
        axes = paths_figure(paths_map(logs), Look(["dwb", "rpp"])).axes[0]
    found = {line.get_label(): line.get_xdata().tolist() for line in axes.lines}
    assert found["waypoint"] == [2.0]
    assert found["goal"] == [5.0]
    drawn = [line.get_xdata() for line in axes.lines if line.get_color() == PLAN_COLOR]
    ends = [(x[0], x[-1]) for x in drawn if len(x) > 1]
    assert ends == [(0.0, pytest.approx(2.0)), (2.0, pytest.approx(5.0))]
    assert "first plan" in found


def test_paths_are_drawn_in_the_controllers_colours(logs):
    with figure_style():
        figure = paths_figure(paths_map(logs), Look(CONTROLLERS))
    colors = [line.get_color() for line in figure.axes[0].lines]
    for name in CONTROLLERS:
        assert colors.count(controller_color(name)) == len(SEEDS)


def test_every_single_trial_is_visible_and_failed_ones_are_hollow(trials):
    some_failed = trials.copy()
    some_failed.loc[0, "outcome"] = "aborted"
    with figure_style():
        panels = box_panels(some_failed, "own_corridor", [efficiency.driven_length_m])
        figure = box_figure(panels, Look(CONTROLLERS))
    points = [line for line in figure.axes[0].lines if line.get_marker() in ("o", "s")]
    hollow = [line for line in points if line.get_markerfacecolor() == "white"]
    assert sum(len(line.get_xdata()) for line in points) == 2 * len(SEEDS)
    assert sum(len(line.get_xdata()) for line in hollow) == 1


def test_a_box_has_the_quartiles_and_whiskers_to_the_last_value_near_them():
    rows = pd.DataFrame(
        {
            "scenario": "s",
            "controller": "rpp",
            "seed": range(6),
            "outcome": ["succeeded"] * 4 + ["aborted", "succeeded"],
            "driven_length_m": [1.0, 2.0, 3.0, 4.0, 100.0, math.nan],
        }
    )
    (panel,) = box_panels(rows, "s", [efficiency.driven_length_m])
    (box,) = panel.boxes
    assert list(box.values) == [1.0, 2.0, 3.0, 4.0, 100.0]
    assert list(box.failed) == [False, False, False, False, True]
    # Half again the height of the box above it is 4 + 1.5 * 2 = 7.
    assert (box.low, box.first, box.median, box.third, box.high) == (1.0, 2.0, 3.0, 4.0, 4.0)


def test_clearance_stands_over_the_driven_length_and_is_unknown_out_of_reach():
    clearance_m = np.where(log_times(2.0) < 1.0, np.inf, 0.4)
    (curve,) = clearance_curves({"rpp": [straight_log(end_time_s=2.0, clearance_m=clearance_m)]})
    assert curve.driven_m[-1] == pytest.approx(1.0)
    assert np.isnan(curve.clearance_m[:50]).all()
    assert (curve.clearance_m[50:] == 0.4).all()


def test_compute_times_run_from_the_shortest_cycle_to_the_longest(logs):
    found = compute_times(logs)
    assert found.period_ms == 50.0
    times_ms, share = found.curves["rpp"]
    assert (times_ms[0], share[0]) == (1.0, 1.0)
    assert times_ms[-1] == pytest.approx(7.0, abs=0.01)


def test_the_curves_of_a_sheet_end_where_the_metrics_are():
    log = circle_log(radius_m=2.0, speed_mps=0.4)
    curves = motion_curves(log)
    # v^2 / r
    assert curves.centripetal_mps2 == pytest.approx(np.full(len(log.samples), 0.08))
    assert curves.fitted.acceleration_mps2 == pytest.approx(0.0, abs=1e-9)
    assert curves.fitted.energy_j[-1] == pytest.approx(efficiency.mechanical_energy_j(log))


def test_a_sheet_shows_the_first_trial_that_arrived():
    failed, arrived = straight_log(outcome="aborted"), straight_log()
    assert shown_trial([failed, arrived, straight_log()]) is arrived
    assert shown_trial([failed, straight_log(outcome="aborted")]) is failed


def test_places_are_those_of_the_verdicts(trials):
    metrics = [efficiency.time_to_goal_s, efficiency.driven_length_m, efficiency.spl]
    verdicts = [verdict(trials.assign(spl=np.nan), "own_corridor", entry) for entry in metrics]
    # Length has no good direction, and SPL no value.
    (row,) = rank_rows([found for found in verdicts if found], metrics)
    assert row.metric.name == "time_to_goal_s"
    assert row.places == {"rpp": 1, "rpp:v=0.4": 2}
    assert row.in_front == ("rpp",)


def test_without_values_there_is_no_figure(trials):
    look = Look(["rpp"])
    empty = {"rpp": [straight_log()]}
    with figure_style():
        assert clearance_figure(clearance_curves(empty), look) is None
        assert compute_figure(compute_times(empty), look) is None
        no_values = trials.assign(spl=np.nan)
        assert box_figure(box_panels(no_values, "own_corridor", [efficiency.spl]), look) is None
        nobody = pareto_points(trials.assign(outcome="aborted"), "own_corridor")
        assert pareto_figure(nobody, look) is None


def test_pareto_points_rest_on_successful_trials_only(trials):
    rows = trials.copy()
    # A quitter that would be quickest and smoothest.
    rows.loc[rows["controller"] == "rpp:v=0.4", "outcome"] = "aborted"
    points = pareto_points(rows, "own_corridor")
    assert points.names == ["rpp"]
    assert list(points.is_on_front) == [True]


def test_pareto_front_of_faster_and_clearer():
    rows = pd.DataFrame(
        {
            "scenario": "s",
            "outcome": "succeeded",
            "controller": ["fast", "clear", "neither"],
            "time_to_goal_s": [1.0, 2.0, 3.0],
            "min_clearance_m": [0.1, 0.5, 0.1],
            "jerk_rms_mps3": [1.0, 1.0, 1.0],
        }
    )
    assert list(pareto_points(rows, "s").is_on_front) == [True, True, False]


def test_a_trial_too_short_for_derivatives_is_still_drawn():
    log = make_log([0.0, 0.02], x_m=[0.0, 0.01], outcome="error")
    with figure_style():
        figure = MotionSheet().draw(sheet_of([log], "rpp"), Look(["rpp"]))
    assert any("too few" in text.get_text() for axes in figure.axes for text in axes.texts)


def test_a_sheet_used_again_is_drawn_as_a_new_one(logs, tmp_path):
    look = Look(CONTROLLERS)
    long = [straight_log(speed_mps=0.2, end_time_s=30.0)]
    with figure_style():
        sheet = MotionSheet()
        sheet.draw(sheet_of(long, "rpp:v=0.4"), look)
        again = write_figure(sheet.draw(sheet_of(logs["rpp"], "rpp"), look), tmp_path / "again")
        new = write_figure(MotionSheet().draw(sheet_of(logs["rpp"], "rpp"), look), tmp_path / "new")
    assert [path.read_bytes() for path in again] == [path.read_bytes() for path in new]


def test_a_trial_without_samples_leaves_the_others_drawn(logs, trials, tmp_path):
    broken = make_log(log_times(0.1), outcome="error")
    broken = type(broken)(broken.samples.iloc[:0], broken.plans, broken.info)
    written = write_scenario_figures(
        tmp_path, "own_corridor", {"rpp": [broken, *logs["rpp"]]}, trials
    )
    assert "motion" in {entry.kind for entry in written}
    assert (tmp_path / "own_corridor" / "paths.svg").is_file()


def test_headline_metrics_all_have_a_direction_or_none_on_purpose():
    undirected = {entry.name for entry in headline_metrics() if entry.better == "neither"}
    assert undirected == {"driven_length_m"}


def test_there_are_ranks_only_where_somebody_arrived(logs, trials, tmp_path):
    def kinds(table):
        found = verdict(trials, "own_corridor", efficiency.time_to_goal_s)
        written = write_scenario_figures(
            tmp_path, "own_corridor", logs, table, FigureChoice.KEY, verdicts=[found]
        )
        return {entry.kind for entry in written}

    assert "ranks" in kinds(trials)
    assert "ranks" not in kinds(trials.assign(outcome="aborted"))


def test_a_controller_without_a_value_has_a_dash_in_its_column_amid_the_panel():
    rows = pd.DataFrame(
        {
            "scenario": "s",
            "controller": ["dwb", "rpp"],
            "seed": 0,
            "outcome": "succeeded",
            "driven_length_m": [4.0, math.nan],
        }
    )
    with figure_style():
        panels = box_panels(rows, "s", [efficiency.driven_length_m])
        axes = box_figure(panels, Look(["dwb", "rpp"])).axes[0]
    (dash,) = axes.texts
    assert dash.get_text() == "–"
    assert dash.get_position() == (2, 0.5)
    assert dash.get_transform() == axes.get_xaxis_transform()
