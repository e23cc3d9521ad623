"""The command line, as a user meets it."""

import json
import shutil
import warnings
from pathlib import Path

import pandas as pd
import pytest

from drake_navbench.analysis.metrics.registry import unrepeatable_names
from drake_navbench.campaign import run_command
from drake_navbench.campaign.request_arguments import request_from_arguments
from drake_navbench.commands import report
from drake_navbench.commands.run import build_parser, main
from drake_navbench.errors import InputWarning, NavbenchError
from drake_navbench.logs.log import TrialLog
from drake_navbench.logs.results import only_run_in

QUICK = ["restricted_small", "--controllers", "rpp", "--trials", "2", "--quiet"]
QUICK += ["--replay", "none", "--figures", "none"]


@pytest.fixture(scope="module")
def finished(tmp_path_factory) -> Path:
    """A results folder of a small finished run."""
    folder = tmp_path_factory.mktemp("results") / "first"
    assert main([*QUICK, "--out", str(folder)]) == 0
    return folder


def test_a_run_leaves_manifest_logs_table_and_inputs(finished):
    manifest = json.loads((finished / "manifest.json").read_text())
    assert manifest["request"]["scenarios"] == ["restricted_small"]
    assert manifest["controllers"] == ["rpp"]
    log = TrialLog.read(finished / "trials/restricted_small/rpp/trial_001.parquet")
    assert log.info["trial"] == 1
    trials = pd.read_parquet(finished / "trials.parquet")
    assert list(trials["outcome"]) == ["aborted", "aborted"]
    assert {"scenario", "controller", "trial", "seed", "reason", "path_length"} <= set(trials)
    assert (finished / "tables/restricted_small.csv").is_file()
    assert (finished / "tables/restricted_small.md").is_file()
    assert (finished / "inputs/controllers/rpp.yaml").is_file()


def test_what_a_nav2_file_repeats_is_one_line_unless_the_run_is_quiet(tmp_path, capsys):
    path = tmp_path / "nav2_params.yaml"
    path.write_text("amcl: {ros__parameters: {a: 1, a: 2}}\nnode: {ros__parameters: {}}\n")
    told = f"{path}, line 1: amcl.ros__parameters.a is given again; line 1 has no effect"
    refused = f"{path}: no parameters of a controller_server with controller_plugins"
    refused += "; it is a Nav2 parameter file of amcl, node"
    assert main(["empty", "--params", str(path)]) == 2
    assert capsys.readouterr().err.splitlines() == [told, refused]
    assert main(["empty", "--params", str(path), "--quiet"]) == 2
    assert capsys.readouterr().err.splitlines() == [refused]


@pytest.mark.long
def test_the_report_has_the_figures_that_were_asked_for(finished, tmp_path, monkeypatch, capsys):
    assert (finished / "report.html").is_file()
    assert not (finished / "figures").exists()
    interrupted = tmp_path / "interrupted"
    shutil.copytree(finished, interrupted)
    manifest = interrupted / "manifest.json"
    asked = json.loads(manifest.read_text())
    asked["request"]["figures"] = "key"
    manifest.write_text(json.dumps(asked))
    # The page's path stands on a line of its own, which is whole at 80 columns, too.
    monkeypatch.setenv("COLUMNS", "80")
    capsys.readouterr()
    assert main(["--resume", str(interrupted)]) == 0
    last = capsys.readouterr().out.splitlines()[-1]
    assert last == f"Open {interrupted / 'report.html'}"
    assert (interrupted / "figures" / "restricted_small" / "paths.svg").is_file()
    assert not list(interrupted.glob("figures/*/*.png"))


def test_the_report_of_a_run_is_that_of_its_logs(finished, tmp_path):
    again = tmp_path / finished.name
    shutil.copytree(finished, again)
    made = ["report.html", "tables/restricted_small.csv", "tables/restricted_small.md"]
    for name in made:
        (again / name).unlink()
    assert report.main([str(again), "--figures", "none", "--jobs", "1"]) == 0
    for name in made:
        assert (again / name).read_bytes() == (finished / name).read_bytes()


def test_no_unfinished_file_is_left_behind(finished):
    assert [path for path in finished.rglob(".*")] == []


def test_without_costmaps_is_asked_for_and_kept_in_the_manifest():
    asked = [build_parser().parse_args(text.split()) for text in ("empty", "empty --no-costmaps")]
    requests = [request_from_arguments(arguments) for arguments in asked]
    assert [request.keeps_costmaps for request in requests] == [True, False]
    specs = [spec for request in requests for spec in request.campaign().specs[:1]]
    assert [spec.keeps_costmaps for spec in specs] == [True, False]
    # What else a trial is does not depend on it: it may be resumed either way.
    assert specs[0].identity == specs[1].identity


def test_resume_runs_what_is_missing_and_gives_the_same_table(finished, tmp_path):
    folder = tmp_path / "interrupted"
    shutil.copytree(finished, folder)
    lost = folder / "trials/restricted_small/rpp/trial_000.parquet"
    kept = folder / "trials/restricted_small/rpp/trial_001.parquet"
    kept_bytes = kept.read_bytes()
    lost.unlink()
    (folder / "trials.parquet").unlink()
    assert main(["--resume", str(folder), "--quiet"]) == 0
    assert lost.is_file()
    assert kept.read_bytes() == kept_bytes
    # The lost one was driven again, with the seed that it had.
    first, second = (pd.read_parquet(path / "trials.parquet") for path in (finished, folder))
    varying = unrepeatable_names()
    pd.testing.assert_frame_equal(
        first.drop(columns=varying), second.drop(columns=varying), check_exact=True
    )


SCENARIO = """
description: a box ahead
world: {obstacles: [{type: box, min: [2.0, -1.0], max: [2.5, 1.0]}]}
goal: [4.0, 0.0, 0.0]
"""


WRONG_INPUTS = {
    "list of no controllers": (
        ["empty", "--controllers", ",,"],
        "--controllers ',,': expected names, found none",
    ),
    "seed beyond 64 bits": (["empty", "--seed", str(2**64)], "seed: input should be less than"),
    "trials without end": (["empty", "--trials", str(10**9)], "trials: input should be less than"),
    "preset that a terminal would obey": (
        ["empty", "--controllers", "rpp:\x1b[31m=1"],
        r"\x1b[31m: unknown field",
    ),
    "unknown scenario": (["emty"], "scenario 'emty' is not known; did you mean 'empty'?"),
    "missing file": (["no/such.yaml"], "scenario file no/such.yaml: no such file"),
    "unknown controller": (
        ["empty", "--controllers", "rppp"],
        "controller 'rppp' is not known; did you mean 'rpp'?",
    ),
    "parameter that does not fit the robot": (
        ["empty", "--controllers", "dwb:max_vel_y=0.1"],
        "controller dwb:max_vel_y=0.1: max_vel_y: got 0.1, expected 0",
    ),
    "parameter that does not fit the control period": (
        ["empty", "--controllers", "mppi_nav2:model_dt=0.01"],
        "model_dt: got 0.01, expected at least the control period 0.05 s",
    ),
    "unknown robot": (["empty", "--robot", "wheelchar"], "did you mean 'wheelchair'?"),
    "unreadable file": (["empty", "--params", "none.yaml"], "none.yaml: cannot be read"),
    "worlds that end before they begin": (
        ["--barn", ".", "--worlds", "3,9-1"],
        "--worlds 3,9-1: 9-1 ends before it begins; expected LOW-HIGH",
    ),
    "a truth value as a client": (
        ["empty", "--controllers", "external:command=false"],
        "command: expected a program with its arguments, a text or a list of texts",
    ),
    "no results folder": (["--resume", "."], "not a results folder"),
    "resume with more": (["empty", "--resume", "."], "expected no SCENARIO"),
}
WRONG_SCENARIOS = {
    "unknown field": (
        SCENARIO + "timeout: 3.0\n",
        "mine.yaml, line 5: timeout: unknown field; did you mean 'timeout_s'?",
    ),
    "wrong type": (
        SCENARIO + "timeout_s: soon\n",
        "mine.yaml, line 5: timeout_s: input should be a valid number, got 'soon'",
    ),
    "negative size": (
        SCENARIO + "timeout_s: -1.0\n",
        "mine.yaml, line 5: timeout_s: input should be greater than 0, got -1.0",
    ),
    "start inside an obstacle": (
        SCENARIO + "start: [1.5, 0.0, 0.0]\n",
        "scenario mine: start: the robot's footprint at [1.5, 0.0, 0.0] overlaps an obstacle",
    ),
    "override of no field of the robot": (
        SCENARIO + "robot_overrides: {drive: {max_speed: 1.0}}\n",
        "scenario mine: robot_overrides: drive.differential.max_speed: unknown field",
    ),
    "override that contradicts the robot": (
        SCENARIO + "robot_overrides: {robot_radius: 0.3}\n",
        "scenario mine: robot_overrides: expected either footprint or robot_radius, and not both",
    ),
    "override of where the robot is": (
        SCENARIO + "robot_overrides: {directory: here}\n",
        "scenario mine: robot_overrides: directory: unknown field",
    ),
    "goal in occupied space": (
        SCENARIO.replace("4.0, 0.0", "2.2, 0.0"),
        "scenario mine: goal: [2.2, 0.0] lies inside an obstacle; expected free space",
    ),
}


def check_refused(arguments: list[str], expected: str, capsys) -> None:
    """Asserts exit status 2 and one line that says what is expected."""
    assert main(arguments) == 2
    message = capsys.readouterr().err
    assert expected in message
    assert len(message.strip().splitlines()) == 1


@pytest.mark.parametrize("case", WRONG_INPUTS)
def test_a_wrong_argument_is_one_line_and_exit_2(case, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    check_refused(*WRONG_INPUTS[case], capsys)
    assert list(tmp_path.iterdir()) == []


def test_a_warning_is_a_line_of_at_most_1000_characters(tmp_path, monkeypatch, capsys):
    def warn(parser, arguments):
        warnings.warn("\x1b[31m" + "x" * 5000, InputWarning, stacklevel=1)
        return 0

    monkeypatch.setattr("drake_navbench.commands.run._run", warn)
    assert main(["empty"]) == 0
    (line,) = capsys.readouterr().err.splitlines()
    assert len(line) == 1000
    assert line.isprintable()


@pytest.mark.parametrize("case", WRONG_SCENARIOS)
def test_a_wrong_scenario_is_one_line_and_exit_2(case, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    text, expected = WRONG_SCENARIOS[case]
    Path("mine.yaml").write_text(text)
    check_refused(["mine.yaml"], expected, capsys)
    assert [path.name for path in tmp_path.iterdir()] == ["mine.yaml"]


def test_a_name_that_a_terminal_would_obey_is_refused(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("a\x1b[31m.yaml").write_text(SCENARIO)
    check_refused(
        ["a\x1b[31m.yaml", "--controllers", "rpp"],
        r"scenario 'a\x1b[31m': expected a name of printable characters",
        capsys,
    )


def test_resume_makes_up_for_inputs_that_were_not_written(finished, tmp_path):
    folder = tmp_path / "interrupted"
    shutil.copytree(finished, folder)
    expected = {path.name: path.read_bytes() for path in (finished / "inputs").rglob("*.yaml")}
    shutil.rmtree(folder / "inputs")
    (folder / "trials" / ".trial_000.parquet.7.unfinished").write_text("half")
    assert main(["--resume", str(folder), "--quiet"]) == 0
    assert {
        path.name: path.read_bytes() for path in (folder / "inputs").rglob("*.yaml")
    } == expected
    assert [path for path in folder.rglob(".*")] == []


def test_resume_into_a_folder_that_is_being_written_is_refused(finished, tmp_path, capsys):
    folder = tmp_path / "busy"
    shutil.copytree(finished, folder)
    with only_run_in(folder):
        check_refused(["--resume", str(folder)], "another run is writing into it", capsys)


def test_an_error_fit_to_be_shown_is_one_line_and_exit_1(monkeypatch, capsys):
    def fail(arguments, *, began_s, remarks):
        raise NavbenchError("nothing to be done")

    monkeypatch.setattr(run_command, "run_from_command_line", fail)
    assert main(["empty"]) == 1
    assert capsys.readouterr().err == "nothing to be done\n"


def test_an_output_folder_that_is_not_empty_is_refused(finished, capsys):
    assert main(["empty", "--controllers", "rpp", "--out", str(finished)]) == 2
    assert "is not empty; name a new folder, or continue with --resume" in capsys.readouterr().err


def test_an_output_folder_below_a_file_is_refused(tmp_path, capsys):
    file = tmp_path / "file"
    file.write_text("")
    assert main(["empty", "--controllers", "rpp", "--out", str(file / "below")]) == 2
    assert "is not a folder that can be written to" in capsys.readouterr().err


def test_trials_must_be_a_positive_number(capsys):
    with pytest.raises(SystemExit) as left:
        main(["--trials", "0"])
    assert left.value.code == 2
    assert "got '0', expected a whole number of at least 1" in capsys.readouterr().err


def test_list_names_scenarios_controllers_and_robots(capsys):
    assert main(["--list"]) == 0
    shown = capsys.readouterr().out
    for name in ("restricted_large", "rpp_bringup", "wheelchair"):
        assert name in shown


COMMAS = "--controllers: expected names separated by commas, --controllers rpp,dwb; got rpp dwb\n"


def test_controllers_without_commas_are_told_that_commas_are_wanted(capsys):
    arguments = ["--controllers", "rpp", "dwb"]
    assert main(arguments) == 2
    assert capsys.readouterr().err == COMMAS
    assert main(["empty", *arguments]) == 2
    assert capsys.readouterr().err == COMMAS


def test_a_scenario_may_still_follow_the_controllers(capsys):
    assert main(["--controllers", "rpp", "emty"]) == 2
    assert "scenario 'emty' is not known" in capsys.readouterr().err
