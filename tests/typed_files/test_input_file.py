"""Only regular files of a limited size are read."""

import os
import re
from pathlib import Path

import pytest

from drake_navbench.errors import InputError
from drake_navbench.typed_files.input_file import (
    MEGABYTE,
    read_head_text,
    read_input,
    read_input_text,
)
from drake_navbench.typed_files.typed_yaml import MAX_FILE_BYTES, read_yaml


def refusal(path: Path) -> str:
    with pytest.raises(InputError) as caught:
        read_yaml(path)
    (line,) = str(caught.value).splitlines()
    return line.removeprefix(f"{path}: ")


def test_a_file_of_the_largest_size_is_read_and_one_byte_more_is_refused(tmp_path):
    path = tmp_path / "large.txt"
    path.write_bytes(b"x" * MEGABYTE)
    assert len(read_input(path, max_bytes=MEGABYTE)) == MEGABYTE
    path.write_bytes(b"x" * (MEGABYTE + 1))
    with pytest.raises(InputError, match=rf"{re.escape(str(path))}: expected at most 1 MB"):
        read_input(path, max_bytes=MEGABYTE)


def test_a_yaml_file_that_is_too_large_is_refused_unread(tmp_path):
    path = tmp_path / "large.yaml"
    with path.open("wb") as file:
        file.truncate(100 * MAX_FILE_BYTES)
    assert refusal(path) == "expected at most 16 MB"


def test_what_has_no_end_is_no_file():
    assert refusal(Path("/dev/zero")) == "cannot be read: expected a regular file"


def test_a_pipe_that_nobody_writes_is_no_file(tmp_path):
    os.mkfifo(tmp_path / "pipe.yaml")
    assert refusal(tmp_path / "pipe.yaml") == "cannot be read: expected a regular file"


def test_a_folder_is_no_file(tmp_path):
    assert refusal(tmp_path) == "is a folder; expected a file"


def test_a_refused_folder_is_closed_again(tmp_path):
    """A studio that is asked for a folder again and again would run out of open files."""
    before = os.listdir("/proc/self/fd")
    with pytest.raises(InputError, match="is a folder"):
        read_input(tmp_path, max_bytes=10)
    assert os.listdir("/proc/self/fd") == before


def test_a_file_that_does_not_exist_is_named(tmp_path):
    assert refusal(tmp_path / "missing.yaml") == "cannot be read: No such file or directory"


def test_a_name_with_a_nul_is_no_file():
    assert "embedded null" in refusal(Path("a\0b.yaml"))


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (b"a: 1\nb: \xf6", ", line 2: cannot be read: not UTF-8 text, found the byte 0xf6"),
        ("a: 1".encode("utf-16"), ": not UTF-8 text, found UTF-16; save it as UTF-8"),
    ],
)
def test_bytes_that_are_no_text_are_refused(tmp_path, content, told):
    (tmp_path / "a.yaml").write_bytes(content)
    with pytest.raises(InputError, match=rf"a\.yaml{told}$"):
        read_input_text(tmp_path / "a.yaml", max_bytes=100)


def test_a_mark_of_utf_8_is_no_part_of_a_text(tmp_path):
    path = tmp_path / "map.yaml"
    path.write_bytes(b"\xef\xbb\xbfimage: a.pgm\r\n")
    assert read_head_text(path) == "image: a.pgm\n"
    assert read_input_text(path, max_bytes=100) == "image: a.pgm\r\n"


def test_a_pointer_of_git_lfs_is_no_file(tmp_path):
    (tmp_path / "a.yaml").write_text("version https://git-lfs.github.com/spec/v1\nsize 1\n")
    assert refusal(tmp_path / "a.yaml") == "a pointer of Git LFS, not the file; run git lfs pull"


def test_a_broken_link_and_an_archive_are_told_as_such(tmp_path):
    (tmp_path / "a.yaml").symlink_to("gone.yaml")
    assert refusal(tmp_path / "a.yaml") == "a link to gone.yaml, which is not there"
    (tmp_path / "a.zip").write_bytes(b"PK\x03\x04\x9c")
    with pytest.raises(
        InputError, match=r"a\.zip: is an archive; expected a file in it, unpacked$"
    ):
        read_input_text(tmp_path / "a.zip", max_bytes=100)
