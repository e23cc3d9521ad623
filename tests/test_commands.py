"""`python -m drake_navbench COMMAND`: every command is found, and a wrong one is one line."""

from __future__ import annotations

import subprocess
import sys

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
