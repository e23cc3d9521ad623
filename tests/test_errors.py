"""What a user sees of an error is a line that a terminal shows as it is."""

import errno
from pathlib import Path

import pytest

from drake_navbench.errors import (
    MAX_LINE_LENGTH,
    CannotBeWritten,
    InputError,
    as_line,
    is_machine_fault,
    nearest_name_hint,
    one_line,
    printable,
)
from drake_navbench.typed_files.output_file import write_text


def test_codes_that_a_terminal_would_obey_are_shown_as_they_are_written():
    assert printable("\x1b[2Ja\x00b\u202ec") == r"\x1b[2Ja\x00b\u202ec"
    assert str(InputError("field 'a\x1b[31m': unknown")) == r"field 'a\x1b[31m': unknown"


def test_lines_of_an_error_stay_lines():
    assert str(InputError("first\nsecond\x07")) == "first\nsecond\\x07"


def test_a_file_name_that_is_no_text_can_be_printed():
    # What Python makes of the byte 0xff in a name.
    assert str(InputError("\udcff.yaml: no such file")).encode() == rb"\udcff.yaml: no such file"


def test_a_long_line_is_cut():
    assert len(printable("x" * 10_000_000)) == MAX_LINE_LENGTH
    assert len(printable("\x1b" * 900)) == MAX_LINE_LENGTH
    assert len(one_line(ValueError("x" * 10_000_000))) == MAX_LINE_LENGTH


def test_many_lines_become_one_that_is_cut():
    assert as_line("two\nlines") == "two lines"
    assert len(as_line("a\n" * 10_000_000)) == MAX_LINE_LENGTH


class Unspeakable(Exception):
    def __str__(self):
        raise RuntimeError


def test_an_exception_without_text_is_named():
    assert one_line(Unspeakable()) == "Unspeakable"


def test_a_name_of_any_length_is_no_misspelt_one():
    assert nearest_name_hint("x" * 1_000_000, ["speed"]) == ""


def test_of_a_long_list_the_names_most_like_the_given_one_are_told():
    """Six names of 100 letters are longer than a hint; of a short list all are told."""
    names = [letter * 100 for letter in "abcdef"]
    hint = nearest_name_hint("fffff", names, listed_by="a page")
    assert hint.startswith(f"; the nearest of 6 names: {'f' * 100}, ")
    assert hint.endswith(" (a page lists all)")
    assert hint.count(",") == 4
    assert nearest_name_hint("zz", ["b", "a"], listed_by="a page") == "; known: a, b"


@pytest.mark.parametrize(
    ("error", "is_fault"),
    [
        (MemoryError(), True),
        (OSError(errno.ENOSPC, ""), True),
        (OSError(errno.EMFILE, ""), True),
        (FileNotFoundError(errno.ENOENT, ""), False),
        (OSError("without a number"), False),
        (ValueError(), False),
        (KeyboardInterrupt(), False),
    ],
)
def test_what_the_machine_lacks_is_told_from_what_code_does(error, is_fault):
    assert is_machine_fault(error) is is_fault


@pytest.mark.parametrize("name", [".", "..", "/"])
def test_a_folder_in_place_of_a_file_is_one_line(tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(CannotBeWritten, match=r"^\S+: cannot be written: Is a directory$"):
        write_text(Path(name), "text")
    assert list(tmp_path.iterdir()) == []
