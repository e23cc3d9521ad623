"""A disk that fills up in the middle of a search costs the configuration that was being written."""

from __future__ import annotations

from small_disk import SmallDisk, on_small_disk
from test_study import planted

from drake_navbench.commands import tune as command
from drake_navbench.studies.tuning import study
from drake_navbench.studies.tuning.journal import JOURNAL

ARGUMENTS = ["rpp", "--scenarios", "doorway", "--parameter", "lookahead_dist=0.4:0.8"]
ARGUMENTS += ["--pairs", "8", "--objectives", "time,clearance", "--search-only"]
ARGUMENTS += ["--configurations", "12"]


def search_twice(disk: SmallDisk) -> None:
    """Searches until the disk is full, and again when it has room."""
    study.measure = planted
    out = disk.path / "out"

    def search() -> tuple[int, int]:
        status = command.main([*ARGUMENTS, "--out", str(out)])
        lines = (out / JOURNAL).read_bytes().splitlines()
        return status, sum(b'"ending"' in line for line in lines)

    print("full", *search())
    disk.grow("50m")
    print("then", *search())


def test_a_full_disk_is_one_line_and_the_study_goes_on_when_there_is_room(tmp_path):
    printed = on_small_disk(tmp_path, "8k", search_twice)
    (line,) = printed.error
    assert line.startswith(str(tmp_path / "disk" / "out" / "study.journal"))
    assert line.endswith("cannot be written: No space left on device")
    (full,) = (text.split() for text in printed.out if text.startswith("full "))
    (then,) = (text.split() for text in printed.out if text.startswith("then "))
    assert full[1] == "2"
    assert 1 < int(full[2]) < 12
    assert then[1] == "0"
    # At most the one that was being written is driven once more.
    assert int(then[2]) in (12, 13)
