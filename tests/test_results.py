"""A results folder: where files go, and what is said where they cannot."""

import json
import shutil
from pathlib import Path

import pytest

from drake_navbench.commands.report import main as report_main
from drake_navbench.commands.run import main as run_main
from drake_navbench.errors import InputError
from drake_navbench.inputs.named_files import NamedFiles
from drake_navbench.logs.results import (
    ResultsFolder,
    file_name,
    only_run_in,
    remove_unfinished,
    require_writable,
)
from drake_navbench.typed_files.output_file import write_text

TOO_LONG = "n" * 300


def test_a_folder_name_that_is_too_long_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"--out .*: cannot be used: File name too long"):
        require_writable(tmp_path / TOO_LONG)


def test_a_file_name_that_is_too_long_is_no_scenario():
    files = NamedFiles(kind="scenario", package="drake_navbench.scenarios")
    with pytest.raises(InputError, match=r"scenario file .*: cannot be read: File name too long"):
        files.find(f"{TOO_LONG}.yaml")


def test_a_file_that_cannot_be_written_is_named(tmp_path):
    # A dangling link is no folder, and none can be made in its place.
    (tmp_path / "link").symlink_to(tmp_path / "nowhere" / "else")
    with pytest.raises(InputError, match=r"link/manifest\.json: cannot be written: .*File exists"):
        write_text(tmp_path / "link" / "manifest.json", "{}")


def test_a_variant_of_many_parameters_has_a_file_name_that_fits():
    names = [f"rpp:{'a' * 300}={value}" for value in (1, 2)]
    shortened = [file_name(name) for name in names]
    # 100 characters of the name, '-' and 6 of its hash.
    assert [len(name) for name in shortened] == [107, 107]
    assert shortened[0] != shortened[1]


@pytest.mark.parametrize("name", ["..", ".", ".hidden", "-rf", "a/../b", "", "\x1b[31m", "\x00"])
def test_no_name_leads_out_of_its_folder_or_hides_in_it(name):
    path = ResultsFolder(Path("out")).log_path(name, name, 0)
    assert len(path.parts) == 5
    assert all(part[0] not in ".-" and part.isprintable() for part in path.parts)
    assert file_name(name) != file_name(name + "_")


def test_two_runs_do_not_write_into_one_folder(tmp_path):
    out = tmp_path / "out"
    refused = pytest.raises(InputError, match="out: another run is writing into it")
    with only_run_in(out), refused, only_run_in(out):
        pass
    with only_run_in(out):
        pass


def test_a_folder_that_a_killed_run_left_unfinished_files_in_is_as_good_as_empty(tmp_path):
    (tmp_path / ".manifest.json.123.unfinished").write_text("{")
    require_writable(tmp_path)
    remove_unfinished(tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_a_name_with_a_nul_is_no_folder():
    refused = pytest.raises(InputError, match=r"cannot be used: .*embedded null")
    with refused, only_run_in(Path("a\0b")):
        pass


@pytest.fixture(scope="module")
def manifest() -> dict:
    """The manifest of a run that was interrupted before its first trial."""
    return {
        "manifest_version": 1,
        "request": {
            "scenarios": ["empty"],
            "controllers": ["rpp"],
            "parameter_files": [],
            "trials": 1,
            "seed": 0,
            "robot": "wheelchair",
            "replay": "none",
        },
        "inputs": {},
        "identity": "",
        "drake_navbench": "0.1.0",
    }


def without(mapping: dict, key: str) -> dict:
    return {k: v for k, v in mapping.items() if k != key}


WRONG_MANIFESTS = {
    "no object": (lambda m: [m], "expected a JSON object, got list"),
    "no request": (lambda m: without(m, "request"), "request: missing, but required"),
    "no inputs": (lambda m: without(m, "inputs"), "inputs: missing, but required"),
    "no version": (
        lambda m: without(m, "drake_navbench"),
        "drake_navbench: missing, but required",
    ),
    "field that a request does not have": (
        lambda m: m | {"request": m["request"] | {"speed": 2.0}},
        "request.speed: unknown field; did you mean 'seed'?",
    ),
    "field of a request missing": (
        lambda m: m | {"request": without(m["request"], "seed")},
        "request.seed: missing, but required",
    ),
    "request of no trials": (
        lambda m: m | {"request": m["request"] | {"trials": 0}},
        "request.trials: input should be greater than or equal to 1, got 0",
    ),
    "other inputs": (lambda m: m, "has changed since the run started"),
}


@pytest.mark.parametrize("case", WRONG_MANIFESTS)
def test_a_manifest_that_cannot_be_resumed_is_one_line_and_exit_2(case, manifest, tmp_path, capsys):
    change, expected = WRONG_MANIFESTS[case]
    (tmp_path / "manifest.json").write_text(json.dumps(change(manifest)))
    assert run_main(["--resume", str(tmp_path)]) == 2
    message = capsys.readouterr().err
    assert expected in message
    assert len(message.strip().splitlines()) == 1


CRAFTED = {
    "controllers that are none": {"controllers": None},
    "scenarios that are no names": {"scenarios": [1]},
    "packages that are text": {"packages": "numpy 2.0"},
    "a request that is a list": {"request": []},
    "a seed that is text": {"request": {"seed": "0"}},
    "a time that is none": {"wall_clock_s": None},
    "a date that is a number": {"created": 0},
}


@pytest.mark.parametrize("command", [run_main, report_main])
@pytest.mark.parametrize("case", CRAFTED)
def test_a_crafted_manifest_is_one_line_and_exit_2(command, case, manifest, tmp_path, capsys):
    (tmp_path / "manifest.json").write_text(json.dumps(manifest | CRAFTED[case]))
    arguments = [str(tmp_path)] if command is report_main else ["--resume", str(tmp_path)]
    assert command(arguments) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert f"{tmp_path / 'manifest.json'}: {next(iter(CRAFTED[case]))}" in line


def test_a_manifest_nested_without_end_is_refused(tmp_path):
    (tmp_path / "manifest.json").write_text(100_000 * "[")
    with pytest.raises(InputError, match=r"manifest\.json: not valid JSON"):
        ResultsFolder(tmp_path).read_manifest()


def test_a_manifest_that_is_no_text_is_refused(tmp_path):
    (tmp_path / "manifest.json").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match=r"manifest\.json: not valid JSON"):
        ResultsFolder(tmp_path).read_manifest()


def test_a_replay_that_cannot_be_drawn_is_a_line_and_the_report_is_written(tmp_path, capsys):
    models = Path(__file__).parents[1] / "models"
    shutil.copy(models / "wheelchair.yaml", tmp_path / "robot.yaml")
    (tmp_path / "wheelchair.sdf").write_text("<sdf>")
    out = tmp_path / "out"
    arguments = ["restricted_small", "--controllers", "rpp", "--trials", "1", "--jobs", "1"]
    robot = str(tmp_path / "robot.yaml")
    assert run_main([*arguments, "--robot", robot, "--out", str(out), "--quiet"]) == 0
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err.startswith("no replay: restricted_small: ")
    assert (out / "report.html").is_file()
