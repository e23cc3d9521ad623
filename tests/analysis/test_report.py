"""The report is made from a folder alone, and says what it had to leave out."""

from __future__ import annotations

import json
import re
import shutil
from collections import Counter
from html import unescape
from html.parser import HTMLParser
from urllib.parse import unquote

import pandas as pd
import pytest
from jinja2 import Environment
from results_folders import measured_folder, report_html, trial_log, write_folder, write_manifest
from synthetic_logs import straight_log

from drake_navbench.analysis.chart_library import chart_library
from drake_navbench.analysis.folder_analysis import analyse_folder
from drake_navbench.analysis.html import page_environment
from drake_navbench.analysis.metrics.definition import Metric
from drake_navbench.analysis.report import build_report
from drake_navbench.analysis.statistics import Interval
from drake_navbench.commands import report as command
from drake_navbench.errors import InputError
from drake_navbench.logs.results import ResultsFolder

WALLED = ("walled_in", "empty")


class Page(HTMLParser):
    """Collects links, sources and ids of a page, and checks that its tags close."""

    VOID = frozenset({"meta", "link", "img", "input", "br", "wbr"})

    def __init__(self, text: str) -> None:
        super().__init__()
        self.text = text
        self.links: list[str] = []
        self.sources: list[str] = []
        self.ids: set[str] = set()
        self.open: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        attributes = dict(attrs)
        self.links += [attributes[key] for key in ("href", "src") if key in attributes]
        if tag == "img":
            self.sources.append(attributes["src"])
        if "id" in attributes:
            self.ids.add(attributes["id"])
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


@pytest.fixture(scope="module")
def text(reported):
    return reported.path.read_text(encoding="utf-8")


def test_every_tag_closes_and_every_link_leads_somewhere(reported, text):
    page = Page(text)
    assert page.open == []
    for link in page.links:
        if link.startswith("#"):
            assert link[1:] in page.ids
        elif not link.startswith("data:"):
            assert (reported.path.parent / link).is_file(), link


def test_nothing_comes_from_the_network(text):
    # The library holds addresses as text, figures as names; what it does is seen in a browser.
    own = text.replace(chart_library(), "")
    assert len(own) < len(text)
    assert not re.search(r"""(?:src|href)\s*=\s*["']?https?:|url\(\s*["']?https?:|@import""", own)


def test_the_page_holds_all_that_it_shows(usual):
    """Sent alone, it has its pictures; only what is another page stays behind."""
    page = Page((usual / "report.html").read_text(encoding="utf-8"))
    assert page.sources
    assert all(source.startswith("data:image/svg+xml,") for source in page.sources)
    assert not re.search(r'<(?:link|object|embed|iframe)\b(?![^>]*href="data:)', page.text)


def test_files_that_cannot_be_read_are_left_out_and_named(reported, text):
    reasons = {entry.path: entry.reason for entry in reported.left_out}
    assert reported.trial_count == 12
    assert set(reasons) == {f"trials/empty/rpp/trial_00{n}.parquet" for n in (7, 8, 9)}
    assert "not a readable trial log" in reasons["trials/empty/rpp/trial_007.parquet"]
    assert "schema version 99" in reasons["trials/empty/rpp/trial_008.parquet"]
    assert "not a trial log" in reasons["trials/empty/rpp/trial_009.parquet"]
    assert "3 files could not be read or drawn" in text
    for path in reasons:
        assert path in text


def test_failures_are_counted_and_their_reason_is_shown_as_text(text):
    assert "10 succeeded" in text
    assert "2 aborted" in text
    assert "no valid control &lt;0.2 s&gt;" in text


def test_empty_cells_have_a_reason(text):
    assert "no obstacle came within 5 m" in text
    assert "nan" not in re.sub(r"<script>.*?</script>", "", text, flags=re.S).lower()


def test_published_values_stand_beside_ours(text):
    # RPP in `empty`: 14.512 s published.
    assert '<span class="published">14.512' in text


def rendered(path, *, scenario="empty", **speeds_mps):
    """Returns the report on straight drives by these controllers, four trials each."""
    folder = ResultsFolder(path)
    folder.write_manifest({"scenarios": [scenario], "controllers": list(speeds_mps)})
    outcome = "succeeded" if scenario == "empty" else "aborted"
    for controller, speed_mps in speeds_mps.items():
        for trial in range(4):
            info = {"controller": controller, "trial": trial, "seed": trial}
            log = straight_log(speed_mps=speed_mps, outcome=outcome, info=info)
            log.info["scenario"]["name"] = scenario
            folder.write_log(log)
    return report_html(path)


def row_of(text, title):
    """Returns the cells of the first row with this title, without its unit."""
    row = re.search(rf'<tr[^>]*><th scope="row">(?:(?!</th>).)*>{title}<.*?</tr>', text, re.S)
    return re.findall(r"<td(?: class=\"n\"[^>]*)?>(.*?)</td>", row.group())


def test_a_published_value_stands_with_the_preset_that_has_the_published_settings(tmp_path):
    text = rendered(tmp_path, mppi=0.4, mppi_nav2=0.45)
    # Published for MPPI in `empty`: 0.459 m/s; 0.45 is 2% less.
    assert row_of(text, "avg_linear_speed") == [
        "0.400",
        '0.450<span class="published">0.459 (-2%)</span>',
    ]
    assert "The published mppi is compared with mppi_nav2" in text


def test_presets_without_published_settings_have_no_published_values(tmp_path):
    text = rendered(tmp_path, mppi=0.4, rpp_bringup=0.45)
    assert row_of(text, "avg_linear_speed") == ["0.400", "0.450"]
    assert "The published" not in text


def test_the_summary_names_who_is_level(tmp_path):
    text = rendered(tmp_path, dwb=0.4, rpp=0.5)
    (cell,) = row_of(text, "cross_track_error_mean_m")
    assert cell.endswith(">level: rpp, dwb</span>")


def test_where_nobody_arrives_the_summary_crowns_nobody(tmp_path):
    text = rendered(tmp_path, scenario="restricted_small", dwb=0.4, rpp=0.5)
    (cell,) = row_of(text, "jerk_rms_mps3")
    assert cell.startswith('<span class="muted" title="nobody reached the goal: ')
    assert cell.endswith(">–</span>")
    assert " is best:" not in text
    assert "In restricted_small nobody reached the goal" in text


def test_trials_that_are_all_the_same_one_are_explained_only_where_there_are_some(tmp_path, text):
    explanation = "n = 1: nothing in the trials is random"
    assert explanation in rendered(tmp_path, rpp=0.5)
    assert explanation not in text


def test_an_interrupted_run_gives_a_report_that_says_what_is_missing(tmp_path):
    path = measured_folder(tmp_path / "results", request={"trials": 3})
    for trial in range(3):
        ResultsFolder(path).log_path("own_corridor", "rpp", trial).unlink()
    ResultsFolder(path).log_path("own_corridor", "rpp:v=0.4", 2).unlink()
    text = report_html(path)
    assert "4 of the 12 trials that were asked for have no log" in text
    assert "<li>own_corridor: rpp 3, rpp:v=0.4 1</li>" in text
    (row,) = re.findall(r'<a href="#scenario-2">own_corridor</a></th>(.*?)</tr>', text, re.S)
    assert re.findall(r"<td>(–|<b>.*?</b>)", row) == ["–", "<b>2 of 2</b>"]


@pytest.fixture(scope="module")
def finished(tmp_path_factory) -> str:
    """The page of a run that drove all its trials, with no more in its manifest."""
    path = measured_folder(tmp_path_factory.mktemp("finished") / "results", request={"trials": 3})
    return report_html(path)


def test_what_stood_in_for_plugins_of_a_nav2_file_is_repeated(finished, tmp_path):
    assert "Replaced in the Nav2 files" not in finished
    path = measured_folder(tmp_path / "results", request={"trials": 1})
    results = ResultsFolder(path)
    told = "planner_server: Smac 2D stands in for <theirs::Planner>"
    results.write_manifest(results.read_manifest() | {"stand_ins": [told]})
    text = report_html(path)
    assert "<li>planner_server: Smac 2D stands in for &lt;theirs::Planner&gt;</li>" in text
    assert "All columns of these files" in text


def test_what_stood_in_within_one_column_is_told_of_that_column(tmp_path):
    path = measured_folder(tmp_path / "results", request={"trials": 1})
    results = ResultsFolder(path)
    own = {"stand_ins_of_columns": {"rpp": ["FollowPath.max_vel_y: 0 stands in"]}}
    results.write_manifest(results.read_manifest() | own)
    text = report_html(path)
    assert re.search(r"rpp</span> drove with</p>\s*<ul><li>FollowPath.max_vel_y: 0", text)
    assert "All columns of these files" not in text


def test_a_finished_run_lacks_nothing(finished):
    assert "Not finished" not in finished


def test_the_clear_winner_is_named_but_not_by_two_trials(finished, text):
    assert "rpp is best" in finished
    # Of three trials of rpp:v=0.4 one does not arrive.
    assert "rpp is best" not in text
    assert "in 2 trials; so few may be alike by chance: at least 3 are needed" in text


def test_the_replay_is_linked_where_there_is_one(text):
    assert 'href="replays/own_corridor.html"' in text
    assert "replays/empty.html" not in text


def test_tables_and_figures_are_written(reported):
    folder = ResultsFolder(reported.path.parent)
    table = pd.read_csv(folder.table_path("empty", ".csv"), index_col=["metric", "unit"])
    assert table.loc[("success_rate", "%"), "rpp"] == 100.0
    assert folder.table_path("own_corridor", ".md").read_text(encoding="utf-8").startswith("| ")
    for kind in ("paths", "metrics", "ranks", "compute", "clearance", "pareto", "motion-rpp"):
        for suffix in (".svg", ".png"):
            assert (folder.path / "figures" / "own_corridor" / f"{kind}{suffix}").is_file()
    # Nothing to be clear of in `empty`.
    assert not (folder.path / "figures" / "empty" / "clearance.svg").exists()


def test_unless_asked_for_only_figures_that_compare_are_drawn(usual):
    assert command.build_parser().parse_args(["results"]).figures == "key"
    written = {file.relative_to(usual / "figures").as_posix() for file in usual.glob("figures/*/*")}
    assert {name for name in written if name.startswith("empty/")} == {
        f"empty/{kind}.svg" for kind in ("paths", "metrics", "ranks", "compute")
    }
    text = (usual / "report.html").read_text(encoding="utf-8")
    assert text.count("<img") == len(written)
    assert "drake-navbench report results --figures all" in text


def test_all_figures_are_those_and_the_motion_of_each_controller_as_png_too(reported, text):
    folder = reported.path.parent / "figures"
    vectors = {file.with_suffix("") for file in folder.glob("*/*.svg")}
    assert {file.with_suffix("") for file in folder.glob("*/*.png")} == vectors
    assert folder / "empty" / "motion-rpp" in vectors
    assert text.count("<img") == len(vectors)
    assert "--figures all" not in text


def test_without_figures_the_page_has_none(tmp_path):
    path = measured_folder(tmp_path / "results")
    assert command.main([str(path), "--jobs", "1", "--figures", "none"]) == 0
    assert list(path.glob("figures/*/*")) == []
    text = (path / "report.html").read_text(encoding="utf-8")
    assert "<img" not in text
    assert 'class="figures"' not in text


def test_every_image_has_the_size_of_its_figure(reported, text):
    tags = re.findall(r"""<img width="(\d+)" height="(\d+)" src="([^"]+)\"""", text)
    assert len(tags) == text.count("<img") > 0
    for width, height, source in tags:
        svg = unquote(unescape(source))
        size = re.search(r'<svg .*?width="([\d.]+)pt" height="([\d.]+)pt"', svg, re.S).groups()
        assert [int(width), int(height)] == pytest.approx(list(map(float, size)), abs=0.5)


def test_templates_are_compiled_for_the_first_page_of_a_process_alone(monkeypatch):
    page_environment(["dwb"]).get_template("page.html")
    monkeypatch.delattr(Environment, "compile")
    again = page_environment(["rpp", "dwb"]).get_template("page.html")
    # What a page names is its own.
    assert again.globals["color"].keywords == {"beside": ("rpp", "dwb")}


def test_what_was_measured_already_is_not_measured_again(reported, tmp_path, monkeypatch):
    folder = tmp_path / "driven"
    shutil.copytree(reported.path.parent, folder, ignore=shutil.ignore_patterns("kept"))
    anew = analyse_folder(folder, jobs=1)
    computed = []
    compute = Metric.__call__
    monkeypatch.setattr(
        Metric, "__call__", lambda entry, log: computed.append(entry.name) or compute(entry, log)
    )
    again = analyse_folder(folder, jobs=1, measured=anew.trials)
    pd.testing.assert_frame_equal(again.trials, anew.trials, check_exact=True)
    for first, second in zip(anew.scenarios, again.scenarios, strict=True):
        assert [entry.reasons for entry in second.trials] == [e.reasons for e in first.trials]
    # Why there is no value is asked again; a table does not tell.
    undefined = anew.trials.isna().sum()
    assert Counter(computed) == Counter(undefined[undefined > 0].to_dict())


def test_two_processes_find_the_same_as_one(reported):
    folder = reported.path.parent
    one, two = (analyse_folder(folder, jobs=jobs).trials for jobs in (1, 2))
    pd.testing.assert_frame_equal(one, two)


def test_a_folder_that_is_no_result_is_one_line_and_status_2(tmp_path, capsys):
    assert command.main([str(tmp_path)]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert "not a results folder" in error


def test_a_folder_without_a_readable_log_is_refused(tmp_path):
    path = write_folder(tmp_path / "results")
    for log in path.glob("trials/*/*/*.parquet"):
        log.write_bytes(b"")
    with pytest.raises(InputError, match="none of its 12 logs can be read"):
        build_report(path, jobs=1)


def test_intervals_exclude_only_what_lies_outside():
    assert Interval(1.0, 2.0).excludes(0.0)
    assert not Interval(-1.0, 2.0).excludes(0.0)


def test_an_impossible_task_is_named_as_one_with_its_description(tmp_path):
    path = tmp_path / "campaign"
    results = write_manifest(path, scenarios=["walled_in"])
    log = trial_log("walled_in", "rpp", 0, outcome="aborted")
    log.info["scenario"] |= {"description": "Walls all round", "expected_outcome": "aborted"}
    results.write_log(log)
    results.write_log(trial_log("empty", "rpp", 0))
    page = report_html(path)
    assert (
        "1 succeeded, 1 aborted. The task in walled_in is impossible on purpose, "
        "where a trial should end as aborted: 1 did." in re.sub(r"\s+", " ", page)
    )
    own, other = (re.search(rf"<h2>{name}.*?</section>", page, re.S)[0] for name in WALLED)
    assert "<p>Walls all round.</p>" in own
    assert "Impossible on purpose" in own
    assert "Impossible on purpose" not in other


def test_a_touch_has_its_place_in_summary_and_lead_with_what_the_preset_says(tmp_path):
    path = tmp_path / "campaign"
    results = write_manifest(path, scenarios=["walled_in"], controllers=["rpp", "rpp:v=0.4"])
    for controller, outcome in (("rpp", "collided"), ("rpp:v=0.4", "aborted")):
        results.write_log(trial_log("walled_in", controller, 0, outcome=outcome))
    preset = path / "inputs/controllers/rpp.yaml"
    preset.parent.mkdir(parents=True)
    preset.write_text("controller: rpp\ndescription: looks at its centre alone\nparameters: {}\n")
    page = report_html(path)
    assert "rpp touched something in walled_in (1 of 1 trials)" in page
    assert "The preset rpp: looks at its centre alone." in page
    assert page.count('<span class="outcome-collided">touched in 1</span>') == 1


def test_a_trial_is_linked_only_to_a_replay_that_shows_it(tmp_path):
    path = measured_folder(tmp_path / "campaign")
    results = ResultsFolder(path)
    race, own = results.replay_path("empty"), results.log_path("empty", "rpp", 2)
    own = own.with_suffix(".html")
    race.parent.mkdir()
    for page in (race, own):
        page.write_text("<!DOCTYPE html><title>replay</title>", encoding="utf-8")
    table = report_html(path).partition('id="trials-table"')[2]
    rows = re.findall(r"<tr>.*?</tr>", table, re.S)[1:]
    shown = {re.findall(r"<code>(trials/[^<]+)</code>", row)[-1]: row for row in rows}
    assert 'href="replays/empty.html"' in shown["trials/empty/rpp/trial_000.parquet"]
    assert 'href="trials/empty/rpp/trial_002.html"' in shown["trials/empty/rpp/trial_002.parquet"]
    second = shown["trials/empty/rpp/trial_001.parquet"]
    assert "href" not in second
    command_line = "drake-navbench replay trials/empty/rpp/trial_001.parquet"
    assert f"<code>{command_line}</code>" in second


def test_the_verdict_comes_before_everything_else(finished, text):
    lead = re.search(r'<div id="verdict">(.*?)</div>', text, re.S)[1]
    assert "rpp reached every goal" in lead
    assert "95% confidence" in re.search(r'<div id="verdict">(.*?)</div>', finished, re.S)[1]
    assert text.index('class="lead"') < text.index('id="overview"') < text.index("<table")


def test_metrics_have_names_that_people_use_and_a_line_that_explains_them(text):
    summary = re.search(r'<section id="summary">.*?</section>', text, re.S)[0]
    assert '<span class="metric">Time to goal</span><span class="what">Time from the' in summary
    assert '<code class="name">time_to_goal_s</code>' in summary
    glossary = re.search(r'<section id="glossary">.*?</section>', text, re.S)[0]
    assert "<dt>Jerk, largest <code" in glossary


def test_units_are_typeset(text):
    assert "m/s³" in text
    assert "m/s^3" not in re.sub(r"<script.*?</script>", "", text, flags=re.S)


def test_a_p_value_that_cannot_fall_below_5_percent_is_none(text):
    # Of three trials, of which one fails for one controller; Wilcoxon's smallest of two is 0.5.
    pairs = re.search(r'id="pairs-table".*?</table>', text, re.S)[0]
    assert ">n/a (2 pairs)</td>" in pairs
    assert "0.500" not in re.findall(r"<td[^>]*>([^<]*)</td>", pairs)


def test_the_numbers_of_the_charts_are_those_of_the_logs(text):
    charts = json.loads(re.search(r'id="chart-data">(.*?)</script>', text, re.S)[1])
    assert [chart["scenario"] for chart in charts] == ["empty", "own_corridor"]
    chart = charts[1]
    assert chart["controllers"] == ["rpp", "rpp:v=0.4"]
    assert len(chart["trials"]) == 6
    first = chart["trials"][0]
    lengths = {len(first[name]) for name in ("x", "y", "time", "error", "driven", "clearance")}
    assert len(lengths) == 1
    assert 20 <= lengths.pop() <= 150
    assert first["clearance"][0] == 0.9
    (jerk,) = (entry for entry in chart["metrics"] if entry["name"] == "jerk_rms_mps3")
    assert jerk["unit"] == "m/s³"
    assert len(jerk["values"]) == 6


def test_processor_workers_and_load_stand_beside_compute_times(finished, tmp_path):
    assert "compute-note" not in finished
    path = measured_folder(tmp_path / "results", request={"trials": 1})
    results = ResultsFolder(path)
    machine = {"processor": "Some <CPU>", "cores": 4, "jobs": 2, "load_before": 0.1}
    results.write_manifest(results.read_manifest() | {"machines": [machine]})
    text = report_html(path)
    assert "Some &lt;CPU&gt;, 4 cores, 2 trials at a time, load 0.1 before the run" in text
    assert "Trials shared the machine" in text
    alone = machine | {"jobs": 1, "cores": 1}
    results.write_manifest(results.read_manifest() | {"machines": [alone]})
    text = report_html(path)
    assert "1 core, 1 trial at a time" in text
    assert "shared the machine" not in text
