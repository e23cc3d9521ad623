"""A report keeps what it measured and drew; the next one does again only what changed."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pyarrow.parquet as pq
import pytest
from results_folders import trial_log

from drake_navbench.analysis import content_stamps, measured_trials
from drake_navbench.analysis.compare import compare_folders
from drake_navbench.analysis.figures import album
from drake_navbench.analysis.figures.choice import FigureChoice
from drake_navbench.analysis.figures.kept_drawing import drawing_stamp, read_drawing
from drake_navbench.analysis.folder_analysis import analyse_folder
from drake_navbench.analysis.measured_trials import read_measured
from drake_navbench.analysis.metrics import metric_file
from drake_navbench.analysis.metrics.definition import Metric
from drake_navbench.analysis.metrics.registry import use_metric_files
from drake_navbench.analysis.report import build_report
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.results import ResultsFolder

OWN_METRIC = """
from drake_navbench.analysis.metrics import metric

@metric(unit="m", better="lower")
def last_x_m(log):
    return {factor} * float(log.samples["x_m"].iloc[-1])
"""


class Work:
    """The logs that were opened, the metrics that were computed, the scenarios that were drawn."""

    def __init__(self) -> None:
        self.opened: list[str] = []
        self.computed: list[str] = []
        self.drawn: list[str] = []

    def clear(self) -> None:
        self.__init__()


@pytest.fixture
def work(monkeypatch) -> Work:
    done = Work()
    read, compute, draw = TrialLog.read, Metric.__call__, album.write_scenario_figures
    monkeypatch.setattr(
        TrialLog, "read", lambda path: done.opened.append("/".join(path.parts[-3:])) or read(path)
    )
    monkeypatch.setattr(
        Metric,
        "__call__",
        lambda entry, log: done.computed.append(entry.name) or compute(entry, log),
    )
    monkeypatch.setattr(
        album,
        "write_scenario_figures",
        lambda folder, scenario, *rest, **named: (
            done.drawn.append(scenario) or draw(folder, scenario, *rest, **named)
        ),
    )
    return done


@pytest.fixture
def reported(usual, tmp_path) -> Path:
    """A results folder of 12 trials in two scenarios, with its report."""
    return Path(shutil.copytree(usual, tmp_path / "results"))


def contents(path: Path) -> dict[str, bytes]:
    files = (file for file in path.rglob("*") if file.is_file())
    return {file.relative_to(path).as_posix(): file.read_bytes() for file in files}


def test_a_second_report_reads_no_log_and_is_the_same_to_the_last_byte(reported, work):
    before = contents(reported)
    build_report(reported, jobs=1)
    assert (work.opened, work.computed, work.drawn) == ([], [], [])
    assert contents(reported) == before


def test_what_was_kept_equals_what_the_logs_tell(reported):
    kept = analyse_folder(reported, jobs=1)
    shutil.rmtree(ResultsFolder(reported).kept_path)
    anew = analyse_folder(reported, jobs=1)
    pd.testing.assert_frame_equal(kept.trials, anew.trials, check_exact=True)
    for first, second in zip(kept.scenarios, anew.scenarios, strict=True):
        assert repr(first) == repr(second)


@pytest.mark.usefixtures("blank_svgs")
def test_a_changed_log_is_measured_and_its_scenario_drawn_again(reported, work):
    ResultsFolder(reported).write_log(trial_log("empty", "rpp", 1, slower=2.0))
    build_report(reported, jobs=1)
    assert work.drawn == ["empty"]
    assert {name.split("/")[0] for name in work.opened} == {"empty"}
    times = analyse_folder(reported, jobs=1).trials.query("scenario == 'empty' and trial == 1")
    # 3 m at 0.25 m/s instead of 0.5.
    assert times["time_to_goal_s"].iloc[0] == pytest.approx(12.0, abs=0.1)


def test_with_other_code_everything_is_measured_again(reported, work, monkeypatch):
    monkeypatch.setattr(content_stamps, "code_stamp", lambda: "another")
    monkeypatch.setattr(measured_trials, "code_stamp", lambda: "another")
    analyse_folder(reported, jobs=1)
    assert len(work.opened) == 12
    assert work.computed.count("driven_length_m") == 12


def test_a_metric_of_a_file_is_measured_when_its_file_changes(reported, tmp_path, work, request):
    request.addfinalizer(lambda: use_metric_files([]))
    file = tmp_path / "own.py"

    def mean_last_x_m(factor: float) -> float:
        file.write_text(OWN_METRIC.format(factor=factor))
        # As another process would.
        metric_file._metrics_of.cache_clear()
        use_metric_files([f"{file}:last_x_m"])
        work.clear()
        return float(analyse_folder(reported, jobs=1, keeps=True).trials["last_x_m"].mean())

    one = mean_last_x_m(1.0)
    # Of the others, those alone that have no value, to tell why.
    assert work.computed.count("last_x_m") == 12
    assert "driven_length_m" not in work.computed
    assert mean_last_x_m(1.0) == one
    assert work.computed == []
    assert mean_last_x_m(2.0) == pytest.approx(2.0 * one)


def test_a_figure_that_is_gone_is_drawn_again(reported, work):
    figure = reported / "figures" / "empty" / "paths.svg"
    before = figure.read_bytes()
    figure.unlink()
    build_report(reported, jobs=1)
    assert work.drawn == ["empty"]
    assert figure.read_bytes() == before


@pytest.mark.parametrize("damage", ["cut", "columns", "types", "{", "[]", '{"reasons": []}'])
def test_damaged_measurements_are_ignored(reported, damage):
    stamps = content_stamps.file_stamps((reported / "trials").rglob("*.parquet"))
    assert len(read_measured(reported, stamps).entries) == 12
    measured = ResultsFolder(reported).kept_path / "measured.parquet"
    table = pq.read_table(measured)
    if damage == "cut":
        measured.write_bytes(measured.read_bytes()[:500])
    elif damage == "columns":
        pq.write_table(table.drop(["driven_length_m", "told"]), measured)
    elif damage == "types":
        place = table.column_names.index("driven_length_m")
        pq.write_table(table.set_column(place, "driven_length_m", [["3"] * len(table)]), measured)
    else:
        place = table.column_names.index("told")
        pq.write_table(table.set_column(place, "told", [[damage] * len(table)]), measured)
    assert read_measured(reported, stamps) == ({}, {})


def test_a_kept_drawing_names_no_file_of_another_folder(reported):
    path = ResultsFolder(reported).kept_path / "drawn" / "empty.json"
    kept = json.loads(path.read_text())
    assert read_drawing(reported, "empty", kept["stamp"]) is not None
    kept["figures"][0]["name"] = "../../../secret"
    path.write_text(json.dumps(kept))
    assert read_drawing(reported, "empty", kept["stamp"]) is None


def test_a_drawing_depends_on_logs_choice_of_figures_and_columns():
    stamps = {
        drawing_stamp({"a": stamp}, choice, columns)
        for stamp in ("1", "2")
        for choice in (FigureChoice.KEY, FigureChoice.ALL)
        for columns in (["rpp"], ["rpp", "dwb"])
    }
    assert len(stamps) == 8


def test_a_comparison_reads_no_log_and_writes_nothing(reported, work):
    before = contents(reported)
    compare_folders([reported], jobs=1)
    assert work.opened == []
    assert contents(reported) == before
    shutil.rmtree(ResultsFolder(reported).kept_path)
    compare_folders([reported], jobs=1)
    assert len(work.opened) == 12
    assert not ResultsFolder(reported).kept_path.exists()


@pytest.mark.long
def test_what_is_not_needed_is_not_imported(reported):
    # A report on a published scenario asks for parameters of controllers.
    shutil.rmtree(reported / "trials" / "empty")
    code = (
        "import sys; from drake_navbench.commands.main import main; "
        f"main(['report', {str(reported)!r}, '--jobs', '1']); "
        f"main(['compare', {str(reported)!r}, '--html', {str(reported / 'c.html')!r}]); "
        "print([n for n in ('matplotlib', 'pydrake', 'scipy.stats') if n in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"
