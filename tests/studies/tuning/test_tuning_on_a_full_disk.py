"""A disk that fills up in the middle of a search costs the configuration that was being written."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

# Everything in a mount namespace of its own, where a user may mount a small disk.
MOUNTED = ["unshare", "--user", "--map-root-user", "--mount", "sh", "-c"]

SCRIPT = """
import subprocess, sys
from pathlib import Path
from test_study import planted
from drake_navbench.commands import tune as command
from drake_navbench.studies.tuning import study
from drake_navbench.studies.tuning.journal import JOURNAL

study.measure = planted
disk = Path(sys.argv[1])
arguments = ["rpp", "--scenarios", "doorway", "--parameter", "lookahead_dist=0.4:0.8", "--pairs",
    "8", "--objectives", "time,clearance", "--search-only", "--out", str(disk / "out"),
    "--configurations"]

def endings():
    lines = (disk / "out" / JOURNAL).read_bytes().splitlines()
    return sum(b'"ending"' in line for line in lines)

print("full", command.main([*arguments, "12"]), endings())
subprocess.run(["mount", "-o", "remount,size=50m", str(disk)], check=True)
print("then", command.main([*arguments, "12"]), endings())
"""


@pytest.fixture
def disk(tmp_path):
    """A folder to mount a disk of 8 kB on; skips where that is not allowed."""
    path = tmp_path / "disk"
    path.mkdir()
    mount = f"mount -t tmpfs -o size=8k none {path}"
    if shutil.which("unshare") is None:
        pytest.skip("no unshare")
    tried = subprocess.run([*MOUNTED, mount], capture_output=True, check=False)
    if tried.returncode != 0:
        pytest.skip("no mounts allowed")
    return path, mount


def test_a_full_disk_is_one_line_and_the_study_goes_on_when_there_is_room(disk, tmp_path):
    path, mount = disk
    (tmp_path / "script.py").write_text(SCRIPT, encoding="utf-8")
    here = Path(__file__).parent
    command = f"{mount} && PYTHONPATH={here} {sys.executable} script.py {path}"
    done = subprocess.run(
        [*MOUNTED, command], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    (line,) = done.stderr.splitlines()
    assert line.startswith(str(path / "out" / "study.journal"))
    assert line.endswith("cannot be written: No space left on device")
    (full,) = [text.split() for text in done.stdout.splitlines() if text.startswith("full ")]
    (then,) = [text.split() for text in done.stdout.splitlines() if text.startswith("then ")]
    assert full[1] == "2"
    assert 1 < int(full[2]) < 12
    assert then[1] == "0"
    # At most the one that was being written is driven once more.
    assert int(then[2]) in (12, 13)
