"""Whatever an interrupted run has left, there is a report of it, and a reproduction."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import pytest
from results_folders import CONTROLLERS, SCENARIOS, SEEDS, trial_log, write_manifest

from drake_navbench.analysis.figures.choice import FigureChoice
from drake_navbench.analysis.report import REPORT_NAME, build_report
from drake_navbench.analysis.reproduction.reproduction import PAGE_NAME
from drake_navbench.errors import InputError
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.results import ResultsFolder

TRIALS = tuple(product(SCENARIOS, CONTROLLERS, range(len(SEEDS))))
# The log of a trial in each state; there may also be half of one, or none at all.
MADE = ("succeeded", "aborted", "collided at once", "error")
# One scenario's trials.
EACH = ("error", "succeeded", "torn", "collided at once", "aborted", "absent")


def log_in_state(scenario: str, controller: str, trial: int, state: str) -> TrialLog:
    """Returns the log of a trial that ended like this."""
    outcome = state if state in ("aborted", "error") else "succeeded"
    log = trial_log(scenario, controller, trial, outcome=outcome)
    if state == "error":
        # As a worker writes it for a trial that never came to its first sample.
        return TrialLog(log.samples[:0], (), dict(log.info) | {"end_time_s": 0.0})
    if state == "collided at once":
        ended = {"outcome": "collided", "end_time_s": 0.0}
        return TrialLog(log.samples[:1], log.plans, dict(log.info) | ended)
    return log


@pytest.fixture(scope="module")
def contents(tmp_path_factory) -> dict[tuple[tuple[str, str, int], str], bytes]:
    """The bytes of the log of every trial in every state."""
    folder = ResultsFolder(tmp_path_factory.mktemp("logs"))
    found = {}
    for key, state in product(TRIALS, MADE):
        folder.write_log(log_in_state(*key, state))
        found[key, state] = folder.log_path(*key).read_bytes()
    for key in TRIALS:
        whole = found[key, "succeeded"]
        found[key, "torn"] = whole[: len(whole) // 2]
    return found


def partial_folder(path: Path, states: list[str], contents: dict) -> ResultsFolder:
    """Writes a folder in which the trials are in these states, in the order of TRIALS."""
    folder = write_manifest(path, trials=len(SEEDS))
    for key, state in zip(TRIALS, states, strict=True):
        if state != "absent":
            log = folder.log_path(*key)
            log.parent.mkdir(parents=True, exist_ok=True)
            log.write_bytes(contents[key, state])
    return folder


def states_with(chosen: str, *places: int) -> list[str]:
    """Returns states in which only the trials at these places have a log."""
    return [chosen if place in places else "absent" for place in range(len(TRIALS))]


def check_report(path: Path, states: list[str], contents: dict, figures: FigureChoice) -> None:
    folder = partial_folder(path / "results", states, contents)
    result = build_report(folder.path, figures=figures, jobs=1)
    read = [state in MADE for state in states]
    assert result.trial_count == sum(read)
    assert len(result.left_out) == states.count("torn")
    text = (folder.path / REPORT_NAME).read_text(encoding="utf-8")
    driven = {key[0] for key, is_read in zip(TRIALS, read, strict=True) if is_read}
    for scenario in SCENARIOS:
        assert (f">{scenario}</a></th>" in text) == (scenario in driven)
    absent = states.count("absent")
    said = f"{absent} of the {len(TRIALS)} trials that were asked for have no log"
    assert (said in text) == (absent > 0)
    # `empty` is a published scenario.
    assert (folder.path / PAGE_NAME).is_file() == ("empty" in driven)


@pytest.mark.parametrize(
    "states",
    [
        states_with("succeeded", 0),
        [*EACH, *["succeeded"] * 4, *["absent"] * 2],
        pytest.param(["error"] * len(TRIALS), marks=pytest.mark.long),
        pytest.param(
            [*["torn"] * (len(TRIALS) // 2), *["succeeded"] * (len(TRIALS) // 2)],
            marks=pytest.mark.long,
        ),
    ],
    ids=["a single trial", "one of each, and a few", "errors", "half of them torn"],
)
def test_every_partial_folder_gives_a_report(tmp_path, contents, states):
    check_report(tmp_path, states, contents, FigureChoice.NONE)


@pytest.mark.parametrize(
    "states",
    [
        states_with("collided at once", 0),
        pytest.param([*["absent"] * len(EACH), *EACH], marks=pytest.mark.long),
    ],
    ids=["a single sample", "one of each"],
)
def test_the_figures_of_a_partial_folder_are_drawn(tmp_path, contents, states):
    check_report(tmp_path, states, contents, FigureChoice.ALL)


def test_a_folder_that_is_not_there_is_one_line(tmp_path):
    missing = tmp_path / "missing"
    with pytest.raises(InputError) as caught:
        build_report(missing)
    assert str(caught.value).startswith(f"{missing}: not a results folder: ")
    assert "\n" not in str(caught.value)
