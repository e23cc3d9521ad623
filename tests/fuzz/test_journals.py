"""Whatever a study's journal holds, `tune` goes on with it or refuses it in a line."""

from __future__ import annotations

import optuna
import pytest
from bounds import fuzz, only_input_errors
from damage import damaged_bytes
from hypothesis import given
from hypothesis import strategies as st

from drake_navbench.studies.tuning import journal as journals
from drake_navbench.studies.tuning.study import (
    DIFFERENCES,
    ENDING,
    EXCESS,
    TOUCHES,
    TRIALS,
    Ending,
    configurations_of,
)
from drake_navbench.studies.tuning.task import TuningTask


@pytest.fixture(scope="module")
def task() -> TuningTask:
    """A task as `tune` makes it."""
    return TuningTask(
        drake_navbench="0.1.0",
        baseline="rpp",
        parameters={"desired_linear_vel": 0.5},
        searched=("desired_linear_vel=0.2..1.0",),
        scenarios=("empty",),
        guards=(),
        robot="wheelchair",
        objectives=("time", "jerk"),
        most_pairs=8,
        seed=0,
    )


@pytest.fixture(scope="module")
def journal(tmp_path_factory, task) -> bytes:
    """The journal of a study with a few trials."""
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    folder = tmp_path_factory.mktemp("study")
    study = journals.open_study(folder, task, lambda line: None)
    for number in range(3):
        trial = study.ask()
        trial.suggest_float("speed", 0.1, 1.0)
        driven = {DIFFERENCES: [[0.1, 0.2]], EXCESS: 0.0, ENDING: Ending.THROUGH}
        for name, value in (driven | {TOUCHES: {}, TRIALS: number}).items():
            trial.set_user_attr(name, value)
        study.tell(trial, [0.1, 0.2])
    return (folder / journals.JOURNAL).read_bytes()


@fuzz
@given(data=st.data())
def test_journals(data, file, journal, task):
    path = file(
        f"study/{journals.JOURNAL}", data.draw(damaged_bytes(journal) | damaged_lines(journal))
    )
    with only_input_errors():
        configurations_of(journals.open_study(path.parent, task, lambda line: None))


def damaged_lines(content: bytes) -> st.SearchStrategy[bytes]:
    """Draws the lines of a file in another order, some of them twice or not at all."""
    lines = content.splitlines(keepends=True)
    return st.lists(st.sampled_from(lines), max_size=len(lines)).map(b"".join)
