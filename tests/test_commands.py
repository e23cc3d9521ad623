"""`python -m drake_navbench COMMAND`: every command is found, and a wrong one is one line."""

from __future__ import annotations

import subprocess
import sys
import tomllib
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest

from drake_navbench.__main__ import COMMANDS, main


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_tells_how_it_is_called(command, capsys):
    with pytest.raises(SystemExit) as left:
        main([command, "--help"])
    assert left.value.code == 0
    assert capsys.readouterr().out.startswith("usage: python -m drake_navbench")


def test_help_names_every_command(capsys):
    assert main(["--help"]) == 0
    shown = capsys.readouterr().out
    assert all(f"\n  {command} " in shown for command in COMMANDS)


def test_without_a_command_the_usage_is_shown_as_wrong_input(capsys):
    assert main([]) == 2
    assert "usage:" in capsys.readouterr().out


def test_an_unknown_command_is_one_line_with_the_nearest_name(capsys):
    assert main(["reprot"]) == 2
    assert capsys.readouterr().err == "command 'reprot' is not known; did you mean 'report'?\n"


def test_the_package_can_be_run():
    command = [sys.executable, "-m", "drake_navbench", "list"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert "wheelchair" in done.stdout


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
