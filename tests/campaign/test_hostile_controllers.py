"""Whatever a plugin does costs it its own trials and nobody else's."""

import os
from collections.abc import Iterator
from multiprocessing.forkserver import _forkserver
from pathlib import Path

import hostile_controllers as hostile
import pandas as pd
import pytest
from hostile_controllers import ABORTED, ALL, EXPECTED, HANGING, LEFT_OUT, NOTICED, SPOILING

from drake_navbench import run_trial
from drake_navbench.campaign.campaign import plan_campaign
from drake_navbench.campaign.driving import Driven, run_campaign
from drake_navbench.errors import MAX_LINE_LENGTH, InputError
from drake_navbench.inputs.foreign_code import runs_foreign_code
from drake_navbench.inputs.presets import Preset, load_preset
from drake_navbench.inputs.robot import load_robot
from drake_navbench.inputs.scenario import load_scenario
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.log_columns import UNREPEATABLE_COLUMNS
from drake_navbench.logs.outcome import Outcome
from drake_navbench.logs.results import ResultsFolder
from drake_navbench.plugins.kinds import forget_installed
from drake_navbench.trial import task_cost
from drake_navbench.trial.spec import TrialSpec
from drake_navbench.trial.trial import simulate

pytestmark = pytest.mark.usefixtures("real_workers")

OTHERS = [f"{name} = hostile_controllers:{name}" for name in ("Honest", "KillsItself")]
SCENARIO = "description: nothing in the way\ngoal: [1.0, 0.0, 0.0]\ntimeout_s: 4.0\n"


@pytest.fixture(scope="module")
def patch():
    with pytest.MonkeyPatch.context() as context:
        yield context


@pytest.fixture(scope="module")
def installed(tmp_path_factory, patch) -> Iterator[Path]:
    """A folder in which all of them are installed, and a scenario."""
    path = tmp_path_factory.mktemp("installed")
    metadata = path / "hostile-1.0.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: hostile\nVersion: 1.0\n")
    plugins = (*ALL, *HANGING, *NOTICED, *ABORTED)
    points = [f"{plugin.__name__} = hostile_controllers:{plugin.__name__}" for plugin in plugins]
    (metadata / "entry_points.txt").write_text(
        "\n".join(["[drake_navbench.controllers]", *OTHERS, *points])
    )
    (path / "short.yaml").write_text(SCENARIO)
    patch.syspath_prepend(path)
    patch.setenv("PYTHONPATH", f"{path}{os.pathsep}{Path(hostile.__file__).parent}")
    forget_installed()
    # A server of the workers that runs already knows nothing of them, one that runs on too much.
    _forkserver._stop()
    yield path
    forget_installed()
    _forkserver._stop()


def column(name: str) -> Preset:
    return Preset(name, name, "a plugin", {}, name)


def drive(installed: Path, columns: list[Preset], folder: ResultsFolder, trials: int) -> Driven:
    campaign = plan_campaign([str(installed / "short.yaml")], columns, trials=trials)
    folder.write_manifest({"identity": campaign.identity})
    return run_campaign(campaign, folder, jobs=2)


@pytest.fixture(scope="module")
def driven(installed, tmp_path_factory, patch) -> tuple[Driven, ResultsFolder]:
    """One campaign of all of them, with an honest plugin and a controller of ours at the end."""
    path = tmp_path_factory.mktemp("driven")
    patch.chdir(path)
    # The folder is named as a user would name it: relative to where the run was started.
    folder = ResultsFolder(Path("out").absolute())
    columns = [column(plugin.__name__) for plugin in ALL]
    columns += [column("Honest"), load_preset("rpp")]
    return drive(installed, columns, folder, trials=1), folder


def row_of(driven: tuple[Driven, ResultsFolder], name: str) -> pd.Series:
    trials = driven[0].trials
    return trials.set_index("controller").loc[name]


@pytest.mark.parametrize("plugin", EXPECTED)
def test_what_it_does_is_an_error_of_its_own_trial(plugin, driven):
    row = row_of(driven, plugin.__name__)
    assert row["outcome"] == Outcome.ERROR
    assert EXPECTED[plugin] in row["reason"]
    assert len(row["reason"]) <= MAX_LINE_LENGTH
    log = TrialLog.read(driven[1].log_path("short", plugin.__name__, 0))
    assert log.info["reason"] == row["reason"]
    assert driven[1].log_path("short", plugin.__name__, 0).stat().st_size < 120_000


def test_who_never_answers_is_ended_after_the_time_limit(installed, tmp_path, monkeypatch):
    # No honest trial is among them, so they need not wait as long as one may take.
    monkeypatch.setattr(task_cost, "MIN_WALL_CLOCK_S", 2.0)
    monkeypatch.setattr(task_cost, "WALL_CLOCK_PER_SIMULATED_SECOND", 0.5)
    columns = [column(plugin.__name__) for plugin in HANGING]
    trials = drive(installed, columns, ResultsFolder(tmp_path / "out"), trials=1).trials
    assert list(trials["outcome"]) == [Outcome.ERROR] * len(HANGING)
    assert set(trials["reason"]) == {"no result after 2 s of wall clock; ended"}


@pytest.mark.parametrize("plugin", NOTICED)
def test_what_a_trial_notices_is_an_error_in_whatever_process_it_is_driven(plugin, installed):
    log = driven_here(plugin, installed)
    assert log.outcome is Outcome.ERROR
    assert NOTICED[plugin] in log.info["reason"]
    assert len(log.info["reason"]) <= MAX_LINE_LENGTH


def driven_here(plugin: type, installed: Path) -> TrialLog:
    scenario = load_scenario(str(installed / "short.yaml"))
    return simulate(TrialSpec(scenario, load_robot("wheelchair"), column(plugin.__name__), seed=0))


@pytest.mark.parametrize("plugin", ABORTED)
def test_a_reason_is_one_line_that_can_be_printed(plugin, installed):
    log = driven_here(plugin, installed)
    assert log.outcome is Outcome.ABORTED
    assert ABORTED[plugin] in log.info["reason"]
    assert log.info["reason"].isprintable()
    assert len(log.info["reason"]) <= MAX_LINE_LENGTH


@pytest.mark.parametrize("plugin", SPOILING)
def test_what_it_changes_in_its_process_does_not_keep_its_log_from_being_written(plugin, driven):
    assert plugin.__name__ in set(driven[0].trials["controller"])
    assert driven[1].log_path("short", plugin.__name__, 0).is_file()


def test_memory_that_the_machine_does_not_have_is_left_to_be_driven_again(driven):
    (entry,) = driven[0].undriven
    assert entry.spec.preset.name == "RunsOutOfMemory"
    assert LEFT_OUT[hostile.RunsOutOfMemory] in entry.reason
    assert not driven[1].log_path("short", "RunsOutOfMemory", 0).exists()


def test_the_others_drive_as_if_they_were_alone(driven, installed, tmp_path):
    alone = ResultsFolder(tmp_path / "alone")
    drive(installed, [column("Honest"), load_preset("rpp")], alone, trials=1)
    for name in ("Honest", "rpp"):
        one, other = (TrialLog.read(f.log_path("short", name, 0)) for f in (driven[1], alone))
        assert one.info == other.info
        varying = list(UNREPEATABLE_COLUMNS)
        pd.testing.assert_frame_equal(
            one.samples.drop(columns=varying), other.samples.drop(columns=varying)
        )


def test_a_spoilt_process_serves_only_the_column_that_spoilt_it(installed, tmp_path):
    # One worker, in the order: spoiler, ours, spoiler, ours.
    folder = ResultsFolder(tmp_path / "out")
    columns = [column("Spoils"), load_preset("rpp")]
    campaign = plan_campaign([str(installed / "short.yaml")], columns, trials=2)
    folder.write_manifest({"identity": campaign.identity})
    trials, *_ = run_campaign(campaign, folder, jobs=1)
    ours = trials[trials["controller"] == "rpp"]
    assert set(ours["outcome"]) == {Outcome.SUCCEEDED}
    # A clock that stands still would make it 0.
    assert (ours["compute_time_p99_ms"] > 0.0).all()


def test_what_kills_its_own_worker_is_an_error_the_second_time(installed, tmp_path):
    """Whoever killed the first one, so that resuming comes to an end; others are not blamed."""
    folder = ResultsFolder(tmp_path / "out")
    columns = [column("KillsItself"), load_preset("rpp")]
    first = drive(installed, columns, folder, trials=1)
    assert [entry.spec.preset.name for entry in first.undriven] == ["KillsItself"]
    campaign = plan_campaign([str(installed / "short.yaml")], columns, trials=1)
    second = run_campaign(campaign, folder, jobs=1)
    assert second.undriven == []
    rows = second.trials.set_index("controller")
    assert rows.loc["KillsItself", "outcome"] == "error"
    assert rows.loc["KillsItself", "reason"] == (
        "the worker process was ended by signal 9 (Killed), for the second time: so its "
        "controller is blamed"
    )
    assert rows.loc["rpp", "outcome"] == "succeeded"


def test_run_trial_drives_a_plugin_apart(installed):
    log = run_trial(str(installed / "short.yaml"), column("LeavesQuietly"))
    assert log.outcome is Outcome.ERROR
    assert log.info["reason"] == "the worker process died with exit code 0"


def test_only_columns_with_code_of_others_run_apart(installed):
    assert runs_foreign_code(column("Honest"))
    assert not runs_foreign_code(load_preset("rpp"))
    assert not runs_foreign_code(load_preset("dwb"))


class BreaksWhenBuilt(hostile.Honest):
    def __init__(self, parameters, setup):
        raise KeyboardInterrupt


def test_a_plugin_that_breaks_when_built_is_one_line(installed, monkeypatch):
    monkeypatch.setattr(hostile, "Honest", BreaksWhenBuilt)
    with pytest.raises(InputError, match="Honest: KeyboardInterrupt"):
        plan_campaign([str(installed / "short.yaml")], [column("Honest")])
