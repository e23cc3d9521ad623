"""`drake-navbench COMMAND`: every command is found, and a wrong one is one line."""

from __future__ import annotations

import os
import subprocess
import sys
import tomllib
from contextlib import suppress
from importlib.metadata import EntryPoint, version
from pathlib import Path

import pytest

from drake_navbench import __version__
from drake_navbench.commands.main import COMMANDS, main


def test_help_names_every_command(capsys):
    assert main(["--help"]) == 0
    shown = capsys.readouterr().out
    assert all(f"\n  {command} " in shown for command in COMMANDS)


def test_the_version_is_told(capsys):
    assert main(["--version"]) == 0
    told = capsys.readouterr().out
    assert told.startswith(f"drake_navbench {__version__} (Drake {version('drake')}, numba ")


@pytest.mark.parametrize("command", [[], *([name] for name in COMMANDS)])
def test_every_command_tells_how_it_is_called_in_80_columns(command, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    with suppress(SystemExit):
        assert main([*command, "--help"]) == 0
    told = capsys.readouterr().out
    assert told.startswith("usage: drake-navbench")
    assert [line for line in told.splitlines() if len(line) > 80] == []


def test_no_command_loads_heavy_packages_before_it_knows_its_arguments():
    """So --help and the completion of a shell are quick."""
    code = (
        "import sys, drake_navbench.run\n"
        "from drake_navbench.commands.completion import whole_parser\n"
        "whole_parser()\n"
        "print({'pydrake', 'numba', 'numpy', 'pandas', 'pydantic', 'rich'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "set()\n"


@pytest.mark.parametrize("arguments", [[], ["run", "--help"]])
def test_a_reader_may_leave_early(arguments):
    """As `| head -3` does: here the reader has gone before anything is written."""
    read_end, write_end = os.pipe()
    os.close(read_end)
    done = subprocess.run(
        [sys.executable, "-m", "drake_navbench", *arguments],
        stdout=write_end,
        stderr=subprocess.PIPE,
        text=True,
        check=False,
    )
    os.close(write_end)
    assert done.stderr == ""
    assert done.returncode in (0, 2)


def test_without_a_command_the_usage_is_shown_as_wrong_input(capsys):
    assert main([]) == 2
    assert "usage:" in capsys.readouterr().out


def test_an_unknown_command_is_one_line_with_the_nearest_name(capsys):
    assert main(["reprot"]) == 2
    assert capsys.readouterr().err == "command 'reprot' is not known; did you mean 'report'?\n"


def said_of_wrong_arguments(arguments, capsys):
    """Returns the one line on stderr with which a command refuses its arguments."""
    with pytest.raises(SystemExit) as left:
        main(arguments)
    assert left.value.code == 2
    said = capsys.readouterr()
    (line,) = said.err.splitlines()
    assert said.out == ""
    return line


@pytest.mark.parametrize("command", COMMANDS)
def test_an_unknown_option_of_any_command_is_one_line(command, capsys):
    line = said_of_wrong_arguments([command, "--hlep"], capsys)
    if command == "leaderboard":
        # Options are those of its steps.
        assert line == "drake-navbench leaderboard: the following arguments are required: STEP"
    else:
        assert line == (
            f"drake-navbench {command}: option '--hlep' is not known; did you mean '--help'?"
        )


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["report", "--bogus"], "option '--bogus' is not known; known: --"),
        (["run", "--trails", "8"], "option '--trails' is not known; did you mean '--trials'?"),
        (["run", "--sedd=4"], "option '--sedd' is not known; did you mean '--seed'?"),
        (["run", "--trials", "x"], "argument --trials: got 'x', expected a whole number"),
        # No option may be cut short, so that one more does not change what a script means.
        (["run", "--trial", "3"], "option '--trial' is not known; did you mean '--trials'?"),
        (["run", "--control=rpp"], "option '--control' is not known; did you mean '--contr"),
        (["run", "--s", "3"], "option '--s' is not known; did you mean '--set'?"),
        (["run", "-x"], "option '-x' is not known; the nearest of "),
        (["run", "empty", "--seed", "1", "doorway"], "unrecognized arguments: doorway"),
        (["run", "--robot", "--\x1b[31m"], "option '--\\x1b[31m' is not known; the nearest"),
        (["report"], "the following arguments are required: DIR"),
        (["report", "x", "--figures", "some"], "argument --figures: got 'some', expected none, "),
        (["why", "x", "--at", "noon"], "argument --at: got 'noon', expected a number"),
        (["compare"], "the following arguments are required: BASELINE"),
        (["report", "one", "two\nthree"], "unrecognized arguments: two three"),
        (
            ["tune", "rpp", "--scenaros", "doorway"],
            "option '--scenaros' is not known; did you mean '--scenarios'?",
        ),
        (["export", "--", "--mcap", "--csv"], "unrecognized arguments: --csv"),
    ],
)
def test_wrong_arguments_are_one_line_that_names_the_command(arguments, told, capsys):
    line = said_of_wrong_arguments(arguments, capsys)
    assert line.startswith(f"drake-navbench {arguments[0]}: {told}")


def test_a_step_of_a_command_knows_its_own_options(capsys):
    line = said_of_wrong_arguments(["leaderboard", "seal", "suite.yaml", "--scret", "x"], capsys)
    assert line == (
        "drake-navbench leaderboard seal: option '--scret' is not known; did you mean '--secret'?"
    )
    line = said_of_wrong_arguments(["leaderboard", "bild", "--suite", "x"], capsys)
    assert line.startswith("drake-navbench leaderboard: argument STEP: got 'bild', expected seal, ")


def test_the_package_can_be_run():
    command = [sys.executable, "-m", "drake_navbench", "--help"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.startswith("usage: drake-navbench")


@pytest.mark.parametrize("shell", ["bash", "zsh", "tcsh"])
def test_a_shell_is_told_of_every_command_and_its_options(shell, capsys):
    assert main(["completion", shell]) == 0
    told = capsys.readouterr().out
    assert all(command in told for command in COMMANDS)
    assert "--controllers" in told or "controllers" in told


def test_the_completion_is_a_script_that_bash_reads(tmp_path, capsys):
    assert main(["completion", "bash"]) == 0
    script = tmp_path / "completion"
    script.write_text(capsys.readouterr().out)
    ask = f"source {script}; complete -p drake-navbench"
    done = subprocess.run(["bash", "-c", ask], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_the_console_command_is_the_same():
    project = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text())["project"]
    command = EntryPoint("drake-navbench", project["scripts"]["drake-navbench"], "console_scripts")
    assert command.load() is main
