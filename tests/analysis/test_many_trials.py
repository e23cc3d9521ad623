"""A scenario of very many trials is told from their rows, with few of its logs opened."""

from __future__ import annotations

import re
import shutil

import pandas as pd
import pytest
from results_folders import CONTROLLERS, SCENARIOS, measured_folder

from drake_navbench.analysis import many_trials, report_sections
from drake_navbench.analysis.figures.choice import FigureChoice
from drake_navbench.analysis.folder_analysis import analyse_folder
from drake_navbench.analysis.report import build_report
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.results import ResultsFolder


@pytest.fixture
def folder(tmp_path, monkeypatch) -> ResultsFolder:
    """Twelve measured trials, of which two logs a scenario are to be opened."""
    path = measured_folder(tmp_path / "results", failing=("rpp:v=0.4",))
    folder = ResultsFolder(path)
    monkeypatch.setattr(many_trials, "MOST_LOGS_OPENED", 2)
    monkeypatch.setattr(many_trials, "LOGS_DRAWN", 2)
    return folder


@pytest.fixture
def opened(monkeypatch) -> list[str]:
    """The names of the logs that are read."""
    names: list[str] = []
    read = TrialLog.read
    monkeypatch.setattr(
        TrialLog, "read", lambda path: names.append("/".join(path.parts[-3:])) or read(path)
    )
    return names


def test_the_numbers_are_those_of_all_logs(folder, monkeypatch):
    from_table = analyse_folder(folder.path, jobs=1)
    monkeypatch.setattr(many_trials, "MOST_LOGS_OPENED", 100)
    from_logs = analyse_folder(folder.path, jobs=1)
    pd.testing.assert_frame_equal(from_table.trials, from_logs.trials, check_exact=True)
    for table, logs in zip(from_table.scenarios, from_logs.scenarios, strict=True):
        assert repr(table.cells) == repr(logs.cells)
        assert repr(table.verdicts) == repr(logs.verdicts)
        assert table.successes == logs.successes


@pytest.mark.long
def test_only_logs_that_are_drawn_or_explain_something_are_opened(folder, opened):
    analysis = analyse_folder(folder.path, figures=FigureChoice.KEY, jobs=1)
    drawn = {
        "/".join(folder.log_path(scenario, controller, 0).parts[-3:])
        for scenario in SCENARIOS
        for controller in CONTROLLERS
    }
    assert drawn < set(opened)
    # A second log of a column explains nothing that its first does not.
    assert not any(name.endswith("trial_001.parquet") and "v_0.4" in name for name in opened)
    assert len(opened) == len(set(opened))
    assert [scenario.drawn for scenario in analysis.scenarios] == [2, 2]


def test_the_rows_of_the_run_are_enough(folder, opened):
    rows = analyse_folder(folder.path, jobs=1).trials
    shutil.rmtree(folder.kept_path)
    found = analyse_folder(folder.path, jobs=1, measured=rows)
    assert len(opened) < 12
    pd.testing.assert_frame_equal(found.trials, rows, check_exact=True)


def test_a_row_that_lacks_a_metric_is_measured(folder, opened):
    rows = analyse_folder(folder.path, jobs=1).trials
    shutil.rmtree(folder.kept_path)
    found = analyse_folder(folder.path, jobs=1, measured=rows.drop(columns="min_clearance_m"))
    assert len(opened) == 12
    pd.testing.assert_frame_equal(found.trials, rows, check_exact=True)


def test_the_page_lists_the_failed_trials_and_tells_of_the_others(folder, monkeypatch):
    monkeypatch.setattr(report_sections, "MOST_TRIALS_LISTED", 4)
    text = build_report(folder.path, figures=FigureChoice.NONE, jobs=1).path.read_text(
        encoding="utf-8"
    )
    listed = re.findall(r"<code>(trials/[^<]*parquet)</code></td></tr>", text)
    assert len(listed) == 4
    assert sum("trial_002" in name for name in listed) == 2
    assert "8 more are in <code>trials.parquet</code>" in text
    assert "All numbers are of all 6 trials; paths and curves are of 2 of them" in text
