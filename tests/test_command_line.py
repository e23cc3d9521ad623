"""What all commands share."""

from __future__ import annotations

import argparse
import warnings

import pytest

from drake_navbench.commands.command_line import (
    EXIT_DONE,
    EXIT_FAILED,
    EXIT_INTERRUPTED,
    EXIT_WRONG_INPUT,
    exit_status_of,
    listed_names,
    number,
    percentage,
    positive_number,
    positive_percentage,
    whole_number,
)
from drake_navbench.errors import CannotBeWritten, EndedFromOutside, InputError, InputWarning


def failing(error: BaseException):
    def work() -> None:
        raise error

    return work


@pytest.mark.parametrize(
    ("error", "status", "line"),
    [
        (InputError("a.yaml: goal: expected three"), EXIT_WRONG_INPUT, "a.yaml: goal: "),
        (CannotBeWritten("out: no space"), EXIT_WRONG_INPUT, "out: no space"),
        (EndedFromOutside("a worker was killed"), EXIT_FAILED, "a worker was killed"),
        (KeyboardInterrupt(), EXIT_INTERRUPTED, "interrupted"),
    ],
)
def test_a_fault_is_one_line_and_its_status(error, status, line, capsys):
    assert exit_status_of(failing(error)) == status
    (said,) = capsys.readouterr().err.splitlines()
    assert said.startswith(line)


def test_a_command_says_what_its_statuses_are(capsys):
    assert exit_status_of(lambda: None) == EXIT_DONE
    assert exit_status_of(lambda: 3) == 3
    assert exit_status_of(failing(EndedFromOutside("killed")), failed=7) == 7
    assert exit_status_of(failing(KeyboardInterrupt()), interrupted="go on") == EXIT_INTERRUPTED
    assert capsys.readouterr().err.splitlines() == ["killed", "go on"]


def test_what_is_no_fault_of_a_user_stays_a_traceback():
    with pytest.raises(ZeroDivisionError):
        exit_status_of(lambda: 1 // 0)


@pytest.mark.parametrize(
    ("read", "text", "value"),
    [
        (whole_number, "0", 0),
        (positive_number, "1", 1),
        (percentage, "0", 0.0),
        (percentage, "2.5", 0.025),
        (positive_percentage, "150", 1.5),
        (listed_names, " rpp, dwb,,rpp ", ("rpp", "dwb")),
    ],
)
def test_arguments_are_read(read, text, value):
    assert read(text) == value


@pytest.mark.parametrize(
    ("read", "text", "expected"),
    [
        (whole_number, "-1", "a whole number of at least 0"),
        (whole_number, "1e3", "a whole number of at least 0"),
        (positive_number, "0", "a whole number of at least 1"),
        (number, "noon", "a number"),
        (number, "inf", "a number"),
        (number, "nan", "a number"),
        (percentage, "-0.1", "a percentage of at least 0"),
        (percentage, "inf", "a percentage of at least 0"),
        (percentage, "nan", "a percentage of at least 0"),
        (positive_percentage, "0", "a percentage above 0"),
        (positive_percentage, "much", "a percentage above 0"),
    ],
)
def test_what_is_no_such_number_is_told(read, text, expected):
    with pytest.raises(argparse.ArgumentTypeError) as raised:
        read(text)
    assert str(raised.value) == f"got {text!r}, expected {expected}"


def test_a_warning_about_the_input_is_a_line_without_a_place_in_the_code(capsys):
    def work() -> None:
        warnings.warn("a.urdf: left out b.dae", InputWarning, stacklevel=2)

    assert exit_status_of(work) == EXIT_DONE
    assert capsys.readouterr().err == "a.urdf: left out b.dae\n"


def test_a_warning_about_the_input_is_printed_once_wherever_it_comes_from(capsys):
    def work():
        for level in (1, 2):
            warnings.warn("cart.urdf: left out wheel.stl", InputWarning, stacklevel=level)

    assert exit_status_of(work) == 0
    assert capsys.readouterr().err == "cart.urdf: left out wheel.stl\n"
